"""Where the command line prints: results to standard output, everything else to standard error."""

from __future__ import annotations

import os
import sys
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

from fluorspar.progress import Progress as ProgressCallback

__all__ = ["error", "out", "progress_bar", "warning"]


class _Output(Console):
    """Standard output that falls silent when nobody reads on: files and exit codes are what they would be."""

    def print(self, *objects: Any, **options: Any) -> None:
        try:
            super().print(*objects, **options)
        except BrokenPipeError:
            self.on_broken_pipe()

    def on_broken_pipe(self) -> None:
        self.quiet = True
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())  # what is left in its buffer goes there at the end


out = _Output(soft_wrap=True)
err = Console(stderr=True, soft_wrap=True)


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
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
