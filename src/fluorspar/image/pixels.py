"""Where a renderer puts finished pixels: an image in memory, or a file."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import FluorsparWarning, OptionError, RendererError, message
from fluorspar.files.run_journal import Left
from fluorspar.image.components import COMPONENTS
from fluorspar.image.formats.netcdf import NetcdfWriter
from fluorspar.image.formats.zarr_writer import ZarrWriter
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["FinishedPixels", "Pixels", "PixelsInFile", "PixelsInMemory", "Target", "check_streamed", "put"]

Array = NDArray[np.float32]

_LARGEST = 1e18  # the standard error needs squares


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


class FinishedPixels:
    """What all pixels of an image go through: numbers that are not finite are an error, and darkness is said.

    Parameters
    ----------
    grid : Wavelengths
    width : int
        Pixels of a row.
    dark : bool
        Whether all before were dark.
    """

    def __init__(self, grid: Wavelengths, width: int, *, dark: bool = True) -> None:
        self._grid, self._width = grid, width
        self._dark = dark

    def add(self, first: int, pixels: Pixels) -> None:
        """Look at the pixels from number `first` on.

        Raises
        ------
        RendererError
            If a radiance is not finite or above 1e18, or a standard error infinite; one that is NaN was not estimated.
        """
        for name, radiance in zip(COMPONENTS, pixels.radiance, strict=False):
            square = _square(radiance)
            if not np.isfinite(square):
                self._refuse(first, f"component {name}", ~(np.abs(radiance) < _LARGEST))
            self._dark = self._dark and square == 0 and not radiance.any()
        errors = pixels.component_standard_error
        for error in (pixels.standard_error, *(() if errors is None else errors)):
            if not np.isfinite(_square(error)):
                self._refuse(first, "a standard error", np.isinf(error))

    def finish(self) -> None:
        """Warn if the image is 0 everywhere."""
        if self._dark:
            text = (
                f"the image is 0 everywhere: perhaps the lamps give no light at {self._grid}, something stands between "
                "them and what is seen, the camera sees the black backs of one-sided surfaces (twosided), or is inside "
                "an object or looks past everything"
            )
            warnings.warn(text, FluorsparWarning, stacklevel=6)

    def _refuse(self, first: int, what: str, bad: NDArray[np.bool_]) -> None:
        if not bad.any():
            return  # only the sum is too large
        pixels = np.flatnonzero(bad.any(axis=1))
        y, x = divmod(first + int(pixels[0]), self._width)
        nanometres = self._grid.values[int(np.flatnonzero(bad[pixels[0]])[0])]
        raise RendererError(
            message(
                "the image holds values that are not finite numbers, or too large",
                where=f"{what}, first in pixel ({x}, {y}) at {nanometres:g} nm",
                got=f"such values in {len(pixels)} of {len(bad)} pixels",
                expected=f"finite numbers below {_LARGEST:g}, whose squares fit into single precision",
                fix="look for very large or small numbers in the scene: lights, distances, transforms",
            )
        )


def _square(values: Array) -> float:
    """Sum of the squares: not finite if a value is not, in a fifth of the time that `isfinite` takes."""
    flat = values.ravel()
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.dot(flat, flat))


class Target(Protocol):
    """Takes runs of pixels in any order: ask for `room`, fill it, `keep` it, and so on; at the end `image`."""

    def __enter__(self) -> Target: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    @property
    def kept(self) -> int:
        """How many pixels were taken."""
        ...

    def has(self, first: int, count: int) -> bool:
        """Whether pixels are there already: they need not be kept again."""
        ...

    def stored(self, first: int, count: int) -> Pixels:
        """Look at pixels that are there."""
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


def put(target: Target, first: int, pixels: Pixels) -> Pixels:
    """Put pixels that are somewhere else into a target, from number `first` on; return where they are now."""
    count = len(pixels.standard_error)
    room, at = target.room(first, count)
    own = room[at : at + count]
    own.radiance[:], own.standard_error[:] = pixels.radiance, pixels.standard_error
    if own.component_standard_error is not None:
        own.component_standard_error[:] = pixels.component_standard_error
    target.keep(first, count)
    return own


def check_streamed(path: str | os.PathLike[str]) -> None:
    """Refuse a file that an image cannot be streamed to.

    Raises
    ------
    OptionError
        If its suffix is not that of NetCDF or Zarr.
    """
    if Path(path).suffix.lower() not in (".nc", ".zarr"):
        raise OptionError(
            message(
                "an image can be streamed to NetCDF or Zarr only",
                got=Path(path).name,
                expected="a name that ends in .nc or .zarr",
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
        self._known = np.zeros(height * width, bool)
        self._finished = FinishedPixels(grid, width)

    def __enter__(self) -> PixelsInMemory:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    @property
    def kept(self) -> int:
        return int(np.count_nonzero(self._known))

    def has(self, first: int, count: int) -> bool:
        return bool(self._known[first : first + count].all())

    def stored(self, first: int, count: int) -> Pixels:
        return self._all[first : first + count]

    def room(self, first: int, count: int) -> tuple[Pixels, int]:
        return self._all, first

    def keep(self, first: int, count: int) -> None:
        self._finished.add(first, self._all[first : first + count])
        self._known[first : first + count] = True

    def image(self, attrs: Mapping[str, Any], *, partial: bool) -> SpectralImage:
        self._finished.finish()
        if not self._known.all():
            for values in (self._all.radiance, self._all.standard_error, self._all.component_standard_error):
                if values is not None:
                    values[..., ~self._known, :] = np.nan
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
    """A NetCDF file or Zarr store that is written while pixels come in, see `NetcdfWriter` and `ZarrWriter`.

    Parameters
    ----------
    path : path-like
    grid : Wavelengths
    height, width : int
    component_errors : bool
    label, left : optional
        See `NetcdfWriter`.
    resume : bool
        See `ZarrWriter`.

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
        label: Mapping[str, str] | None = None,
        left: Left | None = None,
        resume: bool = False,
    ) -> None:
        check_streamed(path)
        options: Any = {"component_errors": component_errors, "label": label}
        self._writer: NetcdfWriter | ZarrWriter
        if Path(path).suffix.lower() == ".zarr":
            self._writer = ZarrWriter(path, grid, height, width, **options, resume=resume)
        else:
            self._writer = NetcdfWriter(path, grid, height, width, **options, left=left)
        self._bands, self._component_errors = len(grid), component_errors
        self._buffer = Pixels.empty(0, self._bands, component_errors)
        self._finished = FinishedPixels(grid, width, dark=self._writer.finished_pixels == 0)

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

    def has(self, first: int, count: int) -> bool:
        return self._writer.has(first, count)

    def stored(self, first: int, count: int) -> Pixels:
        read = self._writer.read_pixels
        errors = read("component_standard_error", first, count) if self._component_errors else None
        return Pixels(read("radiance", first, count), read("standard_error", first, count)[0], errors)

    def room(self, first: int, count: int) -> tuple[Pixels, int]:
        if self._buffer.radiance.shape[1] < count:
            # used again and again, because touching fresh memory takes time
            self._buffer = Pixels.empty(count, self._bands, self._component_errors)
        return self._buffer, 0

    def keep(self, first: int, count: int) -> None:
        filled = self._buffer[:count]
        self._finished.add(first, filled)
        errors = filled.component_standard_error
        self._writer.write_pixels(
            first,
            filled.radiance.swapaxes(0, 1),
            filled.standard_error,
            None if errors is None else errors.swapaxes(0, 1),
        )

    def image(self, attrs: Mapping[str, Any], *, partial: bool) -> SpectralImage:
        self._finished.finish()
        self._writer.close(partial=partial, attrs=attrs)
        return SpectralImage.open(self._writer.path)
