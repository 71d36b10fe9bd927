"""`fluorspar info`: what a file holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.errors import OptionError, message

__all__ = ["info"]


def info(
    file: Annotated[
        str,
        typer.Argument(
            help="A spectral image (.nc, .exr, .hdr), a scene (.xml or built-in) or a material (.csv, .bfc, or a name)."
        ),
    ],
) -> None:
    """Say what an image, a scene or a material holds.

    Example:  fluorspar info box.nc
    """
    from fluorspar.image.formats.registry import SUFFIXES
    from fluorspar.scene.builtin import BUILTIN

    suffix = Path(file).suffix.lower()
    if suffix in SUFFIXES:
        from fluorspar.image.spectral_image import SpectralImage

        with SpectralImage.open(file) as image:
            console.out.print(str(image), markup=False, highlight=False)
            for name, value in image.attrs.items():
                console.out.print(f"  {name + ':':<17}{value}", markup=False, highlight=False)
    elif suffix == ".xml" or file in BUILTIN:
        from fluorspar.scene.loading import load_scene

        console.out.print(str(load_scene(file)), markup=False, highlight=False)
    elif Path(file).is_dir() or (Path(file).exists() and suffix not in (".csv", ".bfc", ".txt")):
        raise OptionError(
            message(
                "this is not an image, a scene or a material",
                where=file,
                expected=".nc, .exr, .hdr, .xml, .csv, .bfc",
            )
        )
    else:
        from fluorspar.bispectral.library import material

        console.out.print(str(material(file)), markup=False, highlight=False)
