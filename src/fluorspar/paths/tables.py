"""The numbers the sweep multiplies with: spectra of all materials and lights, laid out for SIMD."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fluorspar.spectral.conversions import stokes_weights
from fluorspar.spectral.donaldson import DonaldsonMatrix, Stokes

__all__ = ["BLOCK", "LANES", "SpectralTables", "padded", "spectral_tables"]

LANES = 16  # bands are padded with zeros to a multiple of this many, one AVX-512 register
BLOCK = 8  # the running sum of the Stokes limit goes in steps of this many bands, one AVX register


class SpectralTables(NamedTuple):
    """Spectra on the padded grid of B bands, float32, as flat as compiled code wants them.

    Attributes
    ----------
    lights
        (lights, B): L.
    reflectance
        (rows, B): S.
    first, last
        (rows,) int64: range of fluorophores of a row; empty for a surface that does not fluoresce.
    full
        (rows,) int64: index of the row's full matrix, -1 where there is none.
    alpha, beta
        (fluorophores, B): emission spectrum, and excitation spectrum times the grid step.
    beta_below
        beta in the blocks below the overlap of the two spectra, 0 elsewhere.
    alpha_above
        alpha in the blocks above the overlap, 0 elsewhere.
    overlap
        (fluorophores, 2) int64: the blocks [lo, hi) of `BLOCK` bands in which light may be both absorbed and
        emitted, so that the Stokes limit needs a running sum.
    triangle
        (fluorophores, B / BLOCK, BLOCK, BLOCK): step times alpha beta within each block with the Stokes limit
        applied, transposed (excitation, emission).
    matrices
        (full matrices, B, B): step times D_L, transposed (excitation, emission).
    """

    lights: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    full: NDArray[np.int64]
    alpha: NDArray[np.float32]
    beta: NDArray[np.float32]
    beta_below: NDArray[np.float32]
    alpha_above: NDArray[np.float32]
    overlap: NDArray[np.int64]
    triangle: NDArray[np.float32]
    matrices: NDArray[np.float32]


def padded(bands: int) -> int:
    """Number of bands after padding.

    Examples
    --------
    >>> padded(69)
    80
    """
    return -(-bands // LANES) * LANES


def spectral_tables(materials: Sequence[DonaldsonMatrix], lights: Sequence[NDArray[np.float64]]) -> SpectralTables:
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

    first, last, full = [], [], []
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

    alpha, beta = (pad(np.array(rows).reshape(-1, bands)) for rows in (alphas, betas))
    overlap = np.array([_overlap(a, b) for a, b in zip(alpha, beta, strict=True)], dtype=np.int64).reshape(-1, 2)
    block = np.arange(width) // BLOCK
    blocks = (len(alpha), width // BLOCK, BLOCK)
    within = stokes_weights(BLOCK, _one_rule(materials)).T
    triangle = within * beta.reshape(blocks)[..., np.newaxis] * alpha.reshape(blocks)[..., np.newaxis, :]
    return SpectralTables(
        lights=pad(np.array(lights, dtype=np.float64).reshape(-1, bands)),
        reflectance=pad(np.array([made.reflectance for made in materials])),
        first=np.array(first, dtype=np.int64),
        last=np.array(last, dtype=np.int64),
        full=np.array(full, dtype=np.int64),
        alpha=alpha,
        beta=beta,
        beta_below=np.where(block < overlap[:, :1], beta, np.float32(0)),
        alpha_above=np.where(block >= overlap[:, 1:], alpha, np.float32(0)),
        overlap=overlap,
        triangle=triangle.astype(np.float32),
        matrices=np.array(matrices, dtype=np.float32).reshape(-1, width, width),
    )


def _one_rule(materials: Sequence[DonaldsonMatrix]) -> Stokes:
    """The Stokes rule that all materials share."""
    rules = {made.stokes for made in materials}
    if len(rules) > 1:
        raise ValueError("all materials of one sweep must use one Stokes rule")
    return rules.pop()


def _overlap(alpha: NDArray[np.float32], beta: NDArray[np.float32]) -> tuple[int, int]:
    """Blocks [lo, hi) from the first emission to the last excitation; lo = hi where they do not overlap."""
    lo = int(np.flatnonzero(alpha)[0]) // BLOCK
    hi = int(np.flatnonzero(beta)[-1]) // BLOCK + 1
    return lo, max(lo, hi)
