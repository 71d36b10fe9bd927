"""`fluorspar render`: a scene into a spectral image and its pictures."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated, cast

import typer

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.cli import console
from fluorspar.cli.blender_option import BlenderOption, chosen_renderer
from fluorspar.cli.changes import LightOption, SameLuminanceOption, files_named, light_of, settings
from fluorspar.cli.given import exposure_of, staged_options
from fluorspar.cli.options import (
    ComponentErrorsOption,
    DenoiseOption,
    ExcitationOption,
    ExposureOption,
    ImagesOption,
    LibraryOption,
    PicturesOption,
    ResumeOption,
    StokesOption,
    ThreadsOption,
)
from fluorspar.cli.outputs import print_timings
from fluorspar.cli.scene_options import (
    MaterialOption,
    MatteOption,
    MaxDepthOption,
    MeshOption,
    RrDepthOption,
    SceneArgument,
    SceneDefineOption,
    SeedOption,
    SensorOption,
    SizeOption,
    SppOption,
    VariantOption,
    ViewpointOption,
    WavelengthsOption,
    scene_to_trace,
)
from fluorspar.cli.workers import SchedulerOption, WorkersOption, client_for
from fluorspar.errors import OptionError, message
from fluorspar.scene.settings_text import size_of

__all__ = ["render"]

_LOG = logging.getLogger(__name__)

_EXAMPLES = """Examples:

  fluorspar render cornell-box -o box.nc -o box.exr -o box.png

  fluorspar render cornell-box --spp 16 --denoise -o box.nc -o box.png

\b
  fluorspar render room.xml --size 640x480 --spp 256 \\
      --wavelengths 300:780:5 --material left-wall=poster-red -o room.nc

\b
  fluorspar render cornell-box --camera "origin=278,273,-400 fov=60" \\
      --light light=A -o evening.nc -o evening.png

  fluorspar render room.xml --until error=1% --max-time 10m -o room.nc

  fluorspar render room.xml --spp 4096 -o room.nc --resume

\b
  fluorspar render room.xml --spp 4096 -o room.nc \\
      --scheduler tcp://head-node:8786

  fluorspar render cornell-box --method staged --timings -o staged.nc
"""


def render(
    scene: SceneArgument,
    output: ImagesOption,
    spp: SppOption = None,
    seed: SeedOption = 0,
    size: SizeOption = None,
    wavelengths: WavelengthsOption = "360:700:5",
    excitation: ExcitationOption = "full",
    method: Annotated[
        str,
        typer.Option(
            metavar="paths|staged",
            help="paths: all components and wavelengths along the same light paths; staged: the paper's "
            "method, matte surfaces only.",
        ),
    ] = "paths",
    material: MaterialOption = None,
    library: LibraryOption = None,
    define: SceneDefineOption = None,
    max_depth: MaxDepthOption = None,
    rr_depth: RrDepthOption = None,
    matte: MatteOption = False,
    sensor: SensorOption = None,
    camera: ViewpointOption = None,
    light: LightOption = None,
    same_luminance: SameLuminanceOption = False,
    stokes: StokesOption = "half",
    component_errors: ComponentErrorsOption = False,
    until: Annotated[
        str | None,
        typer.Option(
            metavar="error=1%|p95=2%",
            help="Render passes of at least --spp samples until the relative standard error of luminance is "
            "this small: on average over the pixels (error), or for 95 % of them (p95).",
        ),
    ] = None,
    max_time: Annotated[
        str | None,
        typer.Option(
            metavar="TIME", help="With --until: start no pass that would end later than this: 90s, 10m, 1.5h."
        ),
    ] = None,
    resume: ResumeOption = False,
    more_samples: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Add N samples per pixel to the finished image in the .nc file; instead of --spp.",
        ),
    ] = None,
    denoise: DenoiseOption = False,
    pictures: PicturesOption = None,
    exposure: ExposureOption = None,
    variant: VariantOption = "auto",
    threads: ThreadsOption = None,
    scheduler: SchedulerOption = None,
    workers: WorkersOption = None,
    mesh: MeshOption = None,
    emitters: Annotated[
        int | None, typer.Option(help="staged: N x N emitters on a planar surface. [default: 8]")
    ] = None,
    patches: Annotated[
        int | None, typer.Option(help="staged: emitters on a surface that is not planar. [default: 100]")
    ] = None,
    emitter_mode: Annotated[
        str | None,
        typer.Option(
            help="staged: emitters are patches of the surface itself (true), or the faces of a decimated "
            "copy, as in the paper. [default: true]",
            metavar="true|decimated",
        ),
    ] = None,
    exclude_emitter_geometry: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID|all",
            help="staged: leave this object out while it emits, as the paper does: only its emitters are "
            "there, and are black. May be repeated.",
        ),
    ] = None,
    bounces: Annotated[
        int | None,
        typer.Option(
            help="staged: how many times light may luminesce; 2 estimates component 6 too. [default: 1]"
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="staged: subdivide emitters until emission varies by less than this within each: 0.1 is 10 %, rms."
        ),
    ] = None,
    filter_edges: Annotated[
        bool,
        typer.Option("--filter-edges", help="staged: apply the paper's filter against artefacts at edges."),
    ] = False,
    keep_intermediate: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="staged: write the intermediate images, and pictures of the emitters, into this folder.",
        ),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(
            help="staged: independent renders, each of a part of the samples, for the standard error. [default: 4]"
        ),
    ] = None,
    renderer: Annotated[
        str | None,
        typer.Option(
            metavar="mitsuba|cycles",
            help="staged: the renderer of the images of three bands. [default: mitsuba]",
        ),
    ] = None,
    blender: BlenderOption = None,
    timings: Annotated[
        bool,
        typer.Option(
            "--timings", help="Print the time of each stage, in seconds; staged: relative to component 1."
        ),
    ] = False,
) -> None:
    """Render a scene into a spectral image, split into components."""
    from fluorspar.cli.outputs import write_outputs
    from fluorspar.cli.targets import check_images
    from fluorspar.extras import check_extra
    from fluorspar.image.streaming import streamed_to
    from fluorspar.job import read_grid
    from fluorspar.rendering import render as render_scene

    options = staged_options(
        method,
        emitters=emitters,
        patches=patches,
        mode=emitter_mode,
        exclude_emitter_geometry=_excluded(exclude_emitter_geometry),
        bounces=bounces,
        tolerance=tolerance,
        filter_edges=filter_edges or None,
        keep_intermediate=keep_intermediate,
        repeats=repeats,
    )
    lights = settings(light, "--light", light_of)
    check_images(output, pictures, (scene, mesh, *files_named(lights, {}, [])))
    shown_with = exposure_of(exposure, output, pictures)
    if denoise:
        check_extra("denoise")
    if denoise and (resume or more_samples):
        what = "--resume" if resume else "--more-samples"
        fix = "render without --denoise, then 'fluorspar denoise'"
        raise OptionError(message(f"{what} does not go with --denoise", fix=fix))
    loaded = scene_to_trace(
        scene, material=material, library=library, define=define, matte=matte, sensor=sensor, mesh=mesh
    )
    if until is not None:
        logging.getLogger("fluorspar.paths.passes").setLevel(logging.INFO)  # a line for each pass
    shape = size_of(size) or (loaded.settings.width, loaded.settings.height), len(read_grid(wavelengths))
    with streamed_to(
        output,
        *shape,
        component_errors=component_errors,
        denoise=denoise,
        temporary=method == "paths" and not (resume or more_samples),
    ) as streamed:
        with (
            client_for(scheduler, workers, threads) as client,
            console.progress_bar(f"rendering {scene}") as progress,
        ):
            image = render_scene(
                loaded,
                spp=spp,
                seed=seed,
                size=size_of(size),
                wavelengths=wavelengths,
                excitation=excitation,
                camera=camera,
                lights=lights,
                same_luminance=same_luminance,
                method=method,
                max_depth=max_depth,
                rr_depth=rr_depth,
                stokes=cast(Stokes, stokes),
                component_errors=component_errors,
                until=until,
                max_time=max_time,
                variant=variant,
                threads=threads,
                output=streamed,
                resume=resume,
                more_samples=more_samples,
                progress=progress,
                staged=options,
                renderer=chosen_renderer(renderer, blender),
                client=client,
            )
        _LOG.info("rendered")
        if denoise:
            image = image.denoised(scene=loaded, threads=threads)
            _LOG.info("denoised")
        write_outputs(image, output, pictures, streamed=streamed, exposure=shown_with)
        _LOG.info("written")
    if keep_intermediate is not None:
        _draw_emitters(keep_intermediate)
    if timings:
        print_timings(image)
    if image.attrs.get("fault"):
        raise typer.Exit(2)  # a warning has said what it is
    if image.attrs.get("partial") or image.attrs.get("until", {}).get("stopped") == "interrupted":
        raise typer.Exit(130)  # `main` says 143 after SIGTERM


def _draw_emitters(folder: Path) -> None:
    """Draw the emitters that a render has left in a folder, beside their files."""
    from fluorspar.figures.emitters import emitters_figure
    from fluorspar.figures.style import write_figure

    for path in sorted(folder.glob("L_F-*.nc")):
        write_figure(emitters_figure(path), path.with_suffix(".png"))


def _excluded(ids: list[str] | None) -> bool | list[str] | None:
    """Which objects `--exclude-emitter-geometry` leaves out."""
    if ids and len(ids) > 1 and "all" in ids:
        fix = "give all alone, or ids alone"
        where = "--exclude-emitter-geometry"
        raise OptionError(message("all is given beside ids", where=where, got=", ".join(ids), fix=fix))
    return True if ids == ["all"] else ids or None


render.__doc__ = f"{render.__doc__}\n\n{_EXAMPLES}"
