"""Where a renderer puts finished pixels: an image in memory, or a file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.image.components import COMPONENTS
from fluorspar.image.formats.netcdf import NetcdfWriter
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Pixels", "PixelsInFile", "PixelsInMemory", "Target", "check_streamed"]

Array = NDArray[np.float32]


@dataclass(frozen=True)
class Pixels:
    """Spectra of a run of P pixels on N wavelengths, W m-2 sr-1 nm-1.

    Attributes
    ----------
    radiance : ndarray of shape (7, P, N), float32
        The components.
    standard_error : ndarray of shape (P, N), float32
        Of the total; NaN for a single sample.
    component_standard_error : ndarray of shape (7, P, N), float32, or None
        Of the components, if it was asked for.
    """

    radiance: Array
    standard_error: Array
    component_standard_error: Array | None

    @classmethod
    def empty(cls, pixels: int, bands: int, component_errors: bool) -> Pixels:
        """Allocate, without touching the memory: writing the pages twice would show.

        Examples
        --------
        >>> Pixels.empty(4, 69, component_errors=False).radiance.shape
        (7, 4, 69)
        """
        shape = (len(COMPONENTS), pixels, bands)
        return cls(
            np.empty(shape, np.float32),
            np.empty(shape[1:], np.float32),
            np.empty(shape, np.float32) if component_errors else None,
        )

    def __getitem__(self, run: slice) -> Pixels:
        """See a part of the pixels."""
        errors = self.component_standard_error
        return Pixels(
            self.radiance[:, run], self.standard_error[run], None if errors is None else errors[:, run]
        )


class Target(Protocol):
    """Takes runs of pixels in their order: ask for `room`, fill it, `keep` it, and so on; at the end `image`."""

    def __enter__(self) -> Target: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    @property
    def kept(self) -> int:
        """How many pixels were taken."""
        ...

    def room(self, first: int, count: int) -> tuple[Pixels, int]:
        """Return arrays to be filled with `count` pixels from `first` on, and the place of that pixel in them."""
        ...

    def keep(self, first: int, count: int) -> None:
        """Take what was filled in."""
        ...

    def image(self, attrs: Mapping[str, Any], *, partial: bool) -> SpectralImage:
        """Finish; pixels that were not kept are NaN."""
        ...


def check_streamed(path: str | os.PathLike[str]) -> None:
    """Refuse a file that an image cannot be streamed to.

    Raises
    ------
    OptionError
        If its suffix is not that of NetCDF.
    """
    if Path(path).suffix.lower() != ".nc":
        raise OptionError(
            message(
                "an image can be streamed to NetCDF only",
                got=Path(path).name,
                expected="a name that ends in .nc",
            )
        )


class PixelsInMemory:
    """An image in memory; pixels are filled in where they belong.

    Raises
    ------
    OptionError
        If there is not enough memory.
    """

    def __init__(self, grid: Wavelengths, height: int, width: int, component_errors: bool) -> None:
        self._grid, self._height, self._width = grid, height, width
        try:
            self._all = Pixels.empty(height * width, len(grid), component_errors)
        except MemoryError as err:
            size = f"{width} x {height} pixels, {len(COMPONENTS)} components, {len(grid)} wavelengths"
            fix = "stream it to a NetCDF file (-o NAME.nc, output='NAME.nc'), or make it smaller"
            raise OptionError(message("the image does not fit into memory", got=size, fix=fix)) from err
        self.kept = 0

    def __enter__(self) -> PixelsInMemory:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def room(self, first: int, count: int) -> tuple[Pixels, int]:
        return self._all, first

    def keep(self, first: int, count: int) -> None:
        self.kept = first + count

    def image(self, attrs: Mapping[str, Any], *, partial: bool) -> SpectralImage:
        rest = self._all[self.kept :]
        for values in (rest.radiance, rest.standard_error, rest.component_standard_error):
            if values is not None:
                values[...] = np.nan
        shape = (self._height, self._width, len(self._grid))
        errors = self._all.component_standard_error
        return SpectralImage.from_arrays(
            self._all.radiance.reshape(-1, *shape),
            self._grid,
            self._all.standard_error.reshape(shape),
            {**attrs, **({"partial": 1} if partial else {})},
            component_standard_error=None if errors is None else errors.reshape(-1, *shape),
        )


class PixelsInFile:
    """A NetCDF file that is written while pixels come in, see `NetcdfWriter`.

    Raises
    ------
    OptionError
        If the name has another suffix.
    ImageError
        If the file cannot be written.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        grid: Wavelengths,
        height: int,
        width: int,
        component_errors: bool,
    ) -> None:
        check_streamed(path)
        self._writer = NetcdfWriter(path, grid, height, width, component_errors=component_errors)
        self._bands, self._component_errors = len(grid), component_errors
        self._buffer = Pixels.empty(0, self._bands, component_errors)

    def __enter__(self) -> PixelsInFile:
        self._writer.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.__exit__(kind, error, trace)

    @property
    def kept(self) -> int:
        return self._writer.finished_pixels

    def room(self, first: int, count: int) -> tuple[Pixels, int]:
        if self._buffer.radiance.shape[1] < count:
            # used again and again, because touching fresh memory takes time
            self._buffer = Pixels.empty(count, self._bands, self._component_errors)
        return self._buffer, 0

    def keep(self, first: int, count: int) -> None:
        filled = self._buffer[:count]
        errors = filled.component_standard_error
        self._writer.write_pixels(
            first,
            filled.radiance.swapaxes(0, 1),
            filled.standard_error,
            None if errors is None else errors.swapaxes(0, 1),
        )

    def image(self, attrs: Mapping[str, Any], *, partial: bool) -> SpectralImage:
        self._writer.close(partial=partial, attrs=attrs)
        return SpectralImage.open(self._writer.path)
