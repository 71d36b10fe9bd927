"""Shader nodes, as a table that refers to itself by numbers."""

from __future__ import annotations

from typing import Any

from .image_files import Images
from .values import Said, plain, simple_properties

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["Nodes"]


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
        said["properties"] = simple_properties(node, bpy.types.Node)
        if getattr(node, "image", None) is not None:
            said["image"] = self.images.number(node.image)
        if hasattr(node, "color_ramp"):
            said["ramp"] = [[stop.position, *stop.color] for stop in node.color_ramp.elements]
        said["outputs"] = {s.name: plain(getattr(s, "default_value", None)) for s in node.outputs}
        said["inputs"] = {s.identifier: self.input(s, groups) for s in node.inputs if s.enabled}
        return number
