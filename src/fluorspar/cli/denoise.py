"""`fluorspar denoise`: an image of few samples without its noise."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.options import DefineOption, ImagesOption, PicturesOption, ThreadsOption
from fluorspar.image.formats.registry import SUFFIXES

__all__ = ["denoise"]

_EXAMPLES = """Examples:

  fluorspar denoise box.nc -o clean.nc -o clean.png

  fluorspar denoise room.nc --scene room.xml -o clean.nc"""


def denoise(
    image: Annotated[Path, typer.Argument(metavar="IN", help=f"A spectral image ({', '.join(SUFFIXES)}).")],
    output: ImagesOption,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene",
            help="What the image was rendered from: its surfaces tell where edges are. [default: the built-in it "
            "names; without one edges may be softened]",
        ),
    ] = None,
    define: DefineOption = None,
    pictures: PicturesOption = None,
    threads: ThreadsOption = None,
) -> None:
    """Take the noise out of a spectral image, component by component, spectra kept.

    Its error is estimated: pixels of it share errors. Needs the package of 'pip install "fluorspar[denoise]"'.
    """
    from fluorspar.cli.options import scene_named
    from fluorspar.cli.outputs import write_outputs
    from fluorspar.cli.targets import check_images
    from fluorspar.extras import check_extra
    from fluorspar.files.names import text_of
    from fluorspar.image.spectral_image import SpectralImage

    check_images(output, pictures, (image, scene))
    check_extra("denoise")
    with SpectralImage.open(image) as noisy, console.err.status(f"denoising {text_of(image)}"):
        clean = noisy.denoised(scene=scene_named(scene, define), threads=threads)
    console.out.print(f"denoised: {clean.attrs['denoised']}", markup=False, highlight=False)
    write_outputs(clean, output, pictures, streamed=False)


denoise.__doc__ = f"{denoise.__doc__}\n{_EXAMPLES}"
