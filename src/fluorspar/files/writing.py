"""Check where something is to be written, and write a file so that it is there as a whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.filesize import decimal

from fluorspar.errors import ImageError, OptionError, message
from fluorspar.files.beside import Temporary
from fluorspar.files.names import file_and_column

__all__ = [
    "check_folder",
    "check_not_input",
    "check_target",
    "replacing",
    "undisturbed",
    "write_error",
]


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
    _check_there(parent, path)
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
    _check_writable(parent)
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
    _check_there(path.parent, path)
    if path.exists() and not (path.is_dir() and is_ours(path)):
        fix = f"name another {kind}, or remove what is there"
        raise ImageError(message(f"what is there already is not a {kind}", where=path, fix=fix))
    if path.name in ("", ".."):  # it would be exchanged under the feet of whoever works in it
        fix = "name it from the directory above it"
        raise ImageError(message("a folder without a name cannot be written", where=path, fix=fix))
    _check_writable(path.parent)
    return path


def _check_there(parent: Path, path: Path) -> None:
    if not parent.is_dir():
        fix = f"create it: mkdir -p {parent}"
        raise ImageError(message("the directory to write to does not exist", where=path, fix=fix))


def _check_writable(parent: Path) -> None:
    if not os.access(parent, os.W_OK):
        fix = "choose another directory"
        raise ImageError(message("the directory cannot be written to", where=parent, fix=fix))


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
