"""Spectral images as ENVI files, through the `spectral` package: a header `.hdr` and the data beside it."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, ImageError, message
from fluorspar.files.names import check_source, text_of
from fluorspar.files.writing import check_target, replacing, undisturbed
from fluorspar.image.components import TOTAL, select, sum_of
from fluorspar.image.computed import computed
from fluorspar.image.dataset import add_up, grid_of, names_of, row_blocks
from fluorspar.image.formats.envi_header import (
    KEPT,
    bandwidth,
    good_bands,
    header_of,
    laid_out_as,
    layout_of,
    read_header,
    stated_by,
    wavelengths,
)
from fluorspar.spectral.even import interpolated
from fluorspar.spectral.uneven import grid_through

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["check_data_target", "data_file", "read_envi", "write_envi"]


def write_envi(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write the total of a spectral image as an ENVI file: float32, band interleaved by pixel.

    Parameters
    ----------
    dataset : Dataset
        A spectral image. An ENVI file holds one quantity: components and standard errors are left out, and the
        field `components` of the header says what it is the sum of.
    path : str or path-like
        The header, `.hdr`; the data go beside it with the suffix `.img`.

    Raises
    ------
    ImageError
        If the files cannot be written, or a file with the name of the data has no header of that name, so
        that it is another one; what was there before is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> from fluorspar.image.dataset import make_dataset
    >>> path = Path(tempfile.mkdtemp()) / "room.hdr"
    >>> write_envi(make_dataset(np.ones((7, 4, 3, 69)), Wavelengths()), path)
    >>> float(read_envi(path).radiance.max())
    7.0
    """
    from spectral.io import envi

    header = check_target(path)
    data = check_data_target(path, count := 4 * dataset["radiance"][0].size)
    names = names_of(dataset)
    with undisturbed(), replacing(data, count) as new_data, replacing(header) as new_header:
        with new_data.open("wb") as stream:
            for rows in row_blocks(dataset):
                # numpy's own way does not tell why it fails
                stream.write(np.asarray(add_up(dataset, select(None, names), rows), "<f4").data)
        layout = laid_out_as(dataset["radiance"].shape[1:])
        envi.write_envi_header(
            str(new_header), layout | header_of(dataset.attrs | sum_of(names), grid_of(dataset))
        )


def check_data_target(header: str | os.PathLike[str], size: int = 0) -> Path:
    """Find out before any work whether the data of an ENVI header can be written beside it; return their file.

    Raises
    ------
    ImageError
        If they cannot, or a file of that name has no header, so that it is another one.
    """
    header = Path(header)
    data = check_target(header.with_suffix(".img"), size)
    if data.exists() and not header.exists():
        fault = "the data of the ENVI file would replace a file that does not belong to it"
        fix = "name another file, or remove that one"
        raise ImageError(message(fault, where=header, got=data, fix=fix))
    return data


def read_envi(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read an ENVI file as an image that is not split into components.

    Parameters
    ----------
    path : str or path-like
        The header, `.hdr`.

    Returns
    -------
    Dataset
        With the one component `total`, float32; one of more than 1 GiB is read from the file when it is used.
        Wavelengths in micrometres become nm; a `reflectance scale factor` is applied; pixels of the
        `data ignore value` become NaN; `fwhm` becomes the attribute `bandwidth_nm`.

    Raises
    ------
    ImageError
        If a file is missing or truncated, the header is malformed or holds no wavelengths, its scale factor or
        ignored value is no number, or it is not an image of real numbers.

    Warns
    -----
    ApproximationWarning
        If bands are bad (`bbl`): spectra are then interpolated. If the header states no byte order or no unit of the
        wavelengths: the warning says what is assumed.

    Examples
    --------
    >>> read_envi("no-such-file.hdr")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: the image file does not exist
      where:    no-such-file.hdr
    """
    path = check_source(path)
    header = read_header(path)
    (height, width, bands), stored = _numbers_of(header, path)
    at = wavelengths(header, bands, path)
    good = good_bands(header, len(at), path)
    widths = bandwidth(header, at, path)
    order = np.argsort(at, kind="stable")
    in_order = bool((np.diff(order) == 1).all())
    at, good = at[order], good[order]
    if not good.all():
        _say_bad(at, good, path)
    first, last = np.flatnonzero(good)[[0, -1]]
    within = ~good
    within[:first] = within[last + 1 :] = False

    def radiance(rows: slice) -> NDArray[np.float32]:
        values = stored(rows)
        if not in_order:
            values = values[..., order]
        if within.any():  # bad bands between good ones
            values[..., within] = interpolated(values[..., good], at[good], at[within])
        return np.ascontiguousarray(values[np.newaxis, ..., first : last + 1])

    grid = grid_through(at[first : last + 1], path)
    attrs = {
        "source_file": text_of(path.name),
        "description": str(header.get("description", "")),
        **{name: str(header[name]) for name in KEPT if name in header},
        **stated_by(header),
        **widths,
    }
    return computed({"radiance": radiance}, (width, height), grid, attrs, (TOTAL,))


def data_file(header: Path) -> str | None:
    """Find the data of an ENVI header beside it, None if there are none.

    `room.img` comes before `room`, which may be anything; for a header `room.img.hdr` it is `room.img`.
    """
    from spectral.io import envi

    suffixes = ["img", "", *envi.KNOWN_EXTS, "bip", "bil", "bsq"]
    for suffix in suffixes + [suffix.upper() for suffix in suffixes]:
        found = header.with_suffix(f".{suffix}" if suffix else "")
        if found.is_file():
            return str(found)
    return None


def _numbers_of(
    header: dict[str, Any], path: Path
) -> tuple[tuple[int, int, int], Callable[[slice], NDArray[np.float32]]]:
    """The shape (Y, X, N), and a function that reads rows: scaled, and NaN where they are to be ignored."""
    dtype, offset, sizes, order = layout_of(header, path)
    source = data_file(path)
    if source is None:
        raise ImageError(
            message(
                "the ENVI file is not readable",
                where=path,
                got="a header without data",
                expected=f"the data beside it, {path.stem}.img or of another usual name",
            )
        )
    rows, columns, bands = sizes
    expected, held = offset + math.prod(sizes) * dtype.itemsize, os.path.getsize(source)
    if held < expected:
        raise ImageError(
            message(
                "the image file is truncated",
                where=source,
                got=f"{held} bytes",
                expected=f"{expected} bytes",
                fix="write or copy it again",
            )
        )
    unread = [f"the last {held - expected} bytes of its data"] * (held > expected)
    unread += [f"the field '{name}'" for name in header if name.endswith(("gain values", "offset values"))]
    if unread:
        text = f"{path}: not used: {', '.join(unread)}"
        warnings.warn(text, ApproximationWarning, stacklevel=5)
    ignored = np.float32(header["data ignore value"]) if "data ignore value" in header else None
    factor = np.float32(header.get("reflectance scale factor", 1.0))
    stored = np.memmap(source, dtype, "r", offset, tuple(sizes[axis] for axis in order))

    def read(some: slice) -> NDArray[np.float32]:
        values = np.array(stored.transpose(np.argsort(order))[some], np.float32, order="C")
        if ignored is not None:
            values[values == ignored] = np.nan
        if factor != 1:
            values /= factor
        return values

    return (rows, columns, bands), read


def _say_bad(at: NDArray[np.float64], good: NDArray[np.bool_], path: Path) -> None:
    """Say that bad bands are cut off at the ends, and those between good ones interpolated."""
    bad = ", ".join(f"{wavelength:g}" for wavelength in at[~good][:8]) + (
        ", ..." if (~good).sum() > 8 else ""
    )
    text = f"{path}: bad bands (bbl) at {bad} nm: interpolated linearly, or left out at the ends"
    warnings.warn(text, ApproximationWarning, stacklevel=4)
