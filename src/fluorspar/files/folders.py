"""Write a folder under a temporary name and rename it when it is whole, as `writing` does with a file."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import shutil
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from fluorspar.errors import ImageError, message
from fluorspar.files.writing import HOST, OLD, start_of, temporaries

__all__ = ["TemporaryFolder", "check_folder"]

_HERE, _EXCHANGE = -100, 2  # AT_FDCWD and RENAME_EXCHANGE of Linux


def check_folder(path: str | os.PathLike[str], is_ours: Callable[[Path], bool], kind: str) -> Path:
    """Check, before any work is done, that a folder can be written or replaced.

    Parameters
    ----------
    path : str or path-like
        The folder to be written.
    is_ours : callable
        Tells whether a folder that is there is one that may be replaced.
    kind : str
        What such a folder is, for messages.

    Returns
    -------
    Path
        Of the folder itself: a symbolic link is followed.

    Raises
    ------
    ImageError
        If the directory it is to be in is missing or not writable, or what is there is something else.

    Examples
    --------
    >>> check_folder("room.zarr", lambda folder: True, "Zarr store").name
    'room.zarr'
    """
    path = Path(os.path.realpath(path)) if Path(path).is_symlink() else Path(path)
    if not path.parent.is_dir():
        fix = f"create it: mkdir -p {path.parent}"
        raise ImageError(message("the directory to write to does not exist", where=path, fix=fix))
    if path.exists() and not (path.is_dir() and is_ours(path)):
        fix = f"name another {kind}, or remove what is there"
        raise ImageError(message(f"what is there already is not a {kind}", where=path, fix=fix))
    if path.name in ("", ".."):  # it would be exchanged under the feet of whoever works in it
        fix = "name it from the directory above it"
        raise ImageError(message("a folder without a name cannot be written", where=path, fix=fix))
    if not os.access(path.parent, os.W_OK):
        fix = "choose another directory"
        raise ImageError(message("the directory cannot be written to", where=path.parent, fix=fix))
    return path


class TemporaryFolder:
    """A new folder beside `target`, in its stead until it is whole.

    It is locked while its writer lives. What writers that were killed have left there is removed first: folders whose
    lock is free, and of other hosts, whose locks may not be seen here, only after a week.

    Parameters
    ----------
    target : Path
        As `check_folder` returns it.
    in_place : bool
        Whether the new folder has the name of its target from the start, if there is nothing yet.

    Raises
    ------
    OSError
        If no folder can be made there.
    ImageError
        If another process is writing the target in place.

    Examples
    --------
    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "room"
    >>> temporary = TemporaryFolder(target)
    >>> _ = (temporary.path / "note.txt").write_text("whole")
    >>> temporary.keep()
    >>> [path.name for path in target.parent.iterdir()]
    ['room']
    """

    def __init__(self, target: Path, *, in_place: bool = False) -> None:
        self._target = target
        if target.exists() and not _is_free(target):
            fix = "wait for it, or write another one"
            raise ImageError(message("another process is writing the store", where=target, fix=fix))
        _remove_stale(target)
        self._lock = -1
        while self._lock < 0:
            self.path = target.with_name(f"{start_of(target)}{HOST}-{uuid.uuid4().hex[:8]}.tmp")
            if in_place and not target.exists():
                self.path = target
            self.path.mkdir()
            with suppress(FileNotFoundError):  # taken for a stale one before it was locked
                self._lock = os.open(self.path, os.O_RDONLY)
                with suppress(OSError):  # there are file systems without locks
                    fcntl.flock(self._lock, fcntl.LOCK_EX)
                if not self.path.exists():
                    self.drop()

    def keep(self) -> None:
        """Give the folder the name of its target, which keeps its old content until then."""
        if self.path != self._target and self._target.exists():
            _exchange(self.path, self._target)
            shutil.rmtree(self.path, ignore_errors=True)
        elif self.path != self._target:
            os.rename(self.path, self._target)
        self.leave()

    def drop(self) -> None:
        """Remove the folder, if it has not been kept."""
        if self._lock >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            self.leave()

    def leave(self) -> None:
        """Let go of the folder as it is."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1


def _exchange(new: Path, old: Path) -> None:
    """Give two folders each other's names: at once where the system can, so that there is one of them at any time."""
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is not None and rename(_HERE, os.fsencode(new), _HERE, os.fsencode(old), _EXCHANGE) == 0:
        return
    if rename is not None and ctypes.get_errno() not in (errno.EINVAL, errno.ENOSYS):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(old))
    aside = new.with_name(f"{new.name}.old")
    os.rename(old, aside)
    os.rename(new, old)
    os.rename(aside, new)


def _is_free(folder: Path) -> bool:
    """Whether nobody writes a folder in place."""
    lock = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True  # there are file systems without locks
    finally:
        os.close(lock)
    return True


def _remove_stale(target: Path) -> None:
    """Remove temporary folders whose writers are dead."""
    for path in temporaries(target):
        with suppress(OSError):
            lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                here = path.name.startswith(f"{start_of(target)}{HOST}-")
                if here or time.time() - os.fstat(lock).st_mtime > OLD:
                    shutil.rmtree(path, ignore_errors=True)
            finally:
                os.close(lock)
