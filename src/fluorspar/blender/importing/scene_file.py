"""What the script inside Blender said, as a Mitsuba scene: one file, with meshes and textures beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Comment, Element, ElementTree, indent

import numpy as np

from fluorspar.bispectral.library import material as library_material
from fluorspar.blender.importing.camera import sensor
from fluorspar.blender.importing.elements import matrix, plugin, refer, rgb, value
from fluorspar.blender.importing.lights import lamp
from fluorspar.blender.importing.listing import Listing
from fluorspar.blender.importing.meshes import Mesh, parts, write_ply
from fluorspar.blender.importing.shaders import shading_of
from fluorspar.blender.importing.shading import Shading, matte, two_sided
from fluorspar.blender.importing.sockets import Sockets
from fluorspar.blender.importing.textures import Textures
from fluorspar.blender.importing.world import world_light
from fluorspar.errors import MaterialError, SceneError

__all__ = ["write_scene"]

Said = dict[str, Any]

_PREFIX = "fluorspar:"
_COPY = re.compile(r"\.\d{3}$")  # what Blender adds to a name that is there already
_KINDS = {"HAIR": "hair", "CURVES": "hair", "VOLUME": "a volume", "POINTCLOUD": "a cloud of points"}
_DEFAULT = "(no material)"


def write_scene(said: Said, arrays: Path, folder: Path) -> Listing:
    """Write `scene.xml` and `meshes` into a folder that has the textures already.

    Parameters
    ----------
    said : dict
        The description.
    arrays : Path
        Folder of the arrays of meshes.
    folder : Path
        To write to.

    Returns
    -------
    Listing
        What has no counterpart.

    Raises
    ------
    SceneError, MaterialError
        If the camera is of an unknown kind, or a material of the library is asked for that there is not.
    """
    return _Writer(said, arrays, folder).write()


class _Writer:
    def __init__(self, said: Said, arrays: Path, folder: Path) -> None:
        self.said, self.arrays, self.folder = said, arrays, folder
        self.listing = Listing()
        self.textures = Textures(said["images"], said["nodes"], self.listing)
        self.scene = Element("scene", {"version": "3.0.0"})
        self.names: set[str] = set()
        self.shadings: dict[str, Shading] = {}
        self.uv_maps: dict[str, str] = {}
        self.written: dict[tuple[int, bool, bool, tuple[str, ...]], dict[int, str]] = {}
        self.skipped = 0

    def write(self) -> Listing:
        said, listing, scene = self.said, self.listing, self.scene
        for path in said["libraries"]:
            listing.add("the file", f"uses another, which is missing: {path}")
        if len(said["layers"]) > 1:
            listing.add("the file", f"has several view layers: the first one is taken, '{said['layers'][0]}'")
        depth = said["settings"]["bounces"] + 2
        scene.append(plugin("integrator", "path", value("integer", "max_depth", depth)))
        scene.append(sensor(said["camera"], said["settings"], listing))
        for material in said["materials"]:
            self.material(material)
        (self.folder / "meshes").mkdir()
        for thing in said["objects"]:
            self.object(thing)
        for light in said["lights"]:
            sockets = self.sockets(f"light '{light['name']}'")
            made = lamp(light, sockets, self.name(light["name"]), self.folder, said["version"])
            if made is not None:
                scene.append(made)
        if said["world"] is not None:
            world = said["world"]
            made = world_light(world, self.sockets(f"world '{world['name']}'"), self.name(world["name"]))
            if made is not None:
                scene.append(made)
        for name, kind in said["others"]:
            listing.add(f"object '{name}'", f"is or has {_KINDS.get(kind, kind.lower())}: it is left out")
        if scene.find(".//emitter") is None:
            listing.add(
                "the file", "has no light that Fluorspar has: the scene cannot be rendered before it gets one"
            )
        if not any(thing.tag == "shape" for thing in scene):
            listing.add("the file", "has no surface that is rendered")
        self.save()
        return listing

    def save(self) -> None:
        listed = "".join(f"\n  {sentence}" for sentence in self.listing.sentences).replace("--", "- -")
        self.scene.insert(0, Comment(f" What has no counterpart:{listed or ' nothing'}\n"))
        indent(self.scene)
        ElementTree(self.scene).write(self.folder / "scene.xml", encoding="utf-8", xml_declaration=True)

    def sockets(self, where: str) -> Sockets:
        return Sockets(self.said["nodes"], self.textures, self.listing, where)

    def name(self, wanted: str) -> str:
        """A name that nothing else in the scene has."""
        name, number = wanted, 1
        while name in self.names:
            number += 1
            name = f"{wanted}#{number}"
        self.names.add(name)
        return name

    def material(self, material: Said) -> None:
        """A BSDF, and the light that a surface of this material gives."""
        name, where = material["name"], f"material '{material['name']}'"
        if material["nodes"] is not None:
            shading = shading_of(material["nodes"], self.sockets(where))
        else:
            shading = Shading(matte(_colour(material["colour"])))
        fluorescent = material["fluorspar"]
        if fluorescent is None and name.startswith(_PREFIX):
            fluorescent = _COPY.sub("", name)
        if fluorescent is not None:
            shading = Shading(self.fluorescent(str(fluorescent), material, where), emitted=shading.emitted)
        self.shadings[name] = shading
        maps = self.textures.uv_map(self.reached(material["nodes"] or {}))
        if maps is not None:
            self.uv_maps[name] = maps
        made = two_sided(shading)
        made.set("id", name)
        self.names.add(name)
        self.scene.append(made)

    def fluorescent(self, name: str, material: Said, where: str) -> Element:
        name = name.removeprefix(_PREFIX).strip()
        concentration = material["concentration"]
        if concentration is not None and not isinstance(concentration, (int, float)):
            raise SceneError(f"the concentration of {where} is no number\n  got:      {concentration!r}")
        try:
            library_material(name)
        except MaterialError as err:
            raise MaterialError(f"{err}\n  asked for by {where}") from err
        more = [] if concentration is None else [value("float", "concentration", concentration)]
        return plugin("bsdf", "fluorescent", value("string", "material", name), *more)

    def reached(self, outputs: Said) -> set[int]:
        """Numbers of all nodes of a material."""
        found: set[int] = set()
        waiting = [socket["from"] for socket in outputs.values() if "from" in socket]
        while waiting:
            number = waiting.pop()
            if number not in found:
                found.add(number)
                waiting += [s["from"] for s in self.said["nodes"][number]["inputs"].values() if "from" in s]
        return found

    def object(self, thing: Said) -> None:
        """The parts of an object, a shape for each material."""
        if thing["hidden"]:
            ways = ", ".join(thing["hidden"]).replace("is_", "").replace("_", " ")
            self.listing.add(
                f"object '{thing['name']}'", f"is treated apart in Blender ({ways}): here it is as all others"
            )
        place = np.array(thing["matrix"], dtype=np.float64)
        if np.linalg.matrix_rank(place[:3, :3]) < 3:
            self.listing.add(f"object '{thing['name']}'", "is scaled to nothing: it is left out")
            return
        materials = [name or _DEFAULT for name in thing["materials"]] or [_DEFAULT]
        files = self.files(thing["mesh"], materials, mirrored=bool(np.linalg.det(place[:3, :3]) < 0))
        for slot, file in files.items():
            material = materials[min(slot, len(materials) - 1)]
            shading = self.shading(material)
            if shading.absent and shading.emitted is None:
                continue
            name = thing["name"] if len(files) == 1 else f"{thing['name']}/{material}"
            shape = plugin("shape", "ply", value("string", "filename", f"meshes/{file}"), id=self.name(name))
            shape.extend((matrix("to_world", place), refer(material)))
            if shading.emitted is not None:
                where = f"material '{material}'"
                shape.append(
                    plugin("emitter", "area", shading.emitted.element("radiance", where, self.listing))
                )
            self.scene.append(shape)

    def shading(self, material: str) -> Shading:
        if material not in self.shadings:  # what Blender shows without one
            plain = {"nodes": None, "colour": (0.8,) * 3, "fluorspar": None, "concentration": None}
            self.material({"name": material, **plain})
        return self.shadings[material]

    def files(self, number: int, materials: list[str], *, mirrored: bool) -> dict[int, str]:
        """Names of the files of a mesh, by slot; written when they are needed first."""
        slots = {slot: self.shading(name) for slot, name in enumerate(materials)}
        emits = any(shading.emitted is not None for shading in slots.values())
        uv = {slot: self.uv_maps[name] for slot, name in enumerate(materials) if name in self.uv_maps}
        key = number, mirrored, emits, tuple(materials) if emits or uv else ()
        if key not in self.written:
            files = self.written[key] = {}
            for slot, mesh in parts(self.said["meshes"][number], self.arrays, uv):
                shading = slots[min(slot, len(slots) - 1)]
                files[slot] = f"{len(self.written) - 1}-{slot}.ply"
                write_ply(_prepared(mesh, mirrored, shading), self.folder / "meshes" / files[slot])
        return self.written[key]


def _prepared(mesh: Mesh, mirrored: bool, shading: Shading) -> Mesh:
    """As Mitsuba takes it: wound for its transform, and with a back of its own if it shines to both sides."""
    if mirrored:
        mesh = mesh.mirrored()
    return mesh.with_back() if shading.emitted is not None and not mesh.is_closed else mesh


def _colour(given: Any) -> Element:
    return rgb("reflectance", given[:3])
