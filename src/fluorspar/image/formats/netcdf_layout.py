"""How a spectral image lies in a NetCDF file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.files.patient_file import PatientFile
from fluorspar.image.dataset import DIMS, VARIABLES, WAVELENGTH_ATTRS, plain_attrs, variable_attrs
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["chunk_rows", "create", "places", "write_attrs"]

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
    in_place: bool = False,
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
    in_place : bool
        Give all pixels their `places` now, to be written there past HDF5; what is never written reads as 0.

    Returns
    -------
    h5netcdf.File
        To be closed before `stream`.
    """
    import h5netcdf
    import h5py

    options: dict[str, Any]
    with ExitStack() as unless_whole:
        file = h5netcdf.File(stream, "w")
        unless_whole.callback(file.close)  # else HDF5 does when Python has ended, and PatientFile is no more
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
            options = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if compress else {}
            if in_place:
                options["dcpl"] = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
                options["dcpl"].set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
                options["dcpl"].set_fill_time(h5py.h5d.FILL_TIME_NEVER)
            variable = file.create_variable(
                name, dims, np.float32, fillvalue=missing, chunks=chunks, **options
            )
            variable.attrs.update(variable_attrs(name, attrs))
        unless_whole.pop_all()
    return file


def places(stream: PatientFile, variables: Sequence[str]) -> tuple[int, dict[str, NDArray[np.int64]]]:
    """Where the pixels of a file lie that was created `in_place` and closed.

    Returns
    -------
    rows : int
        Rows of a block: float32, pixel after pixel.
    places : dict of str to ndarray of shape (C or 1, blocks)
        For each variable the byte at which a layer of a block begins.
    """
    import h5py

    found = {}
    with h5py.File(stream, "r") as file:
        for name in variables:
            data = file[name].id
            chunks: list[Any] = []
            data.chunk_iter(chunks.append)
            layers = file[name].shape[0] if "component" in VARIABLES[name][1] else 1
            chunks.sort(key=lambda chunk: chunk.chunk_offset)
            found[name] = np.array([chunk.byte_offset for chunk in chunks]).reshape(layers, -1)
        return file[variables[0]].chunks[-3], found


def write_attrs(path: Path, attrs: Mapping[str, Any]) -> None:
    """Write attributes into a file that is whole but for them.

    Raises
    ------
    OSError
        If the disk is full.
    """
    import h5netcdf

    with PatientFile(path, "r+b") as stream:
        with h5netcdf.File(stream, "r+") as file:
            file.attrs.update(plain_attrs(attrs))
        stream.check()
