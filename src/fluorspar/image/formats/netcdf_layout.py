"""How a spectral image lies in a NetCDF file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fluorspar.files.patient_file import PatientFile
from fluorspar.image.dataset import DIMS, VARIABLES, WAVELENGTH_ATTRS, variable_attrs
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["chunk_rows", "create"]

_CHUNK_BYTES = 16 * 2**20  # rows of all components that go to the file together


def chunk_rows(components: int, height: int, width: int, bands: int) -> int:
    """Number of rows that are written together: about 16 MB, and hardly any padding at the end.

    Examples
    --------
    >>> chunk_rows(components=7, height=512, width=512, bands=69)
    16
    """
    rows = max(min(_CHUNK_BYTES // (4 * components * width * bands), height, 64), 1)
    return -(-height // -(-height // rows))


def create(
    stream: PatientFile,
    wavelengths: Wavelengths,
    components: Sequence[str],
    height: int,
    width: int,
    variables: Sequence[str],
    attrs: Mapping[str, Any],
    compress: bool = False,
) -> Any:
    """Lay out a NetCDF file without pixels: what is never written reads as NaN and takes no space.

    Parameters
    ----------
    stream : PatientFile
    wavelengths : Wavelengths
    components : sequence of str
    height, width : int
    variables : sequence of str
        Some of `VARIABLES`.
    attrs : mapping
        Attributes of the image, for quantity and unit.
    compress : bool
        Whether to pack the numbers without loss.

    Returns
    -------
    h5netcdf.File
        To be closed before `stream`.
    """
    import h5netcdf
    import h5py

    file = h5netcdf.File(stream, "w")
    sizes = dict(zip(DIMS, (len(components), height, width, len(wavelengths)), strict=True))
    file.dimensions = sizes
    names = file.create_variable("component", ("component",), h5py.string_dtype())
    names[...] = np.array(components, object)
    wavelength = file.create_variable("wavelength", ("wavelength",), np.float64)
    wavelength[...] = wavelengths.values
    wavelength.attrs.update(WAVELENGTH_ATTRS)
    # one component a chunk, so that a component can be read without the others
    extents = {**sizes, "component": 1, "y": chunk_rows(len(components), height, width, len(wavelengths))}
    for name in variables:
        dims = VARIABLES[name][1]
        chunks = tuple(extents[dim] for dim in dims)
        missing = np.float32(np.nan)
        packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if compress else {}
        variable = file.create_variable(name, dims, np.float32, fillvalue=missing, chunks=chunks, **packed)
        variable.attrs.update(variable_attrs(name, attrs))
    return file
