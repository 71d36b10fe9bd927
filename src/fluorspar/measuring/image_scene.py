"""The scene that an image was rendered from, as the image saw it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fluorspar.errors import OptionError, message
from fluorspar.image.stated import METHODS
from fluorspar.scene.scene import Scene

__all__ = ["given_scene", "scene_of"]


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


def scene_of(
    attrs: Mapping[str, Any], scene: Scene | str | Path | None = None, *, required: bool = False
) -> Scene | None:
    """Load the scene that an image shows, with its camera where it stood for the image.

    Parameters
    ----------
    attrs : mapping
        What the image, or the job that makes it, says of itself.
    scene : Scene, str or Path, optional
        The scene. By default the built-in one that the image names, with the parameters it was rendered with.
    required : bool
        Raise if it cannot be told.

    Raises
    ------
    OptionError
        If it is required, not given, and the image names no built-in scene; or the mesh it was rendered with is gone.
    SceneError
        If it cannot be loaded.

    Examples
    --------
    >>> scene_of({"scene": "a room"}) is None
    True
    >>> print(scene_of({"scene": "cornell-box", "method": "paths", "camera": "fov=20"}).settings.viewpoint)
    fov=20
    """
    from fluorspar.scene.camera import seen_from

    found = _built_in(attrs, required) if scene is None else given_scene(scene)
    camera = attrs.get("camera")  # None in images of light paths that were never saved
    return seen_from(found, str(camera)) if found and camera and attrs.get("method") in METHODS else found


def _built_in(attrs: Mapping[str, Any], required: bool) -> Scene | None:
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
                    fix=f"put it back, or say where it is now: parameters (--scene {name} -D mesh=FILE)",
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
