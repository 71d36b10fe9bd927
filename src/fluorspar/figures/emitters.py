"""The emitters of the staged method on the surface that they are: faces, centres, front and rear."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.figures.style import blank, put_title, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["emitters_figure"]

Array = NDArray[np.float64]
_HELD = ("corner", "face", "patch_of_face", "centre", "area", "emission")
_COLOURS = 20  # of neighbouring emitters
_SPREAD = 7  # prime to it, so that numbers that follow one another differ much


def emitters_figure(path: str | os.PathLike[str]) -> Figure:
    """Draw the emitters of an object, as the staged method has left them in `L_F-OBJECT.nc`.

    Parameters
    ----------
    path : path-like
        A file `L_F-OBJECT.nc` of `StagedOptions.keep_intermediate`.

    Returns
    -------
    Figure
        Each emitter in a colour of its own, with its centre, seen from the side that most of its area faces and from
        the opposite one; centres are drawn where their emitter faces the viewer.

    Raises
    ------
    ImageError
        If the file cannot be read, or holds no emitters.
    """
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf") as opened:
            emitters = opened.load()
    except (OSError, ValueError) as err:
        raise ImageError(message("the file of emitters cannot be read", where=path, got=err)) from err
    if missing := [name for name in _HELD if name not in emitters]:
        fix = "render with --method staged --keep-intermediate DIR, and give DIR/L_F-OBJECT.nc"
        raise ImageError(message("the file holds no emitters", where=path, got=f"no {missing[0]}", fix=fix))
    return styled(_emitters, emitters, str(emitters.attrs.get("object", Path(path).stem)))


def _emitters(emitters: Any, name: str) -> Figure:
    from matplotlib import colormaps
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    triangles = emitters.corner.values[emitters.face.values]
    patch, centre = emitters.patch_of_face.values, emitters.centre.values
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal = np.stack([np.bincount(patch, part, len(centre)) for part in across.T], axis=1)
    towards = _front(across)
    colours = colormaps["tab20"]((patch * _SPREAD) % _COLOURS)
    figure = blank(7.2, 3.8)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle, half = (low + high) / 2, max(float((high - low).max()) / 2, 1e-12)
    for number, (side, view) in enumerate((("front", towards), ("rear", -towards)), start=1):
        space: Any = figure.add_subplot(1, 2, number, projection="3d", computed_zorder=False)
        space.add_collection3d(
            Poly3DCollection(triangles, facecolors=colours, edgecolors="0.3", linewidths=0.1)
        )
        facing = normal @ view > 0
        dots = centre[facing] + 0.01 * half * view
        space.scatter(*dots.T, color="black", s=4, depthshade=False, zorder=3)
        for axis, at in zip("xyz", middle, strict=True):
            getattr(space, f"set_{axis}lim")(at - half, at + half)
            getattr(space, f"set_{axis}label")(axis)
        space.set_box_aspect((1, 1, 1), zoom=0.8)
        space.view_init(np.degrees(np.arcsin(view[2])), np.degrees(np.arctan2(view[1], view[0])))
        put_title(space, f"{name}, {len(centre)} emitters, {side}")
    return figure


def _front(across: Array) -> Array:
    """The direction that most of the area faces; of a closed surface, which faces none, a corner of a cube."""
    mean = across.sum(axis=0)
    closed = np.linalg.norm(mean) < 1e-3 * np.linalg.norm(across, axis=1).sum()
    towards = np.array([1.0, 1.0, 1.0]) if closed else mean
    tilted = towards / np.linalg.norm(towards) + np.array([0.3, 0.2, 0.25])  # not exactly along an axis
    return np.asarray(tilted / np.linalg.norm(tilted))
