"""A scene as Blender holds it, made from a plan, and rendered with one set of spectra after the other."""

from __future__ import annotations

import math
from array import array
from typing import Any

from .meshes import smooth, taken, triangle_mesh
from .probes import Probes
from .settings import setup
from .shaders import PER_FACE, Sockets, Tree, falloff, surface_material

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy
    from mathutils import Matrix

__all__ = ["HeldScene"]


class HeldScene:
    """A scene, and where its spectra go."""

    def __init__(self, plan: dict[str, Any]) -> None:
        self.scene = bpy.data.scenes.new("scene")
        self.camera_size: tuple[int, int] = tuple(plan["size"])
        setup(self.scene, plan["threads"], plan["rr_depth"])
        self.sockets = Sockets()
        self.faces: Any = None  # the attribute of the mesh whose faces emit differently
        self.probes = Probes(self.scene)
        for mesh in plan["meshes"]:
            self.add_mesh(**mesh)
        self.scene.world = bpy.data.worlds.new("world")
        Tree(self.scene.world)
        for light in plan["lights"]:
            self.add_light(**light)
        self.add_camera(**plan["camera"])

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

        `sides` are numbers by which `Probes.look` is asked for its front and back.
        """
        corners, triangles = taken(vertices, "f"), taken(faces, "i")
        mesh = triangle_mesh(corners, triangles)
        if normals is not None:
            smooth(mesh, taken(normals, "f"))
        self.probes.add_surface(corners, triangles, sides, rows[1] == -1)
        thing = self.link("surface", mesh)
        # both move shadow rays off smooth surfaces, for looks
        thing.cycles.shadow_terminator_geometry_offset = thing.cycles.shadow_terminator_offset = 0
        mesh.materials.append(surface_material(self.sockets, rows, light, per_face))
        if per_face:
            self.faces = mesh.attributes.new(PER_FACE, "FLOAT_COLOR", "CORNER")

    def add_light(
        self, *, number: int, plugin: str, place: list[list[float]], scale: float, cutoff: float, beam: float
    ) -> None:
        """Add a light that is on no surface."""
        if plugin == "constant":
            tree = Tree(self.scene.world)
            background = tree.add("Background", (0.0, 0.0, 0.0, 1.0), 1.0)
            tree.add("OutputWorld", background.outputs[0])
            self.sockets.emission.append((number, background.inputs["Color"]))
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
            strength = falloff(tree, Matrix(place), cutoff, beam)
        emission = tree.add("Emission", None, strength)
        tree.add("OutputLight", emission.outputs[0])
        self.sockets.emission.append((number, emission.inputs["Color"]))

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
        light = taken(emission, "f")
        self.sockets.fill(albedo, light)
        if self.faces is not None:
            colours = array("f")
            for i in range(0, len(light), 3):
                corner = light[i : i + 3]
                corner.append(1.0)
                colours.extend(corner * 3)
            attribute = self.faces
            attribute.data.foreach_set("color", colours)
            attribute.id_data.update()

    def render(self, out: str, scale: int) -> None:
        render = self.scene.render
        render.resolution_x, render.resolution_y = (side * scale for side in self.camera_size)
        render.filepath, render.use_persistent_data = out, True  # a bake after such a render does nothing
        self.probes.hide()
        bpy.ops.render.render(write_still=True, scene=self.scene.name)
