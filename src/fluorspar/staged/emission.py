"""The light that each patch of a fluorescent surface receives, and what it emits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.errors import FluorsparError
from fluorspar.scene.scene import Scene
from fluorspar.scene.surfaces import ABSORBS
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.emitters.patches import (
    EmitterArray,
    decimated_patches,
    mesh_patches,
    planar_patches,
    split_patches,
)
from fluorspar.staged.equations import average_illumination, illumination, luminescence
from fluorspar.staged.imaging import Tick
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.renderers.protocol import LoadedScene, Renderer

__all__ = ["emitter_arrays", "patch_illumination", "refine"]

Array = NDArray[np.float64]
# How far above a surface a probe starts, in parts of its coordinates: what lies nearer is taken for the surface;
# single precision is off by 1e-7.
_OFFSET = 1e-5
_MOST_PATCHES = 4096
_MOST_PATHS = 1 << 22  # of one look at all patches
# Mean of sqrt(max(m, 0)) over sqrt(v), for m the mean of 8 products of two normal values of variance v / 2 less
# their means: v is the mean square of their difference.
_FLOOR = 0.17
Probe = Callable[[EmitterArray, int, int], Array]


def emitter_arrays(
    renderer: Renderer, scene: Scene, matrices: Sequence[DonaldsonMatrix], options: StagedOptions
) -> list[EmitterArray]:
    """Cut every fluorescent side of every surface into patches.

    Raises
    ------
    OptionError, SceneError
        If a surface cannot be cut so; the message names it.
    """
    arrays = []
    for number, surface in enumerate(scene.surfaces):
        for row, back in ((surface.front, False), (surface.back, True)):
            if row == ABSORBS or not matrices[row].is_fluorescent:
                continue
            try:
                mesh = renderer.mesh(scene, number)
                array = _cut(mesh.flipped() if back else mesh, options)
            except FluorsparError as err:
                name = f"'{surface.name}'"
                raise err if name in str(err) else type(err)(f"{err}\n  in:       shape {name}") from err
            arrays.append(replace(array, surface=number, back=back, row=row))
    return arrays


def _cut(mesh: TriangleMesh, options: StagedOptions) -> EmitterArray:
    if mesh.is_planar:
        return planar_patches(mesh, options.emitters)
    if options.mode == "decimated":
        return decimated_patches(mesh, options.patches)
    return mesh_patches(mesh, options.patches)


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
    tick: Tick | None = None,
) -> Array:
    """Estimate E averaged over each patch of a surface, seen by the camera or not.

    Light paths start just above random points of the patch, look down at it, and go on as a camera's would; E
    follows by Eq. 11. Point, spot and directional lights count. Points that something lies on, or that are inside a
    hollow object, do not count: no light leaves them either.

    Parameters
    ----------
    scene : LoadedScene
        With its lights, or with an emitter array in their place.
    array : EmitterArray
        The patches.
    albedo : ndarray of shape (rows, N)
    emission : ndarray of shape (emitters, N)
    groups : sequence of ndarray of int
        Bands that are wanted, the others are 0.
    samples : int
        Light paths per patch.
    glows : bool
        Whether the surface itself emits light, which is then taken out.
    tick : callable, optional
        Called after each group of bands and depth.

    Returns
    -------
    ndarray of shape (K, N)
        W m-2 sr-1 nm-1.
    """
    points, normals, patch = array.sample(samples, seed)
    light = np.zeros((len(array), albedo.shape[1]))
    offset = 2 * array.mesh.deviation + _OFFSET * float(np.abs(array.mesh.vertices).max())
    for group in groups:
        reflected = np.zeros((len(points), len(group)), dtype=np.float32)
        for sign, depth in ((1, max_depth), (-1, 1)) if glows else ((1, max_depth),):
            reflected += sign * scene.probe(
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
            if tick:
                tick()
        seen = np.isfinite(reflected).all(axis=1)
        light[:, group] = average_illumination(
            illumination(reflected[seen], albedo[array.row, group]), patch[seen], len(array)
        )
    return light


def refine(
    array: EmitterArray, matrix: DonaldsonMatrix, probe: Probe, *, tolerance: float, samples: int
) -> tuple[EmitterArray, float]:
    """Halve patches where the emission varies, until the estimated error is below the tolerance.

    The error of an array is estimated as the sum over patches of area times root mean square difference
    between the emission of the patch and of its eighths, over the emitted power; emission summed over
    wavelength. Halves would not do: they are alike in a patch with a spot of light in its middle, and so are
    the quarters of a square. The mean square is that of two independent estimates, to which noise adds
    nothing on average, and more light paths are traced while noise could decide.

    Parameters
    ----------
    array : EmitterArray
        Not a decimated one.
    probe : callable
        Function of an array, samples per patch and a stream number, that estimates E of its patches.
    tolerance : float
        The error to fall below.
    samples : int
        Light paths per eighth of a patch and estimate, to begin with.

    Returns
    -------
    array : EmitterArray
        With at most 4096 patches.
    error : float
        Its estimated error. That of component 5 is smaller, because differences that are small against the
        distance are smoothed out there.
    """
    stream = 0
    while True:
        pieces, parent = _eighths(array)
        samples = max(1, min(samples, _MOST_PATHS // len(pieces)))  # pieces become more and more
        first, second = (
            luminescence(matrix, probe(pieces, samples, stream + k)).sum(axis=1) for k in range(2)
        )
        stream += 2
        areas = pieces.areas
        power = float((areas * (first + second)).sum() / 2)
        if power <= 0:
            return array, 0.0
        one, two = (_less_patch_mean(emitted, areas, parent) for emitted in (first, second))
        by_patch = _root_mean_square(one * two, areas, parent)
        error = float(by_patch.sum()) / power
        # what the estimate would be, for noise alone, if all pieces of a patch were alike
        floor = _FLOOR * float(_root_mean_square((one - two) ** 2, areas, parent).sum()) / power
        if floor > max(error, tolerance) / 2 and 4 * samples * len(pieces) <= _MOST_PATHS:
            samples *= 4
            continue
        if error <= tolerance or len(array) >= _MOST_PATCHES:
            return array, error
        worst = by_patch >= 0.5 * by_patch.max()
        room = _MOST_PATCHES - len(array)
        if worst.sum() > room:
            worst = np.zeros(len(array), dtype=bool)
            worst[np.argsort(by_patch)[::-1][:room]] = True
        array, _ = split_patches(array, worst)


def _eighths(array: EmitterArray) -> tuple[EmitterArray, NDArray[np.int64]]:
    """Halve all patches three times; also the patch of each piece."""
    pieces, parent = array, np.arange(len(array))
    for _ in range(3):
        pieces, whole = split_patches(pieces, np.ones(len(pieces), dtype=bool))
        parent = parent[whole]
    return pieces, parent


def _root_mean_square(squares: Array, areas: Array, parent: NDArray[np.int64]) -> Array:
    """Area of each patch times the root of its mean square, 0 where noise makes that negative."""
    area = np.bincount(parent, areas)
    mean = np.bincount(parent, areas * squares) / area
    return np.asarray(area * np.sqrt(np.maximum(mean, 0.0)))


def _less_patch_mean(emitted: Array, areas: Array, parent: NDArray[np.int64]) -> Array:
    """What each piece emits beyond the mean of its patch."""
    mean = np.bincount(parent, areas * emitted) / np.bincount(parent, areas)
    return np.asarray(emitted - mean[parent])
