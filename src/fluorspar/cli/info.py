"""`fluorspar info`: what a file holds."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

import typer

from fluorspar.bispectral.files.registry import SUFFIXES as MATERIALS
from fluorspar.cli import console
from fluorspar.errors import OptionError, message
from fluorspar.image.formats.registry import SUFFIXES as IMAGES

__all__ = ["info"]

_ALIKE = 0.9  # a misspelt name of a scene; those of materials are further off
PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif", ".webp")


def info(
    file: Annotated[
        str,
        typer.Argument(
            help=f"A spectral image ({', '.join(IMAGES)}), a scene (.xml or built-in) "
            f"or a material ({', '.join(MATERIALS)}, or a name)."
        ),
    ],
) -> None:
    """Say what an image, a scene or a material holds.

    Example:  fluorspar info box.nc

    Example:  fluorspar info cornell-box

    Example:  fluorspar info poster-red
    """
    from fluorspar.scene.builtin import BUILTIN

    suffix = Path(file).suffix.lower()
    if suffix in IMAGES:
        from fluorspar.image.spectral_image import SpectralImage

        with SpectralImage.open(file) as image:
            console.out.print(str(image), markup=False, highlight=False)
            for name, value in image.attrs.items():
                if name == "fingerprint":
                    continue  # for programs
                console.out.print(f"  {name + ':':<17}{value}", markup=False, highlight=False)
    elif suffix == ".xml" or (not suffix and get_close_matches(file, BUILTIN, cutoff=_ALIKE)):
        from fluorspar.scene.loading import load_scene

        console.out.print(str(load_scene(file)), markup=False, highlight=False)
    elif suffix in PICTURES:
        fault = "a picture holds red, green and blue, no spectra"
        fix = f"give the spectral image it was made of ({', '.join(IMAGES)})"
        raise OptionError(message(fault, where=file, fix=fix))
    elif Path(file).is_dir() or (Path(file).exists() and suffix not in MATERIALS):
        raise OptionError(
            message(
                "this is not an image, a scene or a material",
                where=file,
                expected=", ".join((*IMAGES, ".xml", *MATERIALS)),
            )
        )
    else:
        from fluorspar.bispectral.library import material

        console.out.print(str(material(file)), markup=False, highlight=False)
