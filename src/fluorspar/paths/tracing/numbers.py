"""The random numbers of light paths: Owen-scrambled Sobol points.

The samples of a set are numbered, and a use of numbers along a path takes a pair of dimensions of Sobol's sequence,
scrambled anew for each pixel and set, so that it is spread evenly over the samples; a direction and the light of the
vertex it leads to are so in all four dimensions. Where the dimensions are used up, the order of the samples is
shuffled, and they begin again. All scrambling is by hashes. Each number alone is uniform and independent of the other
numbers of its path, so that all estimates are unbiased whatever the number of samples; sets and pixels are independent.

References
----------
A. B. Owen, "Scrambling Sobol' and Niederreiter-Xing points", J. Complexity 14, 1998; S. Laine and T. Karras,
"Stratified sampling for stochastic transparency", CGF 30(4), 2011; B. Burley, "Practical hash-based Owen scrambling",
JCGT 9(4), 2020.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.tracing.sobol import sobol_points
from fluorspar.scene.sample_sets import sample_sets
from fluorspar.scene.settings import Settings

__all__ = ["LIGHT", "LOBE", "Numbers", "PathNumbers"]

LIGHT, LOBE = 1 << 16, 1 << 17
"""Uses of pairs that choose one of many lights, or a lobe of a surface: beyond those of the longest path."""

_GOLDEN, _OTHER = 0x9E3779B9, 0x27D4EB2F
_PAIRS_BITS = 3
# Pairs of dimensions in the order of use: of the camera, of the light at the first vertex, of the direction there, of
# the light at the second, and so on. The best pairs go where most of the noise of a pixel comes from.
_ORDER = (2, 1, 0, 3, 4, 5, 6, 7)


class PathNumbers:
    """Random numbers for all samples of all pixels.

    Parameters
    ----------
    settings : Settings
        Size and samples per pixel.
    seed : int
    """

    def __init__(self, settings: Settings, seed: int) -> None:
        spp, sets = settings.spp, sample_sets(settings)
        edges = np.arange(sets + 1) * spp // sets
        set_of_sample = np.repeat(np.arange(sets), np.diff(edges))
        index = np.arange(spp) - edges[set_of_sample]
        bits = max(1, int(index.max()).bit_length())
        # Opaque: a number written into the kernel would mean a new kernel for each.
        self._bits = dr.opaque(mi.UInt32, bits)
        self._seeds = [dr.opaque(mi.UInt32, int(n)) for n in np.random.SeedSequence(seed).generate_state(2)]
        # Two numbers in one entry, and so one gather. (Packets of Dr.Jit need a new kernel for each alignment.)
        self._samples = mi.UInt32((set_of_sample | index << 16).astype(np.uint32))
        self._points = mi.UInt32(_points(bits).ravel())

    def at(self, pixel: Any, sample: Any, first: Any) -> Numbers:
        """Numbers for a sample of a pixel, from use `first` on."""
        entry = dr.gather(mi.UInt32, self._samples, sample)
        key = _hash(_hash(pixel + self._seeds[0]) ^ ((entry & 0xFFFF) * 0x85EBCA6B + self._seeds[1]))
        return Numbers(self._points, self._bits, key, entry >> 16, first)


@dataclass
class Numbers:
    """Random numbers of one vertex of a path; see `PathNumbers.at`."""

    points: Any
    bits: Any
    key: Any
    index: Any
    first: Any

    def two(self, use: int) -> Any:
        """Points in the unit square, spread over the samples."""
        use = self.first + use
        group = _hash(self.key ^ ((use >> _PAIRS_BITS) * _OTHER))
        index = dr.brev(_scrambled(dr.brev(self.index), group)) & ((mi.UInt32(1) << self.bits) - 1)
        pair = use & ((1 << _PAIRS_BITS) - 1)
        point = dr.gather(mi.UInt32, self.points, (pair << self.bits) + index)
        key = _hash(self.key + use * _GOLDEN)
        x, y = _scrambled(point & 0xFFFF, key), _scrambled(point >> 16, _hash(key))
        return mi.Point2f(_fraction(x), _fraction(y))

    def one(self, use: int) -> Any:
        """Numbers in [0, 1), independent; `use` counts apart from that of pairs, up to 15."""
        key = _hash((self.key ^ _OTHER) + (8 * self.first + use) * _GOLDEN)
        return _fraction(_hash(key ^ (self.index * _OTHER)))

    def pair(self, use: int) -> Any:
        """Points in the unit square, independent; they count as two of `one`."""
        return mi.Point2f(self.one(use), self.one(use + 1))


def _points(bits: int) -> NDArray[np.uint32]:
    """The first 2^bits points of Sobol's sequence, of shape (pairs, points), with the bits of numbers reversed.

    They have no more than `bits` bits; the second number of a pair is in the upper half of an entry.
    """
    points = sobol_points(2 << _PAIRS_BITS, bits)
    octets = (points << 32 - bits).astype(">u4").view(np.uint8)
    reversed_bits = np.packbits(np.unpackbits(octets), bitorder="little").view("<u4").reshape(points.shape)
    pairs: NDArray[np.uint32] = (reversed_bits[::2] | reversed_bits[1::2] << 16).astype(np.uint32)
    return pairs[list(_ORDER)]


def _hash(x: Any) -> Any:
    """Mix the bits of a number."""
    x = (x ^ (x >> 16)) * 0x7FEB352D
    x = (x ^ (x >> 15)) * 0x846CA68B
    return x ^ (x >> 16)


def _scrambled(x: Any, key: Any) -> Any:
    """Scramble a number given with its bits reversed: flip each bit by a hash of the bits below it."""
    x = (x ^ (x * 0x3D20ADEA)) + key
    x = x * ((key >> 16) | 1)
    x = x ^ (x * 0x05526C56)
    return x ^ (x * 0x53A22864)


def _fraction(reversed_bits: Any) -> Any:
    return mi.Float(mi.Int32(dr.brev(reversed_bits) >> 8)) * 2.0**-24
