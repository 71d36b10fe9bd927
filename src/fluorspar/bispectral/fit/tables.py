"""From the factors of a measured matrix to the tables of a material: S, alpha, beta, and what is assumed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.checks import SPARE_PHOTONS
from fluorspar.bispectral.conversions import stokes_weights
from fluorspar.bispectral.fit.factorise import Factors
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, message
from fluorspar.spectral.spectrum import trapezoid
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["MaterialTables", "material_tables"]

Array = NDArray[np.float64]

_NEGLIGIBLE = 1e-4  # of the highest value of a spectrum; written as 0
_SAME = 1e-6  # nm, or photons per photon


@dataclass(frozen=True, eq=False)
class MaterialTables:
    """Spectra of a material on common wavelengths.

    Attributes
    ----------
    wavelengths : ndarray of shape (n,)
    reflectance : ndarray of shape (n,)
    emission, excitation : ndarray of shape (K, n)
        alpha; beta with integral 1, 1/nm.
    assumed : str
        What the tables assume where nothing was measured, in words.
    scaled : float
        Smallest factor put on the excitation at a wavelength to keep its photon yield at 1.
    """

    wavelengths: Array
    reflectance: Array
    emission: Array
    excitation: Array
    assumed: str = ""
    scaled: float = 1.0


def material_tables(
    measured: MeasuredMatrix, factors: Factors, support: tuple[float, float], *, tolerance: float
) -> MaterialTables:
    """Turn band-weighted factors into spectra on the measured wavelengths, continued over `support`.

    Parameters
    ----------
    measured
        The matrix.
    factors
        Of its luminescent cells.
    support
        First and last wavelength in nm.
    tolerance
        How far a measured reflectance may be off.

    Returns
    -------
    MaterialTables
        Terms without emission or excitation within `support` are left out.

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
    >>> tables = material_tables(sheet, factors, (390, 410), tolerance=0.01)
    >>> tables.reflectance, tables.assumed
    (array([0.5, 0.5, 0.4]), 'reflectance below 400 nm not measured, held at its value there')
    """
    em, ex, h = measured.emission, measured.excitation, measured.step
    first = em[0] + h * np.ceil((support[0] - em[0]) / h - 1e-6)
    last = em[0] + h * np.floor((support[1] - em[0]) / h + 1e-6)
    grid = Wavelengths(float(first), float(last), h).values
    reflectance = _reflectance(measured, factors, tolerance)
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
    tables = MaterialTables(
        grid,
        np.interp(grid, measured.reflectance.wavelengths, reflectance),
        emission,
        excitation,
    )
    was_measured = (grid > em[0] - _SAME) & (grid < em[-1] + _SAME)
    was_measured &= (grid > ex[0] - _SAME) & (grid < ex[-1] + _SAME)
    kept = _conserving(tables, was_measured, tolerance)
    lowered = grid[~was_measured & (kept.reflectance < tables.reflectance)]
    return replace(kept, assumed=_assumptions(measured, grid, bool(terms), lowered))


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


def _conserving(tables: MaterialTables, was_measured: NDArray[np.bool_], tolerance: float) -> MaterialTables:
    """Keep the photon yield of every wavelength at 1 or below.

    S gives way first: where it was measured by no more than its tolerance, elsewhere as far as it has to. Then the
    excitation does, at that wavelength alone.
    """
    w, h = tables.wavelengths, tables.wavelengths[1] - tables.wavelengths[0]
    density = (tables.emission.T @ tables.excitation) * stokes_weights(len(w), "half")
    luminescent = h * (w @ density) / w
    lowest = np.where(was_measured, tables.reflectance - tolerance, 0.0).clip(0.0)
    room = 1 - luminescent - np.where(was_measured | (luminescent <= 0), 0.0, SPARE_PHOTONS)
    reflectance = np.minimum(tables.reflectance, np.maximum(room, lowest))
    over = reflectance + luminescent > 1 + _SAME
    factor = np.where(over, (1 - reflectance) / np.maximum(luminescent, _SAME), 1.0)
    excitation = tables.excitation * factor
    area = np.array([trapezoid(beta, w) for beta in excitation]).reshape(-1, 1)
    return replace(
        tables,
        reflectance=reflectance,
        emission=tables.emission * area,
        excitation=excitation / area,
        scaled=float(factor.min()),
    )


def _assumptions(measured: MeasuredMatrix, grid: Array, fluorescent: bool, lowered: Array) -> str:
    """Say what the tables assume outside the data; `lowered`: where luminescence leaves no room for a held S."""
    found = []
    first, last = measured.reflectance.support
    what = [("reflectance", first, last, "held at its value there")]
    if fluorescent:
        what += [
            ("emission", float(measured.emission[0]), float(measured.emission[-1]), "taken as 0"),
            ("excitation", float(measured.excitation[0]), float(measured.excitation[-1]), "taken as 0"),
        ]
    for quantity, a, b, how in what:
        for side, end, beyond in (("below", a, grid[0] < a - _SAME), ("above", b, grid[-1] > b + _SAME)):
            if beyond:
                found.append(f"{quantity} {side} {end:g} nm not measured, {how}")
                if (
                    quantity == "reflectance"
                    and np.any((lowered < end) == (side == "below"))
                    and lowered.size
                ):
                    found[-1] += ", or less where luminescence leaves no room"
    return "; ".join(found)
