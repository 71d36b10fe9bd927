"""Renderers of the staged method by name."""

from __future__ import annotations

from collections.abc import Callable

from fluorspar.errors import OptionError, message
from fluorspar.staged.renderers.cycles.renderer import CyclesRenderer
from fluorspar.staged.renderers.mitsuba.renderer import MitsubaRenderer
from fluorspar.staged.renderers.protocol import Renderer

__all__ = ["renderer_of"]

_NAMED: dict[str, Callable[[], Renderer]] = {"mitsuba": MitsubaRenderer, "cycles": CyclesRenderer}


def renderer_of(wanted: Renderer | str | None) -> Renderer:
    """Return a renderer for its name; None is Mitsuba, and a renderer is itself.

    Raises
    ------
    OptionError
        If there is none of that name.

    Examples
    --------
    >>> renderer_of("cycles").max_bands
    3
    """
    if wanted is None or isinstance(wanted, str):
        name = wanted or "mitsuba"
        if name not in _NAMED:
            expected = f"one of {', '.join(_NAMED)}, or an object that is a renderer"
            raise OptionError(message("there is no such renderer", got=repr(wanted), expected=expected))
        return _NAMED[name]()
    return wanted
