"""What notebooks show of an object: a table of facts beside a picture, a curve or a patch of its colour."""

from __future__ import annotations

import html
from collections.abc import Iterable
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["curve", "explore", "facts_table", "patch"]

_WINDOW = (
    "fluorspar.view.frame"  # above all that can be looked at: imported by name, and when it is asked for
)
_WIDTH, _HEIGHT = 240, 90


def facts_table(title: str, facts: Iterable[tuple[str, str]], *beside: str) -> str:
    """Compose HTML: facts in a table, and elements beside it.

    Examples
    --------
    >>> facts_table("a <b>", [("x", "1 & 2")]).count("&")
    3
    """
    cells = "".join(
        f"<tr><td style='text-align:left'>{html.escape(name)}</td>"
        f"<td style='text-align:left;white-space:pre-line'>{html.escape(value)}</td></tr>"
        for name, value in facts
        if value
    )
    return (
        f"<div style='display:flex;gap:1.5em;align-items:flex-start'>{''.join(beside)}"
        f"<table><caption>{html.escape(title)}</caption>{cells}</table></div>"
    )


def curve(x: ArrayLike, y: ArrayLike) -> str:
    """Draw a curve as SVG, y from 0 (or its least value below) to its greatest.

    Examples
    --------
    >>> "points='0.0,90.0 240.0,0.0'" in curve([400, 700], [0, 1])
    True
    """
    at, values = np.asarray(x, np.float64), np.asarray(y, np.float64)
    low, high = min(0.0, values.min()), max(0.0, values.max())
    across = _WIDTH * (at - at[0]) / (at[-1] - at[0])
    up = _HEIGHT * (1 - (values - low) / ((high - low) or 1.0))
    points = " ".join(f"{h:.1f},{v:.1f}" for h, v in zip(across, up, strict=True))
    return (
        f"<svg width='{_WIDTH}' height='{_HEIGHT}' viewBox='-2 -2 {_WIDTH + 4} {_HEIGHT + 4}'>"
        f"<polyline fill='none' stroke='currentColor' points='{points}'/></svg>"
    )


def patch(rgb: ArrayLike) -> str:
    """Show a colour, sRGB from 0 to 1.

    Examples
    --------
    >>> "rgb(255,128,0)" in patch([1, 0.5, 0])
    True
    """
    red, green, blue = (round(255 * float(value)) for value in np.asarray(rgb))
    return f"<div style='width:5em;height:5em;background:rgb({red},{green},{blue})'></div>"


def explore(shown: object, **options: Any) -> Any:
    """Open the window of `fluorspar view` on an object, in a frame; see `fluorspar.view.frame.frame`."""
    return import_module(_WINDOW).frame(shown, **options)
