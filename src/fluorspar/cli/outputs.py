"""Writing a rendered image to the files the user asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fluorspar.cli import console
from fluorspar.errors import OptionError, message
from fluorspar.files.writing import check_not_input, check_target
from fluorspar.image.spectral_image import SpectralImage

__all__ = ["check_outputs", "stream_target", "write_outputs"]

_FORMATS = (".nc", ".exr", ".png")


def check_outputs(
    outputs: Sequence[Path], pictures: Path | None, inputs: Sequence[str | Path | None] = ()
) -> None:
    """Find out before rendering whether the files can be written.

    Raises
    ------
    OptionError
        If a suffix is none of the formats, a file is named twice, or is one that is read.
    ImageError
        If a folder does not exist or may not be written to.
    """
    for path in outputs:
        if path.suffix.lower() not in _FORMATS:
            raise OptionError(
                message(
                    "the suffix names no image format",
                    where="--output",
                    got=path,
                    expected=", ".join(_FORMATS),
                    fix="rename the file",
                )
            )
        check_target(path)
        check_not_input(path, *inputs)
    if len({path.resolve() for path in outputs}) < len(outputs):
        raise OptionError(
            message(
                "a file is to be written twice",
                where="--output",
                got=", ".join(map(str, outputs)),
                fix="name each file once",
            )
        )
    if pictures is not None:
        there = next(folder for folder in (pictures, *pictures.absolute().parents) if folder.exists())
        if not there.is_dir():
            raise OptionError(
                message("the pictures need a folder", where="--pictures", got=f"{there}, a file")
            )


def stream_target(outputs: Sequence[Path]) -> Path | None:
    """Choose the file that the image is streamed to while it is rendered, if one is NetCDF."""
    return next((path for path in outputs if path.suffix.lower() == ".nc"), None)


def write_outputs(image: SpectralImage, outputs: Sequence[Path], pictures: Path | None) -> None:
    """Write the files that are not written yet, and say what came out."""
    from fluorspar.image.display.picture import write_pictures

    console.out.print(str(image), markup=False, highlight=False)
    streamed = stream_target(outputs)
    for path in outputs:
        if path != streamed:
            with console.err.status(f"writing {path}"):
                image.save(path)
        console.out.print(f"wrote {path}", markup=False, highlight=False)
    if pictures is not None:
        with console.err.status(f"writing pictures into {pictures}"):
            write_pictures(image, pictures)
        console.out.print(
            f"wrote a picture of every component into {pictures}", markup=False, highlight=False
        )
