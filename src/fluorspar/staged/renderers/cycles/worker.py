"""Runs inside Blender, not in Fluorspar: builds scenes, renders them with Cycles, and measures light at points.

Run as a script with a mark as its last argument; requests are JSON lines on standard input, answers lines of standard
output that begin with the mark. Blender's Python may lack NumPy, so arrays are those of the module `array`.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
import traceback
from array import array
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __name__ == "__main__":
    import bpy
    from mathutils import Matrix, Vector
    from mathutils.bvhtree import BVHTree

FACES = "per face"  # name of the attribute that holds what each face emits
LOADED: dict[int, Loaded] = {}


def taken(file: str, kind: str) -> array[Any]:
    """Read a file of numbers and remove it."""
    values = array(kind)
    values.fromfile(open(file, "rb"), os.path.getsize(file) // values.itemsize)  # noqa: SIM115
    os.remove(file)
    return values


def setup(scene: Any, threads: int, rr_depth: int) -> None:
    """Choose what makes Cycles a plain, unbiased path tracer, whatever its version calls it."""
    render, cycles, layer = scene.render, scene.cycles, scene.view_layers[0]
    render.engine = "CYCLES"
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", threads
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = render.use_motion_blur = False
    chosen = {
        # the sample number 0 goes through the centre of its pixel, all others through random points
        "sample_offset": 1,
        "use_sample_subset": True,
        "sample_subset_length": 1,
        "samples": 2 if bpy.app.version >= (4, 4) else 1,
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "sample_clamp_direct": 0,
        "sample_clamp_indirect": 0,
        "light_sampling_threshold": 0,
        "blur_glossy": 0,
        "pixel_filter_type": "BOX",
        "filter_width": 1,
        "min_light_bounces": min(max(rr_depth - 1, 0), 1024),
        "caustics_reflective": True,
        "film_exposure": 1,
        "sampling_pattern": "TABULATED_SOBOL" if bpy.app.version >= (4, 0) else "SOBOL",
    }
    for name, value in chosen.items():
        if hasattr(cycles, name):
            setattr(cycles, name, value)
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    for name in ("diffuse_direct", "diffuse_indirect", "emit", "environment"):
        setattr(layer, f"use_pass_{name}", True)
    row = layer.aovs.add()
    row.name, row.type = "row", "VALUE"


class Tree:
    """A tree of shader nodes that is empty at first."""

    def __init__(self, owner: Any) -> None:
        owner.use_nodes = True
        self.tree = owner.node_tree
        self.tree.nodes.clear()

    def add(self, kind: str, *sources: Any, **values: Any) -> Any:
        """Add a node; its first inputs are linked to the given sockets or set to the given numbers."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in values.items():
            setattr(node, name, value)
        for socket, source in zip(node.inputs, sources):  # noqa: B905 (not all inputs are given)
            if isinstance(source, (int, float, tuple)):
                socket.default_value = source
            elif source is not None:
                self.tree.links.new(source, socket)
        return node


class Loaded:
    """A scene, and the sockets that its spectra go to."""

    def __init__(self, plan: dict[str, Any]) -> None:
        self.scene = bpy.data.scenes.new("scene")
        self.camera_size: tuple[int, int] = tuple(plan["size"])
        setup(self.scene, plan["threads"], plan["rr_depth"])
        self.albedo_sockets: list[tuple[int, Any]] = []
        self.emission_sockets: list[tuple[int, Any]] = []  # rows of the table of lights, and where they go
        self.faces: Any = None  # the attribute of the mesh whose faces emit differently
        self.sides: list[list[int]] = []  # of each triangle, which sides its front and back are
        self.corners: list[Any] = []
        self.triangles: list[tuple[int, ...]] = []
        for mesh in plan["meshes"]:
            self.add_mesh(**mesh)
        self.scene.world = bpy.data.worlds.new("world")
        Tree(self.scene.world)
        for light in plan["lights"]:
            self.add_light(**light)
        self.add_camera(**plan["camera"])
        self.tree: Any = None
        self.probes: Any = None
        self.points = 0
        self.image: Any = None

    def link(self, name: str, data: Any) -> Any:
        thing = bpy.data.objects.new(name, data)
        self.scene.collection.objects.link(thing)
        return thing

    def add_mesh(
        self,
        *,
        vertices: str,
        faces: str,
        normals: str | None,
        rows: list[int],
        light: int,
        per_face: bool,
        sides: list[int],
    ) -> None:
        """Add a surface; `rows` are those of its front and back, -1 for a black side; `light` a row or -1.

        `sides` are numbers by which `look` is asked for its front and back.
        """
        corners, triangles = taken(vertices, "f"), taken(faces, "i")
        mesh = triangle_mesh(corners, triangles)
        if normals is not None:
            smooth(mesh, taken(normals, "f"))
        first = len(self.corners)
        self.corners += [Vector(corners[i : i + 3]) for i in range(0, len(corners), 3)]
        self.triangles += [
            tuple(first + v for v in triangles[i : i + 3]) for i in range(0, len(triangles), 3)
        ]
        self.sides += [sides] * (len(triangles) // 3)
        thing = self.link("surface", mesh)
        # both move shadow rays off smooth surfaces, for looks
        thing.cycles.shadow_terminator_geometry_offset = thing.cycles.shadow_terminator_offset = 0
        mesh.materials.append(self.material(rows, light, per_face))
        if per_face:
            self.faces = mesh.attributes.new(FACES, "FLOAT_COLOR", "CORNER")

    def material(self, rows: list[int], light: int, per_face: bool) -> Any:
        """Different colours on front and back, and light from the front only."""
        material = bpy.data.materials.new("surface")
        tree = Tree(material)
        behind = tree.add("NewGeometry").outputs["Backfacing"]
        front, back = (self.side(tree, row) for row in rows)
        if light >= 0 or per_face:
            emission = tree.add("Emission")
            if per_face:
                colour = tree.add("Attribute", attribute_name=FACES).outputs["Color"]
                tree.tree.links.new(colour, emission.inputs["Color"])
            else:
                self.emission_sockets.append((light, emission.inputs["Color"]))
            front = tree.add("AddShader", front, emission.outputs[0]).outputs[0]
            if bpy.app.version >= (3, 5):
                material.cycles.emission_sampling = "FRONT"
            else:
                material.cycles.sample_as_light = True
        mixed = tree.add("MixShader", behind, front, back).outputs[0]
        tree.add("OutputMaterial", mixed)
        row = tree.add("Math", behind, rows[1] - rows[0], rows[0] + 1, operation="MULTIPLY_ADD").outputs[0]
        output = tree.add("OutputAOV", None, row)
        setattr(output, "aov_name" if hasattr(output, "aov_name") else "name", "row")
        return material

    def side(self, tree: Tree, row: int) -> Any:
        node = tree.add("BsdfDiffuse", (0.0, 0.0, 0.0, 1.0), 0.0)
        if row >= 0:
            self.albedo_sockets.append((row, node.inputs["Color"]))
        return node.outputs[0]

    def add_light(
        self, *, number: int, plugin: str, place: list[list[float]], scale: float, cutoff: float, beam: float
    ) -> None:
        """Add a light that is on no surface."""
        if plugin == "constant":
            tree = Tree(self.scene.world)
            background = tree.add("Background", (0.0, 0.0, 0.0, 1.0), 1.0)
            tree.add("OutputWorld", background.outputs[0])
            self.emission_sockets.append((number, background.inputs["Color"]))
            return
        sun = plugin == "directional"
        lamp = bpy.data.lights.new("light", "SUN" if sun else "POINT")
        lamp.energy, lamp.color = 1.0, (1.0, 1.0, 1.0)
        if sun:
            lamp.angle = 0.0
        else:
            lamp.shadow_soft_size = 0.0
            lamp.energy = 4 * math.pi * scale  # W: an intensity of `scale` W/sr
        thing = self.link("light", lamp)
        thing.matrix_world = Matrix(place)
        tree = Tree(lamp)
        strength: Any = 1.0
        if plugin == "spot":
            strength = self.falloff(tree, Matrix(place), cutoff, beam)
        emission = tree.add("Emission", None, strength)
        tree.add("OutputLight", emission.outputs[0])
        self.emission_sockets.append((number, emission.inputs["Color"]))

    def falloff(self, tree: Tree, place: Any, cutoff: float, beam: float) -> Any:
        """1 within the angle `beam` about the axis, 0 beyond `cutoff`, in radians, and linear in between."""
        axis = (place.to_3x3() @ Vector((0, 0, -1))).normalized()
        incoming = tree.add("NewGeometry").outputs["Incoming"]  # towards the surface that is lit
        cosine = tree.add("VectorMath", incoming, tuple(axis), operation="DOT_PRODUCT").outputs["Value"]
        angle = tree.add("Math", cosine, operation="ARCCOSINE").outputs[0]
        beyond = tree.add("Math", cutoff, angle, operation="SUBTRACT").outputs[0]
        width = max(cutoff - beam, 1e-6)
        return tree.add("Math", beyond, width, operation="DIVIDE", use_clamp=True).outputs[0]

    def add_camera(self, *, place: list[list[float]], focal: float, shift: list[float]) -> None:
        """`focal` and `shift` are in widths of the image."""
        camera = bpy.data.cameras.new("camera")
        camera.sensor_fit, camera.sensor_width, camera.lens = "HORIZONTAL", 36.0, 36.0 * focal
        camera.shift_x, camera.shift_y = shift
        camera.clip_start, camera.clip_end = 1e-6, 1e9
        thing = self.link("camera", camera)
        thing.matrix_world = Matrix(place)
        self.scene.camera = thing

    def choose(self, bounces: int, seed: int) -> None:
        cycles = self.scene.cycles
        for kind in ("max", "diffuse", "glossy", "transmission"):
            setattr(cycles, f"{kind}_bounces", bounces)
        cycles.seed = seed

    def colour(self, albedo: list[list[float]], emission: str) -> None:
        """Set the spectra, `emission` a file of rows of three."""
        for row, socket in self.albedo_sockets:
            socket.default_value = (*albedo[row], 1.0)
        light = taken(emission, "f")
        for row, socket in self.emission_sockets:
            socket.default_value = (*light[3 * row : 3 * row + 3], 1.0)
        if self.faces is not None:
            colours = array("f")
            for i in range(0, len(light), 3):
                corner = light[i : i + 3]
                corner.append(1.0)
                colours.extend(corner * 3)
            attribute = self.faces
            attribute.data.foreach_set("color", colours)
            attribute.id_data.update()

    def look(self, points: str, normals: str, side: int, offset: float, size: float) -> bytes:
        """Put a triangle at each point, which nothing sees; tell which points see that side below them."""
        if self.tree is None:
            self.tree = BVHTree.FromPolygons(self.corners, self.triangles)
        here, up = taken(points, "f"), taken(normals, "f")
        self.points = len(here) // 3
        seen = bytearray(self.points)
        corners, triangles = array("f"), array("i", range(3 * self.points))
        uvs = array("f")
        across = math.ceil(math.sqrt(self.points)) if self.points else 1
        for k in range(self.points):
            normal = Vector(up[3 * k : 3 * k + 3])
            place = Vector(here[3 * k : 3 * k + 3]) + offset * normal
            _, front, index, _ = self.tree.ray_cast(place, -normal)
            seen[k] = index is not None and self.sides[index][front.dot(normal) < 0] == side
            a = normal.orthogonal().normalized() * size
            b = normal.cross(a)
            # the centre of the texel, (1/2, 1/2), is the point
            x, y = k % across, k // across
            for u, v in ((0.1, 0.2), (0.9, 0.2), (0.5, 0.9)):
                corners.extend(place + (u - 0.5) * a + (v - 0.5) * b)
                uvs.extend(((x + u) / across, (y + v) / across))
        self.put_probes(triangle_mesh(corners, triangles), uvs, across)
        return bytes(seen)

    def put_probes(self, mesh: Any, uvs: array[float], across: int) -> None:
        layer = mesh.uv_layers.new(name="texels")
        layer.data.foreach_set("uv", uvs)
        material = bpy.data.materials.new("probe")
        tree = Tree(material)
        tree.add("OutputMaterial", tree.add("BsdfDiffuse", (0.5, 0.5, 0.5, 1.0), 0.0).outputs[0])
        if self.image is not None:
            bpy.data.images.remove(self.image)
        self.image = bpy.data.images.new("light", across, across, float_buffer=True, is_data=True)
        target = tree.add("TexImage", image=self.image)
        tree.tree.nodes.active = target
        mesh.materials.append(material)
        if self.probes is not None:
            old = self.probes.data
            bpy.data.objects.remove(self.probes)
            bpy.data.meshes.remove(old)
        self.probes = self.link("probes", mesh)
        # Cycles leaves out what no ray at all sees; there are no volumes
        for ray in ("camera", "diffuse", "glossy", "transmission", "shadow"):
            setattr(self.probes, f"visible_{ray}", False)

    def render(self, out: str, scale: int) -> None:
        render = self.scene.render
        render.resolution_x, render.resolution_y = (side * scale for side in self.camera_size)
        render.filepath, render.use_persistent_data = out, True  # a bake after such a render does nothing
        if self.probes is not None:
            self.probes.hide_render = True
        bpy.ops.render.render(write_still=True, scene=self.scene.name)

    def bake(self, out: str) -> None:
        """Write the light that falls on the points, over pi, rows of four."""
        self.probes.hide_render = False
        self.scene.render.use_persistent_data = False
        window = {"scene": self.scene, "view_layer": self.scene.view_layers[0]}
        chosen = {"active_object": self.probes, "object": self.probes, "selected_objects": [self.probes]}
        options: dict[str, Any] = {
            "type": "DIFFUSE",
            "pass_filter": {"DIRECT", "INDIRECT"},
            "margin": 0,
            "use_clear": True,
        }
        with bpy.context.temp_override(**window, **chosen):
            self.probes.select_set(True, view_layer=self.scene.view_layers[0])
            self.scene.view_layers[0].objects.active = self.probes
            bpy.ops.object.bake(**options)
        pixels = array("f", bytes(16 * self.image.size[0] * self.image.size[1]))
        self.image.pixels.foreach_get(pixels)
        with open(out, "wb") as file:
            pixels[: 4 * self.points].tofile(file)


def triangle_mesh(corners: array[float], triangles: array[int]) -> Any:
    mesh = bpy.data.meshes.new("mesh")
    count = len(triangles) // 3
    mesh.vertices.add(len(corners) // 3)
    mesh.vertices.foreach_set("co", corners)
    mesh.loops.add(len(triangles))
    mesh.loops.foreach_set("vertex_index", triangles)
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", array("i", range(0, 3 * count, 3)))
    if bpy.app.version < (4, 0):
        mesh.polygons.foreach_set("loop_total", array("i", [3]) * count)
    mesh.polygons.foreach_set("use_smooth", array("b", [0]) * count)
    mesh.update(calc_edges=True)
    return mesh


def smooth(mesh: Any, normals: array[float]) -> None:
    """Give a mesh normals of its vertices."""
    mesh.polygons.foreach_set("use_smooth", array("b", [1]) * len(mesh.polygons))
    if bpy.app.version < (4, 1):
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi
    mesh.normals_split_custom_set_from_vertices(
        [tuple(normals[i : i + 3]) for i in range(0, len(normals), 3)]
    )


def load(number: int, file: str) -> dict[str, Any]:
    with open(file, encoding="utf-8") as text:
        LOADED[number] = Loaded(json.load(text))
    os.remove(file)
    return {}


def render(number: int, bounces: int, seed: int, scale: int, out: str, **spectra: Any) -> dict[str, Any]:
    loaded = LOADED[number]
    loaded.choose(bounces, seed)
    if spectra:
        loaded.colour(**spectra)
    began = time.perf_counter()
    loaded.render(out, scale)
    return {"seconds": time.perf_counter() - began}


def look(
    number: int, points: str, normals: str, side: int, offset: float, size: float, out: str
) -> dict[str, Any]:
    seen = LOADED[number].look(points, normals, side, offset, size)
    with open(out, "wb") as file:
        file.write(seen)
    return {}


def bake(number: int, bounces: int, seed: int, out: str, **spectra: Any) -> dict[str, Any]:
    loaded = LOADED[number]
    loaded.choose(bounces, seed)
    loaded.colour(**spectra)
    began = time.perf_counter()
    loaded.bake(out)
    return {"seconds": time.perf_counter() - began}


def main() -> None:
    mark = sys.argv[-1]

    def answer(said: dict[str, Any]) -> None:
        sys.stdout.flush()
        os.write(1, f"\n{mark} {json.dumps(said)}\n".encode())

    answer({"version": list(bpy.app.version)})
    known: dict[str, Callable[..., dict[str, Any]]] = {
        "load": load,
        "render": render,
        "look": look,
        "bake": bake,
    }
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer(known[request.pop("do")](**request))
        except Exception:
            answer({"error": traceback.format_exc()})


if __name__ == "__main__":
    main()
