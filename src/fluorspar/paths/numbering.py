"""Rows of light paths that are kept: each side of each surface has its own, so that each can get another material.

In a scene of general surfaces each lobe of a side has its own, but for those of textures and metals, which have several
rows: they keep theirs, behind the others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.log import END
from fluorspar.scene.lobes.lobe import ANGLES, Lobe
from fluorspar.scene.scene import Scene
from fluorspar.scene.surfaces import ABSORBS

__all__ = ["count_rows", "numbered", "rows_shown"]


def numbered(scene: Scene) -> Scene:
    """Copy a scene, to trace it, with surfaces whose rows are those of kept paths."""
    if scene.lobes is None:
        surfaces = (
            replace(
                surface,
                front=ABSORBS if surface.front == ABSORBS else 2 * number,
                back=ABSORBS if surface.back == ABSORBS else 2 * number + 1,
            )
            for number, surface in enumerate(scene.surfaces)
        )
        return replace(scene, surfaces=tuple(surfaces))
    behind = len(_single(scene))
    number = 0
    of_surface = {}
    for node, sides in scene.lobes.of_surface.items():
        both = []
        for side in sides:
            lobes = []
            for lobe in side:
                own = _is_single(lobe)
                lobes.append(replace(lobe, row=number if own else behind + lobe.row))
                number += own
            both.append(tuple(lobes))
        of_surface[node] = (both[0], both[1])
    return replace(scene, lobes=replace(scene.lobes, of_surface=of_surface, behind=behind))


def rows_shown(traced: Scene, shown: Scene) -> tuple[NDArray[np.uint32], int]:
    """What the rows of kept paths are in a scene with other materials.

    Parameters
    ----------
    traced, shown : Scene
        The second may be the first one, or `relit` from it.

    Returns
    -------
    row_of : ndarray of shape (n,), uint32
        The rows of the table that the rows below n are.
    beyond : int
        What is added to all others.
    """
    if shown.lobes is None or traced.lobes is None:
        rows = [row for surface in shown.surfaces for row in (surface.front, surface.back)]
        return np.array([END if row == ABSORBS else row for row in rows], dtype=np.uint32), 0
    rows = [lobe.row for lobe in _single(shown)]
    before = len(traced.lobes.rows)
    return (
        np.concatenate([np.array(rows, dtype=np.uint32), np.arange(before, dtype=np.uint32)]),
        len(shown.lobes.rows) - before - len(rows),
    )


def count_rows(scene: Scene) -> tuple[int, int]:
    """How many rows of surfaces and of lights kept paths may refer to."""
    row_of, beyond = rows_shown(scene, scene)
    lobes = scene.lobes
    if lobes is None:
        return len(row_of), len(scene.lights)
    texels = (1 + ANGLES) * len(lobes.colours)  # as many as if all were of metals
    return len(lobes.rows) + texels - beyond, len(scene.lights) + len(lobes.light_colours)


def _is_single(lobe: Lobe) -> bool:
    """Whether a lobe has one row."""
    return lobe.texture < 0 and not lobe.angles


def _single(scene: Scene) -> list[Lobe]:
    assert scene.lobes is not None
    sides = (side for both in scene.lobes.of_surface.values() for side in both)
    return [lobe for side in sides for lobe in side if _is_single(lobe)]
