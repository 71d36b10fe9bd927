"""Where the command line prints: results to standard output, everything else to standard error."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.status import Status

from fluorspar.progress import Progress as ProgressCallback

__all__ = ["err", "error", "note", "out", "progress_bar", "visible", "warning"]


_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def visible(text: str) -> str:
    """Show control characters instead of obeying them: what a file says must not move the cursor.

    Examples
    --------
    >>> print(visible("red: \\x1b[31m"))
    red: \\x1b[31m
    """
    return _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


class _Output(Console):
    """Output that falls silent when it cannot be written: files and exit codes are what they would be.

    All that is printed passes here, so this is where control characters become visible.

    Attributes
    ----------
    fault : OSError or None
        Why not all of it was written, unless it is that nobody reads on.
    """

    fault: OSError | None = None

    @property
    def is_animated(self) -> bool:
        """Whether lines can be drawn over: FORCE_COLOR, as Jupyter sets it, asks for colours and makes no terminal."""
        return self.is_terminal and self.file.isatty()

    def status(self, *arguments: Any, **options: Any) -> Status:
        if self.is_animated:
            return super().status(*arguments, **options)
        return Console(quiet=True, force_terminal=False).status(*arguments, **options)

    def render(self, *arguments: Any, **options: Any) -> Iterator[Segment]:
        for segment in super().render(*arguments, **options):
            yield segment if segment.control else segment._replace(text=visible(segment.text))

    def print(self, *objects: Any, **options: Any) -> None:
        try:
            super().print(*objects, **options)
        except OSError as err:
            self._fall_silent(err)

    def on_broken_pipe(self) -> None:
        self._fall_silent(BrokenPipeError())

    def finish(self) -> None:
        """Write what is left in the buffer of the stream."""
        try:
            self.file.flush()
        except OSError as err:
            self._fall_silent(err)

    def _fall_silent(self, err: OSError) -> None:
        self.quiet = True
        if not isinstance(err, BrokenPipeError):
            self.fault = err
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), self.file.fileno())  # what is left in its buffer goes there at the end


out = _Output(soft_wrap=True)
err = _Output(stderr=True, soft_wrap=True)


def error(text: str) -> None:
    """Print an error; the first line says what is wrong, the others where and how to mend it."""
    first, _, rest = text.partition("\n")
    err.print("[bold red]error:[/] ", end="")
    err.print(first, markup=False, highlight=False)
    if rest:
        err.print(rest, markup=False, highlight=False)


def warning(text: str) -> None:
    """Print a warning."""
    err.print("[yellow]warning:[/] ", end="")
    err.print(text, markup=False, highlight=False)


def note(text: str) -> None:
    """Print what is going on."""
    err.print(text, markup=False, highlight=False)


@contextmanager
def progress_bar(what: str) -> Iterator[ProgressCallback]:
    """Draw a progress bar with the time left, on a terminal."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=err, transient=True, disable=not err.is_animated) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
