"""What Dask loads into the workers of this machine: Ctrl-C reaches them too, and is for the client to obey."""

from __future__ import annotations

import signal

__all__ = ["dask_setup"]


def dask_setup(worker: object) -> None:
    """Let a worker go on until the client, which keeps what is finished, ends it; called by Dask when it starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
