"""Which light next-event estimation goes to: in scenes of many, one that may well light the place."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

__all__ = ["ByPlace", "Evenly", "light_choice"]

FEW = 4
ENTRIES = 1 << 20
_MOST_CELLS = 16
_PLACES = 8
_EVEN = 0.1
_STEPS = 1 << 23


class Evenly:
    @property
    def normals(self):
        return 0
    def __init__(self, scene: Any) -> None:
        self.scene = scene

    def sample(self, si: Any, u: Any, rng: Any, active: Any) -> Any:
        return self.scene.sample_emitter_direction(si, u, False, active)

    def pdf(self, origin: Any, ds: Any, active: Any) -> Any:
        return self.scene.pdf_emitter_direction(origin, ds, active)


class ByPlace:
    def __init__(self, scene: Any, power: Any) -> None:
        self.scene = scene
        self.emitters = scene.emitters_dr()
        count = len(scene.emitters())
        pointers = np.array(dr.reinterpret_array(mi.UInt32, self.emitters))
        place = np.zeros(pointers.max() + 1, np.uint32)
        place[pointers] = np.arange(count)
        self.place = mi.UInt32(place)
        self.steps = int(np.ceil(np.log2(count)))
        low, high = extent(scene)
        cells = max(1, ENTRIES // count)
        side = np.maximum(high - low, 1e-6 * (high - low).max())
        edge = (side.prod() / cells) ** (1 / 3)
        self.shape = np.clip(np.round(side / edge), 1, _MOST_CELLS).astype(int)
        self.low, self.per = mi.ScalarPoint3f(*low), mi.ScalarVector3f(*(self.shape / side))
        size = side / self.shape
        import time
        t = time.perf_counter()
        table = self.table(low, size, count, power)
        print('table', self.shape, time.perf_counter() - t)
        self.count = dr.opaque(mi.UInt32, count)
        self.cdf = mi.Float(table.ravel())
        dr.eval(self.cdf, self.place)

    def table(self, low, size, count, power):
        nx, ny, nz = self.shape
        z, y, x = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")
        cells = np.stack([x, y, z], -1).reshape(-1, 3)
        n = len(cells) * count
        i = dr.arange(mi.UInt32, n)
        cell, light = i // count, i % count
        corner = mi.Point3f(*(low + cells * size).astype(np.float32).T)
        corner = dr.gather(mi.Point3f, corner, cell)
        emitter = dr.gather(type(self.emitters), self.emitters, light)
        rng = mi.PCG32(n)
        total = mi.Float(0)
        si = dr.zeros(mi.Interaction3f, n)
        dr.make_opaque(rng, total)
        spread = dr.opaque(mi.Float, float(0.1 * (size**2).sum() / 12))
        for number in range(_PLACES):
            k = dr.opaque(mi.UInt32, number)
            u = mi.Point3f(rng.next_float32(), rng.next_float32(), rng.next_float32())
            u = (u + mi.Point3f(k & 1, (k >> 1) & 1, k >> 2)) / 2
            si.p = corner + u * mi.ScalarVector3f(*size)
            ds, spec = emitter.sample_direction(si, mi.Point2f(rng.next_float32(), rng.next_float32()), True)
            d2 = dr.square(ds.dist)
            total += spec[0] * d2 / (d2 + spread)
            dr.eval(total, rng)
        w = np.array(total, dtype=np.float64).reshape(-1, count) * power
        w[~np.isfinite(w)] = 0
        s = w.sum(1, keepdims=True)
        share = np.where(s > 0, w / np.maximum(s, 1e-300), 1 / count)
        share = (1 - _EVEN) * share + _EVEN / count
        cdf = np.cumsum(share, axis=1)
        cdf = np.round(cdf / cdf[:, -1:] * _STEPS) / _STEPS
        return cdf

    def row(self, p: Any) -> Any:
        at = (p - self.low) * self.per
        c = [mi.UInt32(dr.clip(a, 0, int(n) - 1)) for a, n in zip(at, self.shape)]
        nx, ny, nz = map(int, self.shape)
        return ((c[2] * ny + c[1]) * nx + c[0]) * self.count

    def share(self, row, k, active):
        upper = dr.gather(mi.Float, self.cdf, row + k, active)
        lower = dr.gather(mi.Float, self.cdf, row + k - 1, active & (k > 0))
        return upper - lower

    def sample(self, si: Any, u: Any, rng: Any, active: Any) -> Any:
        row = self.row(si.p)
        v = rng.next_float32()
        k = dr.binary_search(0, 1 << self.steps, lambda j: dr.gather(mi.Float, self.cdf, row + dr.minimum(j, self.count - 1), active) <= v)
        k = dr.minimum(k, self.count - 1)
        share = self.share(row, k, active)
        emitter = dr.gather(type(self.emitters), self.emitters, k, active)
        ds, emitted = emitter.sample_direction(si, u, active)
        ds.pdf *= share
        return ds, emitted / share

    def pdf(self, origin: Any, ds: Any, active: Any) -> Any:
        k = dr.gather(mi.UInt32, self.place, dr.reinterpret_array(mi.UInt32, ds.emitter), active)
        return ds.emitter.pdf_direction(origin, ds, active) * self.share(self.row(origin.p), k, active)


def extent(scene: Any):
    low, high = np.array(scene.bbox().min).ravel(), np.array(scene.bbox().max).ravel()
    return low.astype(float), high.astype(float)


def light_choice(scene: Any, power: Any, row_of: Any) -> Any:
    emitters = scene.emitters()
    import os
    if len(emitters) <= int(os.environ.get("FEW", FEW)):
        return Evenly(scene)
    pointers = np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr()))
    return ByPlace(scene, np.asarray(power)[np.asarray(row_of)[pointers]])
