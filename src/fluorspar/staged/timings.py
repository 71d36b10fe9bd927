"""How long each pass of the staged method takes, relative to component 1."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

__all__ = ["FIRST", "Stopwatch", "timing_table"]

FIRST = "component 1"
_SECONDS = "component 1, seconds"
_REST = "everything else"  # loading, compiling, finding what each sample shows, writing intermediate images


class Stopwatch:
    """Adds up the time of passes by name.

    Examples
    --------
    >>> watch = Stopwatch()
    >>> with watch.timing("component 1"):
    ...     pass
    >>> list(watch.relative())
    ['component 1', 'everything else', 'total', 'component 1, seconds']
    """

    def __init__(self) -> None:
        self.began = time.perf_counter()
        self.seconds: dict[str, float] = {}

    @contextmanager
    def timing(self, name: str) -> Iterator[None]:
        """Time the body of a `with` statement."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - began

    def relative(self) -> dict[str, float]:
        """Each pass, what else took time, and the time since the start, relative to component 1; and component
        1 in seconds."""
        wall = time.perf_counter() - self.began
        first = self.seconds.get(FIRST, 0.0)
        unit = first or 1.0
        rows = self.seconds | {_REST: wall - sum(self.seconds.values()), "total": wall}
        return {name: round(seconds / unit, 4) for name, seconds in rows.items()} | {
            _SECONDS: round(first, 4)
        }


def timing_table(timings: Mapping[str, float]) -> str:
    """Lay out the timings of a staged image, its attribute `timings`, as a table of text.

    Examples
    --------
    >>> timings = {"component 1": 1.0, "components 1 and 3": 2.5, "total": 3.5}
    >>> print(timing_table(timings | {"component 1, seconds": 4.0}))
    component 1              1.00  (4.0 s)
    components 1 and 3       2.50
    total                    3.50
    """
    width = max(22, 1 + max(len(name) for name in timings))
    lines = []
    for name, value in timings.items():
        if name != _SECONDS:
            seconds = f"  ({timings[_SECONDS]:.1f} s)" if name == FIRST and _SECONDS in timings else ""
            lines.append(f"{name:<{width}}{value:>7.2f}{seconds}")
    return "\n".join(lines)
