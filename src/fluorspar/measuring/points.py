"""Points to be measured: pixels of an image or positions in a scene."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.files.tables import read_table

__all__ = ["Point", "pixels_of", "points_of", "read_points"]

_COLUMNS = ("point", "x", "y", "z", "white", "note")


@dataclass(frozen=True)
class Point:
    """One point.

    Parameters
    ----------
    name : str
    position : tuple of float
        (x, y): a pixel, column from the left and row from the top, from 0, fractions allowed, the centre of a
        pixel is a whole number. (x, y, z): a position on a surface of the scene, in scene units.
    white : float, optional
        Reflectance of a known matte white there.
    note : str
        What is there.

    Examples
    --------
    >>> Point("7", (186, 165, 168)).is_pixel
    False
    """

    name: str
    position: tuple[float, ...]
    white: float | None = None
    note: str = ""

    def __post_init__(self) -> None:
        numbers = np.asarray(self.position)
        if (
            numbers.shape not in ((2,), (3,))
            or numbers.dtype.kind not in "iuf"
            or not np.isfinite(numbers).all()
        ):
            raise OptionError(
                message(
                    "a point is not usable",
                    where=f"point {self.name}",
                    got=self.position,
                    expected="x, y or x, y, z",
                )
            )
        number = isinstance(self.white, int | float | np.number)
        if self.white is not None and not (number and 0 < self.white <= 1):
            raise OptionError(
                message(
                    "a white is impossible",
                    where=f"point {self.name}",
                    got=self.white,
                    expected="a reflectance, 0 to 1",
                )
            )

    @property
    def is_pixel(self) -> bool:
        """Whether it is a pixel, not a position in the scene."""
        return len(self.position) == 2


def read_points(path: str | os.PathLike[str]) -> tuple[Point, ...]:
    """Read a points file: CSV with the columns `point`, `x`, `y` and, for positions in the scene, `z`.

    A row whose `z` is empty is a pixel. Further columns may be `white`, the reflectance of a known white (empty:
    none), and `note`.

    Parameters
    ----------
    path : str or path-like

    Returns
    -------
    tuple of Point

    Raises
    ------
    OptionError
        If the file is missing, a column is unknown or missing, a cell is not a number, or a name is
        empty or occurs twice.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "points.csv"
    >>> _ = path.write_text("point,x,y,white\\n1,10,20,\\n2,30,40,0.85\\n")
    >>> read_points(path)[1]
    Point(name='2', position=(30.0, 40.0), white=0.85, note='')
    """
    path = Path(path)
    table = read_table(path, error=OptionError, named_rows=True)
    header = [name.lower() for name in table.header]
    unknown = [name for name in header if name not in _COLUMNS]
    missing = [name for name in _COLUMNS[:3] if name not in header]
    if unknown or missing or len(set(header)) < len(header):
        problem = (
            f"unknown: {', '.join(unknown)}"
            if unknown
            else f"missing: {', '.join(missing)}"
            if missing
            else "one occurs twice"
        )
        raise OptionError(
            message(
                "the columns of a points file are not right",
                where=path,
                got=problem,
                expected="point, x, y[, z][, white][, note]",
            )
        )
    points = []
    for row in table.rows:
        cells = dict(zip(header, row, strict=True))
        if not cells["point"]:
            raise OptionError(message("a point has no name", where=path, got=", ".join(row)))
        try:
            flat = not cells.get("z", "")
            position = tuple(float(cells[axis]) for axis in ("xy" if flat else "xyz"))
            white = float(cells["white"]) if cells.get("white") else None
        except ValueError as err:
            raise OptionError(
                message("a cell is not a number", where=f"{path}, point {cells['point']}", got=err)
            ) from err
        points.append(Point(cells["point"], position, white, cells.get("note", "")))
    names = [point.name for point in points]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise OptionError(message("a point occurs twice", where=path, got=", ".join(twice)))
    return tuple(points)


def points_of(points: Sequence[Point] | str | os.PathLike[str]) -> tuple[Point, ...]:
    """The points that are given, or those of a points file.

    Raises
    ------
    OptionError
        If they are neither, or there are none.

    Examples
    --------
    >>> points_of([Point("1", (3, 4))])
    (Point(name='1', position=(3, 4), white=None, note=''),)
    """
    expected = "a sequence of Point, such as [Point('1', (x, y))], or the path of a points file"
    if isinstance(points, str | os.PathLike):
        return read_points(points)
    given = tuple(points) if isinstance(points, Iterable) else (points,)
    if not given:
        raise OptionError(message("there are no points", got=repr(points), expected=expected))
    for one in given:
        if not isinstance(one, Point):
            where = f"in a {type(points).__name__}" if isinstance(points, Iterable) else None
            raise OptionError(message("this is not a point", where=where, got=repr(one), expected=expected))
    return given


def pixels_of(
    points: tuple[Point, ...], size: tuple[int, int], projected: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Where points appear, in continuous image coordinates: (0.5, 0.5) is the centre of the first pixel.

    Parameters
    ----------
    points : tuple of Point
    size : (int, int)
        Width and height of the image.
    projected : ndarray of shape (P, 2) or None
        Where the camera sees those that are positions; None if none is.

    Returns
    -------
    ndarray of shape (P, 2)

    Raises
    ------
    OptionError
        If a point lies outside the image, or behind the camera.

    Examples
    --------
    >>> pixels_of((Point("1", (3, 4)),), (10, 10), None)
    array([[3.5, 4.5]])
    """
    pixels = np.empty((len(points), 2))
    for row, point in enumerate(points):
        pixels[row] = (
            np.array(point.position) + 0.5 if point.is_pixel or projected is None else projected[row]
        )
        x, y = pixels[row]
        if not (0 <= x < size[0] and 0 <= y < size[1]):
            raise OptionError(
                message(
                    "a point is outside the image" if np.isfinite(x) else "a point is behind the camera",
                    where=f"point {point.name} at {', '.join(f'{c:g}' for c in point.position)}",
                    got=f"pixel ({x - 0.5:.1f}, {y - 0.5:.1f})",
                    expected=f"x from 0 to {size[0] - 1}, y from 0 to {size[1] - 1}",
                )
            )
    return pixels
