"""The scenes that come with Fluorspar."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from pathlib import Path

__all__ = ["BUILTIN", "builtin_parameters", "builtin_path"]

BUILTIN = {
    "cornell-box": "the Cornell box with two fluorescent side walls under CIE D65, 512 x 512",
    "cornell-mesh": "the same box with a curved fluorescent object, or a mesh of yours, 512 x 512",
    "cornell-classic": "the Cornell box as measured at Cornell, not fluorescent, 512 x 512",
    "still-life": "a table with textures, gloss, glass and metal under a UV lamp, coated and printed dyes, 640 x 480",
    "furnace": "a closed cube that fluoresces and emits everywhere, and has a closed form, 128 x 128",
}


def builtin_path(name: str) -> Path:
    """Path of the XML file of a built-in scene.

    Raises
    ------
    KeyError
        If there is no such scene.

    Examples
    --------
    >>> builtin_path("furnace").name
    'furnace.xml'
    """
    if name not in BUILTIN:
        raise KeyError(name)
    return Path(str(resources.files("fluorspar") / "data" / "scenes" / f"{name}.xml"))


def builtin_parameters(name: str, parameters: Mapping[str, str]) -> dict[str, str]:
    """Complete the `$key` substitutions of a built-in scene.

    For `cornell-mesh`, `mesh` names a mesh file of the user's (OBJ, PLY, STL, glTF) or is left out; what the
    scene file gets is the mesh, or a procedural one, fitted into the box.

    Raises
    ------
    SceneError
        If the mesh cannot be read or has no faces.

    Examples
    --------
    >>> builtin_parameters("furnace", {"spp": "4"})
    {'spp': '4'}
    """
    if name != "cornell-mesh":
        return dict(parameters)
    from fluorspar.scene.objects.object_mesh import object_file

    given = parameters.get("mesh")
    return {**parameters, "mesh": str(object_file(Path(given) if given else None))}
