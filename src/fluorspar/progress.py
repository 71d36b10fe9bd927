"""How long work tells how far it is: one callback, which the command line draws as a bar."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress"]

Progress = Callable[[int, int], None]
"""Called with the work done and the work in all."""
