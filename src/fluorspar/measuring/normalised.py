"""Spectra divided by a white reference, or by a luminance."""

from __future__ import annotations

from fluorspar.errors import OptionError, message
from fluorspar.image.units import is_unit_of_radiance
from fluorspar.measuring.options import reference_option
from fluorspar.measuring.point_spectra import PointSpectra

__all__ = ["RANGE", "normalised"]

RANGE = (400.0, 700.0)
"""Wavelengths in nm over which the paper takes means and RMSE (Eq. 14)."""


def normalised(spectra: PointSpectra, by: str) -> PointSpectra:
    """Normalise spectra as a whole: their ratios stay.

    Parameters
    ----------
    spectra : PointSpectra
    by : str
        "none"; "luminance": the mean luminance of the points becomes 1; or the name of a point, the white
        reference: its mean over the bands of 400-700 nm becomes 1, as in Eq. 14 of the paper.

    Returns
    -------
    PointSpectra

    Raises
    ------
    OptionError
        If there is no such point, or what is to become 1 is 0.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.full((2, 31), [[2.0], [4.0]]))
    >>> normalised(spectra, "2").radiance[:, 0]
    array([0.5, 1. ])
    """
    by = reference_option("normalise", by)
    if by == "none":
        return spectra
    if by == "luminance":
        divisor = float(spectra.luminance().mean())
        absolute = is_unit_of_radiance(spectra.unit)
        unit = f"{spectra.unit} per cd m-2" if absolute else "1"
        what = f"the mean luminance of the points, {divisor:.6g}" + (" cd/m2" if absolute else "")
    else:
        low, high = RANGE
        inside = (spectra.grid.values >= low) & (spectra.grid.values <= high)
        divisor = float(spectra.at(by)[inside].mean()) if inside.any() else 0.0
        unit, what = "1", f"the mean of point {by} over the bands of 400-700 nm, {divisor:.6g}"
    if not divisor > 0:
        raise OptionError(
            message("the spectra cannot be normalised", where=spectra.title or None, got=f"{what}")
        )
    return spectra.scaled(1 / divisor, unit, f"divided by {what}")
