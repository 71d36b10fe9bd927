"""Trace light paths with Mitsuba: geometry and visibility, no spectra.

For matte surfaces directions are sampled from the cosine, whatever the wavelength, so one traced path serves
all bands. In the turn in which a path ends, its lane starts the next sample, so that lanes do not wait for the longest
path among them. The loop carries as little as it can (ray, depth, one throughput, the last vertex and pdf): a loop
that carries a whole surface interaction costs twice the time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.log import BLOCK, END, ENTRIES, OF_TERMS, SURVIVAL, Chunk, Log, lanes_per_pixel
from fluorspar.paths.tracing.light_choice import light_choice
from fluorspar.paths.tracing.numbers import PathNumbers
from fluorspar.scene.settings import UNLIMITED, Settings

__all__ = ["Tracer", "camera_ray", "mis"]

# Entries that a strip has room for, a sample: at first, and at the most, which bounds memory. In between it follows
# what the chunk before has needed.
_ROOM, _MOST_ROOM = 10.0, 16.0


@dataclass
class _Launch:
    """Lanes of which each has a strip of `height` entries; they may still be running."""

    lanes: int
    height: int
    log: dict[str, Any]
    used: Any
    state: dict[str, Any]


@dataclass
class Started:
    """A chunk whose tracing has begun."""

    first_pixel: int
    pixels: int
    launch: _Launch


class Tracer:
    """Traces one chunk of pixels after another; the variant of `scene` must be set.

    Parameters
    ----------
    scene : TraceScene, or what a derived class reads
        Geometry with lights of unit spectrum.
    settings : Settings
        Size, samples and depths.
    survival : ndarray of shape (rows,)
        For each material row the throughput of a reflection, for Russian roulette.
    seed : int
        Same seed, same paths, bit for bit, whatever the number of threads.
    power : ndarray of shape (lights,), optional
        For each light row the mean of its spectrum, to choose among many lights; default: all alike.
    """

    def __init__(
        self,
        scene: Any,
        settings: Settings,
        survival: NDArray[np.floating],
        seed: int,
        power: NDArray[np.floating] | None = None,
    ) -> None:
        self.scene: Any = scene
        self.settings = settings
        self.terms = 1
        self.on_gpu = False  # whether entries of the log stay in the memory of the GPU, flat
        self.light_of_emitter = mi.UInt32(scene.light_of_emitter)
        self.one_light = len(scene.light_of_emitter) == 0 or len(scene.mitsuba_scene.emitters()) == 1
        self.survival = mi.Float(np.asarray(survival, dtype=np.float32))
        self._longest_lane = -(-settings.spp // lanes_per_pixel(settings.spp))  # in samples
        self._room = _ROOM
        self.numbers = PathNumbers(settings, seed)
        self.read_scene(scene)
        self.lights = light_choice(scene.mitsuba_scene, self._of_emitters(power))

    def read_scene(self, scene: Any) -> None:
        """Give the tables of the scene to Dr.Jit."""
        self.first_row_of_shape = mi.UInt32(scene.first_row_of_shape)
        self.rows_per_primitive = mi.UInt32(scene.rows_per_primitive)
        self.rows = mi.UInt32(scene.rows)

    def row_of(self, si: Any) -> Any:
        """The material row of a surface that was hit; see `TraceScene`."""
        side = dr.select(si.wi.z > 0, mi.UInt32(0), mi.UInt32(1))
        hit, shape = si.is_valid(), dr.reinterpret_array(mi.UInt32, si.shape)
        first = dr.gather(mi.UInt32, self.first_row_of_shape, shape, hit)
        own = dr.gather(mi.UInt32, self.rows_per_primitive, shape, hit)
        return dr.gather(mi.UInt32, self.rows, first + own * si.prim_index + side, hit)

    def _of_emitters(self, power: NDArray[np.floating] | None) -> NDArray[np.floating]:
        """The power of each emitter of the built scene."""
        emitters = self.scene.mitsuba_scene.emitters_dr()
        if power is None or dr.width(emitters) == 0:
            return np.ones(dr.width(emitters))
        pointers = dr.reinterpret_array(mi.UInt32, emitters).numpy()
        return np.asarray(power[self.scene.light_of_emitter[pointers]])

    def start(self, first_pixel: int, pixels: int) -> Started:
        """Launch the tracing of a chunk, `pixels` pixels from `first_pixel` on, without waiting for it."""
        lane = dr.arange(mi.UInt32, pixels * lanes_per_pixel(self.settings.spp))
        spp, parts = (
            dr.opaque(mi.UInt32, n) for n in (self.settings.spp, lanes_per_pixel(self.settings.spp))
        )
        # Opaque: a number written into the kernel would mean a new kernel for each.
        part = lane % parts
        first = part * spp // parts
        pixel = lane // parts + dr.opaque(mi.UInt32, first_pixel)
        sample = mi.UInt32(first)
        ray = camera_ray(self, pixel, sample)
        state = {
            "o": mi.Point3f(ray.o),
            "d": mi.Vector3f(ray.d),
            **self.first_state(len(lane)),
            "pixel": pixel,
            "sample": sample,
            "left": (part + 1) * spp // parts - first,
        }
        # Not left as constants, nor as one number for all, so that lanes that begin and that go on run one kernel.
        dr.make_opaque(state)
        height = int(np.ceil(self._room * self._longest_lane))
        return Started(first_pixel, pixels, self._launch(state, height))

    def first_state(self, lanes: int) -> dict[str, Any]:
        """What the loop carries besides the ray, where a path begins."""
        return {
            "previous": dr.zeros(mi.Point3f, lanes),
            "pdf": dr.zeros(mi.Float, lanes),
            "throughput": dr.ones(mi.Float, lanes),
            "depth": dr.zeros(mi.UInt32, lanes),
        }

    def run(self, log: dict[str, Any], height: Any, state: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Record the loop: let each lane trace its samples, as far as its strip of `height` entries goes.

        Returns the number of entries that each lane has used, and the state in which it stopped.
        """
        used_and_left: tuple[Any, dict[str, Any]] = _trace(self, log, height, **state)
        return used_and_left

    def finish(self, started: Started) -> Chunk:
        """Wait for a chunk, let lanes go on that came to the end of their strip, and return the log of all."""
        launches = [started.launch]
        while len(going_on := dr.compress(launches[-1].state["left"] > 0)):
            if (
                len(going_on) == 1
            ):  # twice, the second unread: a kernel for one lane alone would be another one
                going_on = dr.concat([going_on, going_on])
            state = {
                name: dr.gather(type(values), values, going_on) for name, values in launches[-1].state.items()
            }
            dr.make_opaque(state)
            launches.append(self._launch(state, started.launch.height))
        longest = (len(launches) - 1) * started.launch.height + int(dr.max(launches[-1].used)[0])
        self._room = min(max(1.1 * longest / self._longest_lane, 2.0), _MOST_ROOM)
        return Chunk(
            started.first_pixel, started.pixels, self.settings.spp, _log(launches, self.terms, self.on_gpu)
        )

    def _launch(self, state: dict[str, Any], height: int) -> _Launch:
        """Allocate a strip for each lane and launch the kernel that fills them."""
        lanes = len(state["left"])
        entries = -(-lanes // BLOCK) * BLOCK * height
        log = {
            name: dr.empty(
                mi.UInt32 if kind is np.uint32 else mi.Float,
                1
                if self.one_light and name.endswith("light")
                else entries * (self.terms if name in OF_TERMS else 1),
            )
            for name, kind in ENTRIES.items()
        }
        used, left = self.run(log, dr.opaque(mi.UInt32, height), state)
        dr.eval(log, used, left)
        return _Launch(lanes, height, log, used, left)


def camera_ray(tracer: Tracer, pixel: Any, sample: Any) -> Any:
    """The ray of a sample of a pixel."""
    sensor, settings = tracer.scene.sensor, tracer.settings
    numbers = tracer.numbers.at(pixel, sample, mi.UInt32(0))
    time = numbers.one(0) if sensor.shutter_open_time() > 0 else mi.Float(0)
    aperture = numbers.pair(1) if sensor.needs_aperture_sample() else mi.Point2f(0.5)
    corner = mi.Point2f(pixel % settings.width, pixel // settings.width)
    film = (corner + numbers.two(0)) * mi.ScalarVector2f(1 / settings.width, 1 / settings.height)
    return sensor.sample_ray(time, mi.Float(0), film, aperture)[0]


@dr.syntax
def _trace(
    tracer: Tracer,
    log: dict[str, Any],
    height: Any,
    o: Any,
    d: Any,
    previous: Any,
    pdf: Any,
    throughput: Any,
    depth: Any,
    pixel: Any,
    sample: Any,
    left: Any,
) -> tuple[Any, dict[str, Any]]:
    """Let each lane trace its `left` samples, as far as its strip goes.

    Returns the number of entries that each lane has used, and the state in which it stopped.
    """
    scene = tracer.scene.mitsuba_scene
    max_depth, rr_depth = tracer.settings.max_depth, tracer.settings.rr_depth
    lane = dr.arange(mi.UInt32, dr.width(left))
    slot = lane // BLOCK * (height * BLOCK) + lane % BLOCK
    used = mi.UInt32(0)

    while (left > 0) & (used < height):
        ray = mi.Ray3f(o, d)
        numbers = tracer.numbers.at(pixel, sample, 2 * depth + 1)
        hit = scene.ray_intersect_preliminary(ray, coherent=False)
        si = hit.compute_surface_interaction(ray, mi.RayFlags.Minimal | mi.RayFlags.ShadingFrame)

        # Light that the ray has hit; it belongs to the vertex before.
        emitter = si.emitter(scene)
        seen = emitter != None  # noqa: E711 (a comparison of each lane)
        origin = dr.zeros(mi.Interaction3f)
        origin.p = previous
        ds = mi.DirectionSample3f(scene, si, origin)
        pdf_direct = tracer.lights.pdf(origin, ds, seen & (depth > 0))
        weight = dr.select(depth == 0, 1.0, mis(pdf, pdf_direct))
        sampled = dr.select(seen, emitter.eval(si, seen)[0] * weight, 0.0)
        dr.scatter(log["sampled"], sampled, slot)
        if dr.hint(not tracer.one_light, mode="scalar"):
            light = dr.gather(
                mi.UInt32, tracer.light_of_emitter, dr.reinterpret_array(mi.UInt32, emitter), seen
            )
            dr.scatter(log["sampled_light"], light, slot)

        # The vertex: which material, and direct light by next-event estimation.
        row = tracer.row_of(si)
        active = si.is_valid() & (row != END)
        if dr.hint(max_depth != UNLIMITED, mode="scalar"):
            active &= depth + 1 < max_depth
        ds, emitted = tracer.lights.sample(si, numbers, active)
        cosine = dr.maximum(dr.dot(si.sh_frame.n, ds.d) * dr.sign(si.wi.z), 0.0)
        pdf_sampled = cosine * dr.inv_pi
        weight = dr.select(ds.delta, 1.0, mis(ds.pdf, pdf_sampled))
        direct = emitted[0] * pdf_sampled * weight
        # Only now the shadow ray: much of the light comes from below the horizon or faces away.
        lit = active & (ds.pdf > 0) & (direct > 0)
        lit &= ~scene.ray_test(si.spawn_ray_to(ds.p), coherent=False, active=lit)
        dr.scatter(log["row"], dr.select(active, row, END), slot)
        dr.scatter(log["direct"], dr.select(lit, direct, 0.0), slot)
        if dr.hint(not tracer.one_light, mode="scalar"):
            light = dr.gather(
                mi.UInt32, tracer.light_of_emitter, dr.reinterpret_array(mi.UInt32, ds.emitter), lit
            )
            dr.scatter(log["direct_light"], light, slot)

        # The next direction, from the cosine; roulette decides before the ray is traced.
        wo = mi.warp.square_to_cosine_hemisphere(numbers.two(1))
        pdf = wo.z * dr.inv_pi
        wo.z = dr.mulsign(wo.z, si.wi.z)
        throughput *= dr.gather(mi.Float, tracer.survival, row, active)
        roulette = depth + 1 >= rr_depth
        chance = dr.clip(throughput, *SURVIVAL)
        goes_on = active & (~roulette | (numbers.one(0) < chance))
        gain = dr.select(roulette, dr.rcp(chance), 1.0)
        dr.scatter(log["weight"], dr.select(goes_on, gain, 0.0), slot)
        spawned = si.spawn_ray(si.to_world(wo))

        # Where the path has ended, the next sample begins.
        left = dr.select(goes_on, left, left - 1)
        sample = dr.select(goes_on, sample, sample + 1)
        fresh = camera_ray(tracer, pixel, sample)
        o = dr.select(goes_on, mi.Point3f(spawned.o), mi.Point3f(fresh.o))
        d = dr.select(goes_on, mi.Vector3f(spawned.d), mi.Vector3f(fresh.d))
        throughput = dr.select(goes_on, throughput * gain, 1.0)
        depth = dr.select(goes_on, depth + 1, 0)
        previous = mi.Point3f(si.p)
        slot += BLOCK
        used += 1

    stopped = {
        "o": o,
        "d": d,
        "previous": previous,
        "pdf": pdf,
        "throughput": throughput,
        "depth": depth,
        "pixel": pixel,
        "sample": sample,
        "left": left,
    }
    return used, stopped


def mis(pdf: Any, other: Any) -> Any:
    """Weight of a light found with density `pdf` that the other technique finds with `other` (power heuristic)."""
    return dr.select(pdf > 0, dr.rcp(1 + dr.square(other / pdf)), 0.0)


def _log(launches: list[_Launch], terms: int, on_gpu: bool) -> Log:
    """Put launches behind one another; see them as numpy arrays, copied only from a GPU or if there are several."""
    fields = {}
    for name in ENTRIES:
        parts = [launch.log.pop(name) for launch in launches]
        if on_gpu:
            fields[name] = _joined(parts, terms if name in OF_TERMS else 1)
            continue
        parts = [part.numpy() for part in parts]
        shape = (terms, -1, BLOCK) if terms > 1 and name in OF_TERMS else (-1, BLOCK)
        parts = [part.reshape(shape) if len(part) > 1 else part[:0].reshape(0, BLOCK) for part in parts]
        fields[name] = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-2)
    strips, goes_on, of_lanes, entry, slot = [], [], [], 0, 0
    for launch in launches:
        blocks = -(-launch.lanes // BLOCK)
        used = np.zeros(blocks * BLOCK, dtype=np.int32)
        used[: launch.lanes] = launch.used.numpy()
        of_lanes.append(used)
        begin = entry + launch.height * np.arange(blocks)
        strips.append(np.stack([begin, begin + used.reshape(blocks, BLOCK).max(axis=1)], axis=1))
        entry += launch.height * blocks
        slot += blocks * BLOCK
        going_on = np.flatnonzero(launch.state["left"].numpy())
        follow = np.full(blocks * BLOCK, -1, dtype=np.int32)
        follow[going_on] = slot + np.arange(len(going_on))
        goes_on.append(follow)
    if on_gpu:
        dr.sync_thread()  # who reads them next does not follow Dr.Jit's stream
    whole = {"strips": strips, "goes_on": goes_on, "used": of_lanes}
    return Log(**fields, **{name: np.concatenate(parts) for name, parts in whole.items()})


def _joined(parts: list[Any], terms: int) -> Any:
    """Put entries of launches behind one another, term by term, where they are; none where they are not recorded."""
    if len(parts[0]) == 1:
        return parts[0].numpy()[:0]
    if len(parts) == 1:
        return parts[0]
    runs = []
    for term in range(terms):
        for part in parts:
            size = len(part) // terms
            runs.append(
                dr.gather(type(part), part, dr.arange(mi.UInt32, size) + dr.opaque(mi.UInt32, term * size))
            )
    joined = dr.concat(runs)
    dr.eval(joined)
    return joined
