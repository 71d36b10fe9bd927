"""What the numbers of an image are, as its file states it: quantity, unit, and the unit of the wavelengths.

Fluorspar works in W m-2 sr-1 nm-1 and nm. An image of another program may hold something else, such as
reflectance; it keeps what its file says in the attributes `quantity` and `unit`. Neither is there for spectral
radiance in W m-2 sr-1 nm-1.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import ApproximationWarning, ImageError, message

__all__ = [
    "NOT_STATED",
    "UNITS",
    "in_our_spelling",
    "is_radiance",
    "is_unit_of_radiance",
    "powers_of",
    "quantity_of",
    "same_unit",
    "stated",
    "unit_of",
    "wavelengths_in_nm",
]

UNITS = "W m-2 sr-1 nm-1"
"""The unit of spectral radiance."""
NOT_STATED = "not stated"
"""What the attribute `unit` is if a file names none."""

_SUPERSCRIPTS = str.maketrans("⁻−⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")
_NM = {
    1.0: "nm nanometer nanometers nanometre nanometres",
    1e3: "um µm μm micron microns micrometer micrometers micrometre micrometres",
    1e6: "mm millimeter millimeters millimetre millimetres",
    1e9: "m meter meters metre metres",
    0.1: "angstrom angstroms",
}
_IN_NM = {name: factor for factor, names in _NM.items() for name in names.split()}


def unit_of(attrs: Mapping[str, Any]) -> str:
    """The unit of an image by its attributes.

    Examples
    --------
    >>> unit_of({}), unit_of({"unit": "mW.cm^-2.sr^-1"})
    ('W m-2 sr-1 nm-1', 'mW.cm^-2.sr^-1')
    """
    return str(attrs.get("unit", UNITS))


def quantity_of(attrs: Mapping[str, Any]) -> str:
    """The quantity of an image by its attributes: "radiance" or "reflectance"."""
    return str(attrs.get("quantity", "radiance"))


def is_radiance(attrs: Mapping[str, Any]) -> bool:
    """Whether an image holds spectral radiance in W m-2 sr-1 nm-1, so that its luminance is in cd/m2.

    Examples
    --------
    >>> is_radiance({}), is_radiance({"unit": "not stated"}), is_radiance({"unit": "1", "quantity": "reflectance"})
    (True, False, False)
    """
    return quantity_of(attrs) == "radiance" and same_unit(unit_of(attrs), UNITS)


def is_unit_of_radiance(unit: str) -> bool:
    """Whether luminance in cd/m2 and illuminance in lux follow from numbers of this unit.

    Examples
    --------
    >>> [is_unit_of_radiance(unit) for unit in ("W/(m2 sr nm)", "W m-2 sr-1", "1", "not stated")]
    [True, False, False, False]
    """
    return same_unit(unit, UNITS)


def same_unit(a: str, b: str) -> bool:
    """Whether two texts are one unit; products and quotients of powers may be spelt in several ways.

    Examples
    --------
    >>> same_unit("W.m^-2.sr^-1.nm^-1", UNITS), same_unit("W/(m2 sr nm)", UNITS), same_unit("mW m-2 sr-1 nm-1", UNITS)
    (True, True, False)
    """
    powers = powers_of(a)
    return a == b or (powers is not None and powers == powers_of(b))


def in_our_spelling(unit: str) -> str:
    """A unit as Fluorspar spells it if it is that of spectral radiance, else as it is.

    Examples
    --------
    >>> in_our_spelling("W.m^-2.sr^-1.nm^-1"), in_our_spelling("counts "), in_our_spelling("")
    ('W m-2 sr-1 nm-1', 'counts', 'not stated')
    """
    return UNITS if same_unit(unit, UNITS) else unit.strip() or NOT_STATED


def powers_of(unit: str) -> dict[str, int] | None:
    """The powers of the base units in a unit, None if the text is not a product of them.

    Examples
    --------
    >>> powers_of("W.m^-2.sr^-1"), powers_of("W/m2/sr"), powers_of("not stated, sorry")
    ({'W': 1, 'm': -2, 'sr': -1}, {'W': 1, 'm': -2, 'sr': -1}, None)
    """
    above, *below = unit.translate(_SUPERSCRIPTS).replace("^", "").replace("**", "").split("/")
    powers: dict[str, int] = {}
    for text, sign in ((above, 1), (" ".join(below), -1)):
        for factor in re.split(r"[\s.·*()]+", text.strip(" ()")):
            power = re.fullmatch(r"([A-Za-zµμ]+)(-?\d+)?", factor)
            if factor and (power is None or power[1] in powers):
                return None
            if power:
                powers[power[1]] = sign * int(power[2] or 1)
    return powers


def stated(unit: str, quantity: str = "radiance") -> dict[str, str]:
    """The attributes that say what an image holds; none for spectral radiance in W m-2 sr-1 nm-1.

    Examples
    --------
    >>> stated("W.m^-2.sr^-1.nm^-1"), stated("1", "reflectance")
    ({}, {'unit': '1', 'quantity': 'reflectance'})
    """
    if quantity == "radiance" and same_unit(unit, UNITS):
        return {}
    return {"unit": unit or NOT_STATED, "quantity": quantity}


def wavelengths_in_nm(at: ArrayLike, unit: str, where: object, fix: str = "") -> NDArray[np.float64]:
    """Bring wavelengths to nm.

    Parameters
    ----------
    at : array_like of shape (N,)
    unit : str
        As the file spells it; without one, numbers above 100 are taken for nm, those from 0.2 to 20 for micrometres.
    where : object
        The file, for messages.
    fix : str
        How to state the unit in this kind of file.

    Raises
    ------
    ImageError
        If the unit is not known.

    Warns
    -----
    ApproximationWarning
        If there is none; the warning says what is assumed.

    Examples
    --------
    >>> wavelengths_in_nm([0.4, 0.5], "Micrometers", "a.hdr")
    array([400., 500.])
    """
    values = np.asarray(at, dtype=np.float64)
    name = unit.strip().lower()
    if name in _IN_NM:
        return values * _IN_NM[name]
    assumed = _assumed_unit(values) if name in ("", "unknown") else ""
    if assumed:
        low, high = values.min(), values.max()
        text = (
            f"{where}: the unit of the wavelengths is not stated: {low:g} to {high:g} are taken for {assumed}"
        )
        warnings.warn(text, ApproximationWarning, stacklevel=5)
        return values * _IN_NM[assumed]
    raise ImageError(
        message(
            "the unit of the wavelengths is not known",
            where=where,
            got=repr(name),
            expected="Nanometers or Micrometers",
            fix=fix,
        )
    )


def _assumed_unit(values: NDArray[np.float64]) -> str:
    """The unit that wavelengths must have by their size; none for what may be the numbers of the bands."""
    if values.min() > 100:
        return "nm"
    numbered = np.array_equal(np.sort(values), np.arange(len(values)) + 1)
    return "um" if values.min() >= 0.2 and values.max() <= 20 and not numbered else ""
