"""Spectra in files that Mitsuba's parser cannot read: given to it in the form that it can."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fluorspar.errors import FluorsparError
from fluorspar.spectral.spectrum import read_spectrum

__all__ = ["with_spectrum_files"]

_FAILED = re.compile(r'failed to load spectrum from file "([^"]+)"')


def with_spectrum_files(parse: Callable[[], Any]) -> Any:
    """Call Mitsuba's parser, and again with the spectra in Mitsuba's own form that it fails to load.

    They are written to a temporary folder where Mitsuba looks first, so a name must be relative for that.

    Parameters
    ----------
    parse : callable
        It raises what Mitsuba's parser raises.

    Raises
    ------
    RuntimeError
        As Mitsuba's parser; for a spectrum that Fluorspar cannot read either, with the reason.
    """
    import mitsuba as mi

    try:
        return parse()
    except Exception as err:
        if not _FAILED.search(str(err)):
            raise
    resolver = mi.file_resolver()
    with _first(resolver) as folder:
        while True:
            try:
                return parse()
            except Exception as err:
                failed = _FAILED.search(str(err))
                if failed is None or Path(failed[1]).is_absolute() or (folder / failed[1]).exists():
                    raise
                name, _, column = failed[1].partition(":")
                source = str(resolver.resolve(name))
                try:
                    _write(folder / failed[1], f"{source}:{column}" if column else source)
                except FluorsparError as reason:
                    raise RuntimeError(f"{err}\n{str(reason).replace(source, name)}") from err


@contextmanager
def _first(resolver: Any) -> Iterator[Path]:
    """A temporary folder in which Mitsuba looks for files first."""
    with TemporaryDirectory(prefix="fluorspar-") as folder:
        resolver.prepend(folder)
        try:
            yield Path(folder)
        finally:
            del resolver[[str(place) for place in resolver].index(folder)]


def _write(target: Path, source: str) -> None:
    spectrum = read_spectrum(source)
    target.parent.mkdir(parents=True, exist_ok=True)
    pairs = zip(spectrum.wavelengths, spectrum.values, strict=True)
    target.write_text("".join(f"{wavelength:.17g} {value:.17g}\n" for wavelength, value in pairs))
