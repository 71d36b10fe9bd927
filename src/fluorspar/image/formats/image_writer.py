"""What the writers of images have in common that take pixels while they are rendered."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.files.writing import undisturbed, write_error
from fluorspar.image.dataset import VARIABLES, plain_attrs
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["ImageWriter"]


class ImageWriter(ABC):
    """Takes runs of pixels of an image in any order, and knows which it has.

    Parameters
    ----------
    wavelengths : Wavelengths
        The N wavelengths.
    height, width : int
        Size of the image in pixels.
    attrs : mapping or None
        Attributes of the data set.
    component_errors : bool
        Whether the standard errors of the components will be given too.
    components : int
        How many there are.
    """

    kind: str
    """What is written, for messages."""
    path: Path

    def __init__(
        self,
        wavelengths: Wavelengths,
        height: int,
        width: int,
        attrs: Mapping[str, Any] | None,
        component_errors: bool,
        components: int,
    ) -> None:
        self.wavelengths = wavelengths
        self.height, self.width = height, width
        self.attrs = plain_attrs(attrs or {})
        self._layers = {
            name: components if "component" in VARIABLES[name][1] else 1
            for name in ("radiance", "standard_error", "component_standard_error")
            if component_errors or name != "component_standard_error"
        }

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self.discard()
        elif self._is_open:
            self.close()

    @cached_property
    def _known(self) -> NDArray[np.bool_]:
        """Which pixels have been written; made once it is certain that there is room for the image."""
        return np.zeros(self.height * self.width, bool)

    @property
    @abstractmethod
    def _is_open(self) -> bool: ...

    @property
    def _can_go_on(self) -> bool:
        """Whether what is finished is left for another writer if this one gives up."""
        return False

    @abstractmethod
    def discard(self) -> None:
        """Give up what was written; what is there of an older one of the name stays as it was."""

    @abstractmethod
    def _write(self, first_pixel: int, count: int, given: Mapping[str, NDArray[np.floating]]) -> None:
        """Write checked pixels, arrays of shape (count, C or 1, N)."""

    @abstractmethod
    def _complete(self) -> None:
        """Write what is left, and the attributes; give the image its name."""

    def has(self, first_pixel: int, count: int) -> bool:
        """Whether pixels have been written."""
        return bool(self._known[first_pixel : first_pixel + count].all())

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
        given: dict[str, Any] = {
            "radiance": radiance,
            "standard_error": standard_error[:, np.newaxis],
            "component_standard_error": component_standard_error,
        }
        count = len(radiance)
        self._check(first_pixel, count, given)
        with self._step():
            self._write(first_pixel, count, given)

    def close(self, partial: bool = False, attrs: Mapping[str, Any] | None = None) -> None:
        """Complete the image and give it its name.

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
        if not self._is_open:
            raise ImageError(message(f"the {self.kind} is closed already", where=self.path))
        with self._step():
            self.attrs.update(attrs or {})
            if partial or not self._known.all():
                self.attrs["partial"] = 1
            self._complete()

    @contextmanager
    def _step(self) -> Iterator[None]:
        """Do something whole, whatever Ctrl-C says, or give the image up."""
        with undisturbed():
            try:
                yield
            except (OSError, RuntimeError) as err:
                self.discard()
                raise write_error(self.path, err, kept=self._can_go_on) from err
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
        if not self._is_open or first_pixel < 0 or first_pixel + count > self.height * self.width:
            raise ImageError(
                message(
                    "pixels lie outside the image" if self._is_open else f"the {self.kind} is closed",
                    where=self.path,
                    got=f"pixels {first_pixel} to {first_pixel + count - 1}",
                    expected=f"0 to {self.height * self.width - 1}",
                )
            )
