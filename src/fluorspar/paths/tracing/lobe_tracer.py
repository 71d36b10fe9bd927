"""Trace light paths among general surfaces: Mitsuba's own BSDFs, as probes, in a variant with three colours.

The loop is that of `tracer.py`, but each vertex has several terms: what a channel of the probe says is the coefficient
of a lobe, and a row says which spectrum goes with it.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fluorspar.paths.log import BLOCK, END, SURVIVAL
from fluorspar.paths.tracing.lobe_scene import LobeScene
from fluorspar.paths.tracing.mesh_colours import MeshColours
from fluorspar.paths.tracing.numbers import LOBE, Numbers
from fluorspar.paths.tracing.tracer import Tracer, camera_ray, mis
from fluorspar.scene.lobes.lobe import ANGLES, CHANNELS, STRAIGHT
from fluorspar.scene.settings import UNLIMITED

__all__ = ["LobeTracer"]

_CERTAIN = 1e15  # density of a direction that next-event estimation cannot find
# Uses of independent numbers at a vertex: roulette; the texels of a light that was hit or found, of a texture, and the
# angle of a metal.
_SURVIVES, _HIT, _FOUND, _PICK = 0, 1, 3, 5
_WRAPS = ("repeat", "mirror", "clamp")


class LobeTracer(Tracer):
    """Traces one chunk of pixels after another; the variant of `scene` must be set. See `Tracer`."""

    def read_scene(self, scene: LobeScene) -> None:
        """Give the tables of the scene to Dr.Jit."""
        self.terms = scene.terms
        self.first_of_shape = mi.UInt32(scene.first_of_shape)
        slots = scene.slots
        # In packets of four, one gather for each: row, texture + 1, scale, and the rest.
        rest = slots.channel | slots.found.astype(np.uint32) << 3 | slots.sent.astype(np.uint32) << 4
        packets = (slots.row, (slots.texture + 1).astype(np.uint32), slots.scale.view(np.uint32))
        self.slots = _aligned(mi.UInt32(np.stack([*packets, rest | slots.angles << 5], axis=1).ravel()))
        textures = scene.lobes.textures
        self.textured, self.metallic = bool((slots.texture >= 0).any()), bool(slots.angles.any())
        self.products = bool(((slots.texture >= 0) & (slots.angles > 0)).any())
        self.picks = self.textured or self.metallic
        self.first_texel = scene.lobes.behind + len(scene.lobes.rows)
        self.rows = self.first_texel + len(scene.lobes.colours)
        holes = (slots.channel == STRAIGHT).reshape(-1, scene.terms).any(axis=1)
        self.straight, self.hole = bool(holes.any()), mi.Bool(holes)
        varying = scene.lobes.light_textures
        self.varying = bool(varying)
        if varying:
            self.one_light = False
            none = (-1, 0)
            rows = [varying.get(row, none) for row in range(scene.lights)]
            self.light_texture = mi.Int32([texture for texture, _ in rows])
            self.light_first = mi.UInt32([scene.lights + first for _, first in rows])
        if textures:
            self.to_uv = _aligned(
                mi.Float(np.array([(*t.to_uv, 0, 0) for t in textures], dtype=np.float32).ravel())
            )
            kinds = [(t.width, t.height, t.bilinear, _WRAPS.index(t.wrap)) for t in textures]
            self.grids = _aligned(mi.UInt32(np.array(kinds, dtype=np.uint32).ravel()))
        self.meshes = MeshColours(scene) if any(t.mesh >= 0 for t in textures) else None

    def first_state(self, lanes: int) -> dict[str, Any]:
        """What the loop carries besides the ray, where a path begins."""
        certain, one = dr.full(mi.Float, _CERTAIN, lanes), dr.ones(mi.Float, lanes)
        return {**super().first_state(lanes), "pdf": certain, "eta": one}

    def run(self, log: dict[str, Any], height: Any, state: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Record the loop; see `Tracer.run`."""
        used_and_left: tuple[Any, dict[str, Any]] = _trace(self, log, height, **state)
        return used_and_left

    def light_of(self, emitter: Any, direction: Any, uv: Any, pick: Any, active: Any) -> Any:
        """The row of the light that comes from an emitter: of one that varies, that of a texel."""
        row = dr.gather(mi.UInt32, self.light_of_emitter, dr.reinterpret_array(mi.UInt32, emitter), active)
        if not self.varying:
            return row
        texture = dr.gather(mi.Int32, self.light_texture, row, active)
        for beam, to_picture in self.scene.beams.items():
            x, y, z = _turned(to_picture, direction)
            uv = dr.select(row == beam, mi.Point2f(0.5 + 0.5 * x / z, 0.5 + 0.5 * y / z), uv)
        if self.scene.to_sky is not None:
            x, y, z = _turned(self.scene.to_sky, direction)
            away = mi.Point2f(dr.atan2(x, -z) * dr.inv_two_pi, dr.safe_acos(y) * dr.inv_pi)
            uv = dr.select(row == self.scene.sky_row, away, uv)
        texel = _texel(self, texture, uv, pick, active)
        return dr.select(texture >= 0, dr.gather(mi.UInt32, self.light_first, row, active) + texel, row)

    def pick(self, numbers: Numbers) -> Any:
        """Random numbers for `terms_of`."""
        count = 3 if self.products else 2 if self.picks else 0
        return mi.Point3f(*[numbers.one(_PICK + i) if i < count else 0 for i in range(3)])

    def texel_of(self, row: Any) -> Any:
        """Of a texel on metal, which has rows for many angles, the row of the texel; other rows as they are."""
        if not self.products:
            return row
        return dr.select(row < self.rows, row, self.first_texel + (row - self.rows) // ANGLES)

    def terms_of(
        self, si: Any, value: Any, weight: Any, wo: Any, bs: Any, pick: Any, active: Any
    ) -> list[tuple[Any, Any, Any]]:
        """Read the terms of a vertex from what its probe says.

        Parameters
        ----------
        si : SurfaceInteraction3f
        value, weight : Color3f
            Of the BSDF for the direction `wo`, times the cosine, and of the sample `bs`.
        wo : Vector3f
        bs : BSDFSample3f
        pick : Point3f
            Random numbers, for what is interpolated.
        active : Bool

        Returns
        -------
        list of (row, coefficient of the light found, of the light sent on)
        """
        shape = dr.reinterpret_array(mi.UInt32, si.shape)
        side = dr.gather(mi.UInt32, self.first_of_shape, shape, active)
        side += dr.select(si.wi.z > 0, mi.UInt32(0), mi.UInt32(1))
        straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        straight &= dr.gather(mi.Bool, self.hole, side, active)
        terms = []
        for t in range(self.terms):
            at = side * self.terms + t
            row, texture, bits, rest = dr.gather(mi.Vector4u, self.slots, at, active)
            scale, channel = dr.reinterpret_array(mi.Float, bits), rest & 7
            found, sent = _of_channel(value, channel), _of_channel(weight, channel)
            if self.straight:
                sent = dr.select(straight, dr.select(channel == STRAIGHT, dr.max(weight), 0.0), sent)
            if self.textured:
                number = mi.Int32(texture) - 1
                texel = _texel(self, number, si.uv, pick, active)
                if self.meshes is not None:
                    texel += self.meshes.texel(number, si, pick.x, active)
                row += texel * dr.maximum(rest >> 5, 1) if self.products else texel
            if self.metallic:
                of_found, of_sent = (rest & 8) != 0, (rest & 16) != 0
                found, sent = dr.select(of_found, found, 0.0), dr.select(of_sent, sent, 0.0)
                angles = rest >> 5
                cosine = dr.sqrt(dr.clip((1 + dr.dot(si.wi, dr.select(of_found, wo, bs.wo))) / 2, 0, 1))
                between = pick.z if self.products else pick.x  # independent of that of the texel
                step = mi.UInt32(dr.sqrt(cosine) * (mi.Float(angles) - 1) + between)
                row += dr.select(angles > 0, dr.minimum(step, angles - 1), 0)
            terms.append((row, found * scale, dr.select(active & (bs.pdf > 0), sent * scale, 0.0)))
        return terms


@dr.syntax
def _trace(
    tracer: LobeTracer,
    log: dict[str, Any],
    height: Any,
    o: Any,
    d: Any,
    previous: Any,
    pdf: Any,
    throughput: Any,
    eta: Any,
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
    context = mi.BSDFContext()
    # Opaque: it follows the number of lanes and the height of strips, and would mean a new kernel for each.
    per_term = dr.opaque(mi.UInt32, dr.width(log["sampled"]))

    while (left > 0) & (used < height):
        ray = mi.Ray3f(o, d)
        numbers = tracer.numbers.at(pixel, sample, 2 * depth + 1)
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False)

        # Light that the ray has hit; it belongs to the vertex before.
        emitter = si.emitter(scene)
        seen = emitter != None  # noqa: E711 (a comparison of each lane)
        origin = dr.zeros(mi.Interaction3f)
        origin.p = previous
        ds = mi.DirectionSample3f(scene, si, origin)
        pdf_direct = tracer.lights.pdf(origin, ds, seen & (pdf < _CERTAIN))
        sampled = dr.select(seen, emitter.eval(si, seen)[0] * mis(pdf, pdf_direct), 0.0)
        dr.scatter(log["sampled"], sampled, slot)
        if dr.hint(not tracer.one_light, mode="scalar"):
            light = tracer.light_of(emitter, ray.d, si.uv, numbers.pair(_HIT), seen)
            dr.scatter(log["sampled_light"], light, slot)

        # The vertex: direct light by next-event estimation, and a direction to go on.
        active = si.is_valid()
        if dr.hint(max_depth != UNLIMITED, mode="scalar"):
            active &= depth + 1 < max_depth
        bsdf = si.bsdf(ray)
        smooth = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        ds, emitted = tracer.lights.sample(si, numbers, smooth)
        smooth &= ds.pdf > 0
        wo = si.to_local(ds.d)
        lobe, direction = numbers.two(LOBE).x, numbers.two(1)
        value, pdf_sampled, bs, weight = bsdf.eval_pdf_sample(context, si, wo, lobe, direction, active)
        mixed = emitted[0] * dr.select(ds.delta, 1.0, mis(ds.pdf, pdf_sampled))
        lit = smooth & (mixed * dr.max(value) > 0)
        lit &= ~scene.ray_test(si.spawn_ray_to(ds.p), coherent=False, active=lit)
        if dr.hint(not tracer.one_light, mode="scalar"):
            light = tracer.light_of(ds.emitter, ds.d, ds.uv, numbers.pair(_FOUND), lit)
            dr.scatter(log["direct_light"], light, slot)

        terms = tracer.terms_of(si, value, weight, wo, bs, tracer.pick(numbers), active)
        carried, survived = mi.Float(0), mi.Float(0)
        for t in range(tracer.terms):
            row, found, sent = terms[t]
            carried += sent
            survived += sent * dr.gather(mi.Float, tracer.survival, tracer.texel_of(row), active)
            dr.scatter(log["direct"], dr.select(lit, found * mixed, 0.0), slot + t * per_term)

        # Roulette decides before the ray is traced.
        throughput *= survived
        eta *= bs.eta
        roulette = depth + 1 >= rr_depth
        chance = dr.clip(throughput * dr.square(eta), *SURVIVAL)
        goes_on = active & (carried > 0) & (~roulette | (numbers.one(_SURVIVES) < chance))
        gain = dr.select(goes_on, dr.select(roulette, dr.rcp(chance), 1.0), 0.0)
        for t in range(tracer.terms):
            row, found, sent = terms[t]
            dr.scatter(log["row"], dr.select(active, row, END), slot + t * per_term)
            dr.scatter(log["weight"], gain * sent, slot + t * per_term)
        spawned = si.spawn_ray(si.to_world(bs.wo))
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)

        # Where the path has ended, the next sample begins.
        left = dr.select(goes_on, left, left - 1)
        sample = dr.select(goes_on, sample, sample + 1)
        fresh = camera_ray(tracer, pixel, sample)
        o = dr.select(goes_on, mi.Point3f(spawned.o), mi.Point3f(fresh.o))
        d = dr.select(goes_on, mi.Vector3f(spawned.d), mi.Vector3f(fresh.d))
        throughput = dr.select(goes_on, throughput * gain, 1.0)
        eta = dr.select(goes_on, eta, 1.0)
        pdf = dr.select(goes_on & ~delta, dr.minimum(bs.pdf, _CERTAIN), _CERTAIN)
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
        "eta": eta,
        "depth": depth,
        "pixel": pixel,
        "sample": sample,
        "left": left,
    }
    return used, stopped


def _aligned(values: Any) -> Any:
    """Copy to memory of Dr.Jit: how packets are gathered from numpy's, aligned by chance, would differ."""
    copy = values + dr.opaque(type(values), 0)
    dr.eval(copy)
    return copy


def _turned(matrix: Any, direction: Any) -> Any:
    """A matrix of numbers times a direction."""
    return (sum((float(a) * b for a, b in zip(line, direction, strict=True)), mi.Float(0)) for line in matrix)


def _of_channel(colour: Any, channel: Any) -> Any:
    """The value of a colour in a channel, 0 where it has no such channel."""
    out = mi.Float(0)
    for c in range(CHANNELS):
        out = dr.select(channel == c, colour[c], out)
    return out


def _texel(tracer: LobeTracer, texture: Any, uv: Any, pick: Any, active: Any) -> Any:
    """The texel of a texture at a place of the surface, one of four at random where it is interpolated."""
    textured = active & (texture >= 0)
    number = mi.UInt32(dr.maximum(texture, 0))
    a, b, c, d = dr.gather(mi.Vector4f, tracer.to_uv, 2 * number, textured)
    e, f, _, _ = dr.gather(mi.Vector4f, tracer.to_uv, 2 * number + 1, textured)
    width, height, interpolated, wrap = dr.gather(mi.Vector4u, tracer.grids, number, textured)
    bilinear = mi.Float(interpolated)
    x = (a * uv.x + b * uv.y + c) * mi.Float(width) + bilinear * (pick.x - 0.5)
    y = (d * uv.x + e * uv.y + f) * mi.Float(height) + bilinear * (pick.y - 0.5)
    return dr.select(textured, _wrapped(y, height, wrap) * width + _wrapped(x, width, wrap), 0)


def _wrapped(place: Any, count: Any, wrap: Any) -> Any:
    """The number of a texel along one axis, 0 to count - 1."""
    n = mi.Float(count)
    period = dr.select(wrap == 1, 2 * n, n)
    inside = place - period * dr.floor(place / period)
    inside = dr.select(wrap == 2, dr.clip(place, 0, n - 1), inside)
    index = dr.minimum(mi.UInt32(inside), mi.UInt32(period) - 1)
    return dr.select(index < count, index, mi.UInt32(period) - 1 - index)
