"""Opens a file, and lets Blender begin a render of it to see what that would show."""

from __future__ import annotations

import json
import traceback
from pathlib import Path
from typing import Any

from .contents import described
from .values import Said
from .view import settings_of

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["describe"]


def describe(file: str, arrays: str, textures: str, out: str) -> Said:
    """Open a file and describe it as it would be rendered: with what its modifiers do then."""
    try:
        bpy.ops.wm.open_mainfile(filepath=file, load_ui=False, use_scripts=False)
    except RuntimeError as err:
        return {"refused": str(err)}
    found: list[Any] = []

    class Engine(bpy.types.RenderEngine):  # type: ignore[misc]
        bl_idname, bl_label = "DESCRIBING", "describing"

        def render(self, depsgraph: Any) -> None:
            if found:
                return  # another view layer
            try:
                found.append(described(depsgraph, Path(arrays), Path(textures)))
            except Exception:
                found.append(traceback.format_exc())

    bpy.utils.register_class(Engine)
    scene = bpy.context.scene
    if scene.camera is None:
        return {"refused": "no camera"}
    settings = settings_of(scene)
    scene.render.engine = Engine.bl_idname
    scene.render.use_compositing = scene.render.use_sequencer = scene.render.use_border = False
    scene.render.resolution_percentage = 100
    bpy.ops.render.render(write_still=False)
    if not found or isinstance(found[0], str):
        raise RuntimeError(found[0] if found else "the scene was not rendered")
    with open(out, "w", encoding="utf-8") as text:
        json.dump({**found[0], "settings": settings}, text)
    return {}
