"""A new file or folder beside its target, in its stead until it is whole; and what killed writers have left there."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import glob
import os
import re
import shutil
import time
import uuid
import warnings
import zlib
from contextlib import suppress
from pathlib import Path

from fluorspar.errors import FluorsparWarning, ImageError, message
from fluorspar.files.host import HOST

__all__ = ["Temporary", "check_alone", "remove_unfinished", "unfinished"]

_NAME = 40  # characters of a name that its temporary name begins with: 255 bytes are the limit
_QUIET = 60.0  # s without a change after which a writer is taken for dead whose lock cannot be seen
_NAMED = re.compile(r"(?P<host>[^.-]+)-[0-9a-f]{8}\.(tmp|journal|lock)$")
_HERE, _EXCHANGE = -100, 2  # AT_FDCWD and RENAME_EXCHANGE of Linux


class Temporary:
    """A new file or folder beside `target`, in its stead until it is whole.

    It is locked while its writer lives; a folder by a file beside it, which stays there if the folder gets its name
    before it is whole. What writers of this host that were killed have left there is removed first.
    What has a journal can be gone on with (see `unfinished`) until a file of that name is whole. What writers of other
    hosts have left is never removed, because their locks may not be seen here; it is told of then.

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
        If another process is writing the target in place, or on another host may be.

    Warns
    -----
    FluorsparWarning
        When it is kept, of what other hosts have left of it.

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
        self._target, self._folder = target, folder
        _check_place(target, going_on=left is not None)
        _remove_stale(target)
        self._lock = -1
        if left is not None and not folder:
            self.path, self._lock = left, _open(left)
            try:
                _lock(self._lock)
            except BlockingIOError:
                self.leave()
                raise
        while self._lock < 0:
            self.path = target.with_name(f"{_start_of(target)}{HOST}-{uuid.uuid4().hex[:8]}.tmp")
            if folder:
                self.path.mkdir()
            else:
                os.close(os.open(self.path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666))
            self._locked = _lock_of(self.path) if folder else self.path
            with suppress(FileNotFoundError):  # taken for a stale one before it was locked
                self._lock = _open(self._locked, new=folder)
                _lock(self._lock, wait=True)
                if not (self.path.exists() and self._locked.exists()):
                    self.drop()
        if left is not None and folder:
            self._take_over(left)
        self.journal = _journal_of(self.path)

    def _take_over(self, left: Path) -> None:
        """Go on with a folder in place, in the stead of those who have written it."""
        os.rmdir(self.path)
        self.path = left
        try:
            _check_place(left, going_on=True, but=self._locked)
        except ImageError:
            self.leave()
            raise
        for lock in _in_place(left, but=self._locked):
            _remove(lock)

    def take_place(self) -> None:
        """Give a folder the name of its target before it is whole, if there is nothing yet.

        Raises
        ------
        ImageError
            If another process has done so meanwhile.
        """
        if self._target.exists():
            _check_place(self._target)
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
                self._check_place_or_stand_aside()
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
        _say_foreign(self._target)

    def _check_place_or_stand_aside(self) -> None:
        """Check that the target may be replaced; if not, what is whole gets another name, and is not lost."""
        try:
            _check_place(self._target)
        except ImageError as err:
            name = f"{self._target.stem}-{uuid.uuid4().hex[:8]}{self._target.suffix}"
            aside = self._target.with_name(name)
            os.rename(self.path, aside)
            self.leave()
            raise ImageError(f"{err}\n  note:     the new one is whole, and is now {aside}") from err

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
            if self._folder:
                _remove(self._locked)
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


def check_alone(target: Path) -> None:
    """Check that no other process is writing a file or folder, be it in place or in its stead.

    Raises
    ------
    ImageError
        If one does.
    """
    _check_place(target, going_on=True)
    for path in _temporaries(target):
        if not _is_free(path):
            raise _busy(target, _host_of(path))


def remove_unfinished(path: Path) -> None:
    """Remove what a killed writer of this host has left under a temporary name, and its journal."""
    if _host_of(path) == HOST:
        for each in (_journal_of(path), path, _lock_of(path)):
            _remove(each)


def _check_place(target: Path, *, going_on: bool = False, but: Path | None = None) -> None:
    """Check that nobody is writing into a folder that is there, `but` who has this lock.

    Where a writer is of another host, its lock may not be seen here: then the folder may be gone on with, if nothing
    has changed there for a while, but not be replaced.
    """
    for lock in _in_place(target, but) if target.is_dir() else ():
        host, free = _host_of(lock), _is_unlocked(lock)
        if free is False or (not (free and host == HOST) and _is_young(target)):
            raise _busy(target, host)
        if host != HOST and not going_on:
            raise ImageError(
                message(
                    "a process of another host may still be writing the folder",
                    where=target,
                    got=f"host {host}: {lock.name}",
                    fix="delete that file if nothing runs there, or go on with the folder (--resume, resume=True) "
                    "if it is not finished, or write another one",
                )
            )


def _in_place(target: Path, but: Path | None = None) -> list[Path]:
    """The locks of those who write, or have written, into a folder in place."""
    locks = _temporaries(target, "lock")
    return [lock for lock in locks if lock != but and not lock.with_suffix(".tmp").exists()]


def _busy(target: Path, host: str) -> ImageError:
    foreign = host not in ("", HOST)
    return ImageError(
        message(
            f"another process is writing the {'folder' if target.is_dir() else 'file'}",
            where=target,
            got=f"host {host}, less than {_QUIET:.0f} s ago" if foreign else None,
            fix=f"wait for it{', for a minute if it was killed' if foreign else ''}, or write another one",
        )
    )


def _say_foreign(target: Path) -> None:
    """Warn of what other hosts have left beside a target."""
    left = [
        path
        for path in (*_temporaries(target), *_in_place(target))
        if _host_of(path) != HOST and _is_unlocked(_locked(path)) is not False
    ]
    if left:
        text = (
            f"{', '.join(path.name for path in left)} beside {target.name}: left by host "
            f"{', '.join(dict.fromkeys(map(_host_of, left)))}, or still being written there; delete it if it is not"
        )
        warnings.warn(text, FluorsparWarning, stacklevel=4)


def _start_of(target: Path) -> str:
    """What temporary names of a file or folder begin with: 255 bytes are the limit of a name."""
    name = target.name
    if len(name) > _NAME:
        name = f"{name[:_NAME]}-{zlib.crc32(name.encode(errors='surrogateescape')):08x}"
    return f".{name}."


def _temporaries(target: Path, suffix: str = "tmp") -> list[Path]:
    """Temporary files or folders that stand beside a target, in its stead."""
    start = _start_of(target)
    beside = target.parent.glob(f"{glob.escape(start)}*.{suffix}")
    return [path for path in beside if _NAMED.fullmatch(path.name.removeprefix(start))]


def _host_of(path: Path) -> str:
    """The host of the writer of what has a temporary name."""
    named = _NAMED.search(path.name)
    return named["host"] if named else ""


def _journal_of(path: Path) -> Path:
    return path.with_suffix(".journal")


def _lock_of(folder: Path) -> Path:
    return folder.with_suffix(".lock")


def _locked(path: Path) -> Path:
    """The file that a writer locks: itself, or one beside a folder, because folders cannot be locked everywhere."""
    return _lock_of(path) if path.is_dir() else path


def _open(path: Path, *, new: bool = False) -> int:
    """Open a file to lock it, a `new` one perhaps."""
    kind = os.O_RDWR | os.O_NONBLOCK | os.O_NOFOLLOW
    return os.open(path, kind | (os.O_CREAT if new else 0), 0o666)


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


def _is_unlocked(path: Path) -> bool | None:
    """Whether nobody holds a lock; None where the file system has no locks."""
    try:
        descriptor = _open(path)
    except FileNotFoundError:
        return True  # gone
    except OSError:
        return None
    try:
        return _lock(descriptor) or None
    except BlockingIOError:
        return False
    finally:
        os.close(descriptor)


def _is_free(path: Path) -> bool:
    """Whether the writer of a temporary file or folder is dead."""
    free = _is_unlocked(_locked(path))
    return free is not False and ((bool(free) and _host_of(path) == HOST) or not _is_young(path))


def _is_young(path: Path) -> bool:
    """Whether something has changed in a file or folder of late."""
    changed = [0.0]
    for each in (path, *path.rglob("*")):
        with suppress(OSError):  # gone meanwhile
            changed.append(each.stat().st_mtime)
    return time.time() - max(changed) < _QUIET


def _remove_stale(target: Path, with_journals: bool = False) -> None:
    """Remove what writers of this host have left that are dead."""
    for path in (*_temporaries(target), *_in_place(target)):
        if _host_of(path) != HOST or (_journal_of(path).exists() and not with_journals):
            continue
        with suppress(OSError):
            descriptor = _open(_locked(path), new=path.is_dir())
            try:
                if _lock(descriptor):
                    remove_unfinished(path)
            finally:
                os.close(descriptor)
    for journal in _temporaries(target, "journal"):  # killed between giving the file its name and this
        if _host_of(journal) == HOST and not journal.with_suffix(".tmp").exists():
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
