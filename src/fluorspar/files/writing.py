"""Write a file under a temporary name and rename it when it is whole."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import threading
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fluorspar.errors import ImageError, OptionError, message

__all__ = ["check_not_input", "check_target", "replacing", "temporary_name", "undisturbed", "write_error"]


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

    Raises
    ------
    ImageError
        If the directory is missing or not writable, the target is a directory, or the disk has too little
        space left.

    Examples
    --------
    >>> check_target("picture.png").name
    'picture.png'
    """
    path = Path(path)
    parent = path.parent
    if not parent.is_dir():
        raise ImageError(
            message(
                "the directory to write to does not exist", where=path, fix=f"create it: mkdir -p {parent}"
            )
        )
    if path.is_dir():
        raise ImageError(message("the file to write is a directory", where=path, fix="name a file in it"))
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
                got=f"{free / 1e9:.2f} GB free",
                expected=f"{size / 1e9:.2f} GB",
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
        The files that are read. What names no file, such as a material of the library, does not count.
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
        if source is not None and os.path.isfile(source) and os.path.samefile(source, target):
            raise OptionError(message(fault, where=source, got=target, fix="name another file to write"))


def temporary_name(path: Path) -> Path:
    """Name a temporary file beside `path`, so that renaming it is one step of the file system.

    Examples
    --------
    >>> temporary_name(Path("out/room.nc")).parent.name
    'out'
    """
    return path.with_name(f".{path.name}.{uuid.uuid4().hex[:12]}.tmp")


def write_error(path: Path, err: BaseException) -> ImageError:
    """Say why writing failed and that an older file of that name is untouched."""
    full = getattr(err, "errno", None) in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG) or any(
        text in str(err) for text in ("No space left", "File too large", "errno = 28", "errno = 27")
    )
    return ImageError(
        message(
            "the disk is full" if full else "the file cannot be written",
            where=path,
            got=str(err).splitlines()[0] if str(err) else type(err).__name__,
            fix="free some space or choose another directory; a file that was there before is unchanged"
            if full
            else "check the directory; a file that was there before is unchanged",
        )
    )


@contextmanager
def replacing(path: str | os.PathLike[str], size: int = 0) -> Iterator[Path]:
    """Give a temporary path to write to; rename it to `path` at the end, remove it after an exception.

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
    temporary = temporary_name(path)
    try:
        yield temporary
        os.replace(temporary, path)
    except (OSError, RuntimeError) as err:
        raise write_error(path, err) from err
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


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
