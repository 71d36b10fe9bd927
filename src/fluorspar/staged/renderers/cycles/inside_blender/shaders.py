"""Shader nodes of surfaces and lights, and the sockets that spectra go to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy
    from mathutils import Vector

__all__ = ["PER_FACE", "Sockets", "Tree", "falloff", "surface_material"]

PER_FACE = "per face"  # name of the attribute that holds what each face emits


@dataclass
class Sockets:
    """Where spectra go: rows of the tables of materials and of lights, each with a socket."""

    albedo: list[tuple[int, Any]] = field(default_factory=list)
    emission: list[tuple[int, Any]] = field(default_factory=list)

    def fill(self, albedo: Sequence[Sequence[float]], emission: Sequence[float]) -> None:
        """Set the colours; `emission` has three numbers for each row."""
        for row, socket in self.albedo:
            socket.default_value = (*albedo[row], 1.0)
        for row, socket in self.emission:
            socket.default_value = (*emission[3 * row : 3 * row + 3], 1.0)


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


def surface_material(sockets: Sockets, rows: Sequence[int], light: int, per_face: bool) -> Any:
    """Different colours on front and back, and light from the front only."""
    material = bpy.data.materials.new("surface")
    tree = Tree(material)
    behind = tree.add("NewGeometry").outputs["Backfacing"]
    front, back = (_side(sockets, tree, row) for row in rows)
    if light >= 0 or per_face:
        emission = tree.add("Emission")
        if per_face:
            colour = tree.add("Attribute", attribute_name=PER_FACE).outputs["Color"]
            tree.tree.links.new(colour, emission.inputs["Color"])
        else:
            sockets.emission.append((light, emission.inputs["Color"]))
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


def _side(sockets: Sockets, tree: Tree, row: int) -> Any:
    node = tree.add("BsdfDiffuse", (0.0, 0.0, 0.0, 1.0), 0.0)
    if row >= 0:
        sockets.albedo.append((row, node.inputs["Color"]))
    return node.outputs[0]


def falloff(tree: Tree, place: Any, cutoff: float, beam: float) -> Any:
    """1 within the angle `beam` about the axis, 0 beyond `cutoff`, in radians, and linear in between."""
    axis = (place.to_3x3() @ Vector((0, 0, -1))).normalized()
    incoming = tree.add("NewGeometry").outputs["Incoming"]  # towards the surface that is lit
    cosine = tree.add("VectorMath", incoming, tuple(axis), operation="DOT_PRODUCT").outputs["Value"]
    angle = tree.add("Math", cosine, operation="ARCCOSINE").outputs[0]
    beyond = tree.add("Math", cutoff, angle, operation="SUBTRACT").outputs[0]
    width = max(cutoff - beam, 1e-6)
    return tree.add("Math", beyond, width, operation="DIVIDE", use_clamp=True).outputs[0]
