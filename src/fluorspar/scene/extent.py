"""How large a scene may be for Mitsuba, which computes in single precision and in units of its own."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from fluorspar.errors import FluorsparWarning

__all__ = ["warn_of_extent"]

_LEAST = (
    300  # extents in ray offsets: a closed box of this size is wrong by half a per cent, of a tenth by 5 %
)
_LARGEST = 1e9  # units; the same box is right at this size, and 11 to 56 % off at 1e12


def warn_of_extent(built: Any) -> None:
    """Warn of a scene so small, so far from the origin, or so large that its light is wrong.

    Parameters
    ----------
    built : mitsuba.Scene

    Warns
    -----
    FluorsparWarning
        Mitsuba moves rays off surfaces by (1 + distance from the origin) * 8.9e-5 units, however small the scene is.
    """
    import mitsuba as mi

    low, high = np.array(built.bbox().min).ravel(), np.array(built.bbox().max).ravel()
    extent, reach = float((high - low).max()), float(np.abs([low, high]).max())
    offset = float(mi.math.RayEpsilon) * (1 + reach)
    if 0 <= extent < _LEAST * offset:
        fault = (
            f"Mitsuba keeps rays {offset:.2g} units off surfaces, so light that goes from surface to surface is wrong; "
            "choose a smaller unit and put the scene around the origin"
        )
    elif extent > _LARGEST:
        fault = "single precision does not hold the squares of such areas; choose a larger unit"
    else:
        return
    place = f"the scene measures {extent:.3g} units, up to {reach:.3g} from the origin on an axis"
    text = f"{place}: {fault} (intensities of point and spot lights then change with the square)"
    warnings.warn(text, FluorsparWarning, stacklevel=2)
