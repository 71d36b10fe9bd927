"""Workers compute the same image bit for bit if what computes it is of the same versions everywhere."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version

from fluorspar.errors import ClusterError, message

__all__ = ["PACKAGES", "check_versions", "versions_here"]

PACKAGES = ("fluorspar", "mitsuba", "drjit", "numba")


def versions_here() -> dict[str, str]:
    """The versions of what traces and sweeps in this process.

    Examples
    --------
    >>> list(versions_here())
    ['fluorspar', 'mitsuba', 'drjit', 'numba']
    """
    return {name: version(name) for name in PACKAGES}


def check_versions(client: Mapping[str, str], worker: Mapping[str, str], address: str) -> None:
    """Compare the versions of a client and of a worker.

    Raises
    ------
    ClusterError
        If they differ.

    Examples
    --------
    >>> check_versions({"numba": "0.61.0"}, {"numba": "0.60.0"}, "tcp://10.0.0.7:8000")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ClusterError: a worker has another version of numba
      where:    worker tcp://10.0.0.7:8000
      got:      numba 0.60.0
      expected: numba 0.61.0, as the client has
      fix:      pip install "numba==0.61.0" there, and start the worker again
    """
    for name, expected in client.items():
        got = worker.get(name)
        if got != expected:
            raise ClusterError(
                message(
                    f"a worker has {'another version of' if got else 'no'} {name}",
                    where=f"worker {address}",
                    got=f"{name} {got}" if got else "not installed",
                    expected=f"{name} {expected}, as the client has",
                    fix=f'pip install "{name}=={expected}" there, and start the worker again',
                )
            )
