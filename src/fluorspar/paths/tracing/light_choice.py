"""Which light next-event estimation goes to: among many, one that probably lights the place.

A grid over the scene says for each cell how probable each light is. Any probabilities give the right mean, if only the
density of a light that a path finds by chance is that of the same cell; good ones give little noise.
"""

from __future__ import annotations

from typing import Any, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.tracing.numbers import LIGHT, Numbers

__all__ = ["LightChoice", "light_choice"]

_FEW = 4  # lights that are chosen evenly
_ENTRIES = 1 << 19  # of the table, a light and a cell each
_MOST_CELLS = 16  # along an axis
_PLACES = 8  # in a cell, one in each eighth, where all lights are asked how bright they are
# What a light gets although it seems dark: it may be brighter in another image of the same paths (0.3 of what the
# mean lamp sends), a cell may be lit where nobody has asked (its neighbours' share), and estimates may be wrong.
_DARK, _NEIGHBOURS, _EVEN = 0.3, 0.3, 0.05
_STEPS = 1 << 23  # probabilities are multiples of what two random numbers differ by, so they are exact


class LightChoice(Protocol):
    """How a direction to a light is drawn, and how probable a direction is that was drawn otherwise."""

    def sample(self, si: Any, numbers: Numbers, active: Any) -> tuple[Any, Any]:
        """Draw a direction with the random numbers of a vertex.

        Returns what `mitsuba.Scene.sample_emitter_direction` does.
        """

    def pdf(self, origin: Any, ds: Any, active: Any) -> Any:
        """The density of a direction from `origin`; see `mitsuba.Scene.pdf_emitter_direction`."""


def light_choice(scene: Any, power: NDArray[np.floating]) -> LightChoice:
    """Choose evenly among few lights; by place among many.

    Parameters
    ----------
    scene : mitsuba.Scene
        Of the variant that is set, with lights of unit spectrum.
    power : ndarray of shape (L,)
        What the spectra of its emitters are on average.
    """
    return _Evenly(scene) if len(power) <= _FEW else _ByPlace(scene, power)


class _Evenly:
    """As Mitsuba does; see `LightChoice`."""

    def __init__(self, scene: Any) -> None:
        self.scene = scene

    def sample(self, si: Any, numbers: Numbers, active: Any) -> tuple[Any, Any]:
        found: tuple[Any, Any] = self.scene.sample_emitter_direction(si, numbers.two(0), False, active)
        return found

    def pdf(self, origin: Any, ds: Any, active: Any) -> Any:
        return self.scene.pdf_emitter_direction(origin, ds, active)


class _ByPlace:
    """By what a light sends to a cell of a grid; see `LightChoice`."""

    def __init__(self, scene: Any, power: NDArray[np.floating]) -> None:
        self.scene = scene  # pointers to its emitters do not keep it
        self.emitters = scene.emitters_dr()
        pointers = dr.reinterpret_array(mi.UInt32, self.emitters).numpy()
        number = np.zeros(pointers.max() + 1, dtype=np.uint32)
        number[pointers] = np.arange(len(power))
        self.number_of_pointer = mi.UInt32(number)
        self.grid = _Grid(scene, max(_ENTRIES // len(power), 1))
        shares = _shares(_irradiance(self.grid, self.emitters), power)
        sums = np.round(np.cumsum(shares, axis=-1) / shares.sum(axis=-1, keepdims=True) * _STEPS) / _STEPS
        self.sums = mi.Float(sums.ravel())
        self.lights = dr.opaque(mi.UInt32, len(power))
        self.most = 1 << 4 * -(-(len(power) - 1).bit_length() // 4)  # few kernels for all numbers of lights

    def sample(self, si: Any, numbers: Numbers, active: Any) -> tuple[Any, Any]:
        first, chosen = self.lights * self.grid.cell(si.p), numbers.two(LIGHT).x

        def comes_before(light: Any) -> Any:
            entry = first + dr.minimum(light, self.lights - 1)
            return dr.gather(mi.Float, self.sums, entry, active) <= chosen

        light = dr.binary_search(0, self.most, comes_before)
        share = self._share(first, light, active)
        emitter = dr.gather(type(self.emitters), self.emitters, light, active)
        ds, emitted = emitter.sample_direction(si, numbers.two(0), active)
        ds.pdf *= share
        return ds, emitted * dr.rcp(share)

    def pdf(self, origin: Any, ds: Any, active: Any) -> Any:
        pointer = dr.reinterpret_array(mi.UInt32, ds.emitter)
        light = dr.gather(mi.UInt32, self.number_of_pointer, pointer, active)
        share = self._share(self.lights * self.grid.cell(origin.p), light, active)
        return share * ds.emitter.pdf_direction(origin, ds, active)

    def _share(self, first: Any, light: Any, active: Any) -> Any:
        """The probability of a light in the cell whose entries begin at `first`."""
        with_it = dr.gather(mi.Float, self.sums, first + light, active)
        return with_it - dr.gather(mi.Float, self.sums, first + light - 1, active & (light > 0))


class _Grid:
    """Cells over a scene: even among its lamps, and the wider the further away from them.

    Parameters
    ----------
    scene : mitsuba.Scene
    most : int
        Cells, at the most.

    Attributes
    ----------
    shape : tuple of int
        Cells along x, y and z; numbers of cells count x first.
    """

    def __init__(self, scene: Any, most: int) -> None:
        low, high = (
            _around([scene.bbox()]) or _around([emitter.bbox() for emitter in scene.emitters()]) or _UNIT
        )
        lamps = _around([emitter.bbox() for emitter in scene.emitters()]) or (low, high)
        centre = (lamps[0] + lamps[1]) / 2
        radius = float((lamps[1] - lamps[0]).max() or (high - low).max() or 1.0) / 2
        first, last = (_drawn_in((corner - centre) / radius, np) for corner in (low, high))
        span = np.maximum(last - first, 1e-6)
        shape = np.ones(3, dtype=int)
        while (shape < _MOST_CELLS).any():
            more = shape.copy()
            more[np.argmax(np.where(shape < _MOST_CELLS, span / shape, 0))] += 1
            if more.prod() > most:
                break
            shape = more
        self.shape: tuple[int, int, int] = tuple(shape.tolist())
        # Opaque: numbers written into the kernel would mean a new kernel for each scene.
        self._centre, self._radius = mi.Point3f(*centre.tolist()), mi.Float(radius)
        self._first, self._per_unit = mi.Point3f(*first.tolist()), mi.Vector3f(*(shape / span).tolist())
        self._counts = mi.Vector3u(*self.shape)
        dr.make_opaque(self._centre, self._radius, self._first, self._per_unit, self._counts)

    def cell(self, p: Any) -> Any:
        """The number of the cell that a point is in, or is next to."""
        drawn_in = _drawn_in((p - self._centre) / self._radius, dr)
        at = dr.maximum((drawn_in - self._first) * self._per_unit, 0)
        x, y, z = dr.minimum(mi.Vector3u(at), self._counts - 1)
        return (z * self._counts.y + y) * self._counts.x + x

    def place(self, cell: Any, u: Any) -> Any:
        """The point of a cell that is at `u` of its edges."""
        x, yz = cell % self._counts.x, cell // self._counts.x
        corner = mi.Vector3f(mi.Float(x), mi.Float(yz % self._counts.y), mi.Float(yz // self._counts.y))
        drawn_in = self._first + (corner + u) / self._per_unit
        size = dr.abs(drawn_in)
        return self._centre + self._radius * dr.select(size <= 1, drawn_in, dr.sign(drawn_in) / (2 - size))


_UNIT = np.zeros(3), np.ones(3)


def _around(boxes: list[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """The box around those of Mitsuba's boxes that are valid: lights that are everywhere have none."""
    valid = [box for box in boxes if box.valid()]
    if not valid:
        return None
    low = np.array([box.min for box in valid], dtype=np.float64).reshape(-1, 3).min(axis=0)
    high = np.array([box.max for box in valid], dtype=np.float64).reshape(-1, 3).max(axis=0)
    return low, high


def _drawn_in(x: Any, of: Any) -> Any:
    """x, drawn in to 2 - 1 / x beyond 1 and likewise below -1; `of` is numpy or Dr.Jit."""
    size = of.abs(x)
    where = np.where if of is np else dr.select
    return where(size <= 1, x, of.sign(x) * (2 - 1 / of.maximum(size, 1)))


def _irradiance(grid: _Grid, emitters: Any) -> NDArray[np.float64]:
    """What each light of unit spectrum sends to each cell, to surfaces that face it, as if nothing were in between.

    Returns
    -------
    ndarray of shape (nz, ny, nx, L)
        Root mean square over some places of the cell.
    """
    cells, lights = int(np.prod(grid.shape)), dr.width(emitters)
    number = dr.arange(mi.UInt32, _PLACES * lights * cells)
    cell, light, eighth = number % cells, number // cells % lights, number // (cells * lights)
    rng = mi.PCG32(dr.width(number))
    corner = mi.Vector3f(mi.Float(eighth & 1), mi.Float(eighth >> 1 & 1), mi.Float(eighth >> 2))
    within = mi.Vector3f(*(rng.next_float32() for _ in range(3)))
    point = dr.zeros(mi.Interaction3f, dr.width(number))
    point.p = grid.place(cell, (corner + within) / 2)
    emitter = dr.gather(type(emitters), emitters, light)
    ds, emitted = emitter.sample_direction(point, mi.Point2f(rng.next_float32(), rng.next_float32()), True)
    diagonal = grid.place(cell, mi.Vector3f(1)) - grid.place(cell, mi.Vector3f(0))
    # Nearer than a tenth of the diagonal counts as that.
    distance, near = dr.square(ds.dist), 0.01 * dr.squared_norm(diagonal)
    found = (emitted[0] * distance / (distance + near)).numpy().astype(np.float64)
    found[~np.isfinite(found)] = 0
    mean = np.sqrt((found**2).reshape(_PLACES, lights, *grid.shape[::-1]).mean(axis=0))
    return np.moveaxis(mean, 0, -1)


def _shares(irradiance: NDArray[np.float64], power: NDArray[np.floating]) -> NDArray[np.float64]:
    """How probable each light is in each cell, but for a factor of the cell; of the shape of `irradiance`."""
    from scipy.ndimage import uniform_filter

    of_unit = irradiance.mean(axis=(0, 1, 2))
    mean = float((of_unit * power).mean()) or 1.0
    powers = power + _DARK * mean * np.divide(1, of_unit, out=np.zeros_like(of_unit), where=of_unit > 0)
    arrives = irradiance * powers
    of_cell = arrives.sum(axis=-1, keepdims=True)
    shares = np.divide(arrives, of_cell, out=np.zeros_like(arrives), where=of_cell > 0)
    shares += _NEIGHBOURS * uniform_filter(shares, (3, 3, 3, 1))
    return np.asarray(shares + _EVEN / len(power))
