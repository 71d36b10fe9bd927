"""Is a Donaldson matrix physically possible? Photon yield and the Stokes side."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import MaterialError, PhotonYieldWarning, message

__all__ = ["MOST_PHOTON_YIELD", "SPARE_PHOTONS", "check_photon_yield", "check_stokes_side", "photon_yield"]

Array = NDArray[np.float64]

MOST_PHOTON_YIELD = 1.15  # more than measurement error explains
SPARE_PHOTONS = 0.01  # per photon, that a reflectance assumed beside luminescence leaves free
_ROUNDING = 1e-6
_ROUNDED_YIELD = 1e-3  # photons, of cells or spectra with few digits
_SIGNIFICANT = 5.0  # standard errors


def photon_yield(band: Array, emission: Array, excitation: Array) -> Array:
    """Return luminescent photons per incident photon of each excitation wavelength.

    Parameters
    ----------
    band : ndarray of shape (M, P)
        The band-weighted luminescent part, without S.
    emission : ndarray of shape (M,)
    excitation : ndarray of shape (P,)
        In nm. A photon has energy hc / lambda, so a cell counts em / ex.

    Returns
    -------
    ndarray of shape (P,)

    Examples
    --------
    >>> photon_yield(np.array([[0.4]]), np.array([500.0]), np.array([400.0]))
    array([0.5])
    """
    return np.asarray(emission @ band / excitation)


def check_photon_yield(total: Array, wavelengths: Array, where: str) -> None:
    """Warn of a photon yield above 1 by more than rounding, refuse one above 1.15; both arrays of shape (N,).

    Examples
    --------
    >>> check_photon_yield(np.array([0.8, 1.0]), np.array([400.0, 500.0]), "a dye")
    """
    worst = int(np.argmax(total))
    if total[worst] <= 1 + _ROUNDED_YIELD:
        return
    place = f"{where}, excitation {wavelengths[worst]:g} nm"
    got = f"{total[worst]:.4g} photons out per photon in"
    if total[worst] > MOST_PHOTON_YIELD:
        fault = "a material gives out more photons than it gets"
        expected = f"at most 1 (up to {MOST_PHOTON_YIELD} passes as measurement error)"
        fix = "check the quantity (band or density), the step and the concentration"
        raise MaterialError(message(fault, where=place, got=got, expected=expected, fix=fix))
    warnings.warn(f"{place}: {got}; used as it is", PhotonYieldWarning, stacklevel=3)


def check_stokes_side(band: Array, emission: Array, excitation: Array, where: str) -> None:
    """Refuse a luminescent part, shape (M, P), that shifts more light to shorter than to longer wavelengths.

    What is above the diagonal counts as noise up to 2 % of the light of any one excitation wavelength. More than
    that is refused if above exceeds below by five times what the scatter of the columns below explains: in a
    transposed matrix that side holds nothing but noise.

    Examples
    --------
    >>> w = np.array([400.0, 410.0])
    >>> check_stokes_side(np.array([[0, 0], [0.3, 0]]), w, w, "a dye")
    """
    shift = emission[:, None] - excitation[None, :]
    above, below = band * (shift < -_ROUNDING), band * (shift > _ROUNDING)
    excess = above.sum() - below.sum()
    columns = below.sum(axis=0)
    scatter = np.sqrt(2 * np.sum(columns**2))  # of the difference of two sums of such columns
    if above.sum(axis=0).max() > 0.02 and excess > _SIGNIFICANT * scatter:
        raise MaterialError(
            message(
                "a Donaldson matrix shifts light to shorter wavelengths",
                where=where,
                got=f"{above.sum():.3g} above the diagonal, {below.sum():.3g} below",
                expected="rows are emission, columns excitation wavelengths",
                fix="transpose the matrix",
            )
        )
