"""`fluorspar render`: a scene into a spectral image and its pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from fluorspar.cli import console
from fluorspar.cli.options import pairs, size_of

__all__ = ["render"]

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
            help="File to write; the suffix picks the format: .nc, .exr, .png. May be repeated.",
        ),
    ],
    spp: Annotated[Optional[int], typer.Option(help="Samples per pixel. [default: the scene's]")] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same image, bit for bit.")] = 0,
    size: Annotated[
        Optional[str], typer.Option(metavar="WxH", help="Size in pixels. [default: the scene's]")
    ] = None,
    wavelengths: Annotated[
        str, typer.Option(metavar="START:STOP:STEP", help="Wavelength grid in nm.")
    ] = "360:700:5",
    method: Annotated[
        str, typer.Option(help="paths: all components, bands and bounces from one pass.")
    ] = "paths",
    material: Annotated[
        Optional[list[str]],
        typer.Option(
            metavar="ID=NAME", help="Give a surface another material, by shape or BSDF id. May be repeated."
        ),
    ] = None,
    define: Annotated[
        Optional[list[str]],
        typer.Option("-D", metavar="KEY=VALUE", help="Value of a $KEY in the scene file. May be repeated."),
    ] = None,
    max_depth: Annotated[
        Optional[int],
        typer.Option(help="As in Mitsuba: 2 is direct light only, -1 unlimited. [default: the scene's]"),
    ] = None,
    rr_depth: Annotated[
        Optional[int], typer.Option(help="Depth at which Russian roulette begins. [default: the scene's]")
    ] = None,
    matte: Annotated[
        bool, typer.Option("--matte", help="Render textures, gloss and environment maps as their averages.")
    ] = False,
    stokes: Annotated[
        str, typer.Option(help="half: excitation at the emission wavelength counts half; strict: not at all.")
    ] = "half",
    component_errors: Annotated[
        bool, typer.Option("--component-errors", help="A standard error for each component too.")
    ] = False,
    pictures: Annotated[
        Optional[Path],
        typer.Option(metavar="DIR", help="Also write a PNG of every component into this folder."),
    ] = None,
    variant: Annotated[str, typer.Option(help="llvm, or cuda for an NVIDIA GPU.")] = "llvm",
    threads: Annotated[Optional[int], typer.Option(help="Threads to use. [default: all cores]")] = None,
) -> None:
    """Render a scene into a spectral image, split into components."""
    from fluorspar.cli.outputs import check_outputs, stream_target, write_outputs
    from fluorspar.errors import OptionError, message
    from fluorspar.render import render as render_scene
    from fluorspar.scene.scene import load_scene

    if stokes not in ("half", "strict"):
        raise OptionError(
            message("there is no such Stokes rule", where="--stokes", got=stokes, expected="half or strict")
        )
    check_outputs(output, pictures)
    loaded = load_scene(
        scene,
        materials=pairs(material or [], "--material"),
        matte=matte,
        parameters=pairs(define or [], "-D"),
    )
    with console.progress_bar(f"rendering {scene}") as progress:
        image = render_scene(
            loaded,
            spp=spp,
            seed=seed,
            size=size_of(size),
            wavelengths=wavelengths,
            method=method,
            max_depth=max_depth,
            rr_depth=rr_depth,
            stokes="strict" if stokes == "strict" else "half",
            component_errors=component_errors,
            variant=variant,
            threads=threads,
            output=stream_target(output),
            progress=progress,
        )
    write_outputs(image, output, pictures)
    if image.attrs.get("partial"):
        raise typer.Exit(130)


render.__doc__ = f"{render.__doc__}\n\n{_EXAMPLES}"
