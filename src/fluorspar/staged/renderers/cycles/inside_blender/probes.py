"""The light at points of surfaces, which Cycles bakes into small triangles there."""

from __future__ import annotations

import math
from array import array
from typing import Any

from .meshes import taken, triangle_mesh
from .shaders import Tree

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy
    from mathutils import Vector
    from mathutils.bvhtree import BVHTree

__all__ = ["Probes"]


class Probes:
    """Points of a scene at which light is measured, others at each `look`."""

    def __init__(self, scene: Any) -> None:
        self.scene = scene
        self.sides: list[list[int]] = []  # of each triangle, which sides its front and back are
        self.hiding: list[bool] = []  # whether its back is black, and not seen by the camera
        self.surface: list[int] = []  # of each triangle, one number for all of a surface
        self.corners: list[Any] = []
        self.triangles: list[tuple[int, ...]] = []
        self.tree: Any = None
        self.thing: Any = None
        self.points = 0
        self.image: Any = None

    def add_surface(
        self, corners: array[float], triangles: array[int], sides: list[int], black_back: bool
    ) -> None:
        """Add what can lie below a point or around it; `sides` are the numbers of its front and back."""
        first = len(self.corners)
        self.corners += [Vector(corners[i : i + 3]) for i in range(0, len(corners), 3)]
        self.triangles += [
            tuple(first + v for v in triangles[i : i + 3]) for i in range(0, len(triangles), 3)
        ]
        count = len(triangles) // 3
        self.surface += [len(self.sides)] * count
        self.sides += [sides] * count
        self.hiding += [black_back] * count

    def hide(self) -> None:
        """Leave the triangles out of renders."""
        if self.thing is not None:
            self.thing.hide_render = True

    def look(
        self,
        points: str,
        normals: str,
        side: int,
        offset: float,
        size: float,
        directions: list[list[float]],
    ) -> bytes:
        """Put a triangle at each point, which nothing sees; tell which points see that side below them, and see more
        than black backs in some directions, of which the third number is along the normal. Backs that the camera sees
        are those of a room, which hides nothing."""
        if self.tree is None:
            self.tree = BVHTree.FromPolygons(self.corners, self.triangles)
            self._look_from_camera(directions)
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
            x_axis = normal.orthogonal().normalized()
            y_axis = normal.cross(x_axis)
            around = (u * x_axis + v * y_axis + w * normal for u, v, w in directions)
            seen[k] = seen[k] and not all(self._is_hidden(place, each) for each in around)
            a, b = x_axis * size, y_axis * size
            # the centre of the texel, (1/2, 1/2), is the point
            x, y = k % across, k // across
            for u, v in ((0.1, 0.2), (0.9, 0.2), (0.5, 0.9)):
                corners.extend(place + (u - 0.5) * a + (v - 0.5) * b)
                uvs.extend(((x + u) / across, (y + v) / across))
        self._put(triangle_mesh(corners, triangles), uvs, across)
        return bytes(seen)

    def _look_from_camera(self, directions: list[list[float]]) -> None:
        place = self.scene.camera.matrix_world.translation
        met = [self._met_behind(place, sign * Vector(each)) for each in directions for sign in (1, -1)]
        rooms = {self.surface[index] for index in met if index is not None}
        self.hiding = [
            hides and surface not in rooms for hides, surface in zip(self.hiding, self.surface, strict=True)
        ]

    def _is_hidden(self, place: Any, direction: Any) -> bool:
        index = self._met_behind(place, direction)
        return index is not None and self.hiding[index]

    def _met_behind(self, place: Any, direction: Any) -> Any:
        """The number of the triangle that is met first, if it is met from behind."""
        _, front, index, _ = self.tree.ray_cast(place, direction)
        return index if index is not None and front.dot(direction) > 0 else None

    def bake(self, out: str) -> None:
        """Write the light that falls on the points, over pi, rows of four."""
        self.thing.hide_render = False
        self.scene.render.use_persistent_data = False
        window = {"scene": self.scene, "view_layer": self.scene.view_layers[0]}
        chosen = {"active_object": self.thing, "object": self.thing, "selected_objects": [self.thing]}
        options: dict[str, Any] = {
            "type": "DIFFUSE",
            "pass_filter": {"DIRECT", "INDIRECT"},
            "margin": 0,
            "use_clear": True,
        }
        with bpy.context.temp_override(**window, **chosen):
            self.thing.select_set(True, view_layer=self.scene.view_layers[0])
            self.scene.view_layers[0].objects.active = self.thing
            bpy.ops.object.bake(**options)
        pixels = array("f", bytes(16 * self.image.size[0] * self.image.size[1]))
        self.image.pixels.foreach_get(pixels)
        with open(out, "wb") as file:
            pixels[: 4 * self.points].tofile(file)

    def _put(self, mesh: Any, uvs: array[float], across: int) -> None:
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
        if self.thing is not None:
            old = self.thing.data
            bpy.data.objects.remove(self.thing)
            bpy.data.meshes.remove(old)
        self.thing = bpy.data.objects.new("probes", mesh)
        self.scene.collection.objects.link(self.thing)
        # Cycles leaves out what no ray at all sees; there are no volumes
        for ray in ("camera", "diffuse", "glossy", "transmission", "shadow"):
            setattr(self.thing, f"visible_{ray}", False)
