"""The surfaces that the camera of a scene sees first, for denoising: their colours in three bands and their normals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.scene.lobes.lobe import METAL, PLAIN, operate
from fluorspar.scene.lobes.textures import sigmoid
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import LOBE_VARIANTS, TRACE_VARIANTS, use_variant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["seen_first"]

Array = NDArray[np.float32]


def seen_first(scene: Scene, grid: Wavelengths, computed: Wavelengths) -> tuple[Array, Array]:
    """Look at a scene with the samples of a few rays a pixel, and no light.

    Parameters
    ----------
    scene : Scene
        With the size and samples of the image.
    grid, computed : Wavelengths
        Of the image, and of the light that excites in it; see `RenderJob.computed_grid`.

    Returns
    -------
    colour, normal : ndarray of shape (Y, X, 3), float32
        What surfaces reflect of white light in each third of the grid, luminescence included, from 0 to 1; and their
        normals towards the camera. Behind mirrors and glass those of what is seen there; 0 where nothing is.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> scene = load_scene("cornell-box").with_settings(width=16, height=16)
    >>> colour, normal = seen_first(scene, Wavelengths(), Wavelengths())
    >>> colour.shape, normal.shape
    ((16, 16, 3), (16, 16, 3))
    """
    variants = TRACE_VARIANTS if scene.lobes is None else LOBE_VARIANTS
    with use_variant(variants["llvm"]):
        from fluorspar.paths.tracing.first_hits import first_hits

        return first_hits(scene, _colours(scene, grid, computed))


def _colours(scene: Scene, grid: Wavelengths, computed: Wavelengths) -> Array:
    """Colour of each row of the scene's materials, and of each texel behind them."""
    white, hidden = np.ones(len(computed)), len(computed) - len(grid)
    shown = np.array([matrix.apply(white)[hidden:] for matrix in scene.matrices(computed)])
    lobes, colours = scene.lobes, []
    for first in range(3):
        third = slice(first * len(grid) // 3, max((first + 1) * len(grid) // 3, first * len(grid) // 3 + 1))
        colours.append(shown[:, third].mean(axis=1))
        if lobes is not None and len(lobes.colours):
            operation = lobes.colours[:, 3]
            S = sigmoid(lobes.colours[:, :3], grid.values[third].mean(keepdims=True))[:, 0]
            of_texels = operate(S, np.where(operation <= METAL, PLAIN, operation))
            colours[-1] = np.concatenate([colours[-1], of_texels])
    return np.asarray(np.clip(np.stack(colours, axis=1), 0, 1), np.float32)
