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

_MORE_THAN_NOISE = 2.3  # how many times more than the same term finds in pure noise
_FURTHER = 3.0  # the same of a term that may emit where others do, and with them misses the shape of theirs
_LEAST_PART = 0.01  # of the sum of squares of the luminescent part
_SEEN = 0.1  # CIEDE2000 in daylight


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
        The decrease one term finds in noise, at least one for each of its numbers.
    """

    factors: Factors
    gains: tuple[float, ...]
    noise_gain: float


def choose_rank(measured: MeasuredMatrix, noise: MatrixNoise, rank: int | None = None) -> RankChoice:
    """Count the fluorophores the data call for.

    The first term is accepted if it lowers the misfit 2.3 times as much as one term does among the cells above the
    diagonal, where there is nothing to find but noise; that takes the true noise as the measure, however it
    is correlated. The best column counts as the second best, as no dye is excited at a single wavelength: a column
    gone wrong is none. Of 200 made-up matrices of noise (drifts within and between columns, doubled in the ultraviolet,
    a column gone wrong, and all of these together) one passed. In noise of 0.0004 a cell and offsets of 0.0008 a column
    a brightener of photon yield 0.015 was never missed; where columns also drift by 0.0007 along the emission, most of
    those of 0.02 were, of 0.04 none.

    A further term must have three times the gain of noise and explain 1 % of the luminescent part (10 % in
    amplitude): below that are the instrument's errors of shape, which are not noise, but no dye either. They lie
    where the strong dye emits. At shorter wavelengths than that a term as weak as a first one is accepted, if it
    changes the colour in daylight by 0.1 of CIEDE2000: a brightener beside a strong dye. Lobes of an excitation
    spectrum that explain less than a term does in noise are dropped.

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
    by_chance = _gain_of_noise(problem, mirror, np.ones(len(measured.cells), bool))
    gains: list[float] = []
    factors = problem.nothing()
    part = _LEAST_PART * factors.misfit
    while len(gains) < (MOST_TERMS if rank is None else rank):
        before = replace(factors, curvature=0.0)
        before = (
            problem.fit(before) if before.rank else before
        )  # what smoothness costs is no gain of another term
        grown = problem.grow(before)
        gain = _of_several(problem, before, grown)
        enough = gain > (max(_FURTHER * by_chance, part) if factors.rank else _MORE_THAN_NOISE * by_chance)
        if factors.rank and not enough:
            rows = problem.bluer_rows(factors)
            apart = problem.grow(before, rows)
            if (
                _of_several(problem, before, apart) > _MORE_THAN_NOISE * _gain_of_noise(problem, mirror, rows)
                and _colour_change(measured, before, apart) > _SEEN
            ):
                grown, enough = apart, True
        gains.append(before.misfit - grown.misfit)
        if rank is None and not enough:
            break
        factors = problem.smooth(grown, cautious=True)
    return RankChoice(problem.prune(factors, by_chance), tuple(gains), by_chance)


def _gain_of_noise(problem: Problem, mirror: Problem, rows: NDArray[np.bool_]) -> float:
    """What a term that emits in some rows, shape (M,), finds above the diagonal, for as many cells as are below."""
    within, beyond = (int(side.lit[rows].sum()) for side in (problem, mirror))
    least = float(rows.sum() + problem.cells.shape[1])  # one for each number of the term
    if not beyond:
        return least
    nothing = mirror.nothing()
    return max(least, within / beyond * (nothing.misfit - mirror.grow(nothing, rows).misfit))


def _of_several(problem: Problem, before: Factors, after: Factors) -> float:
    """By how much the misfit falls, the best excitation wavelength counted as the second best."""
    gain = np.sort(problem.misfit_of_columns(before) - problem.misfit_of_columns(after))
    return float(gain[:-1].sum() + gain[-2])


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
