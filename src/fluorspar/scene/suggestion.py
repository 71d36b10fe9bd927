"""What a misspelt name of a scene was probably meant to be."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

__all__ = ["did_you_mean", "plugin_names"]


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Ask for the names that are closest to a misspelt one; empty if none is close.

    Examples
    --------
    >>> did_you_mean("cornel-box", ["cornell-box", "furnace"])
    'did you mean cornell-box?'
    """
    close = get_close_matches(name, sorted(set(known)), n=3)
    return f"did you mean {' or '.join(close)}?" if close else ""


def plugin_names() -> set[str]:
    """Names of the plugins that come with Mitsuba, and of Fluorspar's own.

    Examples
    --------
    >>> {"diffuse", "prb", "fluorescent"} <= plugin_names()
    True
    """
    import mitsuba as mi

    folder = Path(mi.__file__).parent
    compiled = {path.stem for path in (folder / "plugins").iterdir()}
    return (
        {"fluorescent"} | compiled | {path.stem for path in (folder / "python/ad/integrators").glob("*.py")}
    )
