"""How the command line shows warnings: each once, and of those alike two."""

from __future__ import annotations

import re
from collections import Counter
from typing import TextIO

from fluorspar.cli import console
from fluorspar.errors import FluorsparWarning

__all__ = ["ShownWarnings"]

_ALIKE = 2
_NAMES = re.compile(r"'[^']*'|[-+.\d]+")


class ShownWarnings:
    """Takes the place of `warnings.showwarning`.

    A material that two steps look at is warned of once; of forty surfaces of one kind only two are.

    Parameters
    ----------
    everything : bool
        Show those alike too, and those of libraries.

    Examples
    --------
    >>> shown = ShownWarnings()
    >>> shown.is_shown("'wall' is averaged"), shown.is_shown("'ball' is averaged"), shown.is_shown("'lid' is averaged")
    (True, True, False)
    """

    def __init__(self, everything: bool = False) -> None:
        self.everything = everything
        self.before: set[str] = set()
        self.alike: Counter[str] = Counter()

    def is_shown(self, text: str) -> bool:
        """Whether to show a text; it is counted."""
        if text in self.before:
            return False
        self.before.add(text)
        kind = _NAMES.sub("", text)
        self.alike[kind] += 1
        return self.everything or self.alike[kind] <= _ALIKE

    def finish(self) -> None:
        """Say how many were not shown."""
        hidden = 0 if self.everything else sum(max(0, count - _ALIKE) for count in self.alike.values())
        if hidden:
            console.note(f"{hidden} more warnings like these: 'fluorspar -v ...' prints them")
            self.alike.clear()

    def __call__(
        self,
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        text = str(message)
        if issubclass(category, FluorsparWarning):
            if self.is_shown(text):
                console.warning(text)
        elif self.everything:
            console.note(f"{category.__name__}: {text}")
