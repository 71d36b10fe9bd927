"""The unit and the quantity of spectra: what may be compared as it is, and what has a luminance in cd/m2."""

from __future__ import annotations

from fluorspar.errors import OptionError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.units import NOT_STATED, UNITS, quantity_of, same_unit
from fluorspar.measure.point_spectra import PointSpectra

__all__ = ["check_units", "is_radiance", "unit_of"]

_NOT_STATED = ("", NOT_STATED, "unknown")


def unit_of(side: SpectralImage | PointSpectra) -> str:
    """The unit of an image or a table, in the spelling of its source; radiance has that of Fluorspar.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> attrs = {"unit": "W.m^-2.sr^-1.nm^-1"}
    >>> unit_of(SpectralImage.from_arrays(np.ones((7, 1, 1, 69)), Wavelengths(), attrs=attrs))
    'W m-2 sr-1 nm-1'
    """
    if isinstance(side, PointSpectra):
        unit = side.unit
    elif quantity_of(side.attrs) == "reflectance":
        unit = "1"
    else:
        unit = str(side.attrs.get("unit", UNITS))
    return UNITS if same_unit(unit, UNITS) else unit.strip() or NOT_STATED


def is_radiance(unit: str) -> bool:
    """Whether luminance in cd/m2 and illuminance in lux follow from numbers of this unit.

    Examples
    --------
    >>> is_radiance("W/(m2 sr nm)"), is_radiance("W m-2 sr-1"), is_radiance("1"), is_radiance("not stated")
    (True, False, False, False)
    """
    return same_unit(unit, UNITS)


def check_units(a: SpectralImage | PointSpectra, b: SpectralImage | PointSpectra, match: str) -> list[str]:
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
    units = [unit_of(side) for side in (a, b)]
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
            fix="match the scales (--match luminance, or --match POINT); if a table states no unit, or not the right "
            "one, put a line '# unit: W m-2 sr-1 nm-1' above its header",
        )
    )
