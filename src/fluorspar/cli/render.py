"""`fluorspar render`: a scene into a spectral image and its pictures."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated, cast

import typer

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.cli import console
from fluorspar.cli.options import (
    ExcitationOption,
    LibraryOption,
    mesh_parameter,
    pairs,
    size_of,
    staged_options,
)
from fluorspar.cli.outputs import print_timings
from fluorspar.image.formats.registry import SUFFIXES_WRITTEN
from fluorspar.scene.objects.mesh_file import FORMATS as MESHES

__all__ = ["render"]

_LOG = logging.getLogger(__name__)

_EXAMPLES = """Examples:

  fluorspar render cornell-box -o box.nc -o box.exr -o box.png

  fluorspar render room.xml --size 640x480 --spp 256 --wavelengths 300:780:5 --material left-wall=poster-red -o room.nc
"""


def render(
    scene: Annotated[
        str,
        typer.Argument(
            help="A Mitsuba 3 scene file (.xml) or the name of a built-in scene, see 'fluorspar scenes'."
        ),
    ],
    output: Annotated[
        list[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help=f"File to write; the suffix picks the format: {', '.join(SUFFIXES_WRITTEN)}. May be repeated.",
        ),
    ],
    spp: Annotated[int | None, typer.Option(help="Samples per pixel. [default: the scene's]")] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same image, bit for bit.")] = 0,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Size in pixels. [default: the scene's]")
    ] = None,
    wavelengths: Annotated[
        str, typer.Option(metavar="START:STOP:STEP", help="Wavelength grid in nm.")
    ] = "360:700:5",
    excitation: ExcitationOption = "full",
    method: Annotated[
        str,
        typer.Option(
            metavar="paths|staged",
            help="paths: all components, bands and bounces from one pass; staged: the paper's procedure, matte only.",
        ),
    ] = "paths",
    material: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID=NAME", help="Give a surface another material, by shape or BSDF id. May be repeated."
        ),
    ] = None,
    library: LibraryOption = None,
    define: Annotated[
        list[str] | None,
        typer.Option("-D", metavar="KEY=VALUE", help="Value of a $KEY in the scene file. May be repeated."),
    ] = None,
    max_depth: Annotated[
        int | None,
        typer.Option(help="As in Mitsuba: 2 is direct light only, -1 unlimited. [default: the scene's]"),
    ] = None,
    rr_depth: Annotated[
        int | None, typer.Option(help="Depth at which Russian roulette begins. [default: the scene's]")
    ] = None,
    matte: Annotated[
        bool,
        typer.Option(
            "--matte",
            help="Render textures, gloss and environment maps as diffuse averages; not needed for what is supported.",
        ),
    ] = False,
    sensor: Annotated[
        str | None,
        typer.Option(metavar="N|ID", help="Number, from 0, or id of the sensor. [default: the first]"),
    ] = None,
    stokes: Annotated[
        str,
        typer.Option(
            metavar="half|strict",
            help="half: excitation at the emission wavelength counts half; strict: not at all.",
        ),
    ] = "half",
    component_errors: Annotated[
        bool, typer.Option("--component-errors", help="A standard error for each component too.")
    ] = False,
    pictures: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Also write a PNG of every component into this folder."),
    ] = None,
    variant: Annotated[
        str, typer.Option(metavar="llvm|cuda", help="The processor, or an NVIDIA GPU.")
    ] = "llvm",
    threads: Annotated[int | None, typer.Option(help="Threads to use. [default: all cores]")] = None,
    mesh: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help=f"Mesh to put into cornell-mesh ({', '.join(MESHES)})."),
    ] = None,
    emitters: Annotated[
        int | None, typer.Option(help="staged: N x N emitters on a planar surface. [default: 8]")
    ] = None,
    patches: Annotated[int | None, typer.Option(help="staged: emitters on a mesh. [default: 100]")] = None,
    emitter_mode: Annotated[
        str | None,
        typer.Option(
            help="staged: true patches of a mesh, or the faces of a decimated copy. [default: true]",
            metavar="true|decimated",
        ),
    ] = None,
    exclude_emitter_geometry: Annotated[
        bool,
        typer.Option(
            "--exclude-emitter-geometry",
            help="staged: only black emitters in place of the emitting object, as the paper.",
        ),
    ] = False,
    bounces: Annotated[
        int | None, typer.Option(help="staged: 2 estimates component 6 as well. [default: 1]")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(help="staged: subdivide emitters until emission varies by less than this in each."),
    ] = None,
    filter_edges: Annotated[
        bool, typer.Option("--filter-edges", help="staged: the paper's filter of edge artefacts.")
    ] = False,
    keep_intermediate: Annotated[
        Path | None, typer.Option(metavar="DIR", help="staged: keep the intermediate images here.")
    ] = None,
    repeats: Annotated[
        int | None, typer.Option(help="staged: independent seeds, for the standard error. [default: 4]")
    ] = None,
    timings: Annotated[
        bool, typer.Option("--timings", help="Print how long each pass took, relative to component 1.")
    ] = False,
) -> None:
    """Render a scene into a spectral image, split into components."""
    from fluorspar.cli.outputs import write_outputs
    from fluorspar.cli.targets import check_files, check_pictures, stream_target
    from fluorspar.image.formats.envi import check_data_target
    from fluorspar.rendering import render as render_scene
    from fluorspar.scene.loading import load_scene

    options = staged_options(
        method,
        emitters=emitters,
        patches=patches,
        mode=emitter_mode,
        exclude_emitter_geometry=exclude_emitter_geometry or None,
        bounces=bounces,
        tolerance=tolerance,
        filter_edges=filter_edges or None,
        keep_intermediate=keep_intermediate,
        repeats=repeats,
    )
    check_files(output, SUFFIXES_WRITTEN, (scene, mesh))
    for header in (path for path in output if path.suffix.lower() == ".hdr"):
        check_data_target(header)
    check_pictures(pictures)
    defined = pairs(define or [], "-D")
    loaded = load_scene(
        scene,
        materials=pairs(material or [], "--material"),
        matte=matte,
        parameters=defined | mesh_parameter(scene, mesh, defined),
        library=library or [],
        sensor=sensor,
    )
    _LOG.info("loaded %s: %d surfaces, %d lights", scene, len(loaded.surfaces), len(loaded.lights))
    with console.progress_bar(f"rendering {scene}") as progress:
        image = render_scene(
            loaded,
            spp=spp,
            seed=seed,
            size=size_of(size),
            wavelengths=wavelengths,
            excitation=excitation,
            method=method,
            max_depth=max_depth,
            rr_depth=rr_depth,
            stokes=cast(Stokes, stokes),
            component_errors=component_errors,
            variant=variant,
            threads=threads,
            output=stream_target(output),
            progress=progress,
            staged=options,
        )
    _LOG.info("rendered")
    write_outputs(image, output, pictures)
    _LOG.info("written")
    if timings:
        print_timings(image)
    if image.attrs.get("partial"):
        raise typer.Exit(130)  # `main` says 143 after SIGTERM


render.__doc__ = f"{render.__doc__}\n\n{_EXAMPLES}"
