"""Write a file under a temporary name and rename it when it is whole."""

from __future__ import annotations

import errno
import fcntl
import glob
import os
import platform
import re
import shutil
import signal
import threading
import time
import uuid
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rich.filesize import decimal

from fluorspar.errors import ImageError, OptionError, message
from fluorspar.files.names import file_and_column

__all__ = [
    "HOST",
    "OLD",
    "Temporary",
    "check_alone",
    "check_not_input",
    "check_target",
    "remove_unfinished",
    "replacing",
    "start_of",
    "temporaries",
    "undisturbed",
    "unfinished",
    "write_error",
]

HOST = f"{zlib.crc32(platform.node().encode()):08x}"
_NAME = 40  # characters of a name that its temporary name begins with: 255 bytes are the limit
OLD = 7 * 86400.0  # s
_QUIET = 60.0  # s without a change after which a writer is taken for dead whose lock cannot be seen


def check_target(path: str | os.PathLike[str], size: int = 0) -> Path:
    """Check, before any work is done, that a file can be written.

    Parameters
    ----------
    path : str or path-like
        The file to be written.
    size : int
        Bytes it will take.

    Returns
    -------
    Path
        Of the file itself: a symbolic link is followed.

    Raises
    ------
    ImageError
        If the directory is missing or not writable, the target is a directory or read-only, its name is too
        long, or the disk has too little space left.

    Examples
    --------
    >>> check_target("picture.png").name
    'picture.png'
    """
    given = Path(path)
    try:
        path = Path(os.path.realpath(given)) if given.is_symlink() else given
        there, parent = path.exists(), path.parent
        if path.is_symlink():
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    except OSError as err:
        raise ImageError(message("the file cannot be written", where=given, got=err.strerror)) from err
    if not parent.is_dir():
        raise ImageError(
            message(
                "the directory to write to does not exist", where=path, fix=f"create it: mkdir -p {parent}"
            )
        )
    if path.is_dir():
        raise ImageError(message("the file to write is a directory", where=path, fix="name a file in it"))
    if there and not path.is_file():
        fix = "name a regular file, or one that does not exist"
        raise ImageError(
            message("what is there already is not a file that can be replaced", where=path, fix=fix)
        )
    if there and not (path.stat().st_mode & 0o222 and os.access(path, os.W_OK)):
        fix = f"name another file, or allow it: chmod u+w {path}"
        raise ImageError(message("the file to write exists and is read-only", where=path, fix=fix))
    if not os.access(parent, os.W_OK):
        raise ImageError(
            message("the directory cannot be written to", where=parent, fix="choose another directory")
        )
    free = shutil.disk_usage(parent).free
    if free < size:
        raise ImageError(
            message(
                "the disk has too little space left",
                where=path,
                got=f"{decimal(free)} free",
                expected=decimal(size),
                fix="free some space, or choose another directory, fewer pixels or fewer wavelengths",
            )
        )
    return path


def check_not_input(
    target: str | os.PathLike[str],
    *inputs: str | os.PathLike[str] | None,
    fault: str = "the file to write is one that is read",
) -> None:
    """Check that a file to be written is none of those that are read.

    Parameters
    ----------
    target : str or path-like
        The file to be written.
    *inputs : str or path-like or None
        The files that are read, perhaps with a column (see `file_and_column`). What names no file, such as a material
        of the library, does not count.
    fault : str
        What to call it.

    Raises
    ------
    OptionError
        If they are one file, by whatever names.

    Examples
    --------
    >>> check_not_input("spectra.csv", "room.nc", "points.csv", None)
    """
    if not os.path.exists(target):
        return
    for source in inputs:
        file = None if source is None else file_and_column(source)[0]
        if file is not None and os.path.exists(file) and file.samefile(target):
            raise OptionError(message(fault, where=source, got=target, fix="name another file to write"))


class Temporary:
    """A new file beside `target`, in its stead until it is whole.

    It is locked while its writer lives. What writers that were killed have left there is removed first: files whose
    lock is free, and of other hosts, whose locks may not be seen here, only after a week. Those with a journal can be
    gone on with (see `unfinished`) until a file of that name is whole.

    Parameters
    ----------
    target : Path
        As `check_target` returns it. The new file gets its permissions, if it exists.
    left : Path, optional
        What a killed writer has left, to go on with.

    Attributes
    ----------
    path : Path
    journal : Path
        Where its journal belongs, if it has one.

    Raises
    ------
    OSError
        If no file can be made there, or another process goes on with what was left.

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

    def __init__(self, target: Path, left: Path | None = None) -> None:
        self._target = target
        _remove_stale(target)
        if left is not None:
            self.path = left
            self._lock = os.open(left, os.O_RDWR)
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self.leave()
                raise
            except OSError:
                pass  # there are file systems without locks
        else:
            self._lock = -1
        while self._lock < 0:
            self.path = target.with_name(f"{start_of(target)}{HOST}-{uuid.uuid4().hex[:8]}.tmp")
            self._lock = os.open(self.path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)
            with suppress(OSError):  # there are file systems without locks
                fcntl.flock(self._lock, fcntl.LOCK_EX)
            if not os.fstat(self._lock).st_nlink:  # taken for a stale one before it was locked
                self.drop()
        self.journal = _journal_of(self.path)

    def keep(self, *, durable: bool = False) -> None:
        """Give the file the name of its target, and remove what others have left of it.

        Parameters
        ----------
        durable : bool
            Wait until it is on the disk: after a power cut there is then the older file, or this one.
        """
        if self._target.exists():
            shutil.copymode(self._target, self.path)
        if durable:
            os.fsync(self._lock)
        os.replace(self.path, self._target)
        if durable:
            _sync_folder(self._target.parent)
        self.drop()
        _remove_stale(self._target, with_journals=True)

    def drop(self) -> None:
        """Remove the file, if it has not been kept, and its journal."""
        if self._lock >= 0:
            for path in (_journal_of(self.path), self.path):
                with suppress(OSError):
                    path.unlink(missing_ok=True)
            self.leave()

    def leave(self) -> None:
        """Let go of the file and its journal, for another writer to go on with."""
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
    pairs = [(path, _journal_of(path)) for path in temporaries(target) if _is_free(path)]
    found = [pair for pair in pairs if pair[1].exists()]
    return sorted(found, key=lambda pair: pair[1].stat().st_size, reverse=True)


def check_alone(target: Path) -> None:
    """Check that no other process is writing a file.

    Raises
    ------
    ImageError
        If one does.
    """
    if not all(map(_is_free, temporaries(target))):
        fix = "wait for it, or write another file"
        raise ImageError(message("another process is writing the file", where=target, fix=fix))


def remove_unfinished(path: Path) -> None:
    """Remove what a killed writer has left under a temporary name, and its journal."""
    for each in (_journal_of(path), path):
        with suppress(OSError):
            each.unlink(missing_ok=True)


def start_of(target: Path) -> str:
    """What temporary names of a file or folder begin with: 255 bytes are the limit of a name."""
    name = target.name
    if len(name) > _NAME:
        name = f"{name[:_NAME]}-{zlib.crc32(name.encode(errors='surrogateescape')):08x}"
    return f".{name}."


def temporaries(target: Path, suffix: str = "tmp") -> list[Path]:
    """Temporary files or folders that stand beside a target, in its stead."""
    start = start_of(target)
    name = re.compile(rf"{re.escape(start)}[^.]+-[0-9a-f]{{8}}\.{suffix}")
    return [
        path for path in target.parent.glob(f"{glob.escape(start)}*.{suffix}") if name.fullmatch(path.name)
    ]


def _journal_of(path: Path) -> Path:
    return path.with_suffix(".journal")


def _is_here(path: Path, target: Path) -> bool:
    """Whether a temporary file was made by this host, whose locks are seen here for certain."""
    return path.name.startswith(f"{start_of(target)}{HOST}-")


def _is_free(path: Path) -> bool:
    """Whether the writer of a temporary file is dead."""
    locks = f".{HOST}-" in path.name
    try:
        lock = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        finally:
            os.close(lock)
    except BlockingIOError:
        return False
    except OSError:
        locks = False  # there are file systems without
    try:
        return locks or time.time() - path.stat().st_mtime > _QUIET
    except OSError:
        return True  # gone


def _remove_stale(target: Path, with_journals: bool = False) -> None:
    """Remove temporary files whose writers are dead."""
    for path in temporaries(target):
        journal = _journal_of(path)
        if journal.exists() and not with_journals:
            continue
        with suppress(OSError):
            lock = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if _is_here(path, target) or time.time() - os.fstat(lock).st_mtime > OLD:
                    journal.unlink(missing_ok=True)
                    path.unlink()
            finally:
                os.close(lock)
    for journal in temporaries(target, "journal"):
        with suppress(OSError):
            if not journal.with_suffix(".tmp").exists():  # killed between giving the file its name and this
                journal.unlink()


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_error(path: Path, err: BaseException, *, kept: bool = False) -> ImageError:
    """Say why writing failed, that an older file of that name is untouched, and whether the writer can go on."""
    full = getattr(err, "errno", None) in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG) or any(
        text in str(err) for text in ("No space left", "File too large", "errno = 28", "errno = 27")
    )
    first = "free some space" if full else "check the directory"
    if kept:
        fix = f"{first}, then go on with what is finished: --resume (resume=True)"
    else:
        fix = f"{first} or choose another directory" if full else first
    return ImageError(
        message(
            "the disk is full" if full else "the file cannot be written",
            where=path,
            got=str(err).splitlines()[0] if str(err) else type(err).__name__,
            fix=f"{fix}; a file that was there before is unchanged",
        )
    )


@contextmanager
def replacing(path: str | os.PathLike[str], size: int = 0) -> Iterator[Path]:
    """Give a temporary path to write to; rename it to `path` at the end, remove it after an exception.

    A file that was there keeps its permissions; a symbolic link stays, and the file it leads to is replaced.

    Parameters
    ----------
    path : str or path-like
        The file to be written or replaced.
    size : int
        Bytes it will take at least, checked beforehand.

    Yields
    ------
    Path
        A name in the same directory.

    Raises
    ------
    ImageError
        If the file cannot be written. The target is then as it was before.

    Examples
    --------
    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "note.txt"
    >>> with replacing(target) as temporary:
    ...     _ = temporary.write_text("whole")
    >>> target.read_text(), len(list(target.parent.iterdir()))
    ('whole', 1)
    """
    path = check_target(path, size)
    temporary = None
    try:
        temporary = Temporary(path)
        yield temporary.path
        temporary.keep()
    except (OSError, RuntimeError) as err:
        raise write_error(path, err) from err
    finally:
        if temporary is not None:
            temporary.drop()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Hold back Ctrl-C, and SIGTERM where it is handled, until a step that must not be torn apart is done.

    Examples
    --------
    >>> with undisturbed():
    ...     pass
    """
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    handled = {number: handler for number, handler in handlers.items() if callable(handler)}
    if threading.current_thread() is not threading.main_thread():
        handled = {}  # Python delivers signals to the main thread only
    seen: list[int] = []
    for number in handled:
        signal.signal(number, lambda number, frame: seen.append(number))
    try:
        yield
    finally:
        for number, handler in handled.items():
            signal.signal(number, handler)
        for came in dict.fromkeys(seen):
            signal.raise_signal(came)
