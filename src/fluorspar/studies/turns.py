"""Turns: no two processes of a machine or a shared folder make the same rows of a study at the same time."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from fluorspar.studies.study import Row

__all__ = ["turn"]


@contextmanager
def turn(study: Path | None, rows: Sequence[Row], *, wait: bool) -> Iterator[bool]:
    """Keep other processes from some rows of a study, for the body.

    Each row has a byte of the file of the study, which is locked: such locks work on network file systems, leave
    nothing behind and go when their process dies. The file is not changed.

    Parameters
    ----------
    study : Path or None
        Its file. Without one that may be written to, or locked, nobody is kept from anything.
    rows : sequence of Row
    wait : bool
        For others who make some of them.

    Yields
    ------
    bool
        False if others do.

    Examples
    --------
    >>> with turn(None, [], wait=False) as is_ours:
    ...     is_ours
    True
    """
    descriptor = -1
    with suppress(OSError):
        descriptor = -1 if study is None else os.open(study, os.O_RDWR)
    try:
        yield descriptor < 0 or _lock(descriptor, rows, wait)
    finally:
        if descriptor >= 0:
            os.close(descriptor)


def _lock(descriptor: int, rows: Sequence[Row], wait: bool) -> bool:
    try:
        for row in rows:
            fcntl.lockf(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB), 1, row.number)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:  # the file system has no locks
        pass
    return True
