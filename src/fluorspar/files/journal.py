"""A journal: records of what is done, appended to a file that a crash at any moment leaves readable."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from struct import Struct
from typing import Any

__all__ = ["Journal", "Record", "read_journal"]

Record = tuple[dict[str, Any], bytes, int]
"""What was said, the bytes that go with it, and where in the file it ends."""

_FRAME = Struct("<IQI")  # length of what was said, of the bytes, and CRC-32 of both


class Journal:
    """Appends records to a file.

    Parameters
    ----------
    path : Path
        Created, or gone on with.
    end : int
        Where its last whole record ends, see `read_journal`: what is beyond is given up.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.journal"
    >>> with Journal(path) as journal:
    ...     journal.append({"run": [0, 100]})
    ...     journal.append({"run": [100, 100]}, b"spectra")
    >>> torn = path.write_bytes(path.read_bytes()[:-1])
    >>> [said for said, data, stop in read_journal(path)]
    [{'run': [0, 100]}]
    """

    def __init__(self, path: Path, end: int = 0) -> None:
        self.path = path
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        os.ftruncate(self._file, end)
        os.lseek(self._file, end, os.SEEK_SET)

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def append(self, said: Mapping[str, Any], data: bytes = b"") -> None:
        """Append a record: what is said as JSON, and bytes.

        Raises
        ------
        OSError
            If the disk is full.
        """
        text = json.dumps(said).encode()
        frame = _FRAME.pack(len(text), len(data), zlib.crc32(data, zlib.crc32(text)))
        left = memoryview(frame + text + data)
        while left:
            left = left[os.write(self._file, left) :]

    def sync(self) -> None:
        """Wait until all is on the disk."""
        os.fsync(self._file)

    def close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def read_journal(path: Path, *, with_data: bool = True) -> Iterator[Record]:
    """Read the records of a journal up to the first that is not whole.

    Parameters
    ----------
    path : Path
    with_data : bool
        False: read what was said only, and trust what is as long as it should be.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with path.open("rb") as file:
        whole_size = os.fstat(file.fileno()).st_size
        while len(frame := file.read(_FRAME.size)) == _FRAME.size:
            length, size, checksum = _FRAME.unpack(frame)
            stop = file.tell() + length + size
            if not length or stop > whole_size:
                return
            text = file.read(length)
            if not with_data and size:
                file.seek(stop)
                yield json.loads(text), b"", stop
                continue
            data = file.read(size)
            if zlib.crc32(data, zlib.crc32(text)) != checksum:
                return
            yield json.loads(text), data, stop
