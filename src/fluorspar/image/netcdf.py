"""Spectral images as NetCDF files: the data set as it is, whole or written while it is being rendered."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.image.atomic import check_target, replacing, temporary_name, write_error
from fluorspar.image.components import COMPONENTS
from fluorspar.image.dataset import (
    DIMS,
    UNITS,
    VARIABLES,
    WAVELENGTH_ATTRS,
    check_dataset,
    grid_of,
    names_of,
    plain_attrs,
    row_blocks,
    values_of,
)
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["NetcdfWriter", "read_netcdf", "write_netcdf"]

_CHUNK_BYTES = 16 * 2**20  # rows of all components that go to the file together
_BUFFER_BYTES = 96 * 2**20  # blocks of rows held until they are whole


def write_netcdf(dataset: xr.Dataset, path: str | os.PathLike[str], *, compression: int = 0) -> None:
    """Write a spectral image to a NetCDF file, without loss.

    Parameters
    ----------
    dataset : Dataset
        A spectral image; it may be larger than memory.
    path : str or path-like
        The file to be written or replaced.
    compression : int
        zlib level 0 to 9. Rendered radiance is noise in its low bits: level 1 saves about a tenth of the
        space and takes some twenty times as long as level 0, higher levels save hardly more.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar.image.dataset import make_dataset
    >>> path = Path(tempfile.mkdtemp()) / "room.nc"
    >>> write_netcdf(make_dataset(np.ones((7, 4, 3, 69)), Wavelengths(), attrs={"spp": 16}), path)
    >>> read_netcdf(path).attrs["spp"]
    16
    """
    present = [name for name in VARIABLES if name in dataset]
    shape = (dataset.sizes["y"], dataset.sizes["x"])
    size = 0 if compression else sum(4 * dataset[name].size for name in present)
    with replacing(path, size) as temporary:
        file = _create(temporary, grid_of(dataset), names_of(dataset), *shape, present, compression)
        with file:
            for rows in row_blocks(dataset):
                for name in present:
                    if "component" in VARIABLES[name][1]:
                        for index, component in enumerate(names_of(dataset)):
                            file[name][index, rows] = values_of(dataset, name, rows, component)
                    else:
                        file[name][rows] = values_of(dataset, name, rows)
            file.attrs.update(plain_attrs(dataset.attrs))


def read_netcdf(path: str | os.PathLike[str]) -> xr.Dataset:
    """Open a spectral image in a NetCDF file; radiance is read from the file when it is used.

    Parameters
    ----------
    path : str or path-like
        A file written by Fluorspar, or any NetCDF-4 file of the same layout.

    Returns
    -------
    Dataset
        Close it when done, or call its method `load` to have it all in memory.

    Raises
    ------
    ImageError
        If the file is missing, truncated, or not a spectral image.

    Examples
    --------
    >>> read_netcdf("no-such-file.nc")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: the image file does not exist
      where:    no-such-file.nc
    """
    import xarray as xr

    path = Path(path)
    if not path.is_file():
        raise ImageError(message("the image file does not exist", where=path))
    try:
        dataset = xr.open_dataset(path, engine="h5netcdf", mask_and_scale=False, decode_times=False)
    except (OSError, ValueError, KeyError, RuntimeError) as err:
        what = "the image file is truncated" if "truncated" in str(err) else "the image file is not readable"
        raise ImageError(
            message(
                what,
                where=path,
                got=str(err).splitlines()[0],
                expected="a NetCDF-4 file written by Fluorspar",
                fix="write or copy it again",
            )
        ) from err
    try:
        check_dataset(dataset, path)
    except ImageError:
        dataset.close()
        raise
    for name in VARIABLES:
        if name in dataset:
            dataset[name].attrs.pop("_FillValue", None)
    dataset = dataset.assign_coords(component=list(names_of(dataset)))
    dataset.attrs = plain_attrs(dataset.attrs)
    return dataset


def _create(
    path: Path,
    wavelengths: Wavelengths,
    components: Sequence[str],
    height: int,
    width: int,
    variables: Sequence[str],
    compression: int,
) -> Any:
    """Create a NetCDF file without pixels: what is never written reads as NaN and takes no space."""
    import h5netcdf
    import h5py

    file = h5netcdf.File(path, "w")
    sizes = dict(zip(DIMS, (len(components), height, width, len(wavelengths)), strict=True))
    file.dimensions = sizes
    file.create_variable("component", ("component",), h5py.string_dtype())[...] = np.array(components, object)
    wavelength = file.create_variable("wavelength", ("wavelength",), np.float64)
    wavelength[...] = wavelengths.values
    wavelength.attrs.update(WAVELENGTH_ATTRS)
    rows = _chunk_rows(components, height, width, wavelengths)
    filters = {"compression": "gzip", "compression_opts": compression, "shuffle": True} if compression else {}
    for name in variables:
        long_name, dims = VARIABLES[name]
        # one component a chunk, so that a component can be read without the others
        chunks = {**sizes, "component": 1, "y": rows}
        variable = file.create_variable(
            name,
            dims,
            np.float32,
            fillvalue=np.float32(np.nan),
            chunks=tuple(chunks[dim] for dim in dims),
            **filters,
        )
        variable.attrs.update({"units": UNITS, "long_name": long_name})
    return file


def _chunk_rows(components: Sequence[str], height: int, width: int, wavelengths: Wavelengths) -> int:
    return int(np.clip(_CHUNK_BYTES // (4 * len(components) * width * len(wavelengths)), 1, min(height, 64)))


class _Block:
    """Some whole rows of an image, all variables, that are being filled pixel by pixel."""

    def __init__(self, shapes: Mapping[str, tuple[int, ...]], pixels: int) -> None:
        self.arrays = {name: np.empty(shape, np.float32) for name, shape in shapes.items()}
        self.known = np.zeros(pixels, bool)


class NetcdfWriter:
    """Write a spectral image to a NetCDF file while it is being rendered.

    The file has a temporary name until it is closed. Leaving the `with` block through an exception removes it
    and leaves an older file of the name as it was; to keep what was finished, call `close(partial=True)`
    before.

    Parameters
    ----------
    path : str or path-like
        The file to be written or replaced.
    wavelengths : Wavelengths
        The N wavelengths.
    height, width : int
        Size of the image in pixels.
    attrs : mapping, optional
        Attributes of the data set.
    component_errors : bool
        Whether the standard errors of the components will be given too.
    components : sequence of str
        The C components.
    compression : int
        zlib level, see `write_netcdf`.

    Raises
    ------
    ImageError
        If the file cannot be written, or the disk has not enough space left for it. This is found out before
        anything is rendered.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "room.nc"
    >>> with NetcdfWriter(path, Wavelengths(), height=2, width=3, attrs={"spp": 16}) as writer:
    ...     for first_pixel in (0, 2, 4):
    ...         writer.write_pixels(first_pixel, np.ones((2, 7, 69)), np.zeros((2, 69)))
    >>> read_netcdf(path).radiance.shape
    (7, 2, 3, 69)
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        wavelengths: Wavelengths,
        height: int,
        width: int,
        attrs: Mapping[str, Any] | None = None,
        component_errors: bool = False,
        *,
        components: Sequence[str] = COMPONENTS,
        compression: int = 0,
    ) -> None:
        self.wavelengths = wavelengths
        self.height, self.width = height, width
        self.attrs = dict(attrs or {})
        self._variables = [
            name for name in VARIABLES if component_errors or name != "component_standard_error"
        ]
        layers = {
            name: len(components) if "component" in VARIABLES[name][1] else 1 for name in self._variables
        }
        pixel_bytes = 4 * len(wavelengths) * sum(layers.values())
        self.path = check_target(path, 0 if compression else height * width * pixel_bytes)
        self._rows = _chunk_rows(components, height, width, wavelengths)
        self._shapes = {
            name: (layers[name], self._rows * width, len(wavelengths)) for name in self._variables
        }
        self._held = max(_BUFFER_BYTES // (self._rows * width * pixel_bytes), 2)
        self._blocks: dict[int, _Block] = {}  # in the order of their last use
        self._spilled: dict[int, NDArray[np.bool_]] = {}
        self._spare: list[_Block] = []
        self._known = 0
        self._temporary = temporary_name(self.path)
        self._file: Any = None
        try:
            self._file = _create(
                self._temporary, wavelengths, components, height, width, self._variables, compression
            )
        except (OSError, RuntimeError) as err:
            self.discard()
            raise write_error(self.path, err) from err

    def __enter__(self) -> NetcdfWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self.discard()
        elif self._file is not None:
            self.close()

    @property
    def finished_pixels(self) -> int:
        """How many pixels have been written."""
        return self._known

    def write_pixels(
        self,
        first_pixel: int,
        radiance: NDArray[np.floating],
        standard_error: NDArray[np.floating],
        component_standard_error: NDArray[np.floating] | None = None,
    ) -> None:
        """Write consecutive pixels, numbered row by row from the top left.

        Parameters
        ----------
        first_pixel : int
            Number of the first pixel, y * width + x. Pixels may come in any order.
        radiance : ndarray of shape (n, C, N)
            W m-2 sr-1 nm-1.
        standard_error : ndarray of shape (n, N)
            Of the total.
        component_standard_error : ndarray of shape (n, C, N), optional
            Of the components, if they were announced.

        Raises
        ------
        ImageError
            If the pixels are not in the image, a shape does not fit, or the disk is full.
        """
        given = {
            "radiance": radiance,
            "standard_error": standard_error[:, np.newaxis],
            "component_standard_error": component_standard_error,
        }
        count = len(radiance)
        self._check(first_pixel, count, given)
        block_pixels = self._rows * self.width
        done = 0
        try:
            while done < count:
                number, start = divmod(first_pixel + done, block_pixels)
                stop = min(start + count - done, block_pixels)
                block = self._block(number)
                for name in self._variables:
                    pixels = given[name][done : done + stop - start]  # type: ignore[index]
                    block.arrays[name][:, start:stop] = pixels.swapaxes(0, 1)
                self._known += stop - start - int(np.count_nonzero(block.known[start:stop]))
                block.known[start:stop] = True
                done += stop - start
                if block.known[: self._pixels_in(number)].all():
                    self._flush(number)
        except (OSError, RuntimeError) as err:
            self.discard()
            raise write_error(self.path, err) from err

    def close(self, partial: bool = False, attrs: Mapping[str, Any] | None = None) -> None:
        """Complete the file and give it its name.

        Parameters
        ----------
        partial : bool
            Mark the image as unfinished, with the attribute `partial` = 1. That is done anyway if pixels are
            missing; those are NaN.
        attrs : mapping, optional
            More attributes, such as the timings.

        Raises
        ------
        ImageError
            If the disk is full.
        """
        self.attrs.update(attrs or {})
        if partial or self._known < self.height * self.width:
            self.attrs["partial"] = 1
        try:
            for number in list(self._blocks):
                self._flush(number)
            self._file.attrs.update(plain_attrs(self.attrs))
            self._file.close()
            self._file = None
            os.replace(self._temporary, self.path)
        except (OSError, RuntimeError) as err:
            self.discard()
            raise write_error(self.path, err) from err

    def discard(self) -> None:
        """Remove the temporary file; an older file of the name stays as it was."""
        file, self._file = self._file, None
        with suppress(Exception):  # a full disk makes closing fail too
            if file is not None:
                file.close()
        with suppress(OSError):
            self._temporary.unlink(missing_ok=True)
        self._blocks.clear()

    def _check(self, first_pixel: int, count: int, given: Mapping[str, NDArray[np.floating] | None]) -> None:
        for name in VARIABLES:
            array = given[name]
            wanted = (count, self._shapes[name][0], len(self.wavelengths)) if name in self._shapes else None
            got = None if array is None else array.shape
            if got != wanted:
                raise ImageError(
                    message(
                        "pixels have the wrong shape",
                        where=name,
                        got=got or "none",
                        expected=wanted or "none",
                    )
                )
        if self._file is None or first_pixel < 0 or first_pixel + count > self.height * self.width:
            raise ImageError(
                message(
                    "the file is closed" if self._file is None else "pixels lie outside the image",
                    where=self.path,
                    got=f"pixels {first_pixel} to {first_pixel + count - 1}",
                    expected=f"0 to {self.height * self.width - 1}",
                )
            )

    def _pixels_in(self, number: int) -> int:
        return min(self._rows, self.height - number * self._rows) * self.width

    def _block(self, number: int) -> _Block:
        """Fetch a block and move it to the end of the line; the first in line goes if there are too many."""
        block = self._blocks.pop(number, None)
        if block is None:
            while len(self._blocks) >= self._held:
                self._flush(next(iter(self._blocks)))
            block = self._spare.pop() if self._spare else _Block(self._shapes, self._rows * self.width)
            block.known[:] = False
            if number in self._spilled:
                self._reload(number, block)
        self._blocks[number] = block
        return block

    def _flush(self, number: int) -> None:
        """Write a block to the file; one with gaps is remembered, to be completed later."""
        block = self._blocks.pop(number)
        pixels = self._pixels_in(number)
        gaps = ~block.known[:pixels]
        if gaps.any():
            self._spilled[number] = block.known.copy()
        for name, array in block.arrays.items():
            if gaps.any():
                array[:, :pixels][:, gaps] = np.nan
            where, shape = self._place(name, number)
            self._file[name][where] = array[:, :pixels].reshape(shape)
        self._spare = [block]

    def _reload(self, number: int, block: _Block) -> None:
        block.known[:] = self._spilled.pop(number)
        pixels = self._pixels_in(number)
        for name, array in block.arrays.items():
            where, _ = self._place(name, number)
            array[:, :pixels] = self._file[name][where].reshape(len(array), pixels, -1)

    def _place(self, name: str, number: int) -> tuple[tuple[slice, ...], tuple[int, ...]]:
        """Where a block of a variable belongs in the file, and its shape there."""
        rows = slice(number * self._rows, min((number + 1) * self._rows, self.height))
        shape = (rows.stop - rows.start, self.width, len(self.wavelengths))
        if "component" in VARIABLES[name][1]:
            return (slice(None), rows), (self._shapes[name][0], *shape)
        return (rows,), shape
