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
        number = isinstance(self.diameter, int | float | np.number)
        if self.unit not in ("deg", "px") or not number or not 0 < self.diameter < limit:
            raise OptionError(
                message(
                    "the aperture is impossible",
                    got=f"{self.diameter}{self.unit}",
                    expected="a diameter, such as 0.125deg or 3px, below 180 degrees",
                )
            )

    @classmethod
    def of(cls, aperture: Aperture | str | None) -> Aperture | None:
        """Read an aperture in the forms that `measure` takes; None stays None.

        Examples
        --------
        >>> Aperture.of("3px")
        Aperture(diameter=3.0, unit='px')
        """
        if aperture is None or isinstance(aperture, Aperture):
            return aperture
        if isinstance(aperture, str):
            return cls.parse(aperture)
        raise OptionError(
            message(
                "the aperture is not readable",
                got=repr(aperture),
                expected='an Aperture, or its diameter as text, such as "0.125deg" or "3px"',
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
        unit = "pixel" if self.unit == "px" else "degree"
        return f"{self.diameter:g} {unit}{'' if self.diameter == 1 else 's'}"


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
                fix="name the scene (--scene), or give the aperture in pixels, 3px (--aperture 3px)",
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
    pixel = np.floor(centre).astype(int)
    low = np.minimum(np.maximum(np.floor(centre - reach), 0).astype(int), pixel)
    high = np.maximum(np.minimum(np.ceil(centre + reach), size).astype(int), pixel + 1)
    fine = (np.arange(_FINE) + 0.5) / _FINE
    across = np.arange(low[0], high[0])[:, np.newaxis] + fine  # (columns, _FINE)
    weights = np.empty(high[::-1] - low[::-1])
    for row in range(low[1], high[1]):  # all at once would be a large array
        points = np.stack(np.broadcast_arrays(across, row + fine[:, np.newaxis, np.newaxis]), axis=-1)
        weights[row - low[1]] = _inside(points, centre, aperture, camera_matrix).mean(axis=(0, 2))
    if not weights.any():
        weights[pixel[1] - low[1], pixel[0] - low[0]] = 1.0
    used_rows, used_columns = np.flatnonzero(weights.any(axis=1)), np.flatnonzero(weights.any(axis=0))
    top, left = int(used_rows[0]), int(used_columns[0])
    weights = weights[top : used_rows[-1] + 1, left : used_columns[-1] + 1]
    rows = slice(int(low[1]) + top, int(low[1]) + top + weights.shape[0])
    columns = slice(int(low[0]) + left, int(low[0]) + left + weights.shape[1])
    return rows, columns, weights / weights.sum()


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
