"""Options of measuring and comparing, checked where they come in."""

from __future__ import annotations

import numpy as np

from fluorspar.errors import OptionError, message

__all__ = ["reference_option", "text_option", "width_option"]


def text_option(name: str, value: str | None) -> str | None:
    """Return an option that is text, or None.

    Raises
    ------
    OptionError
        If it is neither.

    Examples
    --------
    >>> text_option("component", "reflected")
    'reflected'
    """
    if value is None or isinstance(value, str):
        return value
    raise OptionError(message(f"{name} is not text", got=repr(value), expected="a name, as text"))


def reference_option(name: str, value: str | None) -> str:
    """Return what scales are matched by: "none" (or None) and "luminance" in any case, or the name of a point.

    Raises
    ------
    OptionError
        If it is not text.

    Examples
    --------
    >>> reference_option("match", "Luminance"), reference_option("match", "P7")
    ('luminance', 'P7')
    """
    text = text_option(name, value) or "none"
    return text.casefold() if text.casefold() in ("none", "luminance") else text


def width_option(name: str, value: float | None) -> float | None:
    """Return a bandwidth, or None.

    Raises
    ------
    OptionError
        If it is not a finite number of 0 or more.

    Examples
    --------
    >>> width_option("bandwidth", 8)
    8
    """
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if value is None or (number and np.isfinite(value) and value >= 0):
        return value
    raise OptionError(
        message(f"{name} is impossible", got=repr(value), expected="the FWHM in nm, 0 or more (0: samples)")
    )
