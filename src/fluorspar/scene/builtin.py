"""The scenes that come with Fluorspar."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

__all__ = ["BUILTIN", "builtin_path"]

BUILTIN = {
    "cornell-box": "the Cornell box with two fluorescent side walls under CIE D65, 512 x 512",
    "cornell-classic": "the Cornell box as measured at Cornell, not fluorescent, 512 x 512",
    "furnace": "a closed cube of one fluorescent material that emits everywhere: has a closed form, 128 x 128",
}


def builtin_path(name: str) -> Path:
    """Path of the XML file of a built-in scene.

    Raises
    ------
    KeyError
        If there is no such scene.

    Examples
    --------
    >>> builtin_path("furnace").name
    'furnace.xml'
    """
    if name not in BUILTIN:
        raise KeyError(name)
    return Path(str(resources.files("fluorspar") / "data" / "scenes" / f"{name}.xml"))
