"""`fluorspar relight`: an image of light paths that are kept, with other lights and materials."""

from __future__ import annotations

from typing import Annotated, Any, cast

import typer

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.cli import console
from fluorspar.cli.changes import (
    GridOption,
    LightOption,
    PathsArgument,
    SameLuminanceOption,
    TracedExcitationOption,
    concentration_of,
    files_named,
    light_of,
    settings,
)
from fluorspar.cli.given import exposure_of, pairs
from fluorspar.cli.options import (
    ComponentErrorsOption,
    DefineOption,
    DenoiseOption,
    ExposureOption,
    ImagesOption,
    LibraryOption,
    PicturesOption,
    StokesOption,
    ThreadsOption,
)

__all__ = ["relight"]

_EXAMPLES = """Examples:

  fluorspar relight box.paths --light light=FL11 --material left-wall=poster-green -o new.nc -o new.png

  fluorspar relight box.paths --light light=D50 --denoise -o clean.nc

  fluorspar relight box.paths --light light=Ax0.5 --concentration left-wall=0 --wavelengths 300:780:1 -o new.nc"""


def relight(
    paths: PathsArgument,
    output: ImagesOption,
    light: LightOption = None,
    material: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID=NAME|FILE",
            help="Give a surface another material, by the id of its shape or BSDF: a name, a file, or a mixture "
            "X:0.3,Y:0.7. May be repeated.",
        ),
    ] = None,
    concentration: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID=FACTOR",
            help="Multiply the luminescence of a surface, by the id of its shape or BSDF. 0: none, its reflectance "
            "stays. May be repeated.",
        ),
    ] = None,
    same_luminance: SameLuminanceOption = False,
    library: LibraryOption = None,
    wavelengths: GridOption = None,
    excitation: TracedExcitationOption = None,
    stokes: StokesOption = "half",
    component_errors: ComponentErrorsOption = False,
    denoise: DenoiseOption = False,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene",
            help="For --denoise: the scene that was traced. [default: the built-in that PATHS name, else none]",
        ),
    ] = None,
    define: DefineOption = None,
    pictures: PicturesOption = None,
    exposure: ExposureOption = None,
    threads: ThreadsOption = None,
) -> None:
    """Compute an image of kept light paths, with other lights, materials or wavelengths; nothing is traced again."""
    from fluorspar.cli.given import scene_named
    from fluorspar.cli.outputs import write_outputs
    from fluorspar.cli.targets import check_images
    from fluorspar.extras import check_extra
    from fluorspar.files.names import text_of
    from fluorspar.image.streaming import streamed_to
    from fluorspar.job import read_grid
    from fluorspar.measuring.image_scene import scene_of
    from fluorspar.paths.light_paths import load_paths
    from fluorspar.scene.relit import relit

    lights = settings(light, "--light", light_of)
    materials = pairs(material or [], "--material")
    check_images(output, pictures, (paths, *files_named(lights, materials, library or [])))
    shown_with = exposure_of(exposure, output, pictures)
    if denoise:
        check_extra("denoise")
    kept = load_paths(paths)
    changes: dict[str, Any] = {
        "lights": lights,
        "materials": materials,
        "concentration": settings(concentration, "--concentration", concentration_of),
        "same_luminance": same_luminance,
        "library": library or [],
    }
    traced, finished = kept.job.scene.settings, 0
    pixels = traced.width * traced.height
    if kept.pixels < pixels:
        console.warning(
            f"{text_of(paths)} holds the paths of {kept.pixels} of {pixels} pixels, the others are NaN: "
            "'fluorspar trace' goes on with it (--resume)"
        )
    with streamed_to(
        output,
        (traced.width, traced.height),
        len(kept.job.grid if wavelengths is None else read_grid(wavelengths)),
        component_errors=component_errors,
        denoise=denoise,
    ) as streamed:
        with console.progress_bar(f"relighting {paths.name}") as progress:

            def report(done: int, whole: int) -> None:
                nonlocal finished
                finished = done
                progress(done, whole)

            image = kept.image(
                **changes,
                wavelengths=wavelengths,
                excitation=excitation,
                stokes=cast(Stokes, stokes),
                component_errors=component_errors,
                threads=threads,
                output=streamed,
                progress=report,
            )
        if denoise:
            shown = scene_of(kept.job.attrs, scene_named(scene, define))
            image = image.denoised(scene=shown and relit(shown, **changes), threads=threads)
            console.out.print(f"denoised: {image.attrs['denoised']}", markup=False, highlight=False)
        write_outputs(image, output, pictures, streamed=streamed, exposure=shown_with)
    if finished < kept.pixels:
        raise typer.Exit(130)  # `main` says 143 after SIGTERM
    if kept.pixels < pixels:
        raise typer.Exit(2)


relight.__doc__ = f"{relight.__doc__}\n\n{_EXAMPLES}"
