"""Packages that Fluorspar needs for some purposes only."""

from __future__ import annotations

from importlib.util import find_spec

from fluorspar.errors import FluorsparError, message

__all__ = ["check_installed"]


def check_installed(what: str, extra: str, *modules: str) -> None:
    """Find out whether the packages of an optional dependency are installed; none is imported.

    Parameters
    ----------
    what : str
        What needs them.
    extra : str
        Name of the optional dependency.
    *modules : str
        What is imported of it.

    Raises
    ------
    FluorsparError
        If one is missing; the message says how to install them.

    Examples
    --------
    >>> check_installed("counting", "numbers", "numpy", "no_such_package")
    Traceback (most recent call last):
    ...
    fluorspar.errors.FluorsparError: counting needs what is not installed
      got:      no no-such-package
      fix:      pip install "fluorspar[numbers]"
    """
    missing = [name.replace("_", "-") for name in modules if find_spec(name) is None]
    if missing:
        fault, fix = f"{what} needs what is not installed", f'pip install "fluorspar[{extra}]"'
        raise FluorsparError(message(fault, got=f"no {', '.join(missing)}", fix=fix))
