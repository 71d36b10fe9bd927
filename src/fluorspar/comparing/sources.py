"""What can be compared: a spectral image, or a table of spectra of points; what each is of, and in which unit."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TypeAlias

from fluorspar.errors import OptionError, message
from fluorspar.files import tables
from fluorspar.files.names import text_of
from fluorspar.image.formats.registry import SUFFIXES
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of, unit_of_image
from fluorspar.image.units import NOT_STATED, in_our_spelling
from fluorspar.measuring.point_spectra import PointSpectra, read_point_spectra
from fluorspar.spectral.bands import Bands

__all__ = [
    "Side",
    "Source",
    "bands_of_side",
    "check_units",
    "open_side",
    "title_of",
    "unit_of_side",
]

Side: TypeAlias = SpectralImage | PointSpectra
Source: TypeAlias = Side | str | os.PathLike[str]

_NOT_STATED = ("", NOT_STATED, "unknown")


def open_side(source: Source) -> Side:
    """Open a file as what its suffix says: an image or a table of spectra.

    Parameters
    ----------
    source : SpectralImage, PointSpectra, str or path-like
        What is open already comes back as it is.

    Raises
    ------
    OptionError
        If it is none of these, or the suffix is none of those known.
    ImageError, SpectrumError
        If the file cannot be read.

    Examples
    --------
    >>> open_side("notes.pdf")
    Traceback (most recent call last):
    ...
    fluorspar.errors.OptionError: this kind of file cannot be compared
      where:    notes.pdf
      got:      .pdf
      expected: an image (.nc, .exr, .hdr, .zarr) or a table of spectra (.csv, .txt)
    """
    if isinstance(source, SpectralImage | PointSpectra):
        return source
    if not isinstance(source, str | os.PathLike):
        raise OptionError(
            message(
                "this cannot be compared",
                got=type(source).__name__,
                expected="a SpectralImage, a PointSpectra, or the path of an image or a table of spectra",
            )
        )
    suffix = Path(source).suffix.lower()
    if suffix in SUFFIXES:
        return SpectralImage.open(source)
    if suffix in tables.SUFFIXES:
        return read_point_spectra(source)
    raise OptionError(
        message(
            "this kind of file cannot be compared",
            where=source,
            got=suffix or "no suffix",
            expected=f"an image ({', '.join(SUFFIXES)}) or a table of spectra ({', '.join(tables.SUFFIXES)})",
        )
    )


def bands_of_side(side: Side) -> Bands:
    """The bands of an image or a table, as far as they are known."""
    return side.bands if isinstance(side, PointSpectra) else bands_of(side)


def unit_of_side(side: Side) -> str:
    """The unit of an image or a table, in the spelling of its source; radiance has that of Fluorspar."""
    return in_our_spelling(side.unit) if isinstance(side, PointSpectra) else unit_of_image(side)


def check_units(a: Side, b: Side, match: str) -> list[str]:
    """Find out whether two sides may be compared as they are.

    Parameters
    ----------
    a, b : SpectralImage or PointSpectra
    match : str
        As in `compare`.

    Returns
    -------
    list of str
        A sentence if the units are not the same.

    Raises
    ------
    OptionError
        If they differ and the scales are not to be matched. A unit that is not stated may be that of the other.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> tables = [PointSpectra(("1",), Bands(Wavelengths()), np.ones((1, 69)), unit=u) for u in ("1", "counts")]
    >>> check_units(*tables, match="luminance")
    ["Units: A has '1', B has 'counts'; only ratios are compared."]
    """
    units = [unit_of_side(side) for side in (a, b)]
    if units[0] == units[1]:
        return []
    told = f"A has {units[0]!r}, B has {units[1]!r}"
    if match != "none":
        return [f"Units: {told}; only ratios are compared."]
    if any(unit.lower() in _NOT_STATED for unit in units):
        return [f"Units: {told}; they are taken as the same (a line '# unit: ...' states that of a table)."]
    raise OptionError(
        message(
            "the two sides have different units",
            got=told,
            expected="the same unit, or scales that are matched",
            fix="match the scales by luminance or at a point (--match luminance|POINT); if a table states no unit, or "
            "not the right one, put a line '# unit: W m-2 sr-1 nm-1' above its header",
        )
    )


def title_of(side: Side, source: Source) -> str:
    """What to call a side: its file, else the title of the table or the scene of the image.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 1, 1, 69)), Wavelengths(), attrs={"scene": "a room"})
    >>> title_of(image, image), title_of(image, "a.nc")
    ('a room', 'a.nc')
    """
    if isinstance(source, str | os.PathLike):
        return text_of(source)
    return side.title if isinstance(side, PointSpectra) else str(side.attrs.get("scene", "an image"))
