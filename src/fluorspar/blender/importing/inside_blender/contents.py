"""What a render shows: the objects, lights and materials of one state of a scene."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from .image_files import Images
from .lamps import light_of
from .mesh_files import Meshes
from .node_table import Nodes
from .values import Said, plain, rows
from .view import camera_of

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["described"]

SOLID = ("MESH", "CURVE", "SURFACE", "FONT", "META")  # have a mesh
SHOWN_OTHERWISE = ("CURVES", "VOLUME", "POINTCLOUD", "GPENCIL", "GREASEPENCIL")


def material_of(material: Any, nodes: Nodes) -> Said:
    return {
        "name": material.name,
        "key": material.name_full,  # of those from other files, names may be the same
        "nodes": nodes.outputs(material),
        "colour": plain(material.diffuse_color),
        "metallic": material.metallic,
        "roughness": material.roughness,
        "fluorspar": plain(material.get("fluorspar")),
        "concentration": plain(material.get("fluorspar_concentration")),
    }


def described(depsgraph: Any, arrays: Path, textures: Path) -> Said:
    """Everything that a render of this state of the scene would show."""
    scene, override = depsgraph.scene, depsgraph.view_layer.material_override
    nodes, meshes = Nodes(Images(textures)), Meshes(arrays)
    materials: dict[str, Said] = {}
    objects, lights, others = [], [], []
    for instance in depsgraph.object_instances:
        thing = instance.object
        if not instance.show_self:
            continue
        name = thing.name
        if instance.is_instance and instance.parent is not None:
            name = f"{instance.parent.name}/{name}"
        place = rows(instance.matrix_world)
        if any(system.settings.type == "HAIR" for system in thing.particle_systems):
            others.append([name, "HAIR"])
        if thing.type == "LIGHT":
            lights.append({"name": name, "matrix": place, **light_of(thing, nodes)})
        elif thing.type in SOLID:
            mesh = meshes.number(thing)
            if mesh is None:
                continue
            slots = [slot.material for slot in thing.material_slots]
            if override is not None:
                slots = [override] * max(len(slots), 1)
            for material in slots:
                if material is not None and material.name_full not in materials:
                    materials[material.name_full] = material_of(material, nodes)
            hidden = [
                way
                for way in ("camera", "diffuse", "glossy", "transmission", "shadow")
                if not getattr(thing, f"visible_{way}")
            ]
            hidden += [way for way in ("is_shadow_catcher", "is_holdout") if getattr(thing, way, False)]
            names = [material and material.name_full for material in slots]
            objects.append(
                {"name": name, "mesh": mesh, "matrix": place, "materials": names, "hidden": hidden}
            )
        elif thing.type in SHOWN_OTHERWISE:
            others.append([name, thing.type])
    world = scene.world
    return {
        "version": list(bpy.app.version),
        "written_by": list(bpy.data.version),
        "camera": camera_of(scene, depsgraph),
        "world": world and {"name": world.name, "colour": plain(world.color), "nodes": nodes.outputs(world)},
        "objects": objects,
        "lights": lights,
        "others": others,
        "materials": list(materials.values()),
        "meshes": meshes.table,
        "nodes": nodes.table,
        "images": nodes.images.table,
        "layers": [layer.name for layer in scene.view_layers if layer.use],
        "libraries": [
            library.filepath
            for library in bpy.data.libraries
            if not os.path.isfile(bpy.path.abspath(library.filepath))
        ],
    }
