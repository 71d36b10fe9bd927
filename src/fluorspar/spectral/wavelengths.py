"""The wavelength grid all spectra of one image share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SpectrumError, message

__all__ = ["Wavelengths"]


@dataclass(frozen=True)
class Wavelengths:
    """A uniform wavelength grid, both ends included.

    Parameters
    ----------
    start, stop, step : float
        In nm. `stop` must be reached from `start` in whole steps.

    Raises
    ------
    SpectrumError
        If the numbers do not describe an ascending grid of at least two wavelengths.

    Examples
    --------
    >>> grid = Wavelengths()
    >>> grid
    Wavelengths(start=360.0, stop=700.0, step=5.0)
    >>> len(grid), grid.values[:3]
    (69, array([360., 365., 370.]))
    >>> Wavelengths.parse("300:780:2.5").step
    2.5
    """

    start: float = 360.0
    stop: float = 700.0
    step: float = 5.0

    def __post_init__(self) -> None:
        for field in ("start", "stop", "step"):
            object.__setattr__(self, field, float(getattr(self, field)))
        numbers = (self.start, self.stop, self.step)
        steps = (self.stop - self.start) / self.step if self.step else np.nan
        if not (np.all(np.isfinite(numbers)) and self.start > 0 and self.step > 0 and steps > 0.5):
            problem = "a wavelength grid must ascend from start to stop"
        elif abs(steps - round(steps)) > 1e-6 * steps:
            problem = "the stop of a wavelength grid is not a whole number of steps from its start"
        elif steps > 100_000:
            problem = "a wavelength grid has too many wavelengths"
        else:
            return
        raise SpectrumError(
            message(
                problem,
                got=f"{self.start:g}:{self.stop:g}:{self.step:g}",
                expected="START:STOP:STEP in nm, at least two wavelengths, such as 360:700:5",
            )
        )

    @classmethod
    def parse(cls, text: str) -> Wavelengths:
        """Read a grid from `"START:STOP:STEP"` (nm), as the command line takes it."""
        try:
            start, stop, step = (float(part) for part in text.split(":"))
        except ValueError as err:
            raise SpectrumError(
                message(
                    "a wavelength grid is not readable",
                    got=repr(text),
                    expected="START:STOP:STEP in nm, such as 360:700:5",
                )
            ) from err
        return cls(start, stop, step)

    @classmethod
    def from_values(cls, values: NDArray[np.floating]) -> Wavelengths:
        """Make the grid whose wavelengths are `values`, ndarray of shape (N,), in nm, evenly spaced."""
        values = np.asarray(values, dtype=np.float64)
        steps = np.diff(values)
        if values.ndim != 1 or len(values) < 2 or np.ptp(steps) > 1e-6 * np.abs(steps).max():
            raise SpectrumError(
                message(
                    "the wavelengths are not evenly spaced",
                    got=values,
                    expected="an ascending, uniform grid in nm",
                )
            )
        return cls(float(values[0]), float(values[-1]), float(steps.mean()))

    @cached_property
    def values(self) -> NDArray[np.float64]:
        """The wavelengths in nm, ndarray of shape (N,), read-only."""
        values = np.linspace(self.start, self.stop, round((self.stop - self.start) / self.step) + 1)
        values.flags.writeable = False
        return values

    def __len__(self) -> int:
        return len(self.values)

    def __str__(self) -> str:
        return f"{self.start:g}-{self.stop:g} nm by {self.step:g}"
