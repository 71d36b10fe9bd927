"""The numbers the sweep multiplies with: spectra of all materials and lights, laid out for SIMD."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.donaldson import DonaldsonMatrix

__all__ = ["LANES", "SpectralTables", "padded", "spectral_tables"]

LANES = 16  # bands are padded with zeros to a multiple of this many, one AVX-512 register


class SpectralTables(NamedTuple):
    """Spectra on the padded grid of B bands, float32, as flat as compiled code wants them.

    Attributes
    ----------
    bands : int
        How many of the B bands are not padding; an image of fewer holds the last of them.
    lights : ndarray of shape (lights, B)
        L.
    reflectance : ndarray of shape (rows, B)
        S.
    first, last : ndarray of shape (rows,), int64
        range of fluorophores of a row; empty for a surface that does not fluoresce.
    full : ndarray of shape (rows,), int64
        index of the row's full matrix, -1 where there is none.
    alpha, beta : ndarray of shape (fluorophores, B)
        emission spectrum, and excitation spectrum times the grid step.
    equal : float32
        Weight of excitation at the emission wavelength itself: 1/2, or 0 for `stokes="strict"`.
    matrices : ndarray of shape (full matrices, B, B)
        step times D_L, transposed (excitation, emission).
    glows : ndarray of shape (rows,), int64
        index of the row in `glow`, -1 for a surface that does not fluoresce.
    glow : ndarray of shape (fluorescent rows, lights, B)
        the luminescence of the row in the light of each lamp.
    """

    bands: int
    lights: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    full: NDArray[np.int64]
    alpha: NDArray[np.float32]
    beta: NDArray[np.float32]
    equal: np.float32
    matrices: NDArray[np.float32]
    glows: NDArray[np.int64]
    glow: NDArray[np.float32]


def padded(bands: int) -> int:
    """Number of bands after padding.

    Examples
    --------
    >>> padded(69)
    80
    """
    return -(-bands // LANES) * LANES


def spectral_tables(
    materials: Sequence[DonaldsonMatrix], lights: Sequence[NDArray[np.float64]]
) -> SpectralTables:
    """Lay out materials and lights, all on one wavelength grid, for the sweep.

    Parameters
    ----------
    materials
        The material table, at least one row.
    lights
        The light table: spectral power distributions, ndarrays of shape (N,).

    Returns
    -------
    SpectralTables
    """
    grid = materials[0].wavelengths
    bands = len(grid)
    width = padded(bands)

    def pad(values: NDArray[np.floating]) -> NDArray[np.float32]:
        out = np.zeros((*values.shape[:-1], width), dtype=np.float32)
        out[..., :bands] = values
        return out

    first, last, full, glows = [], [], [], []
    glow: list[list[NDArray[np.float64]]] = []
    alphas: list[NDArray[np.float64]] = []
    betas: list[NDArray[np.float64]] = []
    matrices: list[NDArray[np.float32]] = []
    for made in materials:
        full.append(-1)
        first.append(len(alphas))
        if made.luminescent is not None:
            if made.luminescent.any():
                full[-1] = len(matrices)
                square = np.zeros((width, width), dtype=np.float32)
                square[:bands, :bands] = grid.step * made.luminescent.T
                matrices.append(square)
        elif made.emission is not None and made.excitation is not None:
            for alpha, beta in zip(made.emission, made.excitation, strict=True):
                if alpha.any() and beta.any():
                    alphas.append(alpha)
                    betas.append(grid.step * beta)
        last.append(len(alphas))
        glows.append(len(glow) if last[-1] > first[-1] or full[-1] >= 0 else -1)
        if glows[-1] >= 0:
            glow.append([made.apply_luminescent(light) for light in lights])

    rules = {made.stokes for made in materials}
    if len(rules) > 1:
        raise ValueError("all materials of one sweep must use one Stokes rule")
    return SpectralTables(
        bands=bands,
        lights=pad(np.array(lights, dtype=np.float64).reshape(-1, bands)),
        reflectance=pad(np.array([made.reflectance for made in materials])),
        first=np.array(first, dtype=np.int64),
        last=np.array(last, dtype=np.int64),
        full=np.array(full, dtype=np.int64),
        alpha=pad(np.array(alphas).reshape(-1, bands)),
        beta=pad(np.array(betas).reshape(-1, bands)),
        equal=np.float32(0.0 if rules == {"strict"} else 0.5),
        matrices=np.array(matrices, dtype=np.float32).reshape(-1, width, width),
        glows=np.array(glows, dtype=np.int64),
        glow=pad(np.array(glow).reshape(len(glow), len(lights), bands)),
    )
