"""From the factors of a measured matrix to the spectra of a material: S, alpha, beta, and what is assumed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.checks import SPARE_PHOTONS
from fluorspar.bispectral.conversions import stokes_weights
from fluorspar.bispectral.factored import FactoredMatrix, Fluorophore
from fluorspar.bispectral.fit.factorise import Factors
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, message
from fluorspar.spectral.spectrum import Spectrum, trapezoid
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["spectra_of_factors"]

Array = NDArray[np.float64]

_NEGLIGIBLE = 1e-4  # of the highest value of a spectrum; written as 0
_SAME = 1e-6  # nm, or photons per photon


def spectra_of_factors(
    measured: MeasuredMatrix, factors: Factors, support: tuple[float, float], *, tolerance: float, name: str
) -> tuple[FactoredMatrix, float]:
    """Turn band-weighted factors into spectra on the measured wavelengths, continued over `support`.

    Parameters
    ----------
    measured : MeasuredMatrix
    factors : Factors
        Of its luminescent cells.
    support : tuple of float
        First and last wavelength in nm.
    tolerance : float
        How far a measured reflectance may be off.
    name : str
        Of the material.

    Returns
    -------
    spectra : FactoredMatrix
        Factors without emission or excitation within `support` are left out. `assumed` of the spectra says in words
        what was not measured.
    scaled : float
        Smallest factor put on the excitation at a wavelength to keep its photon yield at 1.

    Raises
    ------
    MaterialError
        If S lies outside 0 to 1 by more than the tolerance.

    Examples
    --------
    >>> w = np.array([400.0, 410.0])
    >>> sheet = MeasuredMatrix(w, w, [[0.5, 0], [0, 0.4]])
    >>> nothing, none = np.zeros((0, 2)), np.zeros((0, 2), dtype=bool)
    >>> factors = Factors(nothing, nothing, np.zeros((2, 2)), 0.0, none, none)
    >>> spectra, _ = spectra_of_factors(sheet, factors, (390, 410), tolerance=0.01, name="sheet")
    >>> spectra.reflectance.values, spectra.reflectance.assumed
    (array([0.5, 0.5, 0.4]), 'reflectance below 400 nm not measured, held at its value there')
    """
    em, ex, h = measured.emission, measured.excitation, measured.step
    first = em[0] + h * np.ceil((support[0] - em[0]) / h - 1e-6)
    last = em[0] + h * np.floor((support[1] - em[0]) / h + 1e-6)
    grid = Wavelengths(float(first), float(last), h).values
    held = np.interp(grid, measured.reflectance.wavelengths, _reflectance(measured, factors, tolerance))
    terms = []
    for a, b in zip(factors.emission, factors.excitation, strict=True):
        alpha = np.interp(grid, em, a, left=0.0, right=0.0)
        beta = np.interp(grid, ex, b, left=0.0, right=0.0)
        area = trapezoid(beta, grid)
        if area > 0 and alpha.any():
            pair = np.array([alpha * area / h, beta / area])
            pair[pair < _NEGLIGIBLE * pair.max(axis=1, keepdims=True)] = 0.0
            terms.append(pair)
    emission, excitation = np.array(terms).reshape(-1, 2, len(grid)).swapaxes(0, 1)
    was_measured = (grid > em[0] - _SAME) & (grid < em[-1] + _SAME)
    was_measured &= (grid > ex[0] - _SAME) & (grid < ex[-1] + _SAME)
    S, scale = _conserving(grid, held, emission.T @ excitation, was_measured, tolerance)
    excitation = excitation * scale
    integrals = np.array([trapezoid(beta, grid) for beta in excitation]).reshape(-1, 1)
    emission, excitation = emission * integrals, excitation / integrals
    assumed = _assumptions(measured, grid, bool(terms), lowered=grid[~was_measured & (held > S)])

    def spectrum(values: Array, what: str) -> Spectrum:
        return Spectrum(grid, values, f"{what} of {name!r}", assumed)

    dyes = tuple(
        Fluorophore(spectrum(a, "emission"), spectrum(b, "excitation"), f"{name}_{k}")
        for k, (a, b) in enumerate(zip(emission, excitation, strict=True), start=1)
    )
    return FactoredMatrix(spectrum(S, "reflectance"), dyes, name), float(scale.min())


def _reflectance(measured: MeasuredMatrix, factors: Factors, tolerance: float) -> Array:
    """Take half a cell of luminescence off the diagonal."""
    em, ex, at = measured.emission, measured.excitation, measured.reflectance.wavelengths
    own = np.interp(at, em, np.arange(len(em))).round().astype(int)
    excited = np.interp(at, ex, np.arange(len(ex))).round().astype(int)
    reflectance = measured.reflectance.values - 0.5 * factors.product[own, excited]
    worst = int(np.argmax(np.abs(reflectance - 0.5)))
    if not -tolerance <= reflectance[worst] <= 1 + tolerance:
        raise MaterialError(
            message(
                "the reflectance in a Donaldson matrix lies outside 0 to 1 by more than noise",
                where=f"{measured.title}, {at[worst]:g} nm",
                got=f"{reflectance[worst]:.3g} once half a cell of luminescence is taken off",
                expected=f"0 to 1 within {tolerance:.2g}",
                fix="check the calibration of the measurement, or that the diagonal is S",
            )
        )
    return np.asarray(np.clip(reflectance, 0.0, 1.0))


def _conserving(
    w: Array, held: Array, product: Array, was_measured: NDArray[np.bool_], tolerance: float
) -> tuple[Array, Array]:
    """Keep the photon yield of every wavelength (n,) at 1 or below: S (n,) and what excitation is multiplied with (n,).

    S gives way first: where it was measured by no more than its tolerance, elsewhere as far as it has to. Then the
    excitation does, at that wavelength alone. `held` (n,) is S before, `product` (n, n) the sum of alpha beta.
    """
    luminescent = (w[1] - w[0]) * (w @ (product * stokes_weights(len(w), "half"))) / w
    lowest = np.where(was_measured, held - tolerance, 0.0).clip(0.0)
    room = 1 - luminescent - np.where(was_measured | (luminescent <= 0), 0.0, SPARE_PHOTONS)
    S = np.minimum(held, np.maximum(room, lowest))
    over = S + luminescent > 1 + _SAME
    return S, np.where(over, (1 - S) / np.maximum(luminescent, _SAME), 1.0)


def _assumptions(measured: MeasuredMatrix, grid: Array, fluorescent: bool, lowered: Array) -> str:
    """Say what the tables assume outside the data; `lowered`: where luminescence leaves no room for a held S."""
    gaps = []
    first, last = measured.reflectance.support
    spans = [("reflectance", first, last, "held at its value there")]
    if fluorescent:
        spans += [
            ("emission", float(measured.emission[0]), float(measured.emission[-1]), "taken as 0"),
            ("excitation", float(measured.excitation[0]), float(measured.excitation[-1]), "taken as 0"),
        ]
    for quantity, a, b, how in spans:
        for side, end, beyond in (("below", a, grid[0] < a - _SAME), ("above", b, grid[-1] > b + _SAME)):
            if beyond:
                gave_way = (
                    quantity == "reflectance"
                    and lowered.size
                    and np.any((lowered < end) == (side == "below"))
                )
                less = ", or less where luminescence leaves no room" if gave_way else ""
                gaps.append(f"{quantity} {side} {end:g} nm not measured, {how}{less}")
    return "; ".join(gaps)
