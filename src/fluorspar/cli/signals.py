"""Ctrl-C, and SIGTERM as batch systems send it: both stop a command, at a moment when Python can be stopped."""

from __future__ import annotations

import _thread
import re
import signal
import sys
import threading
from contextlib import AbstractContextManager
from types import FrameType
from typing import Any

__all__ = ["Signals"]

_AGAIN = 0.02  # seconds
# Code in which the exception would be lost: an import, and the package trimesh, which catches all and goes on.
_WAITS = re.compile(r"<frozen importlib|.*[\\/]trimesh[\\/]")


class Signals(AbstractContextManager["Signals"]):
    """In its body both signals raise KeyboardInterrupt, which says nothing of which it was: `number` does.

    Not within an import: there the exception would leave half a module, and extension modules swallow it or crash; nor
    within code that swallows it. It waits until that is done. Where Python cannot pass it on (in a destructor, a
    callback of C code), it comes once more. A signal that was ignored before stays so.

    Attributes
    ----------
    number : int
        The last signal that came, 0 if none.

    Examples
    --------
    >>> with Signals() as signals:
    ...     try:
    ...         signal.raise_signal(signal.SIGTERM)
    ...     except KeyboardInterrupt:
    ...         print(signals.exit_code)
    143
    """

    def __init__(self) -> None:
        self.number = 0

    @property
    def exit_code(self) -> int:
        """128 and the number of the signal, as shells have it; of Ctrl-C if none came."""
        return 128 + (self.number or signal.SIGINT)

    def __enter__(self) -> Signals:
        self._handlers: dict[int, Any] = {}
        self._hook = sys.unraisablehook
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._handlers[number] = signal.signal(number, self._stop)
            sys.unraisablehook = self._lost
        return self

    def __exit__(self, *_: object) -> None:
        sys.unraisablehook = self._hook
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self.number = number
        while frame is not None:
            if _WAITS.match(frame.f_code.co_filename):
                self._again()
                return
            frame = frame.f_back
        raise KeyboardInterrupt

    def _lost(self, unraisable: sys.UnraisableHookArgs) -> None:
        if isinstance(unraisable.exc_value, KeyboardInterrupt):
            self._again()
        else:
            self._hook(unraisable)

    def _again(self) -> None:
        later = threading.Timer(_AGAIN, _thread.interrupt_main, (self.number or signal.SIGINT,))
        later.daemon = True
        later.start()
