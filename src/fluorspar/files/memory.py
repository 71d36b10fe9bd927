"""Find out whether something fits into memory before it is read."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from fluorspar.errors import ImageError, message

__all__ = ["available_memory", "check_memory", "is_large"]

_SHARE = 4  # of the memory that is free: what is larger is better kept in a file


def available_memory() -> int:
    """Bytes that can be taken now: what is free, within the limit that a container may set.

    Examples
    --------
    >>> available_memory() > 2**20
    True
    """
    free = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    with suppress(OSError, ValueError, KeyError):
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        said = {name: int(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines)}
        free.append(1024 * (said["MemAvailable"] + said["SwapFree"]))
    with suppress(OSError, ValueError):
        folder = Path("/sys/fs/cgroup")
        taken = int((folder / "memory.current").read_text("ascii"))
        free.append(max(int((folder / "memory.max").read_text("ascii")) - taken, 2**20))
    return min(free)


def is_large(needed: int) -> bool:
    """Whether so many bytes are more than a quarter of what is free.

    Examples
    --------
    >>> is_large(2**10), is_large(2**60)
    (False, True)
    """
    return needed > available_memory() // _SHARE


def check_memory(needed: int, where: object, what: str) -> None:
    """Refuse what does not fit into memory.

    Parameters
    ----------
    needed : int
        Bytes.
    where : object
        The file.
    what : str
        What would be read, with its size.

    Raises
    ------
    ImageError
        If there is less memory.

    Examples
    --------
    >>> check_memory(2**10, "small.nc", "16 x 16 pixels")
    """
    if needed > 2**24 and needed > (free := available_memory()):
        raise ImageError(
            message(
                "the image does not fit into memory",
                where=where,
                got=f"{what}: {needed / 1e9:,.0f} GB",
                expected=f"at most {free / 1e9:.3g} GB, which are free here",
                fix="write the file again if its size is wrong; else use a part of it, or a computer with more memory",
            )
        )
