"""Where the camera of a scene sees positions in it, and what is doubtful about them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.measuring.points import Point, inside, not_in_image, places
from fluorspar.scene.scene import Scene

__all__ = ["doubts", "visible_pixels"]

Array = NDArray[np.float64]

_ON_SURFACE = 2e-3  # of the distance to the camera
_FACTORS = (1000.0, 100.0, 10.0, 0.1, 0.01, 0.001)  # between m, cm and mm, the most first


def visible_pixels(scene: Scene, points: Sequence[Point]) -> Array:
    """Where the camera sees positions.

    Parameters
    ----------
    scene : Scene
        With the size of the image.
    points : sequence of Point
        P positions.

    Returns
    -------
    ndarray of shape (P, 2)
        Continuous image coordinates.

    Raises
    ------
    OptionError
        If a point is outside the image, behind the camera, hidden from it, or not on a surface; the message says if
        other units or another order of the axes mend all of them.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> visible_pixels(load_scene("cornell-box"), [Point("7", (186, 165, 168))]).round(1)
    array([[324.1, 336. ]])
    """
    positions = np.array([point.position for point in points], np.float64)
    pixels, there, seen, hits = _looked_at(scene, positions)
    size = scene.settings.width, scene.settings.height
    bad = np.flatnonzero(~_is_visible(pixels, there, seen, size))
    if not bad.size:
        return pixels
    first, faulty = int(bad[0]), [points[int(p)] for p in bad]
    fix = _another_frame(scene, positions, size)
    if not inside(pixels[first], size):
        raise not_in_image(faulty, pixels[first], size, fix)
    what = "hidden from the camera" if seen[first] < there[first] else "not on a surface"
    hit = ", ".join(f"{c:.4g}" for c in hits[first])
    raise OptionError(
        message(
            f"a point is {what}",
            where=places(faulty),
            got="the camera sees nothing" if np.isnan(seen[first]) else f"the camera sees a surface at {hit}",
            expected="a point of a surface that the camera sees",
            fix=fix,
        )
    )


def doubts(points: Sequence[Point], pixels: Array, scene: Scene | None = None) -> list[str]:
    """What is doubtful about the places of points that can be measured.

    Parameters
    ----------
    points : sequence of Point
        P pixels or positions.
    pixels : ndarray of shape (P, 2)
        Where they are in the image.
    scene : Scene, optional
        With the size of the image; needed for positions.

    Returns
    -------
    list of str
        Sentences: all points in one place, or some points at the very same.

    Examples
    --------
    >>> doubts([Point("1", (0.2, 0.9)), Point("2", (0.7, 0.1))], np.array([[0.7, 1.4], [1.2, 0.6]]))[0][:41]
    'all 2 points lie within one pixel: pixels'
    """
    if len(points) < 2:
        return []
    within = np.ptp(pixels, axis=0).max()
    positions = np.array([point.position for point in points if not point.is_pixel], np.float64)
    if scene is not None and len(positions) == len(points):
        extent = float(np.ptp(positions, axis=0).max())
        if within <= 1 or extent <= _ON_SURFACE * _looked_at(scene, positions)[1].min():
            size = scene.settings.width, scene.settings.height
            other = _another_frame(scene, positions, size) or "are they in the units of the scene?"
            return [f"all {len(points)} points lie within {extent:.3g} units of the scene: {other}"]
    elif within <= 1:
        return [
            f"all {len(points)} points lie within one pixel: pixels are columns and rows, counted from 0, "
            "not shares of the image"
        ]
    at: dict[tuple[float, ...], list[str]] = {}
    for point in points:
        at.setdefault(tuple(map(float, point.position)), []).append(point.name)
    return [f"points {', '.join(names)} are at the same place" for names in at.values() if len(names) > 1]


def _looked_at(scene: Scene, positions: Array) -> tuple[Array, Array, Array, Array]:
    """Pixels (P, 2) of positions, distances (P,) of them and of what the camera sees there, and that itself (P, 3)."""
    from fluorspar.paths.tracing.visibility import first_hits
    from fluorspar.scene.camera import camera_of

    camera = camera_of(scene)
    eye = -np.linalg.solve(camera.matrix[:, :3], camera.matrix[:, 3])
    hits = first_hits(scene, positions)
    there, seen = (np.linalg.norm(at - eye, axis=1) for at in (positions, hits))
    return camera.project(positions), there, seen, hits


def _is_visible(pixels: Array, there: Array, seen: Array, size: tuple[int, int]) -> NDArray[np.bool_]:
    return inside(pixels, size) & (np.abs(seen - there) <= _ON_SURFACE * there)


def _another_frame(scene: Scene, positions: Array, size: tuple[int, int]) -> str:
    """In which other units, or order of the axes, the camera sees all positions; empty: in none."""
    frames = {
        f"multiplied by {factor:g} all are on surfaces that the camera sees; "
        "give them in the units of the scene": factor * positions
        for factor in _FACTORS
    }
    for order in list(permutations(range(3)))[1:]:
        axes = ", ".join("xyz"[axis] for axis in order)
        frames[f"with {axes} in place of x, y, z all are on surfaces that the camera sees"] = positions[
            :, order
        ]
    stacked = np.stack(list(frames.values()))
    pixels, there, seen, _ = _looked_at(scene, stacked.reshape(-1, 3))
    fits = _is_visible(pixels, there, seen, size).reshape(len(frames), -1).all(axis=1)
    # shrunk to the origin they would be on any surface there
    fits &= np.abs(stacked).max(axis=(1, 2)) > 10 * _ON_SURFACE * there.min()
    return next((words for words, fit in zip(frames, fits, strict=True) if fit), "")
