"""Kinds of files by their suffix: what they are, who reads and who writes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

__all__ = ["Format", "suffixes_read", "suffixes_written"]


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Parameters
    ----------
    name : str
        What it is, in words.
    reader, writer : str
        The functions as `module:function`, which are imported when they are used; "" if there is none.

    Examples
    --------
    >>> Format("JSON", writer="json:dumps").write([1, 2], indent=None)
    '[1, 2]'
    """

    name: str
    reader: str = ""
    writer: str = ""

    def read(self, *args: Any, **options: Any) -> Any:
        """Call the reader."""
        return _function(self.reader)(*args, **options)

    def write(self, *args: Any, **options: Any) -> Any:
        """Call the writer."""
        return _function(self.writer)(*args, **options)


def _function(reference: str) -> Any:
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)


def suffixes_read(formats: Mapping[str, Format]) -> tuple[str, ...]:
    """Those of the suffixes whose files are read.

    Examples
    --------
    >>> suffixes_read({".json": Format("JSON", "json:loads", "json:dumps"), ".png": Format("PNG")})
    ('.json',)
    """
    return tuple(suffix for suffix, kind in formats.items() if kind.reader)


def suffixes_written(formats: Mapping[str, Format]) -> tuple[str, ...]:
    """Those of the suffixes whose files are written.

    Examples
    --------
    >>> suffixes_written({".json": Format("JSON", "json:loads", "json:dumps"), ".txt": Format("text", "json:loads")})
    ('.json',)
    """
    return tuple(suffix for suffix, kind in formats.items() if kind.writer)
