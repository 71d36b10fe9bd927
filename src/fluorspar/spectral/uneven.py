"""Wavelengths that are not evenly spaced: the bands of a camera or of a few lamps, kept as they are."""

from __future__ import annotations

from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from fluorspar.errors import FluorsparError, ImageError, SpectrumError, message
from fluorspar.spectral.even import check_ascending, even_grid
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["UnevenWavelengths", "grid_through"]


class UnevenWavelengths(Wavelengths):
    """The wavelengths of an image, not evenly spaced. What needs a step refuses them.

    Parameters
    ----------
    values : array_like of shape (N,)
        In nm, ascending, N >= 2.

    Examples
    --------
    >>> grid = UnevenWavelengths([365, 405, 450])
    >>> print(grid)
    365-450 nm, 3 uneven bands
    >>> grid.step
    Traceback (most recent call last):
    ...
    fluorspar.errors.SpectrumError: the wavelengths are not evenly spaced
      got:      365-450 nm, 3 uneven bands
      expected: START:STOP:STEP in nm
      fix:      bring the image to other wavelengths first: fluorspar convert IN OUT --wavelengths 365:450:5
    """

    def __init__(self, values: ArrayLike) -> None:
        at = np.array(values, np.float64)
        at.flags.writeable = False
        for name, value in (("start", float(at[0])), ("stop", float(at[-1])), ("values", at)):
            object.__setattr__(self, name, value)

    @property
    def step(self) -> NoReturn:
        """There is none."""
        step = 5 if self.stop - self.start >= 20 else 1
        start, stop = np.ceil(self.start / step) * step, np.floor(self.stop / step) * step
        raise SpectrumError(
            message(
                "the wavelengths are not evenly spaced",
                got=self,
                expected="START:STOP:STEP in nm",
                fix="bring the image to other wavelengths first: "
                f"fluorspar convert IN OUT --wavelengths {start:g}:{stop:g}:{step}",
            )
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, UnevenWavelengths) and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return hash(self.values.tobytes())

    def __repr__(self) -> str:
        return f"UnevenWavelengths({self.values.tolist()})"

    def __str__(self) -> str:
        return f"{self.start:g}-{self.stop:g} nm, {len(self.values)} uneven bands"


def grid_through(
    at: ArrayLike, where: object = None, error: type[FluorsparError] = ImageError
) -> Wavelengths:
    """The grid of wavelengths as they are: even but for rounding, else uneven.

    Parameters
    ----------
    at : array_like of shape (N,)
        In nm, ascending, N >= 2.
    where : object
        The file, for messages.
    error : type of FluorsparError
        What to raise.

    Raises
    ------
    FluorsparError
        Of class `error`, if the wavelengths do not ascend or are fewer than two.

    Examples
    --------
    >>> grid_through([400.0, 403.33, 406.67, 410.0]).step.__round__(4)
    3.3333
    >>> grid_through([365, 405, 450])
    UnevenWavelengths([365.0, 405.0, 450.0])
    """
    values = np.asarray(at, dtype=np.float64)
    check_ascending(values, where, error)
    return even_grid(values) or UnevenWavelengths(values)
