"""Spectral OpenEXR files of other programs.

Read are the layout of A. Fichet, R. Pacanowski, A. Wilkie, "An OpenEXR Layout for Spectral Images", JCGT 10(3),
2021, and what comes near it: wavelengths in any unit of length or frequency and in any order, names with fewer
digits, as pbrt writes them, half floats, further channels, attributes left out; and channels that are named by a
wavelength alone, as those of Mitsuba's specfilm often are.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fluorspar.errors import ApproximationWarning, ImageError, OptionError, message
from fluorspar.files.names import text_of
from fluorspar.image.components import TOTAL
from fluorspar.image.dataset import make_dataset
from fluorspar.image.formats.exr_units import stated_by
from fluorspar.spectral.uneven import grid_through

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["channel_wavelength", "foreign_dataset", "stated_already"]

_LIGHT_SPEED = 299_792_458.0  # m/s
_CHANNEL = re.compile(
    r"(?:(?P<layer>.+)\.)?(?P<kind>S[0-3]|T)\.(?P<number>\d*[.,]?\d+(?:[eE][+-]?\d+)?)"
    r"(?P<prefix>[YZEPTGMkhdcmunp]|da)?(?P<unit>m|Hz)"
)
_PLAIN = re.compile(
    r"(?P<before>(?:.*[^\d.,])?)(?P<number>\d+(?:[.,]\d+)?)(?P<unit>(?:nm|um)?)(?P<after>[^\d]*)"
)
_BISPECTRAL = re.compile(r"T\.[\d.,]+nm\.[\d.,]+nm")
_PREVIEW = frozenset("RGBAXYZ")
_PREFIXES = {
    **{
        "": 1.0,
        "Y": 1e24,
        "Z": 1e21,
        "E": 1e18,
        "P": 1e15,
        "T": 1e12,
        "G": 1e9,
        "M": 1e6,
        "k": 1e3,
        "h": 1e2,
    },
    **{"da": 1e1, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12},
}


def channel_wavelength(name: str) -> tuple[str, str, float] | None:
    """Tell what a channel holds by its name.

    Parameters
    ----------
    name : str

    Returns
    -------
    layer : str
        What comes before the kind, such as "left"; "" if nothing does.
    kind : str
        "S0": emitted or received light; "S1", "S2", "S3": its polarisation; "T": reflectance or transmittance.
    wavelength : float
        In nm. The whole is None if the channel is not spectral.

    Examples
    --------
    >>> channel_wavelength("S0.550,938nm"), channel_wavelength("left.T.600THz"), channel_wavelength("R")
    (('', 'S0', 550.938), ('left', 'T', 499.654096666667), None)
    """
    found = _CHANNEL.fullmatch(name)
    if found is None:
        return None
    value = float(found["number"].replace(",", ".")) * _PREFIXES[found["prefix"] or ""]
    if value <= 0:
        return None
    metres = value if found["unit"] == "m" else _LIGHT_SPEED / value
    # 550.938e-9 m is 550.938 nm, not 550.9380000000001
    return found["layer"] or "", found["kind"], float(f"{metres * 1e9:.15g}")


def foreign_dataset(
    parts: list[Any], path: Path, channel_wavelengths: Sequence[float] | None = None
) -> xr.Dataset:
    """Make a spectral image, not split into components, of the parts of an EXR file.

    Parameters
    ----------
    parts : list of OpenEXR.Part
        With separate channels. The first one that holds light (S0) is used, or else reflectance (T), or else
        channels that are named by their wavelengths alone.
    path : Path
        For messages.
    channel_wavelengths : sequence of float, optional
        Wavelengths in nm of the channels of the first part, in the order of the numbers in their names.

    Returns
    -------
    Dataset
        With the one component `total`. Attributes: `source_file`; and, if it is not radiance in W m-2 sr-1
        nm-1, `unit` as the file states it, and `quantity` ("radiance" or "reflectance").

    Raises
    ------
    ImageError
        If there is no spectral channel, only one, or their sizes differ.
    OptionError
        If wavelengths are given for channels that state their own.

    Warns
    -----
    ApproximationWarning
        If parts, layers, polarisation or other channels are left out, it holds reflectance, or the names of the
        channels have to be interpreted.
    """
    if channel_wavelengths is not None:
        part, kind, named = parts[0], "S0", _named_by(parts, channel_wavelengths, path)
    else:
        part, kind, named = _spectral_channels(parts, path)
    if len(named) < 2:
        raise ImageError(
            message(
                "the EXR file has only one spectral channel",
                where=path,
                got=next(iter(named.values())),
                expected="at least two wavelengths",
            )
        )
    planes = [np.asarray(part.channels[named[wavelength]].pixels) for wavelength in sorted(named)]
    shapes = {plane.shape for plane in planes}
    if len(shapes) > 1 or planes[0].ndim != 2:
        raise ImageError(message("the spectral channels differ in size", where=path, got=sorted(shapes)))
    values = np.empty((*planes[0].shape, len(planes)), np.float32)
    for index, plane in enumerate(planes):
        values[..., index] = plane
    if kind == "T":
        text = f"{path} holds reflectance, and is kept as such: pictures show it in light that is even over the bands"
        warnings.warn(text, ApproximationWarning, stacklevel=3)
    grid = grid_through(sorted(named), path)
    attrs = {"source_file": text_of(path.name)} | stated_by(part.header, kind)
    return make_dataset(values[np.newaxis], grid, attrs=attrs, components=(TOTAL,))


def _spectral_channels(parts: list[Any], path: Path) -> tuple[Any, str, dict[float, str]]:
    """What is read: the part, "S0" or "T", and the channel of each wavelength.

    That is the first layer, in the order of the parts, that holds light (S0), or else reflectance (T).
    """
    found: dict[tuple[int, str, str], dict[float, str]] = {}
    twice: dict[tuple[int, str, str], str] = {}
    for number, part in enumerate(parts):
        for name in part.channels:
            if (what := channel_wavelength(name)) is None:
                continue
            layer, kind, wavelength = what
            named = found.setdefault((number, layer, kind), {})
            if wavelength in named:
                twice[number, layer, kind] = f"{named[wavelength]} and {name}"
            named[wavelength] = name
    usable = sorted(key for key in found if key[2] in ("S0", "T"))
    if not usable:
        part, named = _named_plainly(parts, path)
        return part, "S0", named
    chosen = next((key for key in usable if key[2] == "S0"), usable[0])
    if chosen in twice:
        raise ImageError(message("two channels have one wavelength", where=path, got=twice[chosen]))
    left_out = [_called(key, chosen, parts) for key in sorted(found) if key != chosen]
    _say_unread(parts[chosen[0]], list(dict.fromkeys(left_out)), path)
    return parts[chosen[0]], chosen[2], found[chosen]


def _say_unread(part: Any, left_out: list[str], path: Path, known: Iterable[str] = ()) -> None:
    """Warn of what is not read: what is given, and channels that are neither spectral, a preview nor known."""
    others = [name for name in part.channels if channel_wavelength(name) is None and name not in known]
    bispectral = [name for name in others if _BISPECTRAL.search(name)]
    plain = [name for name in others if name not in _PREVIEW and name not in bispectral]
    if plain:
        left_out.append(f"{'channel' if len(plain) == 1 else 'channels'} {_listed(plain)}")
    if left_out:
        warnings.warn(f"{path}: not read: {', '.join(left_out)}", ApproximationWarning, stacklevel=5)
    if bispectral:
        text = (
            f"{path}: {len(bispectral)} bispectral channels are not read ({_listed(bispectral, 2)}): an image holds "
            "light, not how a surface luminesces; write their numbers as a Donaldson matrix (CSV) to make a material"
        )
        warnings.warn(text, ApproximationWarning, stacklevel=5)


def _named_plainly(parts: list[Any], path: Path) -> tuple[Any, dict[float, str]]:
    """The part and its channels of wavelengths whose names are a wavelength and nothing that says what they hold."""
    families: dict[tuple[int, str, str], dict[float, str]] = {}
    for number, part in enumerate(parts):
        for name in part.channels:
            if (found := _PLAIN.fullmatch(name)) is None:
                continue
            wavelength = float(found["number"].replace(",", ".")) * (1e3 if found["unit"] == "um" else 1.0)
            family = families.setdefault((number, found["before"], found["unit"] + found["after"]), {})
            family.setdefault(wavelength, name)
    # where there are small numbers, too, they count the channels
    families = {key: named for key, named in families.items() if min(named) > 100 and max(named) < 1e5}
    if not families:
        raise ImageError(
            message(
                "the EXR file has no spectral channel",
                where=path,
                got=_listed([name for part in parts for name in part.channels]),
                expected="channels such as S0.550,000000nm, band_550nm or 550",
                fix="state the wavelengths of its channels: fluorspar convert IN OUT --channel-wavelengths 400:700:10",
            )
        )
    chosen = max(families, key=lambda key: len(families[key]))
    named = families[chosen]
    ends = f"{named[min(named)]} to {named[max(named)]}"
    text = (
        f"{path}: channels {ends} are taken for light at the wavelengths of their names, in nm; what they hold is not "
        "stated (specfilm of Mitsuba writes integrals over its bands)"
    )
    warnings.warn(text, ApproximationWarning, stacklevel=5)
    _say_unread(parts[chosen[0]], _other_parts(parts, chosen[0]), path, named.values())
    return parts[chosen[0]], named


def _other_parts(parts: list[Any], chosen: int) -> list[str]:
    """Parts with more than a preview, as they are called in a warning."""
    return [
        f"part {part.header.get('name', number)!r}"
        for number, part in enumerate(parts)
        if number != chosen and not _PREVIEW.issuperset(part.channels)
    ]


def _named_by(parts: list[Any], wavelengths: Sequence[float], path: Path) -> dict[float, str]:
    """The channels that were given wavelengths, in the order of the numbers in their names."""
    if stated := [name for part in parts for name in part.channels if channel_wavelength(name)]:
        raise stated_already(path, stated[0])
    names = [name for name in parts[0].channels if name not in _PREVIEW]
    names.sort(key=lambda name: [int(text) if text.isdigit() else text for text in re.split(r"(\d+)", name)])
    if len(names) != len(wavelengths) or len(set(wavelengths)) < len(wavelengths):
        raise ImageError(
            message(
                "the wavelengths of the channels do not fit the EXR file",
                where=path,
                got=f"{len(wavelengths)} wavelengths",
                expected=f"{len(names)} different ones, for {_listed(names)}",
            )
        )
    _say_unread(parts[0], _other_parts(parts, 0), path, names)
    return {float(wavelength): name for wavelength, name in zip(wavelengths, names, strict=True)}


def stated_already(path: Path, got: str) -> OptionError:
    """The error that an EXR file needs no wavelengths for its channels."""
    fault, fix = "the EXR file states the wavelengths of its channels", "leave out --channel-wavelengths"
    return OptionError(message(fault, where=path, got=got, fix=fix))


def _listed(names: list[str], most: int = 12) -> str:
    return ", ".join(names[:most]) + (", ..." if len(names) > most else "")


def _called(key: tuple[int, str, str], chosen: tuple[int, str, str], parts: list[Any]) -> str:
    """What channels that are not read are called in a warning."""
    number, layer, kind = key
    if number != chosen[0]:
        return f"part {parts[number].header.get('name', number)!r}"
    if layer != chosen[1]:
        return f"layer {layer!r}"
    return "reflectance (T)" if kind == "T" else "polarisation (S1, S2, S3)"
