"""Signals that come while processes are started."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from types import FrameType

__all__ = ["late_signals"]


@contextmanager
def late_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM come when the body is done, which would else leave half of what it starts.

    Processes that are started by threads of the body, then or later, ignore Ctrl-C: a terminal sends it to them too,
    and it is for this one to obey.

    Examples
    --------
    >>> try:
    ...     with late_signals():
    ...         signal.raise_signal(signal.SIGINT)
    ...         print("started")
    ... except KeyboardInterrupt:
    ...     print("stopped")
    started
    stopped
    """
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        came.append(number)

    resource_tracker.ensure_running()  # which would unblock Ctrl-C in the thread of the first process
    handlers = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                handlers[number] = signal.signal(number, note)
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for late in came:
            signal.raise_signal(late)
