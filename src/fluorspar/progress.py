"""How long work tells how far it is: one callback, which the command line and notebooks draw as a bar."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "shown"]

Progress = Callable[[int, int], None]
"""Called with the work done and the work in all."""


def shown(progress: Progress | bool | None) -> Progress | None:
    """Return the callback that is meant: `True` draws a bar, in a notebook or on standard error.

    Examples
    --------
    >>> shown(False) is None, shown(print) is print
    (True, True)
    """
    if not isinstance(progress, bool):
        return progress
    if not progress:
        return None
    from tqdm.auto import tqdm

    bar = tqdm(unit_scale=True)

    def draw(done: int, whole: int) -> None:
        bar.total = whole
        bar.update(done - bar.n)
        if done >= whole:
            bar.close()

    return draw
