"""Which workers of a client can do what is asked: the others get no work, which is told once."""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fluorspar.cluster.connect import connection
from fluorspar.cluster.versions import PACKAGES, check_versions, versions_here
from fluorspar.errors import ClusterError, FluorsparWarning

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["FitWorkers", "Unfit"]

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Unfit:
    """What a worker returns that cannot do a task, though others may: its address, and why."""

    worker: str
    fault: str


class FitWorkers:
    """The workers of a client that have its versions, those that join later too.

    Parameters
    ----------
    client : distributed.Client
        If it has no worker yet, this waits for the first.

    Attributes
    ----------
    fit : frozenset of str
        Addresses of those that were there at the last look.

    Raises
    ------
    ClusterError
        If there are workers, but none that fits; or if the scheduler is lost.
    """

    def __init__(self, client: Client) -> None:
        self.fit: frozenset[str] = frozenset()
        self._client = client
        self._unfit: dict[str, str] = {}
        self._told = False
        with connection(client):
            if not client.nthreads():
                _LOG.warning("waiting for workers")  # which on a machine with a queue may take hours
            while not client.nthreads():
                time.sleep(0.5)
        self.look()

    @property
    def only(self) -> list[str] | None:
        """What a task is to be restricted to: `Client.submit(..., workers=...)`."""
        return sorted(self.fit) if self._unfit else None

    def look(self, *, patient: bool = False) -> frozenset[str]:
        """Look which workers there are; return those that fit and were not there at the last look.

        Parameters
        ----------
        patient : bool
            Whether to wait for others where none fits: some have been there.

        Raises
        ------
        ClusterError
            If none fits; or if the scheduler is lost.
        """

        def versions(
            names: tuple[str, ...],
        ) -> dict[str, str]:  # sent as code, for a worker without Fluorspar
            from importlib import metadata

            there = {}
            for name in names:
                try:
                    there[name] = metadata.version(name)
                except metadata.PackageNotFoundError:
                    there[name] = ""
            return there

        with connection(self._client):
            there = frozenset(self._client.nthreads())
            new = sorted(there - self.fit - self._unfit.keys())
            found = self._client.run(versions, PACKAGES, workers=new, on_error="return") if new else {}
        for worker, has in found.items():
            if isinstance(has, Mapping):  # else it was lost meanwhile
                try:
                    check_versions(versions_here(), has, worker)
                except ClusterError as err:
                    self._unfit[worker] = str(err)
        before, self.fit = self.fit, there - self._unfit.keys()
        self._tell(patient)
        return self.fit - before

    def refuse(self, unfit: Unfit) -> None:
        """Give a worker no more work.

        Raises
        ------
        ClusterError
            If no other one fits.
        """
        self._unfit[unfit.worker] = unfit.fault
        self.fit -= {unfit.worker}
        self._tell(patient=False)

    def _tell(self, patient: bool) -> None:
        if not self._unfit:
            return
        fault = next(iter(self._unfit.values()))
        if not self.fit and not patient:
            raise ClusterError(fault)
        if not self._told:
            self._told = True
            text = f"a worker gets no work, and neither do others like it: {fault}"
            warnings.warn(text, FluorsparWarning, stacklevel=7)
