"""Runs inside Blender, not in Fluorspar: opens a file and says what a render of it would show.

Run as `fluorspar.blender.process` does. Nothing is interpreted here: meshes are arrays in files, everything else is
one JSON file. Blender's Python may lack NumPy, so arrays are those of the module `array`.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import traceback
from array import array
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __name__ == "__main__":
    import bpy

SOLID = ("MESH", "CURVE", "SURFACE", "FONT", "META")  # have a mesh
SHOWN_OTHERWISE = ("CURVES", "VOLUME", "POINTCLOUD", "GPENCIL", "GREASEPENCIL")
KEPT_FORMATS = {
    "PNG": ".png",
    "JPEG": ".jpg",
    "OPEN_EXR": ".exr",
    "HDR": ".hdr",
    "BMP": ".bmp",
}
SIMPLE = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")

Said = dict[str, Any]


def plain(value: Any) -> Any:
    """A value of Blender as JSON has it; None for what has none."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    try:
        return [float(v) for v in value]
    except (TypeError, ValueError):
        return None


def rows(matrix: Any) -> list[list[float]]:
    return [list(row) for row in matrix]


class Nodes:
    """All shader nodes that are reached, in one table; groups, reroutes and muted nodes are followed through."""

    def __init__(self, images: Images) -> None:
        self.images = images
        self.table: list[Said] = []
        self.numbers: dict[Any, int] = {}

    def outputs(self, owner: Any) -> Said | None:
        """What is plugged into the active output of a material, light or world; None if it has no nodes."""
        tree = owner.node_tree if owner.use_nodes else None
        if tree is None:
            return None
        output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
        if output is None:
            return {}
        return {socket.identifier: self.input(socket, ()) for socket in output.inputs if socket.is_linked}

    def input(self, socket: Any, groups: tuple[Any, ...]) -> Said:
        """A value, or which output of which node."""
        links = [] if not socket.is_linked else [link for link in socket.links if not link.is_muted]
        if not links:
            return {"value": plain(getattr(socket, "default_value", None))}
        return self.source(links[0].from_node, links[0].from_socket, groups)

    def source(self, node: Any, socket: Any, groups: tuple[Any, ...]) -> Said:
        if node.mute:
            through = [link.from_socket for link in node.internal_links if link.to_socket == socket]
            return self.input(through[0], groups) if through else {"value": plain(socket.default_value)}
        if node.type == "REROUTE":
            return self.input(node.inputs[0], groups)
        if node.type == "GROUP" and node.node_tree is not None:
            ends = [inner for inner in node.node_tree.nodes if inner.bl_idname == "NodeGroupOutput"]
            end = next((inner for inner in ends if inner.is_active_output), None)
            if end is not None:
                same = next(s for s in end.inputs if s.identifier == socket.identifier)
                return self.input(same, (*groups, node))
        if node.type == "GROUP_INPUT" and groups:
            outer = next(s for s in groups[-1].inputs if s.identifier == socket.identifier)
            return self.input(outer, groups[:-1])
        return {"from": self.number(node, groups), "output": socket.name}

    def number(self, node: Any, groups: tuple[Any, ...]) -> int:
        key = tuple((one.id_data.as_pointer(), one.name) for one in (node, *groups))
        if key in self.numbers:
            return self.numbers[key]
        number = self.numbers[key] = len(self.table)
        said: Said = {"kind": node.bl_idname.removeprefix("ShaderNode"), "name": node.name}
        self.table.append(said)
        common = set(bpy.types.Node.bl_rna.properties.keys())
        said["properties"] = {
            prop.identifier: plain(getattr(node, prop.identifier))
            for prop in node.bl_rna.properties
            if prop.identifier not in common and prop.type in SIMPLE
        }
        if getattr(node, "image", None) is not None:
            said["image"] = self.images.number(node.image)
        if hasattr(node, "color_ramp"):
            said["ramp"] = [[stop.position, *stop.color] for stop in node.color_ramp.elements]
        said["outputs"] = {s.name: plain(getattr(s, "default_value", None)) for s in node.outputs}
        said["inputs"] = {s.identifier: self.input(s, groups) for s in node.inputs if s.enabled}
        return number


class Images:
    """The images of a file, copied into a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.table: list[Said] = []
        self.numbers: dict[str, int] = {}

    def number(self, image: Any) -> int:
        if image.name_full not in self.numbers:
            self.numbers[image.name_full] = len(self.table)
            self.table.append(self.copied(image, len(self.table)))
        return self.numbers[image.name_full]

    def copied(self, image: Any, number: int) -> Said:
        said = {
            "name": image.name,
            "space": image.colorspace_settings.name,
            "source": image.source,
            "alpha": image.alpha_mode,
            "file": None,
        }
        if image.source not in ("FILE", "GENERATED"):
            return said
        path = bpy.path.abspath(image.filepath, library=image.library)
        if not image.size[0]:  # this reads it
            return {**said, "missing": path}
        stem = "".join(c if c.isalnum() or c in "-_" else "-" for c in Path(image.name).stem)[:60]
        known = KEPT_FORMATS.get(image.file_format)
        self.folder.mkdir(exist_ok=True)
        if image.source == "FILE" and known:
            file = self.folder / f"{number}-{stem}{known}"
            if image.packed_file is not None:
                file.write_bytes(image.packed_file.data)
            else:
                shutil.copyfile(path, file)
        else:
            file = self.folder / f"{number}-{stem}{'.exr' if image.is_float else '.png'}"
            self.converted(image).save(filepath=str(file))
        return {**said, "file": file.name}

    def converted(self, image: Any) -> Any:
        """The same pixels as another image: one that is packed would be saved as the file that it was."""
        kind = {"alpha": image.channels == 4, "float_buffer": image.is_float}
        made = bpy.data.images.new("converted", *image.size, **kind)
        made.colorspace_settings.name, made.alpha_mode = image.colorspace_settings.name, image.alpha_mode
        values = array("f", bytes(4 * len(image.pixels)))
        image.pixels.foreach_get(values)
        if image.channels < 4:
            grown = array("f", [1.0]) * (4 * (len(values) // image.channels))
            for channel in range(3):
                grown[channel::4] = values[min(channel, image.channels - 1) :: image.channels]
            values = grown
        made.pixels.foreach_set(values)
        made.file_format = "OPEN_EXR" if image.is_float else "PNG"
        return made


class Meshes:
    """Meshes as files of numbers, each once for all objects that share it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.table: list[Said] = []
        self.numbers: dict[Any, int | None] = {}

    def number(self, thing: Any) -> int | None:
        """Number of the mesh of an object; None if it has no faces."""
        key = (thing.data.as_pointer(), thing.type) if thing.type == "MESH" else thing.name_full
        if key not in self.numbers:
            mesh = thing.to_mesh()
            mesh.calc_loop_triangles()
            self.numbers[key] = None
            if len(mesh.loop_triangles):
                self.numbers[key] = len(self.table)
                self.table.append(self.written(mesh, len(self.table)))
            thing.to_mesh_clear()
        return self.numbers[key]

    def written(self, mesh: Any, number: int) -> Said:
        corners, triangles = len(mesh.loops), len(mesh.loop_triangles)
        files = {
            "points": self.put(number, mesh.vertices, "co", "f", 3 * len(mesh.vertices)),
            "corners": self.put(number, mesh.loops, "vertex_index", "i", corners),
            "triangles": self.put(number, mesh.loop_triangles, "loops", "i", 3 * triangles),
            "slots": self.put(number, mesh.loop_triangles, "material_index", "i", triangles),
        }
        if hasattr(mesh, "corner_normals"):
            files["normals"] = self.put(number, mesh.corner_normals, "vector", "f", 3 * corners)
        else:
            mesh.calc_normals_split()
            files["normals"] = self.put(number, mesh.loops, "normal", "f", 3 * corners)
        layers = {
            layer.name: self.put(number, layer.data, "uv", "f", 2 * corners, f"-{at}")
            for at, layer in enumerate(mesh.uv_layers)
            if len(layer.data) == corners
        }
        rendered = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
        return {**files, "uv": layers, "uv_rendered": rendered}

    def put(self, number: int, things: Any, name: str, kind: str, length: int, more: str = "") -> str:
        values = array(kind, bytes(4 * length))
        things.foreach_get(name, values)
        file = self.folder / f"mesh-{number}-{name}{more}"
        with open(file, "wb") as out:
            values.tofile(out)
        return file.name


def light_of(thing: Any, nodes: Nodes) -> Said:
    light = thing.data
    common = set(bpy.types.ID.bl_rna.properties.keys())
    said = {
        prop.identifier: plain(getattr(light, prop.identifier))
        for prop in light.bl_rna.properties
        if prop.identifier not in common and prop.type in SIMPLE
    }
    cycles = getattr(light, "cycles", None)
    said["cast_shadow"] = getattr(
        cycles, "cast_shadow", said.get("use_shadow", True)
    )  # Cycles' own until 4.2
    said["is_portal"] = bool(getattr(cycles, "is_portal", False))
    said["hidden"] = [
        way for way in ("diffuse", "glossy", "transmission") if not getattr(thing, f"visible_{way}")
    ]
    return {**said, "seen": thing.visible_camera, "nodes": nodes.outputs(light)}


def camera_of(scene: Any, depsgraph: Any) -> Said | None:
    if scene.camera is None:
        return None
    thing = scene.camera.evaluated_get(depsgraph)
    data, dof = thing.data, thing.data.dof
    names = (
        "type",
        "lens",
        "sensor_fit",
        "sensor_width",
        "sensor_height",
        "shift_x",
        "shift_y",
        "ortho_scale",
        "clip_start",
        "clip_end",
    )
    distance = dof.focus_distance
    if dof.focus_object is not None:
        there = dof.focus_object.evaluated_get(depsgraph).matrix_world.translation
        distance = -(thing.matrix_world.inverted() @ there).z
    round_one = dof.aperture_blades < 3 and dof.aperture_ratio == 1
    focus = {"distance": distance, "fstop": dof.aperture_fstop, "round": round_one} if dof.use_dof else None
    said = {name: plain(getattr(data, name)) for name in names}
    return {**said, "name": thing.name, "matrix": rows(thing.matrix_world), "focus": focus}


def settings_of(scene: Any) -> Said:
    render, cycles = scene.render, getattr(scene, "cycles", None)
    part = render.resolution_percentage / 100
    return {
        "width": max(1, int(render.resolution_x * part)),
        "height": max(1, int(render.resolution_y * part)),
        "aspect": render.pixel_aspect_y / render.pixel_aspect_x,
        "region": render.use_border,
        "transparent": render.film_transparent,
        "motion_blur": render.use_motion_blur,
        "exposure": getattr(cycles, "film_exposure", 1.0),
        "samples": getattr(cycles, "samples", 128),
        "bounces": getattr(cycles, "max_bounces", 12),
    }


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


def main() -> None:
    mark = sys.argv[-1]

    def answer(said: Said) -> None:
        sys.stdout.flush()
        os.write(1, f"\n{mark} {json.dumps(said)}\n".encode())

    answer({"version": list(bpy.app.version)})
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer({"describe": describe}[request.pop("do")](**request))
        except Exception:
            answer({"error": traceback.format_exc()})


if __name__ == "__main__":
    main()
