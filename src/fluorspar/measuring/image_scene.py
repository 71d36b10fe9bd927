"""The scene that an image was rendered from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fluorspar.errors import OptionError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import METHODS
from fluorspar.scene.scene import Scene

__all__ = ["as_seen", "built_in_scene", "given_scene", "scene_of"]


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
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> scene_of(SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())) is None
    True
    """
    return built_in_scene(image.attrs, required=required)


def as_seen(scene: Scene, attrs: Mapping[str, Any]) -> Scene:
    """Move the camera of a scene to where it stood for an image with these attributes.

    Examples
    --------
    >>> scene = built_in_scene({"scene": "cornell-box"})
    >>> print(as_seen(scene, {"method": "paths", "camera": "fov=20"}).settings.viewpoint)
    fov=20
    """
    from fluorspar.scene.camera import seen_from

    camera = attrs.get("camera")  # None in images of light paths that were never saved
    return seen_from(scene, str(camera)) if camera and attrs.get("method") in METHODS else scene


def built_in_scene(attrs: Mapping[str, Any], *, required: bool = False) -> Scene | None:
    """Load the built-in scene that the attributes of an image, or of the job that makes it, name; see `scene_of`.

    Examples
    --------
    >>> built_in_scene({"scene": "cornell-box"}).name
    'cornell-box'
    """
    from fluorspar.scene.builtin import BUILTIN
    from fluorspar.scene.loading import load_scene

    name = str(attrs.get("scene", ""))
    if name in BUILTIN:
        stated = attrs.get("parameters")
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
        return as_seen(load_scene(name, parameters=parameters), attrs)
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
