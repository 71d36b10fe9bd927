"""What the camera sees first: colours and normals of surfaces, without light, which tell a denoiser where edges are.

A pass of its own, of a few samples spread over each pixel: the tracers record nothing more than light paths need. A
pixel that shows an edge or a texture gets more of them.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.log import END
from fluorspar.paths.tracing.lobe_scene import build_lobe_scene
from fluorspar.paths.tracing.lobe_tracer import LobeTracer
from fluorspar.paths.tracing.trace_scene import build_trace_scene
from fluorspar.paths.tracing.tracer import Tracer, camera_ray
from fluorspar.scene.scene import Scene

__all__ = ["first_hits"]

Array = NDArray[np.float32]

_FIRST = 16  # samples of a pixel
_LATER, _MOST = 4, 256  # of one with an edge: 4 for each sample of the image, 256 at most
_SPREAD = 0.05  # of colours and normals within a pixel, from which it has an edge
_PIXELS = 1 << 18  # at a time
_NUMBERS = 8  # of a pixel, see `_look`
_MIRRORS = 6  # smooth surfaces that are looked through


def first_hits(scene: Scene, colours: Array) -> tuple[Array, Array]:
    """Look at a scene, in the variant that is set: `LOBE_VARIANTS` for one with lobes, else `TRACE_VARIANTS`.

    Parameters
    ----------
    scene : Scene
        With the size and the samples of the image.
    colours : ndarray of shape (rows, 3)
        Three numbers for each row of its materials or, behind them, texels.

    Returns
    -------
    colour, normal : ndarray of shape (Y, X, 3)
        Means over the pixel, 0 where nothing is seen: colours, each times how much is reflected, behind mirrors and
        glass those of what is seen there; and normals in the frame of the scene, towards the camera.
    """
    samples = min(max(_LATER * scene.settings.spp, 2 * _FIRST), _MOST)
    settings = scene.with_settings(spp=samples).settings
    survival = np.ones(len(colours), np.float32)
    tracer: Tracer
    if scene.lobes is None:
        tracer = Tracer(build_trace_scene(scene), settings, survival, 0)
    else:
        tracer = LobeTracer(build_lobe_scene(scene), settings, survival, 0)
    table = mi.Float(np.asarray(colours, np.float32).ravel())
    seen = np.empty((settings.width * settings.height, _NUMBERS), np.float32)
    for first in range(0, len(seen), _PIXELS):
        some = seen[first : first + _PIXELS]
        some[:] = _look(tracer, table, np.arange(first, first + len(some)), 0, _FIRST)
        mean = some[:, :6] / np.maximum(some[:, 7:], 1)
        edges = np.flatnonzero(
            some[:, 6] / np.maximum(some[:, 7], 1) - np.square(mean).sum(axis=1) > _SPREAD**2
        )
        if len(edges):
            some[edges] += _look(tracer, table, first + edges, _FIRST, samples)
    means = seen[:, :6] / np.maximum(seen[:, 7:], 1)
    colour, normal = (np.ascontiguousarray(each, np.float32) for each in np.split(means, 2, axis=1))
    shape = (settings.height, settings.width, 3)
    return colour.reshape(shape), normal.reshape(shape)


def _look(tracer: Tracer, table: Any, pixels: NDArray[np.integer], start: int, stop: int) -> Array:
    """Sums over samples of some pixels: colours, normals, the squares of both, and how many count."""
    # Numbers written into the kernel would mean a new one for each.
    from_sample, to_sample = (dr.opaque(mi.UInt32, number) for number in (start, stop))
    sums = _sums(tracer, table, mi.UInt32(pixels.astype(np.uint32)), from_sample, to_sample)
    return np.stack([value.numpy() for value in sums], axis=1)


@dr.syntax
def _sums(tracer: Tracer, table: Any, pixel: Any, sample: Any, stop: Any) -> tuple[Any, ...]:
    zero = dr.zeros(mi.Float, dr.width(pixel))
    colour, normal, squares, count = mi.Vector3f(zero), mi.Vector3f(zero), mi.Float(zero), mi.Float(zero)
    sample = mi.UInt32(sample)
    while sample < stop:
        ray = camera_ray(tracer, pixel, sample)
        counts = mi.Bool(True)
        if dr.hint(isinstance(tracer, LobeTracer), mode="scalar"):
            shown, facing, counts = _through_mirrors(tracer, table, ray, pixel, sample)
        else:
            shown, facing = _seen(tracer, table, ray)
        colour += dr.select(counts, shown, 0.0)
        normal += dr.select(counts, facing, 0.0)
        squares += dr.select(counts, dr.squared_norm(shown) + dr.squared_norm(facing), 0.0)
        count += dr.select(counts, mi.Float(1), 0.0)
        sample += 1
    sums = (*colour, *normal, squares, count)
    dr.eval(sums)
    return sums


def _seen(tracer: Tracer, table: Any, ray: Any) -> tuple[Any, Any]:
    hit = tracer.scene.mitsuba_scene.ray_intersect_preliminary(ray, coherent=True)
    si = hit.compute_surface_interaction(ray, mi.RayFlags.Minimal | mi.RayFlags.ShadingFrame)
    row = tracer.row_of(si)
    active = si.is_valid() & (row != END)
    return dr.gather(mi.Vector3f, table, row, active), dr.select(active, _normal(si), 0.0)


def _normal(si: Any) -> Any:
    return mi.Vector3f(si.sh_frame.n) * dr.sign(si.wi.z)


@dr.syntax
def _through_mirrors(
    tracer: LobeTracer, table: Any, ray: Any, pixel: Any, sample: Any
) -> tuple[Any, Any, Any]:
    """Follow each ray to the first surface that is not smooth; what a smooth coat reflects does not count."""
    scene = tracer.scene.mitsuba_scene
    context = mi.BSDFContext()
    o, d = mi.Point3f(ray.o), mi.Vector3f(ray.d)
    colour, normal, number = mi.Vector3f(1), mi.Vector3f(0), mi.UInt32(0)
    active, counts = mi.Bool(True), mi.Bool(True)
    while active:
        ray = mi.Ray3f(o, d)
        si = scene.ray_intersect(ray)
        hit = si.is_valid()
        along = mi.Vector3f(0, 0, 1)
        numbers = tracer.numbers.at(pixel, sample, 2 * number + 1)
        bsdf = si.bsdf(ray)
        value, _, bs, weight = bsdf.eval_pdf_sample(context, si, along, numbers.one(0), numbers.two(0), hit)
        shown = mi.Vector3f(0)
        terms = tracer.terms_of(si, value, weight, along, bs, tracer.pick(numbers), hit)
        for row, _, sent in terms:
            shown += sent * dr.gather(mi.Vector3f, table, tracer.texel_of(row), hit)
        colour *= shown
        normal = dr.select(hit, _normal(si), 0.0)
        number += 1
        smooth = hit & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        coated = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        counts &= ~(smooth & coated)
        active = smooth & ~coated & (number < _MIRRORS)
        spawned = si.spawn_ray(si.to_world(bs.wo))
        o, d = mi.Point3f(spawned.o), mi.Vector3f(spawned.d)
    return colour, normal, counts
