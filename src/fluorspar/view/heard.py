"""What is warned of while an image is made, for those who look at it."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fluorspar.errors import FluorsparWarning

__all__ = ["heard"]


@contextmanager
def heard() -> Iterator[list[str]]:
    """Collect the texts of warnings of this thread in a block, each once; those of others go where they went.

    `warnings.catch_warnings` would lose what other threads do to filters meanwhile: one block at a time, please.

    Examples
    --------
    >>> with heard() as texts:
    ...     warnings.warn("it is dark", FluorsparWarning)
    >>> texts
    ['it is dark']
    """
    texts: list[str] = []
    before, me = warnings.showwarning, threading.get_ident()
    hearing = True

    def hear(message: Warning | str, category: type[Warning], *others: Any, **more: Any) -> None:
        if not (hearing and threading.get_ident() == me and issubclass(category, FluorsparWarning)):
            before(message, category, *others, **more)
        elif str(message) not in texts:
            texts.append(str(message))

    warnings.simplefilter("always", FluorsparWarning)
    warnings.showwarning = hear
    try:
        yield texts
    finally:
        hearing = False
        warnings.showwarning = before
