"""Find out before any work whether the files that a command is to write can be written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fluorspar.errors import OptionError, message
from fluorspar.files.writing import check_not_input, check_target

__all__ = ["check_files", "check_material_target", "check_outputs", "check_plot", "stream_target"]

_IMAGES = (".nc", ".exr", ".png")
_FIGURES = (".png", ".pdf", ".svg")


def check_files(paths: Sequence[Path], suffixes: tuple[str, ...]) -> None:
    """Find out before any work whether the files can be written.

    Raises
    ------
    OptionError
        If a suffix is none of those known, or a file is named twice.
    ImageError
        If a folder does not exist or may not be written to.

    Examples
    --------
    >>> check_files([Path("report.html")], (".html",))
    """
    for path in paths:
        if path.suffix.lower() not in suffixes:
            expected = ", ".join(suffixes)
            raise OptionError(
                message("this kind of file cannot be written", where="--output", got=path, expected=expected)
            )
        check_target(path)
    if len(set(paths)) < len(paths):
        raise OptionError(
            message("a file is to be written twice", where="--output", got=", ".join(map(str, paths)))
        )


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
        if path.suffix.lower() not in _IMAGES:
            raise OptionError(
                message(
                    "the suffix names no image format",
                    where="--output",
                    got=path,
                    expected=", ".join(_IMAGES),
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


def check_plot(path: Path | None) -> None:
    """Find out before any work whether a figure can be written.

    Raises
    ------
    OptionError
        If the suffix names no format.
    ImageError
        If the folder does not exist or may not be written to.
    """
    if path is None:
        return
    if path.suffix.lower() not in _FIGURES:
        expected = ", ".join(_FIGURES)
        fault, fix = "the suffix names no format of figures", "rename the file"
        raise OptionError(message(fault, where="--plot", got=path, expected=expected, fix=fix))
    check_target(path)


def check_material_target(path: Path, *inputs: str | Path | None) -> None:
    """Find out before any work whether a material file can be written.

    Raises
    ------
    OptionError
        If it is no `.csv` file, or one of the files that are read.
    ImageError
        If the folder does not exist or may not be written to.
    """
    if path.suffix.lower() != ".csv":
        fault = "a material file is a .csv file"
        raise OptionError(message(fault, where="--output", got=path, fix=f"write {path.stem}.csv"))
    check_target(path)
    check_not_input(path, *inputs)
