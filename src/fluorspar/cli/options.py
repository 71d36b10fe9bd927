"""Options that several commands read the same way."""

from __future__ import annotations

from collections.abc import Sequence

from fluorspar.errors import OptionError, message

__all__ = ["pairs", "size_of"]


def size_of(text: str | None) -> tuple[int, int] | None:
    """Read `WIDTHxHEIGHT`.

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
                where="--size",
                got=text,
                expected="WIDTHxHEIGHT in pixels, such as 512x512",
            )
        )
    return int(width), int(height)


def pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """Read `KEY=VALUE` texts.

    Examples
    --------
    >>> pairs(["left-wall=poster-red"], "--material")
    {'left-wall': 'poster-red'}
    """
    read = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not (key and separator and value):
            raise OptionError(
                message("an option is not readable", where=option, got=text, expected="KEY=VALUE")
            )
        read[key] = value
    return read
