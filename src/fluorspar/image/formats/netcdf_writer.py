"""Write a spectral image to a NetCDF file while it is being rendered, in bounded memory."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.files.patient_file import PatientFile
from fluorspar.files.writing import Temporary, check_target, undisturbed, write_error
from fluorspar.image.components import COMPONENTS
from fluorspar.image.dataset import VARIABLES, plain_attrs
from fluorspar.image.formats.netcdf_layout import create, places
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["NetcdfWriter"]


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

    Raises
    ------
    ImageError
        If the file cannot be written, or the disk has not enough space left for it. This is found out before
        anything is rendered.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar.image.formats.netcdf import read_netcdf
    >>> path = os.path.join(tempfile.mkdtemp(), "room.nc")
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
    ) -> None:
        self.wavelengths = wavelengths
        self.height, self.width = height, width
        self.attrs = plain_attrs(attrs or {})
        layers = {
            name: len(components) if "component" in dims else 1
            for name, (_, dims) in VARIABLES.items()
            if name in ("radiance", "standard_error")
            or (component_errors and name == "component_standard_error")
        }
        pixel_bytes = 4 * len(wavelengths) * sum(layers.values())
        self.path = check_target(path, height * width * pixel_bytes)
        self._layers = layers
        self._known = np.zeros(height * width, bool)
        self._data = -1
        try:
            self._temporary = Temporary(self.path)
            try:
                rows, self._places = self._lay_out(components)
                self._data = os.open(self._temporary.path, os.O_RDWR)
            except BaseException:
                self._temporary.drop()
                raise
        except OSError as err:
            raise write_error(self.path, err) from err
        self._block = rows * width  # pixels that follow one another in the file

    def __enter__(self) -> NetcdfWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self.discard()
        elif self._data >= 0:
            self.close()

    @property
    def finished_pixels(self) -> int:
        """How many pixels have been written."""
        return int(np.count_nonzero(self._known))

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
        with self._step():
            for name in self._layers:
                for layer, pixels in enumerate(np.swapaxes(given[name], 0, 1)):  # type: ignore[arg-type]
                    self._put(name, layer, first_pixel, pixels)
            self._known[first_pixel : first_pixel + count] = True

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
        if self._data < 0:
            raise ImageError(message("the file is closed already", where=self.path))
        with self._step():
            self.attrs.update(attrs or {})
            if not self._known.all():
                self._fill_gaps()
                partial = True
            if partial:
                self.attrs["partial"] = 1
            os.close(self._data)
            self._data = -1
            self._write_attrs()
            self._temporary.keep()

    def discard(self) -> None:
        """Remove the temporary file; an older file of the name stays as it was."""
        if self._data >= 0:
            os.close(self._data)
            self._data = -1
        self._temporary.drop()

    @contextmanager
    def _step(self) -> Iterator[None]:
        """Do something to the file whole, whatever Ctrl-C says, or give the file up."""
        with undisturbed():
            try:
                yield
            except (OSError, RuntimeError) as err:
                self.discard()
                raise write_error(self.path, err) from err
            except BaseException:
                self.discard()
                raise

    def _check(self, first_pixel: int, count: int, given: Mapping[str, NDArray[np.floating] | None]) -> None:
        for name, array in given.items():
            wanted = (count, self._layers[name], len(self.wavelengths)) if name in self._layers else None
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
        if self._data < 0 or first_pixel < 0 or first_pixel + count > self.height * self.width:
            raise ImageError(
                message(
                    "the file is closed" if self._data < 0 else "pixels lie outside the image",
                    where=self.path,
                    got=f"pixels {first_pixel} to {first_pixel + count - 1}",
                    expected=f"0 to {self.height * self.width - 1}",
                )
            )

    def _lay_out(self, components: Sequence[str]) -> tuple[int, dict[str, NDArray[np.int64]]]:
        """Create the file without pixels; return where they belong, see `places`."""
        with PatientFile(self._temporary.path) as stream:
            size = self.height, self.width
            create(
                stream, self.wavelengths, components, *size, list(self._layers), self.attrs, in_place=True
            ).close()
            stream.check()
            return places(stream, list(self._layers))

    def _put(self, name: str, layer: int, first_pixel: int, pixels: NDArray[np.floating]) -> None:
        """Write pixels of a layer to where they belong, past HDF5, of which a crash then leaves nothing half done."""
        pixels = np.ascontiguousarray(pixels, np.float32)
        done, count = 0, len(pixels)
        while done < count:
            number, start = divmod(first_pixel + done, self._block)
            run = pixels[done : done + self._block - start]
            place = int(self._places[name][layer, number]) + start * pixels[0].nbytes
            left = memoryview(run).cast("B")
            while left:
                written = os.pwrite(self._data, left, place)
                left, place = left[written:], place + written
            done += len(run)

    def _fill_gaps(self) -> None:
        edges = np.flatnonzero(np.diff(self._known, prepend=True, append=True))
        for first, stop in edges.reshape(-1, 2).tolist():
            for start in range(first, stop, self._block):
                shape = min(self._block, stop - start), len(self.wavelengths)
                missing = np.full(shape, np.nan, np.float32)
                for name, layers in self._layers.items():
                    for layer in range(layers):
                        self._put(name, layer, start, missing)

    def _write_attrs(self) -> None:
        import h5netcdf

        with PatientFile(self._temporary.path, "r+b") as stream:
            with h5netcdf.File(stream, "r+") as file:
                file.attrs.update(plain_attrs(self.attrs))
            stream.check()
