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

__all__ = ["Point", "inside", "not_in_image", "pixels_of", "places", "points_of", "read_points"]

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
                    fix="write per cent as a share: 85 % is 0.85" if number and 1 < self.white <= 100 else "",
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
    twice = sorted({name for name in header if header.count(name) > 1})
    if unknown or missing or twice:
        faults = (("unknown", unknown), ("missing", missing), ("twice", twice))
        raise OptionError(
            message(
                "the columns of a points file are not right",
                where=path,
                got="; ".join(f"{what}: {', '.join(names)}" for what, names in faults if names),
                expected="point, x, y[, z][, white][, note]",
                fix="write the names of the columns above the first point"
                if len(unknown) == len(header)
                else "",
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


def pixels_of(points: tuple[Point, ...], size: tuple[int, int]) -> NDArray[np.float64]:
    """Where points that are pixels lie, in continuous image coordinates: (0.5, 0.5) is the centre of the first pixel.

    Parameters
    ----------
    points : tuple of Point
    size : (int, int)
        Width and height of the image.

    Returns
    -------
    ndarray of shape (P, 2)
        NaN for points that are positions.

    Raises
    ------
    OptionError
        If a point lies outside the image.

    Examples
    --------
    >>> pixels_of((Point("1", (3, 4)), Point("2", (186, 165, 168))), (10, 10))
    array([[3.5, 4.5],
           [nan, nan]])
    """
    pixels = np.array([point.position if point.is_pixel else (np.nan, np.nan) for point in points]) + 0.5
    given = np.flatnonzero(~np.isnan(pixels[:, 0]))
    outside = given[~inside(pixels[given], size)]
    if outside.size:
        fix = ""
        if inside(pixels[given][:, ::-1], size).all():
            fix = "exchange x and y: x is the column from the left, y the row from the top"
        elif inside(pixels[given] - 1, size).all():
            fix = "count from 0: the first pixel is 0, 0"
        raise not_in_image([points[p] for p in outside], pixels[outside[0]], size, fix)
    return pixels


def inside(pixels: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Whether image points (..., 2) are in an image of some width and height; NaN is not.

    Examples
    --------
    >>> inside(np.array([[0.5, 0.5], [10.0, 3.0]]), (10, 10))
    array([ True, False])
    """
    return np.asarray(((pixels >= 0) & (pixels < size)).all(axis=-1))


def not_in_image(
    points: Sequence[Point], pixel: NDArray[np.float64], size: tuple[int, int], fix: str
) -> OptionError:
    """The error that some points are not in the image; `pixel` is where the first of them is, NaN: behind the camera.

    Examples
    --------
    >>> raise not_in_image([Point("1", (12, 4)), Point("2", (3, 40))], np.array([12.5, 4.5]), (10, 10), "")
    Traceback (most recent call last):
    ...
    fluorspar.errors.OptionError: a point is outside the image
      where:    point 1 at 12, 4, and 1 other
      got:      pixel (12.0, 4.0)
      expected: x from 0 to 9, y from 0 to 9
    """
    return OptionError(
        message(
            "a point is outside the image" if np.isfinite(pixel[0]) else "a point is behind the camera",
            where=places(points),
            got=f"pixel ({pixel[0] - 0.5:.1f}, {pixel[1] - 0.5:.1f})",
            expected=f"x from 0 to {size[0] - 1}, y from 0 to {size[1] - 1}",
            fix=fix,
        )
    )


def places(points: Sequence[Point]) -> str:
    """Name the first of some points with its place, and say how many there are.

    Examples
    --------
    >>> places([Point("1", (12, 4)), Point("2", (3, 40))])
    'point 1 at 12, 4, and 1 other'
    """
    first, *others = points
    more = f", and {len(others)} other{'s' if len(others) > 1 else ''}" if others else ""
    return f"point {first.name} at {', '.join(f'{c:g}' for c in first.position)}{more}"
