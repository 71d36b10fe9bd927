"""The light that each patch of a fluorescent surface receives, and what it emits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.scene.scene import Scene
from fluorspar.scene.surfaces import ABSORBS
from fluorspar.spectral.donaldson import DonaldsonMatrix
from fluorspar.staged.equations import average_illumination, illumination, luminescence
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.patches import (
    EmitterArray,
    decimated_patches,
    mesh_patches,
    planar_patches,
    split_patches,
)
from fluorspar.staged.protocol import LoadedScene, Renderer

__all__ = ["emitter_arrays", "patch_illumination", "refine"]

Array = NDArray[np.float64]
# How far above a surface a probe starts, in parts of its coordinates: what lies nearer is taken for the surface;
# single precision is off by 1e-7.
_OFFSET = 1e-5
_MOST_PATCHES = 4096
Probe = Callable[[EmitterArray, int, int], Array]


def emitter_arrays(
    renderer: Renderer, scene: Scene, matrices: Sequence[DonaldsonMatrix], options: StagedOptions
) -> list[EmitterArray]:
    """Cut every fluorescent side of every surface into patches."""
    arrays = []
    for number, surface in enumerate(scene.surfaces):
        for row, back in ((surface.front, False), (surface.back, True)):
            if row == ABSORBS or not matrices[row].is_fluorescent:
                continue
            mesh = renderer.mesh(scene, number)
            mesh = mesh.flipped() if back else mesh
            if mesh.is_planar:
                array = planar_patches(mesh, options.emitters)
            elif options.mode == "decimated":
                array = decimated_patches(mesh, options.patches)
            else:
                array = mesh_patches(mesh, options.patches)
            arrays.append(replace(array, surface=number, back=back, row=row))
    return arrays


def patch_illumination(
    scene: LoadedScene,
    array: EmitterArray,
    albedo: Array,
    emission: Array,
    groups: Sequence[NDArray[np.int64]],
    *,
    samples: int,
    max_depth: int,
    seed: int,
    glows: bool,
) -> Array:
    """Estimate E averaged over each patch of a surface, seen by the camera or not.

    Light paths start just above random points of the patch, look down at it, and go on as a camera's would; E
    follows by Eq. 11. Point, spot and directional lights count. Points that something lies on do not count: no
    light leaves them either.

    Parameters
    ----------
    scene
        With its lights, or with an emitter array in their place.
    array
        The patches.
    albedo : ndarray of shape (rows, N)
    emission : ndarray of shape (emitters, N)
    groups
        Bands that are wanted, the others are 0.
    samples
        Light paths per patch.
    glows
        Whether the surface itself emits light, which is then taken out.

    Returns
    -------
    ndarray of shape (K, N)
        W m-2 sr-1 nm-1.
    """
    points, normals, patch = array.sample(samples, seed)
    light = np.zeros((len(array), albedo.shape[1]))
    offset = 2 * array.mesh.deviation + _OFFSET * float(np.abs(array.mesh.vertices).max())
    for group in groups:
        shown, own = (
            scene.probe(
                points,
                normals,
                albedo[:, group],
                emission[:, group],
                surface=array.surface,
                back=array.back,
                offset=offset,
                max_depth=depth,
                seed=seed,
            )
            if depth == max_depth or glows
            else np.zeros((len(points), len(group)), dtype=np.float32)
            for depth in (max_depth, 1)
        )
        reflected = shown - own
        seen = np.isfinite(reflected).all(axis=1)
        light[:, group] = average_illumination(
            illumination(reflected[seen], albedo[array.row, group]), patch[seen], len(array)
        )
    return light


def refine(
    array: EmitterArray, matrix: DonaldsonMatrix, probe: Probe, *, tolerance: float, samples: int
) -> tuple[EmitterArray, float]:
    """Halve patches where the emission varies, until the estimated error is below the tolerance.

    The error of an array is estimated as the share of the emitted power that is in the wrong half of its
    patch: sum over halves of area times |L_half - L_patch|, over the emitted power, L summed over wavelength.
    What sampling noise adds to that difference is taken out, by its mean square from two independent
    estimates. It is an upper bound of the error of component 5, which smooths out differences that are small
    against the distance.

    Parameters
    ----------
    array
        Not a decimated one.
    probe
        Function of an array, samples per patch and a stream number, that estimates E of its patches.
    tolerance
        The share to fall below.
    samples
        Light paths per patch and estimate.

    Returns
    -------
    array : EmitterArray
        With at most 4096 patches.
    error : float
        Its estimated error.
    """
    stream = 0
    while True:
        halves, parent = split_patches(array, np.ones(len(array), dtype=bool))
        first, second = (
            luminescence(matrix, probe(halves, samples, stream + k)).sum(axis=1) for k in range(2)
        )
        stream += 2
        areas = halves.areas
        power = areas * (first + second) / 2
        if power.sum() <= 0:
            return array, 0.0
        whole = np.bincount(parent, areas, minlength=len(array))

        first, second = (
            emitted - (np.bincount(parent, areas * emitted) / whole)[parent] for emitted in (first, second)
        )
        # The product of two independent estimates of the difference has no bias from noise.
        square = first * second
        by_patch = np.bincount(parent, areas * np.sqrt(np.maximum(square, 0.0)), minlength=len(array))
        error = float(by_patch.sum() / power.sum())
        if error <= tolerance or len(array) >= _MOST_PATCHES:
            return array, error
        worst = by_patch >= 0.5 * by_patch.max()
        room = _MOST_PATCHES - len(array)
        if worst.sum() > room:
            worst = np.zeros(len(array), dtype=bool)
            worst[np.argsort(by_patch)[::-1][:room]] = True
        array, _ = split_patches(array, worst)
