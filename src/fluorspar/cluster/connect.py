"""A Dask client for the command line: of a scheduler somewhere, or of workers here; and whether it is connected."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from fluorspar.cluster.late_signals import late_signals
from fluorspar.errors import ClusterError, OptionError, message
from fluorspar.extras import check_extra
from fluorspar.files.temporary import temporary_folder

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

__all__ = ["check_connection", "connected", "connection", "dashboard_of"]

_LOG = logging.getLogger(__name__)

_LOOPBACK = "127.0.0.1"
# Dask looks at each of its processes 50 to 100 times a second. Where processors are shared by client, scheduler and
# workers, that costs a twentieth of one.
_SELDOM = {
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
}
# Of a worker here that is killed Dask would wait 30 s for an answer; and give it up where it takes more than 15 s to
# start again, as on a busy machine.
_KILLED = {"distributed.comm.timeouts.connect": "10s", "distributed.deploy.lost-worker-timeout": "1 hour"}
_REPLACED = 1.0  # seconds after which workers here are looked for that have ended while they started again
_SILENT = 2.0  # seconds after which it is said what is waited for


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
        If the scheduler does not answer, or the workers do not start; or if certificates are needed, and Dask's
        configuration names none, or none that can be read.

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
    from distributed import Client

    # Dask logs each lost connection with a traceback; what matters of that is in our errors.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    _check_certificates(scheduler)
    with ExitStack() as stack:
        if workers is not None:
            stack.enter_context(dask.config.set(_SELDOM | _KILLED))
            with late_signals():
                cluster = stack.enter_context(_start(workers, threads or 1))
                client = stack.enter_context(Client(cluster, direct_to_workers=True))
            yield client
            return
        waiting = threading.Timer(_SILENT, _LOG.warning, ("connecting to %s", scheduler))
        waiting.daemon = True
        waiting.start()
        try:
            asyncio.run(_answer(scheduler))
            client = stack.enter_context(Client(scheduler))
        except (OSError, ValueError, TypeError, RuntimeError, MemoryError) as err:
            foreign = isinstance(err, MemoryError)  # "HTTP/1.1" read as a length
            raise ClusterError(
                message(
                    "the scheduler does not answer",
                    where=scheduler,
                    got="an answer that is none of a scheduler of Dask"
                    if foreign
                    else str(err).partition("\n")[0] or "it accepts a connection, and says nothing",
                    expected="an address such as tcp://HOST:8786 where 'dask scheduler' runs, tls:// if encrypted",
                )
            ) from err
        finally:
            waiting.cancel()
        yield client


async def _answer(scheduler: str | None) -> None:
    """Wait until a scheduler answers, for as long as Dask's configuration says: `Client` waits for ever for an answer.

    Raises
    ------
    OSError, ValueError, TypeError, RuntimeError, MemoryError
        If it does not, or something else does.
    """
    import dask
    from dask.utils import parse_timedelta
    from distributed import Security
    from distributed.comm import connect

    patience = parse_timedelta(dask.config.get("distributed.comm.timeouts.connect"))
    opening = connect(scheduler, **Security().get_connection_args("client"))
    (await asyncio.wait_for(opening, patience + 1)).abort()  # it says more itself, if it gives up


def _start(workers: int, threads: int) -> LocalCluster:
    """Start workers here, of which those that are killed start again.

    Raises
    ------
    ClusterError
        If one ends while it starts, again and again.
    """
    from distributed import LocalCluster

    for is_last in (False, False, True):
        try:
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=threads,
                processes=True,
                host=_LOOPBACK,
                dashboard_address=f"{_LOOPBACK}:0",
                local_directory=str(temporary_folder()),
                silence_logs=logging.CRITICAL,
            )
            break
        except (OSError, RuntimeError, TimeoutError) as err:
            if is_last:
                raise ClusterError(
                    message(
                        "the workers do not start",
                        where=f"--workers {workers}",
                        got=str(_first_cause(err)).partition("\n")[0],
                        fix="fewer workers, or see what ends processes here, as a limit of memory does",
                    )
                ) from err
    _replace_lost(cluster)
    return cluster


def _first_cause(err: BaseException) -> BaseException:
    while err.__cause__ is not None:
        err = err.__cause__
    return err


def _replace_lost(cluster: LocalCluster) -> None:
    """Have workers replaced that are killed while they start again, on which Dask gives up."""
    from tornado.ioloop import PeriodicCallback

    async def replace() -> None:
        for name, watcher in list(cluster.workers.items()):
            if watcher.status.name in ("closed", "failed"):
                del cluster.workers[name]
        if cluster.worker_spec.keys() - cluster.workers.keys():
            with suppress(Exception):  # next time
                await cluster

    callback: Any = PeriodicCallback(replace, 1000 * _REPLACED)
    cluster.periodic_callbacks["replace-lost"] = callback  # which ends it with the cluster
    cluster.loop.add_callback(callback.start)


def _check_certificates(scheduler: str | None) -> None:
    """Check, where connections are encrypted, that Dask's configuration names certificates for it.

    Parameters
    ----------
    scheduler : str or None
        Its address; None if it is started here.

    Raises
    ------
    ClusterError
        If there are none, or if they cannot be read.
    """
    from distributed import Security

    security = Security()
    if not (security.require_encryption or (scheduler or "").startswith("tls:")):
        return
    for role in ("client",) if scheduler else ("scheduler", "worker", "client"):
        named = security.get_tls_config_for_role(role)
        try:
            if security.get_connection_args(role)["ssl_context"] is not None:
                continue
            fault = "Dask's configuration names no certificates"
        except OSError as err:
            fault = f"Dask's certificates cannot be read: {err.strerror or err}"
        raise ClusterError(
            message(
                fault,
                where=f"distributed.comm.tls, {role}",
                got=", ".join(
                    f"{key.replace('_', '-')} {_shown(named[key])}" for key in ("ca_file", "cert", "key")
                ),
                expected=f"the full names of three files: ca-file, {role}.cert and {role}.key",
                fix="see the section 'Security' of the page 'Many workers' in the documentation",
            )
        )


def _shown(file: str | None) -> str:
    """The name of a file; of a key that itself stands in the configuration nothing but what it is."""
    return (file or "missing").partition("\n")[0]


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
