"""A Dask client for the command line: of a scheduler somewhere, or of workers here; and whether it is connected."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from fluorspar.errors import ClusterError, OptionError, message
from fluorspar.extras import check_extra
from fluorspar.files.temporary import temporary_folder

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["check_connection", "connected", "connection", "dashboard_of"]

_LOOPBACK = "127.0.0.1"
# Dask looks at each of its processes 50 to 100 times a second. Where processors are shared by client, scheduler and
# workers, that costs a twentieth of one.
_SELDOM = {
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
}


@contextmanager
def connected(
    scheduler: str | None = None, workers: int | None = None, threads: int | None = None
) -> Iterator[Client | None]:
    """Connect to a scheduler, or start workers here, which listen on the loopback interface only.

    Parameters
    ----------
    scheduler : str, optional
        Its address, such as `tcp://10.0.0.1:8786`, or `tls://...` with the certificates of Dask's configuration.
    workers : int, optional
        Processes to start here, which end with the body.
    threads : int, optional
        Of each of these; default: 1.

    Yields
    ------
    distributed.Client or None
        None if neither is given.

    Raises
    ------
    OptionError
        If both are given, or fewer than one worker.
    FluorsparError
        If Dask is not installed.
    ClusterError
        If the scheduler does not answer.

    Examples
    --------
    >>> with connected() as client:
    ...     print(client)
    None
    """
    if scheduler is None and workers is None:
        yield None
        return
    if scheduler is not None and workers is not None:
        got = f"--scheduler {scheduler} and --workers {workers}"
        raise OptionError(
            message("workers are started here or found at a scheduler", got=got, fix="leave one of them out")
        )
    if workers is not None and workers < 1:
        raise OptionError(message("the number of workers is out of range", got=workers, expected="1 or more"))
    check_extra("cluster")
    import dask
    from distributed import Client, LocalCluster

    # Dask logs each lost connection with a traceback; what matters of that is in our errors.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        if workers is not None:
            stack.enter_context(dask.config.set(_SELDOM))
            cluster = stack.enter_context(
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=threads or 1,
                    processes=True,
                    host=_LOOPBACK,
                    dashboard_address=f"{_LOOPBACK}:0",
                    local_directory=str(temporary_folder()),
                    preload="fluorspar.cluster.unstoppable",
                    silence_logs=logging.CRITICAL,
                )
            )
            yield stack.enter_context(Client(cluster, direct_to_workers=True))
            return
        try:
            client = stack.enter_context(Client(scheduler))
        except (OSError, ValueError, TypeError) as err:
            raise ClusterError(
                message(
                    "the scheduler does not answer",
                    where=scheduler,
                    got=str(err).partition("\n")[0],
                    expected="an address such as tcp://HOST:8786 where 'dask scheduler' runs",
                )
            ) from err
        yield client


def dashboard_of(client: Client) -> str | None:
    """The address of the page that shows what the workers do; None where Bokeh is missing, which draws it."""
    link: str | None = client.dashboard_link
    return link if find_spec("bokeh") or client.cluster is None else None


@contextmanager
def connection(client: Client) -> Iterator[None]:
    """Ask a scheduler something.

    Raises
    ------
    ClusterError
        If it is lost.
    """
    check_connection(client)
    try:
        yield
    except (OSError, TimeoutError) as err:
        raise _lost(client) from err


def check_connection(client: Client) -> None:
    """Check that a client still has its scheduler.

    Raises
    ------
    ClusterError
        If it is lost.
    """
    if client.status != "running":
        raise _lost(client)


def _lost(client: Client) -> ClusterError:
    address = client.scheduler.address if client.scheduler else ""
    fix = "see whether it still runs, and what it has logged"
    return ClusterError(
        message("the connection to the scheduler is lost", where=f"scheduler {address}", fix=fix)
    )
