"""The temporary folder of this process, and those that killed processes have left."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
import time
from contextlib import suppress
from functools import cache
from pathlib import Path

from fluorspar.errors import FluorsparError, message
from fluorspar.files.host import HOST

__all__ = ["temporary_folder"]

# The folder of temporary files may be one of several hosts, whose locks may not be seen here.
_PREFIX, _LOCK = f"fluorspar-{HOST}-", ".in-use-by-fluorspar"
_YOUNG = 60  # seconds in which a folder may still be without its lock


@cache
def temporary_folder() -> Path:
    """A folder that goes when the process ends; after `kill -9`, when another process of this host asks for one.

    Its process holds a lock on a file in it for as long as it lives, whatever its number and wherever it runs.

    Raises
    ------
    FluorsparError
        If it cannot be made.

    Examples
    --------
    >>> temporary_folder().is_dir(), temporary_folder() == temporary_folder()
    (True, True)
    """
    try:
        remove_stale()
        folder = tempfile.mkdtemp(prefix=_PREFIX)
    except OSError as err:
        fix = "set TMPDIR to a folder with some space"
        raise FluorsparError(message("there is no room for temporary files", got=err, fix=fix)) from err
    _take(os.open(os.path.join(folder, _LOCK), os.O_RDWR | os.O_CREAT, 0o600))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def remove_stale() -> None:
    """Remove the folders of processes of this host that are gone; no other folder holds that file."""
    for lock in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*/{_LOCK}"):
        with suppress(OSError):
            descriptor = os.open(lock, os.O_RDWR)
            try:
                old = time.time() - os.fstat(descriptor).st_mtime > _YOUNG
                if old and _take(descriptor):
                    shutil.rmtree(lock.parent, ignore_errors=True)
            finally:
                os.close(descriptor)


def _take(descriptor: int) -> bool:
    """Take the lock if nobody holds it. Where there are no such locks, none is ever free."""
    try:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):
        return False
    return True
