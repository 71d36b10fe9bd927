"""Who may use the cores: those who look come first, tracing goes on when nobody waits."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["Abandoned", "Turns"]

_AGAIN = 0.02  # seconds


class Abandoned(Exception):
    """Whoever asked does not wait for the answer any more."""


class Turns:
    """One image is made at a time, and tracing gives way to it.

    Examples
    --------
    >>> turns = Turns()
    >>> with turns.looking(None):
    ...     turns.waiting
    1
    """

    def __init__(self) -> None:
        self.waiting = 0
        self._making = threading.Lock()
        self._idle = threading.Condition()

    @contextmanager
    def looking(self, abandoned: threading.Event | None) -> Iterator[None]:
        """Wait for one's turn, which a block then has; Abandoned if the event comes before."""
        with self._idle:
            self.waiting += 1
        try:
            while not self._making.acquire(timeout=_AGAIN):
                if abandoned is not None and abandoned.is_set():
                    raise Abandoned
            try:
                yield
            finally:
                self._making.release()
        finally:
            with self._idle:
                self.waiting -= 1
                self._idle.notify_all()

    def give_way(self, longest: float) -> None:
        """Wait until nobody looks, or for so many seconds: whoever always looks is not to stop tracing for good."""
        end = time.monotonic() + longest
        with self._idle:
            while self.waiting and (left := end - time.monotonic()) > 0:
                self._idle.wait(left)
