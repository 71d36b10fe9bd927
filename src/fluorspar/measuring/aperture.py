"""The measuring aperture: which share of each pixel it covers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message

__all__ = ["Aperture", "coverage", "directions", "radius_in_pixels"]

Array = NDArray[np.float64]

_FINE = 16  # points along each side of a pixel


@dataclass(frozen=True)
class Aperture:
    """A round aperture.

    Parameters
    ----------
    diameter : float
    unit : str
        "deg": the angle it subtends at the camera; "px": pixels.

    Raises
    ------
    OptionError
        If the diameter is not positive, 180 degrees or more, or the unit is another one.

    Examples
    --------
    >>> Aperture.parse("0.125deg"), Aperture.parse("3px")
    (Aperture(diameter=0.125, unit='deg'), Aperture(diameter=3.0, unit='px'))
    """

    diameter: float = 0.125
    unit: str = "deg"

    def __post_init__(self) -> None:
        limit = 180.0 if self.unit == "deg" else np.inf  # a half space
        if self.unit not in ("deg", "px") or not 0 < self.diameter < limit:
            raise OptionError(
                message(
                    "the aperture is impossible",
                    got=f"{self.diameter}{self.unit}",
                    expected="a diameter, such as 0.125deg or 3px, below 180 degrees",
                )
            )

    @classmethod
    def parse(cls, text: str) -> Aperture:
        """Read `0.125deg` or `3px`."""
        for unit in ("deg", "px"):
            if text.strip().lower().endswith(unit):
                try:
                    return cls(float(text.strip()[: -len(unit)]), unit)
                except ValueError:
                    break
        raise OptionError(
            message(
                "the aperture is not readable", got=repr(text), expected="a diameter, such as 0.125deg or 3px"
            )
        )

    def __str__(self) -> str:
        return f"{self.diameter:g} {'pixels' if self.unit == 'px' else 'degrees'}"


def directions(pixels: Array, camera_matrix: Array) -> Array:
    """Unit vectors from the camera through image points.

    Parameters
    ----------
    pixels : ndarray of shape (..., 2)
        Continuous image coordinates.
    camera_matrix : ndarray of shape (3, 4)
        Homogeneous pixels = matrix @ (x, y, z, 1).

    Returns
    -------
    ndarray of shape (..., 3)

    Examples
    --------
    >>> matrix = np.array([[100.0, 0, 64, 0], [0, 100.0, 48, 0], [0, 0, 1, 0]])
    >>> directions(np.array([64.0, 48.0]), matrix)
    array([0., 0., 1.])
    """
    homogeneous = np.concatenate([pixels, np.ones((*pixels.shape[:-1], 1))], axis=-1)
    rays = homogeneous @ np.linalg.inv(camera_matrix[:, :3]).T
    return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))


def radius_in_pixels(centre: Array, aperture: Aperture, camera_matrix: Array | None = None) -> float:
    """The greatest distance from the centre to the edge of an aperture, in pixels.

    Parameters
    ----------
    centre : ndarray of shape (2,)
        Continuous image coordinates.
    aperture : Aperture
    camera_matrix : ndarray of shape (3, 4), optional

    Raises
    ------
    OptionError
        If the aperture is in degrees and there is no camera.

    Examples
    --------
    >>> radius_in_pixels(np.array([3.5, 4.5]), Aperture(3, "px"))
    1.5
    """
    if aperture.unit == "px":
        return aperture.diameter / 2
    if camera_matrix is None:
        raise OptionError(
            message(
                "an aperture in degrees needs the camera",
                got=str(aperture),
                fix="name the scene (--scene), or give the aperture in pixels (--aperture 3px)",
            )
        )
    axis = directions(centre, camera_matrix)
    angle = np.radians(aperture.diameter / 2)
    # two directions at right angles to the axis; the edge is projected back to the image
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)[:, np.newaxis]
    edge = np.cos(angle) * axis + np.sin(angle) * (np.cos(turn) * first + np.sin(turn) * second)
    projected = edge @ camera_matrix[:, :3].T
    return float(np.linalg.norm(projected[:, :2] / projected[:, 2:] - centre, axis=1).max() * (1 + 1e-3))


def coverage(
    centre: Array, aperture: Aperture, size: tuple[int, int], camera_matrix: Array | None = None
) -> tuple[slice, slice, Array]:
    """Find which pixels an aperture covers, and how much of each.

    Parameters
    ----------
    centre : ndarray of shape (2,)
        Continuous image coordinates: (0.5, 0.5) is the centre of the first pixel.
    aperture : Aperture
    size : (int, int)
        Width and height of the image; the aperture is cut at its edge.
    camera_matrix : ndarray of shape (3, 4), optional
        Needed for an aperture in degrees.

    Returns
    -------
    rows, columns : slice
        The part of the image.
    weights : ndarray of shape (rows, columns)
        They sum to 1. An aperture that is smaller than a sixteenth of a pixel measures the pixel it is in.

    Raises
    ------
    OptionError
        If the aperture is in degrees and there is no camera.

    Examples
    --------
    >>> rows, columns, weights = coverage(np.array([3.5, 4.5]), Aperture(1, "px"), (10, 10))
    >>> rows, columns, weights
    (slice(4, 5, None), slice(3, 4, None), array([[1.]]))
    """
    reach = radius_in_pixels(centre, aperture, camera_matrix)
    low = np.maximum(np.floor(centre - reach), 0).astype(int)
    high = np.minimum(np.ceil(centre + reach), size).astype(int)
    low, high = (
        np.minimum(low, np.floor(centre).astype(int)),
        np.maximum(high, np.floor(centre).astype(int) + 1),
    )
    weights = _covered(low, high, centre, aperture, camera_matrix)
    if not weights.any():
        weights[int(centre[1]) - low[1], int(centre[0]) - low[0]] = 1.0
    used_rows, used_columns = np.flatnonzero(weights.any(axis=1)), np.flatnonzero(weights.any(axis=0))
    top, left = int(used_rows[0]), int(used_columns[0])
    weights = weights[top : used_rows[-1] + 1, left : used_columns[-1] + 1]
    rows = slice(int(low[1]) + top, int(low[1]) + top + weights.shape[0])
    columns = slice(int(low[0]) + left, int(low[0]) + left + weights.shape[1])
    return rows, columns, weights / weights.sum()


def _covered(
    low: NDArray[np.int_],
    high: NDArray[np.int_],
    centre: Array,
    aperture: Aperture,
    camera_matrix: Array | None,
) -> Array:
    """The covered share of each pixel from `low` to `high`, ndarray of shape (rows, columns)."""
    columns, rows = (np.arange(first, last) for first, last in zip(low, high, strict=True))
    corners = np.stack(np.meshgrid(np.append(columns, high[0]), np.append(rows, high[1])), axis=-1)
    inside = _inside(corners.astype(np.float64), centre, aperture, camera_matrix)
    four = np.stack([inside[:-1, :-1], inside[:-1, 1:], inside[1:, :-1], inside[1:, 1:]])
    weights = np.asarray(four.all(axis=0), dtype=np.float64)  # an aperture is convex
    # a pixel without a corner inside is covered only next to one that has one, or next to the centre
    touched = np.pad(four.any(axis=0), 1)
    touched[int(centre[1]) - low[1] + 1, int(centre[0]) - low[0] + 1] = True
    near = np.any(
        [touched[y : y + len(rows), x : x + len(columns)] for y in range(3) for x in range(3)], axis=0
    )
    at = np.argwhere(near & (weights == 0))
    fine = (np.arange(_FINE) + 0.5) / _FINE
    points = np.stack(np.meshgrid(fine, fine), axis=-1) + (at[:, ::-1] + low)[:, np.newaxis, np.newaxis]
    shares = _inside(points, centre, aperture, camera_matrix).mean(axis=(1, 2))
    weights[at[:, 0], at[:, 1]] = shares
    return weights


def _inside(
    points: Array, centre: Array, aperture: Aperture, camera_matrix: Array | None
) -> NDArray[np.bool_]:
    """Whether image points are inside the aperture; ndarray of shape (..., 2) to (...,)."""
    if camera_matrix is None or aperture.unit == "px":
        return np.asarray(np.linalg.norm(points - centre, axis=-1) <= aperture.diameter / 2)
    axis = directions(centre, camera_matrix)
    # the chord, since the cosine of so small an angle has few digits
    chord = np.linalg.norm(directions(points, camera_matrix) - axis, axis=-1)
    return np.asarray(chord <= 2 * np.sin(np.radians(aperture.diameter) / 4))
