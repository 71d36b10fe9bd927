"""A fluorescent base under a clear coat, which sends a part of the light back to it.

Light comes through the coat, the base answers with D, the coat reflects the share r of that back, the base answers
again, and so on: in all D (1 + r D + r^2 D^2 + ...) = D (1 - r D)^-1. With D = S + L, L the luminescence, and
A = 1 / (1 - r S), what never luminesced is S A, what luminesced once A L A, and the rest more often.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluorspar.bispectral.donaldson import DonaldsonMatrix

__all__ = ["under_a_coat"]


def under_a_coat(base: DonaldsonMatrix, r: float) -> tuple[DonaldsonMatrix, DonaldsonMatrix]:
    """Return how a base answers under a coat: light that luminesced up to once, and light that did so more often.

    Parameters
    ----------
    base : DonaldsonMatrix
        D of the base by itself, N wavelengths.
    r : float
        Share of the light from the base that the coat reflects back to it, 0 to 1.

    Returns
    -------
    once : DonaldsonMatrix
        S A, and A L A.
    more : DonaldsonMatrix
        The rest of D (1 - r D)^-1; its `reflectance` is the diagonal and reflects nothing.

    Notes
    -----
    With one fluorophore L is alpha_i beta_j below the diagonal, and so is all of it: with S' = S + h alpha beta / 2 and
    A' = 1 / (1 - r S'), the entry below the diagonal is h alpha'_i beta'_j, with alpha' = alpha A' P,
    beta'_j = beta_j A'_j / P_{j+1}, P_0 = 1, P_{i+1} = P_i (1 + r h alpha_i beta_i A'_i).

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> base = DonaldsonMatrix(Wavelengths(400, 420, 10), np.full(3, 0.5), [[0, 0.2, 0.4]], [[0.05, 0.02, 0]])
    >>> once, more = under_a_coat(base, 0.6)
    >>> D = base.band()
    >>> bool(np.allclose(once.band() + more.band(), D @ np.linalg.inv(np.eye(3) - 0.6 * D)))
    True
    """
    S, h = base.reflectance, base.wavelengths.step
    A = 1 / (1 - r * S)
    if base.luminescent is not None or len(base.emission) > 1:
        D = base.band()
        L = D - np.diag(S)
        total = np.linalg.solve((np.eye(len(S)) - r * D).T, D.T).T
        first = A[:, np.newaxis] * L * A
        once = DonaldsonMatrix(base.wavelengths, S * A, luminescent=first / h, stokes=base.stokes)
        rest = total - np.diag(S * A) - first
        return once, DonaldsonMatrix(
            base.wavelengths,
            np.diag(rest),
            luminescent=(rest - np.diag(np.diag(rest))) / h,
            stokes=base.stokes,
        )
    if not len(base.emission):
        nothing = replace(base, reflectance=np.zeros_like(S))
        return replace(base, reflectance=S * A), nothing
    alpha, beta = base.emission[0], base.excitation[0]
    own = 0.5 if base.stokes == "half" else 0.0
    once = replace(base, reflectance=S * A, emission=alpha * A[np.newaxis], excitation=beta * A[np.newaxis])
    at_once = S + own * h * alpha * beta
    A_all = 1 / (1 - r * at_once)
    P = np.cumprod(np.concatenate([[1.0], 1 + r * h * alpha * beta * A_all]))
    alpha_all, beta_all = alpha * A_all * P[:-1], beta * A_all / P[1:]
    diagonal = at_once * A_all - S * A - own * h * alpha * beta * A**2
    emission = np.stack([alpha_all, -alpha * A])
    excitation = np.stack([beta_all, beta * A])
    in_factors = own * h * (emission * excitation).sum(axis=0)
    more = DonaldsonMatrix(base.wavelengths, diagonal - in_factors, emission, excitation, stokes=base.stokes)
    return once, more
