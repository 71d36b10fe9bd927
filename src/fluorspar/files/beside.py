"""A new file or folder beside its target, in its stead until it is whole; and what killed writers have left there."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import glob
import os
import platform
import re
import shutil
import time
import uuid
import zlib
from contextlib import suppress
from pathlib import Path

from fluorspar.errors import ImageError, message

__all__ = ["Temporary", "check_alone", "remove_unfinished", "unfinished"]

_HOST = f"{zlib.crc32(platform.node().encode()):08x}"
_NAME = 40  # characters of a name that its temporary name begins with: 255 bytes are the limit
_OLD = 7 * 86400.0  # s
_QUIET = 60.0  # s without a change after which a writer is taken for dead whose lock cannot be seen
_HERE, _EXCHANGE = -100, 2  # AT_FDCWD and RENAME_EXCHANGE of Linux


class Temporary:
    """A new file or folder beside `target`, in its stead until it is whole.

    It is locked while its writer lives. What writers that were killed have left there is removed first: what has a
    free lock, and of other hosts, whose locks may not be seen here, only after a week. What has a journal can be gone
    on with (see `unfinished`) until a file of that name is whole.

    Parameters
    ----------
    target : Path
        As `check_target` or `check_folder` returns it. A new file gets its permissions, if it exists.
    left : Path, optional
        What a killed writer has left, to go on with; a folder may be `target` itself.
    folder : bool
        Whether it is a folder.

    Attributes
    ----------
    path : Path
    journal : Path
        Where its journal belongs, if it has one.

    Raises
    ------
    OSError
        If nothing can be made there, or another process goes on with what was left.
    ImageError
        If another process is writing the target in place.

    Examples
    --------
    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "note.txt"
    >>> temporary = Temporary(target)
    >>> _ = temporary.path.write_text("whole")
    >>> temporary.keep()
    >>> [path.name for path in target.parent.iterdir()]
    ['note.txt']
    """

    def __init__(self, target: Path, left: Path | None = None, *, folder: bool = False) -> None:
        self._target = target
        check_alone(target, within=True)
        _remove_stale(target)
        self._lock = -1
        if left is not None:
            self.path, self._lock = left, _open(left)
            try:
                _lock(self._lock)
            except BlockingIOError:
                self.leave()
                raise
        while self._lock < 0:
            self.path = target.with_name(f"{_start_of(target)}{_HOST}-{uuid.uuid4().hex[:8]}.tmp")
            if folder:
                self.path.mkdir()
            else:
                os.close(os.open(self.path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666))
            with suppress(FileNotFoundError):  # taken for a stale one before it was locked
                self._lock = _open(self.path)
                _lock(self._lock, wait=True)
                if not self.path.exists():
                    self.drop()
        self.journal = _journal_of(self.path)

    def take_place(self) -> None:
        """Give a folder the name of its target before it is whole, if there is nothing yet.

        Raises
        ------
        ImageError
            If another process has done so meanwhile.
        """
        if self._target.exists():
            check_alone(self._target, within=True)
        else:
            os.rename(self.path, self._target)
            self.path = self._target

    def keep(self, *, durable: bool = False) -> None:
        """Give it the name of its target, which keeps its old content until then; remove what others have left of it.

        Parameters
        ----------
        durable : bool
            Wait until a file is on the disk: after a power cut there is then the older one, or this one.
        """
        if self.path != self._target:
            if self._target.is_dir():
                check_alone(self._target, within=True)
                _exchange(self.path, self._target)
                shutil.rmtree(self.path, ignore_errors=True)
            else:
                if self._target.exists():
                    shutil.copymode(self._target, self.path)
                if durable:
                    os.fsync(self._lock)
                os.replace(self.path, self._target)
            if durable:
                _sync_folder(self._target.parent)
            _remove(_journal_of(self.path))
        self.leave()
        _remove_stale(self._target, with_journals=True)

    def drop(self) -> None:
        """Remove it, if it has not been kept, and its journal."""
        if self._lock >= 0:
            if self.path == self._target:  # which has no journal: what is called so is the user's
                _remove(self.path)
            else:
                remove_unfinished(self.path)
            self.leave()

    def leave(self) -> None:
        """Let go of it and its journal, for another writer to go on with."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1


def unfinished(target: Path) -> list[tuple[Path, Path]]:
    """What writers of a file have left that were killed, and can be gone on with.

    Returns
    -------
    list of (Path, Path)
        The file under its temporary name, and its journal; the one with the longest journal first.
    """
    pairs = [(path, _journal_of(path)) for path in _temporaries(target) if _is_free(path)]
    found = [pair for pair in pairs if pair[1].exists()]
    return sorted(found, key=lambda pair: pair[1].stat().st_size, reverse=True)


def check_alone(target: Path, *, within: bool = False) -> None:
    """Check that no other process is writing a file or folder, or, if `within`, into a folder that is there.

    Raises
    ------
    ImageError
        If one does.
    """
    alone = not target.is_dir() or _is_free(target, in_place=True)
    if not (alone and (within or all(map(_is_free, _temporaries(target))))):
        what, fix = "folder" if target.is_dir() else "file", "wait for it, or write another one"
        raise ImageError(message(f"another process is writing the {what}", where=target, fix=fix))


def remove_unfinished(path: Path) -> None:
    """Remove what a killed writer has left under a temporary name, and its journal."""
    for each in (_journal_of(path), path):
        _remove(each)


def _start_of(target: Path) -> str:
    """What temporary names of a file or folder begin with: 255 bytes are the limit of a name."""
    name = target.name
    if len(name) > _NAME:
        name = f"{name[:_NAME]}-{zlib.crc32(name.encode(errors='surrogateescape')):08x}"
    return f".{name}."


def _temporaries(target: Path, suffix: str = "tmp") -> list[Path]:
    """Temporary files or folders that stand beside a target, in its stead."""
    start = _start_of(target)
    name = re.compile(rf"{re.escape(start)}[^.]+-[0-9a-f]{{8}}\.{suffix}")
    return [
        path for path in target.parent.glob(f"{glob.escape(start)}*.{suffix}") if name.fullmatch(path.name)
    ]


def _journal_of(path: Path) -> Path:
    return path.with_suffix(".journal")


def _open(path: Path) -> int:
    kind = os.O_RDONLY | os.O_DIRECTORY if path.is_dir() else os.O_RDWR | os.O_NONBLOCK
    return os.open(path, kind | os.O_NOFOLLOW)


def _lock(descriptor: int, *, wait: bool = False) -> bool:
    """Lock a file or folder; False where the file system has no locks.

    Raises
    ------
    BlockingIOError
        If another process has locked it.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        raise
    except OSError:
        return False
    return True


def _is_here(path: Path) -> bool:
    """Whether a temporary name was made by this host, whose locks are seen here for certain."""
    return f".{_HOST}-" in path.name


def _is_free(path: Path, *, in_place: bool = False) -> bool:
    """Whether the writer of a temporary file or folder, or of a folder in place, is dead."""
    try:
        descriptor = _open(path)
        try:
            seen = _lock(descriptor) and _is_here(path)
        finally:
            os.close(descriptor)
    except BlockingIOError:
        return False
    except OSError:
        seen = False
    try:
        return in_place or seen or time.time() - path.stat().st_mtime > _QUIET
    except OSError:
        return True  # gone


def _remove_stale(target: Path, with_journals: bool = False) -> None:
    """Remove temporary files and folders whose writers are dead."""
    for path in _temporaries(target):
        if _journal_of(path).exists() and not with_journals:
            continue
        with suppress(OSError):
            descriptor = _open(path)
            try:
                old = time.time() - os.fstat(descriptor).st_mtime > _OLD
                if _lock(descriptor) and (old or _is_here(path)):
                    remove_unfinished(path)
            finally:
                os.close(descriptor)
    for journal in _temporaries(target, "journal"):
        if not journal.with_suffix(".tmp").exists():  # killed between giving the file its name and this
            _remove(journal)


def _remove(path: Path) -> None:
    with suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


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


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
