"""Spectral OpenEXR files of other programs.

Read are the layout of A. Fichet, R. Pacanowski, A. Wilkie, "An OpenEXR Layout for Spectral Images", JCGT 10(3),
2021, and what comes near it: wavelengths in any unit of length or frequency and in any order, names with fewer
digits, as pbrt writes them, half floats, further channels, attributes left out.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fluorspar.errors import ApproximationWarning, ImageError, message
from fluorspar.image.components import TOTAL
from fluorspar.image.dataset import make_dataset
from fluorspar.image.regular import regular_spectra

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["channel_wavelength", "foreign_dataset"]

_LIGHT_SPEED = 299_792_458.0  # m/s
_CHANNEL = re.compile(
    r"(?:(?P<layer>.+)\.)?(?P<kind>S[0-3]|T)\.(?P<number>\d*[.,]?\d+(?:[eE][+-]?\d+)?)"
    r"(?P<prefix>[YZEPTGMkhdcmunp]|da)?(?P<unit>m|Hz)"
)
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


def foreign_dataset(parts: list[Any], path: Path) -> xr.Dataset:
    """Make a spectral image, not split into components, of the parts of an EXR file.

    Parameters
    ----------
    parts : list of OpenEXR.Part
        With separate channels. The first one that holds spectral channels is used.
    path : Path
        For messages.

    Returns
    -------
    Dataset
        With the one component `total`. Attributes: `source_file`, `unit` as the file states it, `quantity`
        ("radiance" or "reflectance").

    Raises
    ------
    ImageError
        If there is no spectral channel, only one, or their sizes differ.

    Warns
    -----
    ApproximationWarning
        If polarisation is left out, reflectance is read as radiance, or the wavelengths are not evenly spaced.
    """
    part, kind, named = _spectral_part(parts, path)
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
        text = f"{path} holds reflectance: it is read as the radiance in light of 1 W m-2 sr-1 nm-1"
        warnings.warn(text, ApproximationWarning, stacklevel=3)
    values, grid = regular_spectra(values, np.array(sorted(named)), path)
    attrs = {
        "source_file": path.name,
        "unit": str(part.header.get("emissiveUnits", "not stated")) if kind == "S0" else "1",
        "quantity": "radiance" if kind == "S0" else "reflectance",
    }
    return make_dataset(values[np.newaxis], grid, attrs=attrs, components=(TOTAL,))


def _spectral_part(parts: list[Any], path: Path) -> tuple[Any, str, dict[float, str]]:
    """The first part with spectral channels, which kind is read, and the channel of each wavelength."""
    for part in parts:
        spectral = {name: what for name in part.channels if (what := channel_wavelength(name))}
        if not spectral:
            continue
        layers = sorted({layer for layer, _, _ in spectral.values()})
        kinds = {kind for layer, kind, _ in spectral.values() if layer == layers[0]}
        kind = "S0" if "S0" in kinds else "T"
        left_out = [f"layer {layer!r}" for layer in layers[1:]]
        left_out += ["polarisation (S1, S2, S3)"] * bool(kinds & {"S1", "S2", "S3"})
        left_out += ["reflectance (T)"] * (kind == "S0" and "T" in kinds)
        named: dict[float, str] = {}
        for name, (layer, of_kind, wavelength) in spectral.items():
            if (layer, of_kind) != (layers[0], kind):
                continue
            if wavelength in named:
                got = f"{named[wavelength]} and {name}"
                raise ImageError(message("two channels have one wavelength", where=path, got=got))
            named[wavelength] = name
        if not named:
            continue
        if left_out:
            warnings.warn(f"{path}: not read: {', '.join(left_out)}", ApproximationWarning, stacklevel=4)
        return part, kind, named
    names = [name for part in parts for name in part.channels]
    raise ImageError(
        message(
            "the EXR file has no spectral channel",
            where=path,
            got=", ".join(names[:12]) + (", ..." if len(names) > 12 else ""),
            expected="channels such as S0.550,000000nm",
        )
    )
