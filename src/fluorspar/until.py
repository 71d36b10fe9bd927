"""`Until`: how good an image is to become, and how long that may take."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from fluorspar.errors import OptionError, message
from fluorspar.scene.settings import MOST_SAMPLES

__all__ = ["Until", "next_samples"]

_MEASURES = ("error", "p95")
_FRACTION = re.compile(r"([0-9.]+(?:e-?[0-9]+)?)\s*(%?)", re.IGNORECASE)
_TIME = re.compile(r"([0-9]*\.?[0-9]+)\s*(s|m|h)?")
_OVERSHOOT = 1.1
_SECONDS = {"s": 1.0, "m": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class Until:
    """Render passes until the relative standard error of luminance is small enough, or the time is up.

    Parameters
    ----------
    measure : str
        `"error"`: the mean over the pixels that show light; `"p95"`: their 95th percentile.
    target : float
        What it is to become, as a fraction: 0.01 is one per cent.
    max_time : float, optional
        Seconds after which no more passes are made.

    Examples
    --------
    >>> Until.parse("p95=2%", "10m")
    Until(measure='p95', target=0.02, max_time=600.0)
    """

    measure: str
    target: float
    max_time: float | None = None

    @classmethod
    def parse(cls, until: str | None, max_time: str | float | None = None) -> Until | None:
        """Read `error=1%` or `p95=0.02`, and a time such as `90s`, `10m`, `1.5h` or a number of seconds.

        Returns
        -------
        Until or None
            None if neither is given.

        Raises
        ------
        OptionError
            If one is not readable or out of range, or there is a time without a target.
        """
        if until is None:
            if max_time is None:
                return None
            fix = "say until when to render (--until error=1%, until='error=1%')"
            raise OptionError(message("a time is given without a target", got=max_time, fix=fix))
        expected = (
            "error=FRACTION (the mean over the pixels) or p95=FRACTION (their 95th percentile), a fraction "
        )
        expected += "above 0 and below 1, such as error=1% or error=0.01"
        measure, _, text = str(until).partition("=")
        found = _FRACTION.fullmatch(text.strip())
        try:
            target = float(found[1]) / (100 if found[2] else 1) if found else math.nan
        except ValueError:  # two points in one number
            target = math.nan
        if measure.strip() not in _MEASURES or not 0 < target < 1:
            raise OptionError(
                message("the target of the render is not readable", got=repr(until), expected=expected)
            )
        return cls(measure.strip(), target, _seconds(max_time))

    def __str__(self) -> str:
        return f"{self.measure}={100 * self.target:g}%"

    @property
    def seconds(self) -> float:
        """The longest time, infinite if none is given."""
        return math.inf if self.max_time is None else self.max_time


def _seconds(given: str | float | None) -> float | None:
    if given is None:
        return None
    found = _TIME.fullmatch(str(given).strip())
    seconds = float(found[1]) * _SECONDS[found[2] or "s"] if found else math.nan
    if not 0 < seconds < math.inf:
        expected = "a time above 0, such as 90s, 10m, 1.5h, or a number of seconds"
        raise OptionError(message("the longest time is not readable", got=repr(given), expected=expected))
    return seconds


def next_samples(first: int, samples: int, wanted: float, affordable: float = math.inf) -> int:
    """How many samples per pixel the next pass takes: those of the first pass times a power of two.

    A larger pass is cheaper than several small ones, and its samples are better spread. It is not larger than all
    before it together, because what it is based on is an estimate, and overshoots by a tenth at the most.

    Parameters
    ----------
    first : int
        Samples of the first pass.
    samples : int
        Samples of all passes so far.
    wanted : float
        Estimate of what it takes in all; not finite if the error is not known, as after a single sample.
    affordable : float
        As many are finished in time.

    Returns
    -------
    int
        0 if not even as many as in the first pass are affordable, or there would be more than `MOST_SAMPLES` in all.

    Examples
    --------
    >>> next_samples(64, 64, 5000), next_samples(64, 1024, 5000), next_samples(64, 4096, 5000)
    (64, 1024, 1024)
    >>> next_samples(64, 1024, 5000, affordable=300), next_samples(64, 1024, 5000, affordable=50)
    (256, 0)
    """
    most = min(affordable, MOST_SAMPLES - samples)
    if not math.isfinite(wanted):
        size = max(first, 2)
        return size if size <= most else 0
    size = first
    while size < wanted - samples and 2 * size <= min(samples, _OVERSHOOT * wanted - samples, most):
        size *= 2
    return size if size <= most else 0
