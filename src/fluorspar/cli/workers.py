"""The options of commands that can work on a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from fluorspar.cli import console
from fluorspar.cluster.connect import connected, dashboard_of

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["SchedulerOption", "WorkersOption", "client_for"]

SchedulerOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Render on the workers of this Dask scheduler, such as tcp://HOST:8786."
    ),
]

WorkersOption: TypeAlias = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="Render on N worker processes of this machine, of one thread each, or of --threads."
    ),
]


@contextmanager
def client_for(scheduler: str | None, workers: int | None, threads: int | None) -> Iterator[Client | None]:
    """Connect as the options say, and print where the workers can be watched; see `connected`."""
    with connected(scheduler, workers, threads) as client:
        if client is not None and (link := dashboard_of(client)):
            console.note(f"dashboard: {link}")
        yield client
