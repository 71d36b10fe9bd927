"""`LightPaths`: what is recorded of traced light paths. It holds geometry and no spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["KILLED", "SLOTS", "TILE", "LightPaths", "Segment"]

TILE = 64  # paths that lie side by side in memory: [tile][slot][path in tile]
SLOTS = 48  # vertices of a path that one segment holds
KILLED = -1.0  # `survival` of a vertex at which Russian roulette ended the path


@dataclass(frozen=True)
class Segment:
    """Up to `SLOTS` vertices each of `n` paths, vertex 0 nearest to the camera.

    The arrays with a slot axis have shape (tiles, SLOTS, TILE), n = tiles x TILE at most; path i is in
    tile i // TILE. Slots from `length` on are undefined, except slot `length` of `sampled`, which holds the
    light that the last sampled direction reached.

    Attributes
    ----------
    length
        (n,) uint8: number of vertices recorded.
    child
        (n,) int32: index of the path in the next segment where it goes on, else -1.
    row
        uint32: row of the material table at each vertex.
    direct
        float32: weight of the light found by next-event estimation, E_D = direct x L, in sr for
        radiance, m-2 for intensity, 1 for irradiance, divided by pi; w_k of the method.
    direct_light
        uint32: its row of the light table; shape (0,) where the scene has one light.
    sampled
        float32: weight of the light that the direction sampled at the *previous* vertex (slot 0: the camera
        ray or the last vertex of the previous segment) has hit; h_k of the method.
    sampled_light
        uint32: its row of the light table; shape (0,) where the scene has one light.
    survival
        float32: 1 / survival probability of Russian roulette, `KILLED` where it ended the path;
        undefined below roulette depth; f_k of the method.
    """

    length: NDArray[np.uint8]
    child: NDArray[np.int32]
    row: NDArray[np.uint32]
    direct: NDArray[np.float32]
    direct_light: NDArray[np.uint32]
    sampled: NDArray[np.float32]
    sampled_light: NDArray[np.uint32]
    survival: NDArray[np.float32]


@dataclass(frozen=True)
class LightPaths:
    """The light paths of some pixels, `spp` for each; path i belongs to pixel `first_pixel + i // spp`.

    Attributes
    ----------
    first_pixel, pixels
        Range of pixels, numbered row by row from the top left.
    spp
        Samples per pixel.
    rr_depth
        Vertex k (from 0) has a valid `survival` if k + 1 >= rr_depth.
    segments
        The beginning of all paths, then what goes on beyond `SLOTS` vertices, beyond 2 x `SLOTS`, ...
    """

    first_pixel: int
    pixels: int
    spp: int
    rr_depth: int
    segments: tuple[Segment, ...]
