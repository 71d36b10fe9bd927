"""How many fluorophores do the data of a measured Donaldson matrix call for?"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.fit.factorise import Factors, Problem
from fluorspar.bispectral.matrix_noise import MatrixNoise, stokes_shift
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import lab_from_xyz, observer_weights
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["MOST_TERMS", "RankChoice", "choose_rank"]

MOST_TERMS = 3
"""More terms than this are never chosen; more can be asked for."""

_MORE_THAN_NOISE = 1.7  # how many times more than the same term finds in pure noise
_LEAST_PART = 0.01  # of the sum of squares of the luminescent part
_SEEN = 0.2  # CIEDE2000 in daylight


@dataclass(frozen=True, eq=False)
class RankChoice:
    """What `choose_rank` found.

    Attributes
    ----------
    factors : Factors
        As many terms as the data call for, smooth.
    gains : tuple of float
        Decrease of the misfit by each term tried, the one that was not accepted included.
    noise_gain : float
        The decrease one term finds in noise.
    """

    factors: Factors
    gains: tuple[float, ...]
    noise_gain: float


def choose_rank(measured: MeasuredMatrix, noise: MatrixNoise, rank: int | None = None) -> RankChoice:
    """Count the fluorophores the data call for.

    A term is accepted if it lowers the misfit three times more than one term does among the cells above the
    diagonal, where there is nothing to find but noise; that takes the true noise as the measure, however it
    is correlated. A further term must also explain 1 % of the luminescent part (10 % in amplitude): below
    that are the instrument's errors of shape, which are not noise, but no dye either. Lobes of an
    excitation spectrum that explain less than a term does in noise are dropped.

    Terms are counted, not dyes: if one dye emits only at shorter wavelengths than another is excited at, one
    product of spectra serves for both.

    Parameters
    ----------
    measured : MeasuredMatrix
    noise : MatrixNoise
        See `estimate_noise`.
    rank : int, optional
        Do not choose, take so many terms.

    Returns
    -------
    RankChoice

    Examples
    --------
    >>> from fluorspar.bispectral.matrix_noise import estimate_noise
    >>> import numpy as np
    >>> w = np.arange(400.0, 701.0, 10.0)
    >>> cells = 0.3 * np.eye(31) + np.random.default_rng(1).normal(0, 0.003, (31, 31))
    >>> grey = MeasuredMatrix(w, w, cells)
    >>> choose_rank(grey, estimate_noise(cells, stokes_shift(w, w, 10.0))).factors.rank
    0
    """
    shift = stokes_shift(measured.emission, measured.excitation, measured.step)
    problem, mirror = (Problem(measured.cells, shift, noise, mirrored=side) for side in (False, True))
    nothing = mirror.nothing()
    share = int(problem.lit.sum()) / max(1, int(mirror.lit.sum()))
    noise_gain = share * (nothing.misfit - mirror.grow(nothing).misfit) if mirror.lit.any() else 0.0
    least = _MORE_THAN_NOISE * max(noise_gain, sum(measured.cells.shape))
    gains: list[float] = []
    factors = problem.nothing()
    part = _LEAST_PART * factors.misfit
    while len(gains) < (MOST_TERMS if rank is None else rank):
        before = replace(factors, curvature=0.0)
        columns = problem.misfit_of_columns(before)
        grown = problem.grow(before)
        gain = columns - problem.misfit_of_columns(grown)
        enough = _of_several(gain) > max(least, part if factors.rank else 0.0)
        if factors.rank and not enough:
            other = problem.grow(before, apart=True)
            of_other = columns - problem.misfit_of_columns(other)
            if _of_several(of_other) > least and _colour_change(measured, before, other) > _SEEN:
                grown, gain, enough = other, of_other, True
        gains.append(float(gain.sum()))
        if rank is None and not enough:
            break
        factors = problem.smooth(grown, cautious=True)
    return RankChoice(problem.prune(factors, least / _MORE_THAN_NOISE), tuple(gains), float(noise_gain))


def _colour_change(measured: MeasuredMatrix, before: Factors, after: Factors) -> float:
    """CIEDE2000 in daylight between the luminescence of two fits, S as measured."""
    excitation, emission = (
        Wavelengths(float(at[0]), float(at[-1]), measured.step)
        for at in (measured.excitation, measured.emission)
    )
    light, white = (illuminant("D65").on(grid, outside="zero") for grid in (excitation, emission))
    weights = observer_weights(emission)
    lit = stokes_shift(measured.emission, measured.excitation, measured.step) > 0
    reflected = measured.reflectance.on(emission, outside="hold") * white
    labs = [
        lab_from_xyz((reflected + (factors.product * lit) @ light) @ weights, white @ weights)
        for factors in (before, after)
    ]
    return float(ciede2000(*labs))


def _of_several(gain: NDArray[np.float64]) -> float:
    """What all excitation wavelengths but the best one gain: no dye is excited at a single one."""
    return float(gain.sum() - gain.max(initial=0.0))
