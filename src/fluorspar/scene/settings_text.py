"""What is asked of a scene, given as text: its size, and what a light becomes."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from typing import Any

from fluorspar.errors import OptionError, message
from fluorspar.files.names import file_and_column
from fluorspar.spectral.illuminants import listed_name

__all__ = ["light_of", "size_of"]

_TIMES = re.compile(r"^(?P<name>.+)x(?P<factor>[0-9.]+([eE][+-]?[0-9]+)?)$")


def size_of(text: str | None, where: str = "--size") -> tuple[int, int] | None:
    """Read `WIDTHxHEIGHT`.

    Raises
    ------
    OptionError
        If it is something else; the message says where.

    Examples
    --------
    >>> size_of("640x480")
    (640, 480)
    """
    if text is None:
        return None
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise OptionError(
            message(
                "the size is not readable",
                where=where,
                got=text,
                expected="WIDTHxHEIGHT in pixels, such as 512x512",
            )
        )
    return int(width), int(height)


def light_of(text: str) -> Any:
    """Read what a light becomes: a factor, a name or file, or one of these and a factor.

    What is the name of an illuminant, or a file, as it stands is that.

    Examples
    --------
    >>> light_of("FL11"), light_of("0.5"), light_of("FL11x0.5")
    ('FL11', 0.5, ('FL11', 0.5))
    """
    with suppress(ValueError):
        return float(text)
    known = listed_name(text) is not None or os.path.isfile(file_and_column(text)[0])
    parts = None if known else _TIMES.match(text)
    with suppress(ValueError):
        return (parts["name"], float(parts["factor"])) if parts else text
    return text
