"""Components 5 and 6: fluorescent surfaces as arrays of emitters that light the scene."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, OptionError, message
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.scene.surfaces import NO_LIGHT
from fluorspar.staged.emission import emitter_arrays, patch_illumination, refine
from fluorspar.staged.emitters.patches import EmitterArray
from fluorspar.staged.equations import luminescence, luminescent_reflection
from fluorspar.staged.imaging import Layers, Views, seeds_of, views_of
from fluorspar.staged.intermediate import file_names
from fluorspar.staged.passes import Groups, Passes
from fluorspar.staged.renderers.protocol import EmitsPerFace, LoadedScene

__all__ = ["FluorescentObject", "fluorescent_objects", "mutual_illumination"]

Array = NDArray[np.float64]
Estimate = TypeVar("Estimate", Layers, Array)
_ADAPTIVE_STREAM = 1 << 16  # seeds of the adaptive subdivision, away from those of the repeats


@dataclass
class FluorescentObject:
    """A side of a fluorescent surface as emitters, and the scene in which they are the only lights.

    Attributes
    ----------
    name, file : str
        In messages and attributes, and in file names.
    glows : bool
        Whether the surface is also a lamp.
    per_face : bool
        Whether each face of the array is an emitter, not each patch.
    excluded : bool
        Whether the object itself is left out of that scene.
    """

    name: str
    file: str
    array: EmitterArray
    scene: LoadedScene
    glows: bool
    per_face: bool
    excluded: bool

    def radiance(self, emitted: Array) -> Array:
        """What each emitter of the scene gets for L_F of the patches, ndarray of shape (emitters, N)."""
        radiance = emitted * self.array.gain[:, np.newaxis]
        return radiance[self.array.patch_of_face] if self.per_face else radiance


def fluorescent_objects(p: Passes) -> list[FluorescentObject]:
    """Cut fluorescent surfaces into emitters, and load a scene for each."""
    arrays = emitter_arrays(p.renderer, p.scene, p.matrices, p.options)
    names = [p.scene.surfaces[array.surface].name + (" (back)" if array.back else "") for array in arrays]
    _check_excluded(p, [p.scene.surfaces[array.surface].name for array in arrays])
    renderer = p.renderer
    per_face = isinstance(renderer, EmitsPerFace)
    objects = []
    for number, (array, name, file) in enumerate(zip(arrays, names, file_names(names), strict=True)):
        glows = p.scene.surfaces[array.surface].light != NO_LIGHT
        if p.options.tolerance is not None and array.copy is None:
            with p.watch.timing("subdivision"):
                array = _subdivided(p, array, name, number, glows)
        keep_object = not p.options.excludes(p.scene.surfaces[array.surface].name)
        if isinstance(renderer, EmitsPerFace):
            loaded = renderer.load_faces(p.scene, array, keep_object=keep_object)
        else:
            loaded = renderer.load(p.scene, array, keep_object=keep_object)
        objects.append(FluorescentObject(name, file, array, loaded, glows, per_face, not keep_object))
    # each object is probed once, and then once in the light of each other; its emitters are rendered twice
    probed = len(p.exciting) * sum(1 + item.glows + 2 * (p.bounces - 1) * len(objects) for item in objects)
    rendered = 2 * len(p.emitted) * p.bounces * len(objects) * p.sampling.passes
    p.expect(p.repeats * (probed + rendered))
    return objects


def _check_excluded(p: Passes, emitting: Sequence[str]) -> None:
    """Refuse to leave out an object that emits nothing."""
    chosen = p.options.exclude_emitter_geometry
    for name in () if isinstance(chosen, bool) else chosen:
        if name not in emitting:
            raise OptionError(
                message(
                    f"'{name}' is no fluorescent shape of the scene, so its geometry cannot be left out",
                    where="exclude_emitter_geometry",
                    expected=f"one of {', '.join(dict.fromkeys(emitting)) or '(none)'}",
                    fix=did_you_mean(name, emitting),
                )
            )


def mutual_illumination(
    p: Passes, repeat: int, objects: Sequence[FluorescentObject], views: Views, spare: Sequence[int]
) -> tuple[Array, Array]:
    """Components 5 and 6: light that luminesced on other surfaces first (Eq. 10, and VIII-A).

    `spare` are two seeds.
    """
    y5 = np.zeros((*views.edge.shape, len(p.grid)))
    y6 = np.zeros_like(y5)
    samples = max(1, p.options.patch_samples // p.repeats)
    emission: list[Array] = []
    for number, item in enumerate(objects):
        with p.watch.timing("light on emitters"):
            light = _on_patches(p, p.base, item, p.lights, p.exciting, samples, spare[0] + number)
            emission.append(luminescence(p.matrices[item.array.row], light))
        if repeat == 0:
            p.kept.patches(f"L_F {item.file}", item.array, light, emission[-1])
    for bounce in range(1, p.bounces + 1):
        last = bounce == p.bounces
        renders, light_f = [], dict.fromkeys(p.fluorescent, np.zeros(()))
        for item, emitted in zip(objects, emission, strict=True):
            shown = _emitter_render(p, item, emitted, views, bounce, layers=not last)
            renders.append(shown.image)
            order = "" if bounce == 1 else f" {bounce}"
            p.kept.image(f"emitters{order} {item.file}", shown.image)
            if not last:
                light_f = {row: e + shown.light[row] for row, e in light_f.items()}
        reflected = luminescent_reflection(renders) if renders else np.zeros_like(y5)
        if bounce == 1:
            y5 = reflected
        else:
            y6 += reflected
        if not last and objects:
            y6 += p.luminesced(light_f, views)
            with p.watch.timing("light on emitters"):
                emission = _next_emission(p, objects, emission, samples, spare[1] + bounce)
    return y5, y6


def _subdivided(p: Passes, array: EmitterArray, name: str, number: int, glows: bool) -> EmitterArray:
    """Refine an array until its estimated error is below the tolerance."""

    def probe(cut: EmitterArray, samples: int, stream: int) -> Array:
        p.expect(len(p.exciting) * (1 + glows))
        return patch_illumination(
            p.base,
            cut,
            p.albedo,
            p.lights,
            p.exciting,
            samples=samples,
            max_depth=p.depth,
            seed=seeds_of(p.seed, _ADAPTIVE_STREAM + number, stream, count=1)[0],
            glows=glows,
            tick=p.tick,
        )

    tolerance = p.options.tolerance
    assert tolerance is not None
    samples = max(1, p.options.patch_samples // 16)
    cut, error = refine(array, p.matrices[array.row], probe, tolerance=tolerance, samples=samples)
    if error > tolerance:
        warnings.warn(
            f"'{name}': with {len(cut)} emitters, the most there may be, the "
            f"estimated error is {error:.3g}, above the tolerance of {tolerance:g}",
            ApproximationWarning,
            stacklevel=2,
        )
    return cut


def _on_patches(
    p: Passes,
    scene: LoadedScene,
    item: FluorescentObject,
    emission: Array,
    groups: Groups,
    samples: int,
    seed: int,
) -> Array:
    """E on the patches of an object, (K, N)."""
    return patch_illumination(
        scene,
        item.array,
        p.albedo,
        emission,
        groups,
        samples=samples,
        max_depth=p.depth,
        seed=seed,
        glows=item.glows or scene is not p.base,
        tick=p.tick,
    )


def _emitter_render(
    p: Passes, item: FluorescentObject, emitted: Array, views: Views, bounce: int, *, layers: bool
) -> Layers:
    """What the emitters of one object show in the scene, without being seen themselves."""
    radiance, depths = item.radiance(emitted), {"everything": p.depth, "itself": 1}
    p.compile(item.scene, np.abs(radiance), depths)
    with p.watch.timing(f"component {5 if bounce == 1 else 6}: {item.name}"):
        seen = Views(views.sampling, views.seeds, [{}] * len(views.seeds), views.edge)
        if layers:
            seen = views_of(item.scene, views.sampling, views.seeds, p.fluorescent)
        albedo = p.albedo if layers else p.reflectance

        def shown(positive: Array, groups: Groups) -> Layers:
            everything, itself = p.pictures(item.scene, albedo, positive, seen, groups, depths)
            return everything.without(itself)

        extra = 2 * len(views.seeds)
        return _signed(p, radiance, p.emitted, shown, extra)


def _next_emission(
    p: Passes, objects: Sequence[FluorescentObject], emission: Sequence[Array], samples: int, seed: int
) -> list[Array]:
    """What each object emits in the light of all objects' emitters."""
    new = []
    for item in objects:
        light = np.zeros((len(item.array), len(p.grid)))
        for other, emitted in zip(objects, emission, strict=True):

            def received(
                positive: Array,
                groups: Groups,
                item: FluorescentObject = item,
                other: FluorescentObject = other,
            ) -> Array:
                return _on_patches(p, other.scene, item, positive, groups, samples, seed)

            light += _signed(p, other.radiance(emitted), p.exciting, received, extra=2)
        new.append(luminescence(p.matrices[item.array.row], light))
    return new


def _signed(
    p: Passes,
    radiance: Array,
    groups: Groups,
    estimate: Callable[[Array, Groups], Estimate],
    extra: int,
) -> Estimate:
    """Estimate for the positive part of an emission, less that for the negative part of a noisy matrix.

    `extra` is the number of renders of each group that the second takes.
    """
    positive = estimate(np.maximum(radiance, 0.0), groups)
    negative = np.maximum(-radiance, 0.0)
    again = [group for group in groups if negative[:, group].any()]
    if not again:
        return positive
    p.expect(extra * len(again))
    return positive - estimate(negative, again)
