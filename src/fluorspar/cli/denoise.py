"""`fluorspar denoise`: an image of few samples without its noise."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.options import DefineOption, ImagesOption, PicturesOption, ThreadsOption
from fluorspar.image.formats.registry import SUFFIXES

__all__ = ["denoise"]

_EXAMPLES = """The error that is left is estimated; neighbouring pixels share it, so averaging over them does not make
it smaller. Needs 'pip install "fluorspar[denoise]"'.

Examples:

  fluorspar denoise box.nc -o clean.nc -o clean.png

  fluorspar denoise room.nc --scene room.xml -o clean.nc"""


def denoise(
    image: Annotated[Path, typer.Argument(metavar="IN", help=f"A spectral image ({', '.join(SUFFIXES)}).")],
    output: ImagesOption,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene",
            help="The scene that the image was rendered from; it tells where edges are, which are softened without it. "
            "[default: the built-in scene that the image names]",
        ),
    ] = None,
    define: DefineOption = None,
    pictures: PicturesOption = None,
    threads: ThreadsOption = None,
) -> None:
    """Take the noise out of a spectral image: its total and all components, at all wavelengths."""
    from fluorspar.cli.given import scene_named
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
    write_outputs(clean, output, pictures)


denoise.__doc__ = f"{denoise.__doc__}\n\n{_EXAMPLES}"
