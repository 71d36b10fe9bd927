"""Spectral images as ENVI files, through the `spectral` package: a header `.hdr` and the data beside it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.image.atomic import check_target, temporary_name, undisturbed, write_error
from fluorspar.image.components import TOTAL, select
from fluorspar.image.dataset import UNITS, add_up, decoded_attrs, grid_of, make_dataset, names_of
from fluorspar.image.regular import regular_spectra

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_envi", "write_envi"]

_NANOMETRES = {"nanometers": 1.0, "nm": 1.0, "micrometers": 1e3, "um": 1e3, "millimeters": 1e6, "mm": 1e6}
_NANOMETRES |= {
    "nanometer": 1.0,
    "nanometres": 1.0,
    "micrometer": 1e3,
    "micrometres": 1e3,
    "microns": 1e3,
    "µm": 1e3,
}


def write_envi(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write the total of a spectral image as an ENVI file: float32, band interleaved by pixel.

    Parameters
    ----------
    dataset : Dataset
        A spectral image. An ENVI file holds one quantity: components and standard errors are left out.
    path : str or path-like
        The header, `.hdr`; the data go beside it with the suffix `.img`.

    Raises
    ------
    ImageError
        If the files cannot be written; older ones of these names are then unchanged.

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
    grid = grid_of(dataset)
    said = [
        f"{name}: {value}"
        for name, value in decoded_attrs(dataset.attrs).items()
        if isinstance(value, str | int)
    ]
    metadata: dict[str, Any] = {
        # braces end an ENVI value
        "description": "; ".join([f"spectral radiance, {UNITS}", *said]).translate(
            {123: 40, 125: 41, 10: 32}
        ),
        "wavelength": [f"{wavelength:.10g}" for wavelength in grid.values],
        "wavelength units": "Nanometers",
        "band names": [f"{wavelength:g} nm" for wavelength in grid.values],
    }
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
        `reflectance scale factor` is applied; pixels of the `data ignore value` become NaN.

    Raises
    ------
    ImageError
        If a file is missing or truncated, or the header is malformed or holds no wavelengths.

    Warns
    -----
    ApproximationWarning
        If the wavelengths are not evenly spaced: spectra are then interpolated.

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

    path = Path(path)
    if not path.is_file():
        raise ImageError(message("the image file does not exist", where=path))
    try:
        image = envi.open(str(path))
        metadata: dict[str, Any] = image.metadata
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
    wavelengths = _wavelengths(metadata, image.nbands, path)
    if "data ignore value" in metadata:
        ignored = np.float32(float(metadata["data ignore value"]) / (image.scale_factor or 1.0))
        values[values == ignored] = np.nan
    order = np.argsort(wavelengths, kind="stable")
    if (np.diff(order) != 1).any():
        values = np.ascontiguousarray(values[..., order])
    values, grid = regular_spectra(values, wavelengths[order], path)
    attrs = {
        "source_file": path.name,
        "description": str(metadata.get("description", "")),
        "unit": "not stated",
    }
    return make_dataset(values[np.newaxis], grid, attrs=attrs, components=(TOTAL,))


def _wavelengths(metadata: dict[str, Any], count: int, path: Path) -> NDArray[np.float64]:
    """Wavelengths in nm, ndarray of shape (count,)."""
    fix = "add 'wavelength = { ... }' and 'wavelength units = Nanometers' to the header"
    try:
        at = np.array([float(text) for text in metadata["wavelength"]])
    except (KeyError, ValueError, TypeError) as err:
        raise ImageError(message("the ENVI header holds no wavelengths", where=path, fix=fix)) from err
    if len(at) != count:
        raise ImageError(
            message(
                "the ENVI header does not fit its data",
                where=path,
                got=f"{len(at)} wavelengths",
                expected=count,
            )
        )
    unit = str(metadata.get("wavelength units", "")).strip().lower()
    if unit in _NANOMETRES:
        return at * _NANOMETRES[unit]
    if unit in ("", "unknown") and at.min() > 100:
        return at  # no instrument measures 100 micrometres here
    raise ImageError(
        message(
            "the unit of the wavelengths is not known",
            where=path,
            got=repr(unit),
            expected="Nanometers or Micrometers",
            fix=fix,
        )
    )
