"""Which runs of pixels of a file are on the disk for certain, so that a killed writer can be gone on with."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fluorspar.files.journal import Journal, read_journal

__all__ = ["Left", "Run", "RunJournal", "read_left"]

SYNC_EVERY = 5.0
"""Seconds of work that may be lost. A shorter render leaves no journal."""

Run = tuple[int, int]
"""Number of the first pixel of a run, and how many pixels it has."""


class RunJournal:
    """Notes runs of pixels once they are on the disk, every few seconds, in a thread of its own.

    Parameters
    ----------
    path : Path
        The journal, not there yet, or to be gone on with.
    header : mapping
        What it begins with.
    data : int
        Descriptor of the file of the pixels.
    end : int
        Where to go on, see `Left`.
    """

    def __init__(self, path: Path, header: Mapping[str, Any], data: int, end: int = 0) -> None:
        self._path, self._header, self._data, self._end = path, header, data, end
        self._journal: Journal | None = None
        self._pool = ThreadPoolExecutor(1)
        self._syncing: Future[None] | None = None
        self._new: list[Run] = []
        self._synced = time.monotonic()

    @property
    def is_begun(self) -> bool:
        """Whether there is anything in it to go on with."""
        return self._journal is not None or self._end > 0

    def add(self, first: int, count: int) -> None:
        """Note a run of pixels that has been written.

        Raises
        ------
        OSError
            If runs could not be brought to the disk, as when it is full.
        """
        self._new.append((first, count))
        if time.monotonic() - self._synced < SYNC_EVERY:
            return
        if self._syncing is not None:
            if not self._syncing.done():
                return
            self._syncing.result()
        self._synced = time.monotonic()
        runs, self._new = self._new, []
        self._syncing = self._pool.submit(self._sync, runs)

    def close(self) -> None:
        """Bring to the disk what is not there yet.

        Raises
        ------
        OSError
            If that does not succeed.
        """
        try:
            if self._syncing is not None:
                self._syncing.result()
            if self.is_begun:
                self._sync(self._new)
        finally:
            self._pool.shutdown()
            if self._journal is not None:
                self._journal.close()

    def _sync(self, runs: list[Run]) -> None:
        getattr(os, "fdatasync", os.fsync)(self._data)  # not on macOS
        if self._journal is None:
            self._journal = Journal(self._path, self._end)
            if not self._end:
                self._journal.append(self._header)
        self._journal.append({"runs": runs})
        self._journal.sync()


@dataclass(frozen=True)
class Left:
    """What a killed writer has left of a file, to be gone on with.

    Attributes
    ----------
    path : Path
        The file under its temporary name.
    header : dict
        Of its journal.
    runs : list of (int, int)
        What is on the disk: number of the first pixel of each run, and how many pixels it has.
    end : int
        Where the last whole record of the journal ends.
    """

    path: Path
    header: dict[str, Any]
    runs: list[Run]
    end: int


def read_left(path: Path) -> Left:
    """Read the journal of what a killed writer has left.

    Parameters
    ----------
    path : Path
        The file under its temporary name, see `unfinished`.
    """
    header: dict[str, Any] = {}
    runs: list[Run] = []
    end = 0
    for said, _, stop in read_journal(path.with_suffix(".journal")):
        if not header:
            header = said
        else:
            runs += [(first, count) for first, count in said["runs"]]
        end = stop
    return Left(path, header, runs, end)
