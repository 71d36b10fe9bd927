"""A file object that survives a full disk."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

__all__ = ["PatientFile"]


class PatientFile(io.FileIO):
    """A file that keeps an error of writing to itself until `check` is called.

    HDF5 1.14 and 2.0 crash the whole process when the disk fills up while data are in their cache, so they
    must not learn of it.

    Parameters
    ----------
    path : Path
        The file to be created, or to be changed.
    mode : str
        `"w+b"` or `"r+b"`, as of `open`.

    Examples
    --------
    >>> import tempfile
    >>> with PatientFile(Path(tempfile.mkdtemp()) / "a") as file:
    ...     written = file.write(b"spectrum")
    ...     file.check()
    >>> written
    8
    """

    def __init__(self, path: Path, mode: str = "w+b") -> None:
        super().__init__(path, mode)
        self.error: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of `data`, or pretend to after an error."""
        view = memoryview(data).cast("B")
        done = 0
        try:
            while self.error is None and done < len(view):
                done += super().write(view[done:]) or 0
        except OSError as err:
            self.error = err
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the length of the file, or pretend to after an error."""
        try:
            return super().truncate(size)
        except OSError as err:
            self.error = self.error or err
            return size or 0

    def check(self) -> None:
        """Raise the first error of writing, if there was one.

        Raises
        ------
        OSError
        """
        if self.error is not None:
            raise self.error
