"""The scene that an image was rendered from, and where its camera sees points of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.points import Point
from fluorspar.scene.scene import Scene

__all__ = ["given_scene", "scene_of", "visible_pixels"]

Array = NDArray[np.float64]

_ON_SURFACE = 2e-3  # of the distance to the camera


def given_scene(scene: Scene | str | Path | None) -> Scene | None:
    """Load a scene that is given by its name or path; None stays None.

    Raises
    ------
    SceneError
        If it cannot be loaded.

    Examples
    --------
    >>> given_scene("cornell-box").name
    'cornell-box'
    """
    from fluorspar.scene.loading import load_scene

    return scene if scene is None or isinstance(scene, Scene) else load_scene(scene)


def scene_of(image: SpectralImage, *, required: bool = False) -> Scene | None:
    """Load the scene an image was rendered from, if it is built-in, with the parameters it was rendered with.

    Parameters
    ----------
    image : SpectralImage
    required : bool
        Raise if it cannot be told.

    Raises
    ------
    OptionError
        If it is required and the image names no built-in scene, or the mesh it was rendered with is gone.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> scene_of(SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())) is None
    True
    """
    from fluorspar.scene.builtin import BUILTIN
    from fluorspar.scene.loading import load_scene

    name = str(image.attrs.get("scene", ""))
    if name in BUILTIN:
        stated = image.attrs.get("parameters")
        parameters = stated if isinstance(stated, dict) else {}
        mesh = parameters.get("mesh")
        if mesh is not None and not Path(mesh).is_file():
            raise OptionError(
                message(
                    "the mesh that the image was rendered with is gone",
                    where=f"scene {name}",
                    got=mesh,
                    fix=f"put it back, or load the scene with its place: parameters (--scene {name} -D mesh=FILE)",
                )
            )
        return load_scene(name, parameters=parameters)
    if required:
        raise OptionError(
            message(
                "the scene is needed for positions in it, and for an aperture in degrees",
                got=f"an image of {name!r}" if name else "an image that names no scene",
                fix="give the scene as it was rendered (--scene, -D KEY=VALUE), or pixels and an aperture in pixels, "
                "3px (--aperture 3px)",
            )
        )
    return None


def visible_pixels(scene: Scene, points: tuple[Point, ...]) -> Array:
    """Where the camera sees the points that are positions.

    Parameters
    ----------
    scene : Scene
        With the size of the image.
    points : tuple of Point
        P points, some of them pixels perhaps.

    Returns
    -------
    ndarray of shape (P, 2)
        Continuous image coordinates; NaN for points that are pixels, or behind the camera.

    Raises
    ------
    OptionError
        If a point is hidden from the camera, or is not on a surface.
    """
    from fluorspar.paths.tracing.visibility import first_hits
    from fluorspar.scene.camera import camera_of

    pixels = np.full((len(points), 2), np.nan)
    rows = [row for row, point in enumerate(points) if not point.is_pixel]
    positions = np.array([points[row].position for row in rows])
    camera = camera_of(scene)
    pixels[rows] = camera.project(positions)
    eye = -np.linalg.solve(camera.matrix[:, :3], camera.matrix[:, 3])
    hits = first_hits(scene, positions)
    for row, position, hit in zip(rows, positions, hits, strict=True):
        there, seen = np.linalg.norm(position - eye), np.linalg.norm(hit - eye)
        if np.isnan(pixels[row]).any() or abs(seen - there) <= _ON_SURFACE * there:
            continue  # behind the camera: said when it is looked up in the image
        what = "a point is hidden from the camera" if seen < there else "a point is not on a surface"
        sees = "nothing" if np.isnan(seen) else "a surface at " + ", ".join(f"{c:.4g}" for c in hit)
        raise OptionError(
            message(
                what,
                where=f"point {points[row].name} at {', '.join(f'{c:g}' for c in position)}",
                got=f"the camera sees {sees}",
                expected="a point of a surface that the camera sees",
            )
        )
    return pixels
