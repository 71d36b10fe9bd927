"""Trace light paths with Mitsuba: geometry and visibility, no spectra.

For matte surfaces directions are sampled from the cosine, whatever the wavelength, so one traced path serves
all bands. The loop carries as little as it can (ray, depth, one throughput, the last vertex and pdf): a loop
that carries a whole surface interaction costs twice the time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.light_paths import KILLED, SLOTS, TILE, LightPaths, Segment
from fluorspar.paths.tracing.trace_scene import NO_ROW, TraceScene
from fluorspar.scene.settings import UNLIMITED, Settings

__all__ = ["Tracer"]

# Roulette survives with the throughput of the brightest band, within these bounds. The lower one keeps
# paths unbiased if the spectra are changed after tracing.
_SURVIVAL = (0.05, 0.95)


@dataclass
class _Started:
    """A chunk whose first kernel was launched and may still be running."""

    first_pixel: int
    pixels: int
    chunk: int
    buffers: dict[str, Any]
    state: dict[str, Any]


class Tracer:
    """Traces one chunk of pixels after another; the variant of `scene` must be set.

    Parameters
    ----------
    scene
        Geometry with lights of unit spectrum.
    settings
        Size, samples and depths.
    survival
        (rows,) float: for each material row the throughput of a reflection, for Russian roulette.
    seed
        Same seed, same paths, bit for bit, whatever the number of threads.
    """

    def __init__(
        self, scene: TraceScene, settings: Settings, survival: NDArray[np.floating], seed: int
    ) -> None:
        self.scene = scene
        self.settings = settings
        self.seed = seed
        self.first_row_of_shape = mi.UInt32(scene.first_row_of_shape)
        self.rows_per_primitive = mi.UInt32(scene.rows_per_primitive)
        self.rows = mi.UInt32(scene.rows)
        self.light_of_emitter = mi.UInt32(scene.light_of_emitter)
        self.one_light = len(scene.light_of_emitter) == 0 or len(scene.mitsuba_scene.emitters()) == 1
        self.survival = mi.Float(np.asarray(survival, dtype=np.float32))

    def start(self, chunk: int, first_pixel: int, pixels: int) -> _Started:
        """Launch the tracing of `pixels` pixels from `first_pixel` on, without waiting for it."""
        spp, width, height = self.settings.spp, self.settings.width, self.settings.height
        count = pixels * spp
        sampler = self.scene.sampler.clone()
        sampler.set_samples_per_wavefront(spp)
        sampler.seed(self._seed(chunk, 0), count)

        path = dr.arange(mi.UInt32, count)
        # Opaque, here and for seeds: a number written into the kernel would mean a new kernel for each chunk.
        pixel = path // spp + dr.opaque(mi.UInt32, first_pixel)
        corner = mi.Point2f(pixel % width, pixel // width)
        film = (corner + sampler.next_2d()) * mi.ScalarVector2f(1 / width, 1 / height)
        time = sampler.next_1d() if self.scene.sensor.shutter_open_time() > 0 else mi.Float(0)
        aperture = sampler.next_2d() if self.scene.sensor.needs_aperture_sample() else mi.Point2f(0.5)
        ray, _ = self.scene.sensor.sample_ray(time, mi.Float(0), film, aperture)
        state = {
            "o": mi.Point3f(ray.o),
            "d": mi.Vector3f(ray.d),
            "previous": mi.Point3f(0),
            "pdf": mi.Float(0),
            "throughput": mi.Float(1),
            "depth": mi.UInt32(0),
        }
        if self.scene.sampler.class_name() != "IndependentSampler":
            # The user's sampler spreads the rays of a pixel. Beyond, its dimensions may be correlated along a path,
            # which biases long paths (ldsampler: by up to 0.8 %) and spoils the standard error.
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(self._seed(chunk, -1), count)
        return _Started(first_pixel, pixels, chunk, *self._launch(path, sampler, state, count))

    def finish(self, started: _Started) -> LightPaths:
        """Wait for a chunk, follow the paths that did not end within their slots, and return them all."""
        segments = []
        buffers, state = started.buffers, started.state
        while True:
            going_on = dr.compress(mi.Bool(buffers["going_on"]))
            n = len(going_on)
            child = np.full(len(buffers["length"]), -1, dtype=np.int32)
            if n:
                child[going_on.numpy()] = np.arange(n, dtype=np.int32)
            segments.append(_segment(buffers, child))
            if n == 0:
                break
            state = {name: dr.gather(type(values), values, going_on) for name, values in state.items()}
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(self._seed(started.chunk, len(segments)), n)
            buffers, state = self._launch(dr.arange(mi.UInt32, n), sampler, state, n)
        return LightPaths(
            started.first_pixel, started.pixels, self.settings.spp, self.settings.rr_depth, tuple(segments)
        )

    def _seed(self, chunk: int, segment: int) -> Any:
        return dr.opaque(
            mi.UInt32, int(np.random.SeedSequence((self.seed, chunk, segment + 1)).generate_state(1)[0])
        )

    def _launch(
        self, path: Any, sampler: Any, state: dict[str, Any], count: int
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Allocate the records of one segment and launch the kernel that fills them."""
        slots = -(-count // TILE) * TILE * SLOTS
        lights = 1 if self.one_light else slots
        buffers = {
            "row": dr.empty(mi.UInt32, slots),
            "direct": dr.empty(mi.Float, slots),
            "direct_light": dr.empty(mi.UInt32, lights),
            "sampled": dr.empty(mi.Float, slots),
            "sampled_light": dr.empty(mi.UInt32, lights),
            "survival": dr.empty(mi.Float, slots),
        }
        left = {name: dr.empty(type(values), count) for name, values in state.items()}
        length, going_on = _trace(self, path, sampler, buffers, left, **state)
        buffers["length"], buffers["going_on"] = mi.UInt8(length), going_on
        dr.eval(buffers, left)
        return buffers, left


@dr.syntax
def _trace(
    tracer: Tracer,
    path: Any,
    sampler: Any,
    buffers: dict[str, Any],
    left: dict[str, Any],
    o: Any,
    d: Any,
    previous: Any,
    pdf: Any,
    throughput: Any,
    depth: Any,
) -> tuple[Any, Any]:
    """Follow each path through up to `SLOTS` vertices and record them.

    Returns the number of vertices recorded for each path and whether it goes on; where it does, its state
    is put into `left`.
    """
    scene = tracer.scene.mitsuba_scene
    max_depth, rr_depth = tracer.settings.max_depth, tracer.settings.rr_depth
    slot = (path // TILE) * (TILE * SLOTS) + path % TILE
    length = mi.UInt32(0)
    active = mi.Bool(True)

    while active & (length < SLOTS):
        ray = mi.Ray3f(o, d)
        hit = scene.ray_intersect_preliminary(ray, coherent=depth == 0, active=active)
        si = hit.compute_surface_interaction(ray, mi.RayFlags.Minimal | mi.RayFlags.ShadingFrame, active)

        # Light that the sampled direction has reached; it belongs to the vertex before.
        emitter = si.emitter(scene)
        seen = active & (emitter != None)  # noqa: E711 (a comparison of each lane)
        origin = dr.zeros(mi.Interaction3f)
        origin.p = previous
        ds = mi.DirectionSample3f(scene, si, origin)
        pdf_direct = scene.pdf_emitter_direction(origin, ds, seen & (depth > 0))
        weight = dr.select(depth == 0, 1.0, _mis(pdf, pdf_direct))
        sampled = dr.select(seen, emitter.eval(si, seen)[0] * weight, 0.0)
        dr.scatter(buffers["sampled"], sampled, slot, active)
        if dr.hint(not tracer.one_light, mode="scalar"):
            light = dr.gather(
                mi.UInt32, tracer.light_of_emitter, dr.reinterpret_array(mi.UInt32, emitter), seen
            )
            dr.scatter(buffers["sampled_light"], light, slot, active)

        # The vertex: which material, and direct light by next-event estimation.
        side = dr.select(si.wi.z > 0, mi.UInt32(0), mi.UInt32(1))
        active &= si.is_valid()
        shape = dr.reinterpret_array(mi.UInt32, si.shape)
        first = dr.gather(mi.UInt32, tracer.first_row_of_shape, shape, active)
        own = dr.gather(mi.UInt32, tracer.rows_per_primitive, shape, active)
        row = dr.gather(mi.UInt32, tracer.rows, first + own * si.prim_index + side, active)
        active &= row != NO_ROW
        if dr.hint(max_depth != UNLIMITED, mode="scalar"):
            active &= depth + 1 < max_depth
        ds, emitted = scene.sample_emitter_direction(si, sampler.next_2d(active), True, active)
        cosine = dr.maximum(dr.dot(si.sh_frame.n, ds.d) * dr.sign(si.wi.z), 0.0)
        pdf_sampled = cosine * dr.inv_pi
        weight = dr.select(ds.delta, 1.0, _mis(ds.pdf, pdf_sampled))
        direct = dr.select(ds.pdf > 0, emitted[0] * pdf_sampled * weight, 0.0)
        dr.scatter(buffers["row"], row, slot, active)
        dr.scatter(buffers["direct"], direct, slot, active)
        if dr.hint(not tracer.one_light, mode="scalar"):
            light = dr.gather(
                mi.UInt32,
                tracer.light_of_emitter,
                dr.reinterpret_array(mi.UInt32, ds.emitter),
                active & (ds.pdf > 0),
            )
            dr.scatter(buffers["direct_light"], light, slot, active)

        # The next direction, from the cosine; roulette decides before the ray is traced.
        wo = mi.warp.square_to_cosine_hemisphere(sampler.next_2d(active))
        pdf = wo.z * dr.inv_pi
        wo.z = dr.mulsign(wo.z, si.wi.z)
        throughput *= dr.gather(mi.Float, tracer.survival, row, active)
        roulette = depth + 1 >= rr_depth
        chance = dr.clip(throughput, *_SURVIVAL)
        survives = ~roulette | (sampler.next_1d(active) < chance)
        gain = dr.rcp(chance)
        dr.scatter(buffers["survival"], dr.select(survives, gain, KILLED), slot, active & roulette)
        throughput = dr.select(roulette, throughput * gain, throughput)
        spawned = si.spawn_ray(si.to_world(wo))
        o = mi.Point3f(spawned.o)
        d = mi.Vector3f(spawned.d)
        previous = mi.Point3f(si.p)

        slot += TILE
        length = dr.select(active, length + 1, length)
        depth = dr.select(active, depth + 1, depth)
        active &= survives

    for name, values in (
        ("o", o),
        ("d", d),
        ("previous", previous),
        ("pdf", pdf),
        ("throughput", throughput),
        ("depth", depth),
    ):
        dr.scatter(left[name], values, path, active)
    return length, active


def _mis(pdf: Any, other: Any) -> Any:
    """Weight of a light found with density `pdf` that the other technique finds with `other` (power heuristic)."""
    return dr.select(pdf > 0, dr.rcp(1 + dr.square(other / pdf)), 0.0)


def _segment(buffers: dict[str, Any], child: NDArray[np.int32]) -> Segment:
    """See the records as numpy arrays; copied only where they are on a GPU."""
    views = {name: values.numpy() for name, values in buffers.items() if name != "going_on"}
    for name in ("row", "direct", "sampled", "survival", "direct_light", "sampled_light"):
        shape = (-1, SLOTS, TILE) if len(views[name]) > 1 else (1, 1, 1)
        views[name] = views[name].reshape(shape)
    return Segment(child=child, **views)
