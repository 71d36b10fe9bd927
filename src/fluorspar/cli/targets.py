"""Find out before any work whether the files that a command is to write can be written."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from fluorspar.bispectral.files.registry import SUFFIXES_WRITTEN
from fluorspar.errors import OptionError, message
from fluorspar.figures.style import FORMATS
from fluorspar.files.writing import check_not_input, check_target
from fluorspar.image.formats.envi import check_data_target
from fluorspar.image.formats.registry import SUFFIXES_WRITTEN as IMAGES_WRITTEN
from fluorspar.image.formats.zarr import check_zarr_target

__all__ = [
    "check_files",
    "check_images",
    "check_material_target",
    "check_pictures",
    "check_plot",
    "check_suffix",
]


def check_files(
    paths: Sequence[Path], suffixes: Sequence[str], inputs: Sequence[str | Path | None] = ()
) -> None:
    """Find out before any work whether the files of `--output` can be written.

    Parameters
    ----------
    paths : sequence of Path
        The files.
    suffixes : sequence of str
        Those that can be written.
    inputs : sequence of str or Path or None
        Files that are read, which are not to be overwritten.

    Raises
    ------
    OptionError
        If a suffix is none of those known, a file is named twice, or is one that is read.
    ImageError
        If a folder does not exist or may not be written to.

    Examples
    --------
    >>> check_files([Path("report.html")], (".html",))
    """
    for path in paths:
        check_suffix(path, suffixes, "--output")
        (check_zarr_target if path.suffix.lower() == ".zarr" else check_target)(path)
        check_not_input(path, *inputs)
    if len({os.path.realpath(path) for path in paths}) < len(paths):
        fault, got = "a file is to be written twice", ", ".join(map(str, paths))
        raise OptionError(message(fault, where="--output", got=got, fix="name each file once"))


def check_images(outputs: Sequence[Path], pictures: Path | None, inputs: Sequence[str | Path | None]) -> None:
    """Find out before any work whether the images of `--output` and the pictures can be written.

    Raises
    ------
    OptionError, ImageError
        As `check_files` and `check_pictures`; or if the data file of an ENVI header belongs to another one.

    Examples
    --------
    >>> check_images([Path("box.nc"), Path("box.png")], None, ["cornell-box"])
    """
    check_files(outputs, IMAGES_WRITTEN, inputs)
    for header in (path for path in outputs if path.suffix.lower() == ".hdr"):
        check_data_target(header)
    check_pictures(pictures)


def check_suffix(path: Path, suffixes: Sequence[str], option: str) -> None:
    """Check that a kind of file can be written.

    Raises
    ------
    OptionError
        If the suffix is none of those known.

    Examples
    --------
    >>> check_suffix(Path("box.NC"), (".nc", ".exr"), "--output")
    """
    if path.suffix.lower() not in suffixes:
        fault, expected, fix = "this kind of file cannot be written", ", ".join(suffixes), "rename the file"
        raise OptionError(message(fault, where=option, got=path, expected=expected, fix=fix))


def check_pictures(folder: Path | None) -> None:
    """Find out before rendering whether pictures can be written into a folder, which need not exist.

    Raises
    ------
    OptionError
        If it is a file, or within one.
    """
    if folder is not None:
        there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
        if not there.is_dir():
            raise OptionError(
                message("the pictures need a folder", where="--pictures", got=f"{there}, a file")
            )


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
    check_suffix(path, FORMATS, "--plot")
    check_target(path)


def check_material_target(path: Path, *inputs: str | Path | None) -> None:
    """Find out before any work whether a material file can be written.

    Raises
    ------
    OptionError
        If it is no kind of material file that is written, or one of the files that are read.
    ImageError
        If the folder does not exist or may not be written to.
    """
    check_suffix(path, SUFFIXES_WRITTEN, "--output")
    check_target(path)
    check_not_input(path, *inputs)
