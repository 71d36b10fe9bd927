"""Spectral images as ENVI files, through the `spectral` package: a header `.hdr` and the data beside it."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, ImageError, message
from fluorspar.files.names import check_source, text_of
from fluorspar.files.writing import check_target, temporary_name, undisturbed, write_error
from fluorspar.image.components import TOTAL, select, sum_of
from fluorspar.image.dataset import add_up, grid_of, make_dataset, names_of
from fluorspar.image.formats.envi_header import (
    bandwidth,
    check_number,
    good_bands,
    header_of,
    stated_by,
    wavelengths,
)
from fluorspar.spectral.even import interpolated, regular_spectra

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["data_file", "read_envi", "write_envi"]


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
    >>> path = Path(tempfile.mkdtemp()) / "room.hdr"
    >>> write_envi(make_dataset(np.ones((7, 4, 3, 69)), Wavelengths()), path)
    >>> float(read_envi(path).radiance.max())
    7.0
    """
    from spectral.io import envi

    path = Path(path)
    target = path.with_suffix(".img")
    check_target(path)
    check_target(target, 4 * dataset["radiance"][0].size)
    if target.exists() and not path.exists():
        fault = "the data of the ENVI file would replace a file that is no part of it"
        fix = "name another file, or remove that one"
        raise ImageError(message(fault, where=path, got=target, fix=fix))
    metadata = header_of(dataset.attrs | sum_of(names_of(dataset)), grid_of(dataset))
    header = temporary_name(path).with_suffix(".hdr")
    data = header.with_suffix(".img")
    try:
        values = add_up(dataset, select(None, names_of(dataset)))
        envi.save_image(
            str(header),
            values,
            dtype=np.float32,
            interleave="bip",
            byteorder=0,
            ext=".img",
            metadata=metadata,
            force=True,
        )
        with undisturbed():
            os.replace(data, target)
            os.replace(header, path)
    except (OSError, RuntimeError) as err:
        raise write_error(path, err) from err
    finally:
        for temporary in (header, data):
            temporary.unlink(missing_ok=True)


def read_envi(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read an ENVI file as an image that is not split into components.

    Parameters
    ----------
    path : str or path-like
        The header, `.hdr`.

    Returns
    -------
    Dataset
        In memory, with the one component `total`, float32. Wavelengths in micrometres become nm; a
        `reflectance scale factor` is applied; pixels of the `data ignore value` become NaN; `fwhm` becomes
        the attribute `bandwidth_nm`.

    Raises
    ------
    ImageError
        If a file is missing or truncated, the header is malformed or holds no wavelengths, its scale factor or
        ignored value is no number, or it is not an image of real numbers.

    Warns
    -----
    ApproximationWarning
        If the wavelengths are not evenly spaced, or bands are bad (`bbl`): spectra are then interpolated.

    Examples
    --------
    >>> read_envi("no-such-file.hdr")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: the image file does not exist
      where:    no-such-file.hdr
    """
    from spectral.io import envi
    from spectral.io.spyfile import SpyException

    path = check_source(path)
    try:
        image = envi.open(str(path), data_file(path))
        _check_kind(image, path)
        header: dict[str, Any] = image.metadata
        for name in ("reflectance scale factor", "data ignore value"):
            check_number(header, name, path)
        values = np.array(image.load(dtype=np.float32, scale=True), np.float32, order="C")
    except (
        envi.EnviException,
        SpyException,
        OSError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
    ) as err:
        raise ImageError(
            message(
                "the ENVI file is not readable",
                where=path,
                got=str(err).strip().splitlines()[0] if str(err).strip() else type(err).__name__,
                expected="a header and, beside it, the data of the same name",
            )
        ) from err
    at = wavelengths(header, image.nbands, path)
    good = good_bands(header, image.nbands, path)
    if "data ignore value" in header:
        ignored = np.float32(float(header["data ignore value"]) / (image.scale_factor or 1.0))
        values[values == ignored] = np.nan
    order = np.argsort(at, kind="stable")
    if (np.diff(order) != 1).any():
        values, at, good = np.ascontiguousarray(values[..., order]), at[order], good[order]
    if not good.all():
        values, at = _mended(values, at, good, path)
    values, grid = regular_spectra(values, at, path)
    attrs = {
        "source_file": text_of(path.name),
        "description": str(header.get("description", "")),
        **({"components": str(header["components"])} if "components" in header else {}),
        **stated_by(header),
        **bandwidth(header, image.nbands, path),
    }
    return make_dataset(values[np.newaxis], grid, attrs=attrs, components=(TOTAL,))


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


def _check_kind(image: Any, path: Path) -> None:
    """Refuse what is not an image of real numbers, whole."""
    from spectral.io import envi

    if isinstance(image, envi.SpectralLibrary):
        fault = "the ENVI file is a spectral library, not an image"
        raise ImageError(message(fault, where=path, got=f"{len(image.spectra)} spectra", fix="give an image"))
    if np.dtype(image.dtype).kind == "c":
        raise ImageError(message("the ENVI file holds complex numbers", where=path, expected="real ones"))
    expected = image.offset + image.nrows * image.ncols * image.nbands * image.sample_size
    held = os.path.getsize(image.filename)
    if held < expected:
        raise ImageError(
            message(
                "the image file is truncated",
                where=image.filename,
                got=f"{held} bytes",
                expected=f"{expected} bytes",
                fix="write or copy it again",
            )
        )


def _mended(
    values: NDArray[np.float32], at: NDArray[np.float64], good: NDArray[np.bool_], path: Path
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Cut bad bands off at the ends, and interpolate those between good ones."""
    first, last = np.flatnonzero(good)[[0, -1]]
    bad = ", ".join(f"{wavelength:g}" for wavelength in at[~good][:8]) + (
        ", ..." if (~good).sum() > 8 else ""
    )
    text = f"{path}: bad bands (bbl) at {bad} nm: interpolated linearly, or left out at the ends"
    warnings.warn(text, ApproximationWarning, stacklevel=4)
    within = ~good
    within[:first] = within[last + 1 :] = False
    values[..., within] = interpolated(values[..., good], at[good], at[within])
    return np.ascontiguousarray(values[..., first : last + 1]), at[first : last + 1]
