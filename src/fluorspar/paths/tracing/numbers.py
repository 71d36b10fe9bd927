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
JCGT 9(4), 2020. Directions of Sobol's sequence: S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30, 2008.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.stats import qmc

from fluorspar.scene.sample_sets import sample_sets
from fluorspar.scene.settings import Settings

__all__ = ["Numbers", "PathNumbers"]

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
        self._bits, self._last = (dr.opaque(mi.UInt32, n) for n in (bits, (1 << bits) - 1))
        self._seeds = [dr.opaque(mi.UInt32, int(n)) for n in np.random.SeedSequence(seed).generate_state(2)]
        self._samples = mi.UInt32(np.stack([set_of_sample, index], axis=1).astype(np.uint32).ravel())
        self._points = mi.UInt32(_points(bits).ravel())

    def at(self, pixel: Any, sample: Any, first: Any) -> Numbers:
        """Numbers for a sample of a pixel, from use `first` on."""
        number_of_set, index = dr.gather(mi.Vector2u, self._samples, sample)
        key = _hash(_hash(pixel + self._seeds[0]) ^ (number_of_set * 0x85EBCA6B + self._seeds[1]))
        return Numbers(self._points, self._bits, self._last, key, index, first)


@dataclass
class Numbers:
    """Random numbers of one vertex of a path; see `PathNumbers.at`."""

    points: Any
    bits: Any
    last: Any
    key: Any
    index: Any
    first: Any

    def two(self, use: int) -> Any:
        """Points in the unit square, spread over the samples."""
        use = self.first + use
        group = _hash(self.key ^ ((use >> _PAIRS_BITS) * _OTHER))
        index = dr.brev(_scrambled(dr.brev(self.index), group)) & self.last
        pair = use & ((1 << _PAIRS_BITS) - 1)
        x, y = dr.gather(mi.Vector2u, self.points, (pair << self.bits) + index)
        key = _hash(self.key + use * _GOLDEN)
        return mi.Point2f(_fraction(_scrambled(x, key)), _fraction(_scrambled(y, _hash(key))))

    def one(self, use: int) -> Any:
        """Numbers in [0, 1), independent; `use` counts apart from that of pairs, up to 15."""
        key = _hash((self.key ^ _OTHER) + (8 * self.first + use) * _GOLDEN)
        return _fraction(_hash(key ^ (self.index * _OTHER)))

    def pair(self, use: int) -> Any:
        """Points in the unit square, independent; they count as two of `one`."""
        return mi.Point2f(self.one(use), self.one(use + 1))


def _points(bits: int) -> np.ndarray:
    """The first 2^bits points of Sobol's sequence, of shape (pairs, points, 2), with the bits of numbers reversed."""
    dimensions = 2 << _PAIRS_BITS
    points = qmc.Sobol(dimensions, scramble=False, bits=32).random(1 << bits)
    octets = (points * 2.0**32).astype(">u4").view(np.uint8)
    reversed_bits = np.packbits(np.unpackbits(octets), bitorder="little").view("<u4")
    pairs = reversed_bits.reshape(1 << bits, -1, 2).transpose(1, 0, 2)
    return np.ascontiguousarray(pairs[list(_ORDER)]).astype(np.uint32)


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
