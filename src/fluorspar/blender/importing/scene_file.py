"""What the script inside Blender said, as a Mitsuba scene: one file, with meshes and textures beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Comment, Element, ElementTree, indent

import numpy as np
from numpy.typing import NDArray

from fluorspar.blender.importing.camera import sensor
from fluorspar.blender.importing.elements import matrix, plugin, refer, rgb, value
from fluorspar.blender.importing.fluorescent import PREFIX, fluorescent_bsdf
from fluorspar.blender.importing.lights import lamp
from fluorspar.blender.importing.listing import Listing
from fluorspar.blender.importing.meshes import encloses, parts, write_ply
from fluorspar.blender.importing.shaders import shading_of
from fluorspar.blender.importing.shading import Shading, matte, two_sided
from fluorspar.blender.importing.sockets import Sockets
from fluorspar.blender.importing.solid_shadows import list_solid_shadows
from fluorspar.blender.importing.textures import Textures
from fluorspar.blender.importing.world import world_light

__all__ = ["write_scene"]

Said = dict[str, Any]
Array = NDArray[np.float64]

_COPY = re.compile(r"\.\d{3}$")  # what Blender adds to a name that is there already
_KINDS = {"HAIR": "hair", "CURVES": "hair", "VOLUME": "a volume", "POINTCLOUD": "a cloud of points"}
_DEFAULT = "(no material)"
_FLAT = 1e-6  # thickness of what is flattened, in its size
_UNSPEAKABLE = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff\ufffe\uffff]")  # that XML cannot hold


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
        self.textures = Textures(said["images"], said["nodes"], self.listing, folder)
        self.scene = Element("scene", {"version": "3.0.0"})
        self.names: set[str] = set()
        self.ids: dict[str, str] = {}
        self.shadings: dict[str, Shading] = {}
        self.textured: set[str] = set()
        self.uv_maps: dict[str, str] = {}
        self.written: dict[tuple[int, bool, bool, bool, tuple[str, ...]], dict[int, str]] = {}

    def write(self) -> Listing:
        said, listing, scene = self.said, self.listing, self.scene
        if said["written_by"][:2] > said["version"][:2]:
            theirs, ours = (".".join(map(str, said[one][:2])) for one in ("written_by", "version"))
            listing.add(
                "the file", f"was written by Blender {theirs} and read by {ours}: what is new may be lost"
            )
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
        list_solid_shadows(scene, listing)
        if scene.find(".//emitter") is None:
            listing.add(
                "the file", "has no light that Fluorspar has: the scene cannot be rendered before it gets one"
            )
        if not any(thing.tag == "shape" for thing in scene):
            listing.add("the file", "has no surface that is rendered")
        self.save()
        return listing

    def save(self) -> None:
        listed = "".join(f"\n  {_UNSPEAKABLE.sub('_', sentence)}" for sentence in self.listing.sentences)
        listed = re.sub("-(?=-)", "- ", listed)
        self.scene.insert(0, Comment(f" What has no counterpart:{listed or ' nothing'}\n"))
        indent(self.scene)
        ElementTree(self.scene).write(self.folder / "scene.xml", encoding="utf-8", xml_declaration=True)

    def sockets(self, where: str) -> Sockets:
        return Sockets(self.said["nodes"], self.textures, self.listing, where)

    def name(self, wanted: str) -> str:
        """A name that nothing else in the scene has."""
        wanted = _UNSPEAKABLE.sub("_", wanted).replace("$", "_")  # in scene files, $name is a parameter
        name, number = wanted, 1
        while name in self.names:
            number += 1
            name = f"{wanted}#{number}"
        self.names.add(name)
        return name

    def material(self, material: Said) -> None:
        """A BSDF, and the light that a surface of this material gives."""
        name, key, where = material["name"], material["key"], f"material '{material['name']}'"
        if material["nodes"] is not None:
            shading = shading_of(material["nodes"], self.sockets(where))
        else:
            shading = Shading(matte(_colour(material["colour"])))
        fluorescent = material["fluorspar"]
        if fluorescent is None and name.startswith(PREFIX):
            fluorescent = _COPY.sub("", name)
        if fluorescent is not None:
            shading = Shading(
                fluorescent_bsdf(str(fluorescent), material["concentration"], where), emitted=shading.emitted
            )
        elif material["concentration"] is not None:
            self.listing.add(
                where, "has a concentration, but no name of a fluorescent material: it is left out"
            )
        self.shadings[key], self.ids[key] = shading, self.name(name)
        maps = self.textures.uv_map(self.reached(material["nodes"] or {}))
        if maps is not None:
            self.uv_maps[key] = maps
        made = two_sided(shading)
        made.set("id", self.ids[key])
        if made.find(".//texture") is not None:
            self.textured.add(self.ids[key])
        self.scene.append(made)

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
        rank = np.linalg.matrix_rank(place[:3, :3])
        if rank < 2:
            self.listing.add(f"object '{thing['name']}'", "is scaled to nothing: it is left out")
            return
        if rank < 3:
            place[:3, :3] = _thickened(place[:3, :3])
        materials = [name or _DEFAULT for name in thing["materials"]] or [_DEFAULT]
        files = self.files(thing["mesh"], materials, place)
        for slot, file in files.items():
            material = materials[min(slot, len(materials) - 1)]
            shading = self.shading(material)
            if not self.said["meshes"][thing["mesh"]]["uv"] and self.ids[material] in self.textured:
                self.listing.add(
                    f"object '{thing['name']}'",
                    "has images but no UV map: their lower left corner is everywhere",
                )
            if shading.absent and shading.emitted is None:
                continue
            name = thing["name"] if len(files) == 1 else f"{thing['name']}/{self.ids[material]}"
            shape = plugin("shape", "ply", value("string", "filename", f"meshes/{file}"), id=self.name(name))
            shape.extend((matrix("to_world", place), refer(self.ids[material])))
            if shading.emitted is not None:
                where = f"material '{self.ids[material]}'"
                shape.append(
                    plugin("emitter", "area", shading.emitted.element("radiance", where, self.listing))
                )
            self.scene.append(shape)

    def shading(self, material: str) -> Shading:
        if material not in self.shadings:  # what Blender shows without one
            plain = {"nodes": None, "colour": (0.8,) * 3, "fluorspar": None, "concentration": None}
            self.material({"name": material, "key": material, **plain})
        return self.shadings[material]

    def files(self, number: int, materials: list[str], place: Array) -> dict[int, str]:
        """Names of the files of a mesh, by slot; written when they are needed first."""
        slots = {slot: self.shading(name) for slot, name in enumerate(materials)}
        emits = any(shading.emitted is not None for shading in slots.values())
        uv = {slot: self.uv_maps[name] for slot, name in enumerate(materials) if name in self.uv_maps}
        mirrored = bool(np.linalg.det(place[:3, :3]) < 0)
        eye = np.linalg.solve(place, np.array(self.said["camera"]["matrix"])[:, 3])[:3]
        around = emits and encloses(self.said["meshes"][number], self.arrays, eye)
        key = number, mirrored, emits, around, tuple(materials) if emits or uv else ()
        if key not in self.written:
            files = self.written[key] = {}
            for slot, mesh in parts(self.said["meshes"][number], self.arrays, uv):
                shading = slots[min(slot, len(slots) - 1)]
                files[slot] = f"{len(self.written) - 1}-{slot}.ply"
                both = shading.emitted is not None and (around or not mesh.is_closed)
                mesh = mesh.with_back() if both else mesh
                write_ply(mesh.mirrored() if mirrored else mesh, self.folder / "meshes" / files[slot])
        return self.written[key]


def _colour(given: Any) -> Element:
    return rgb("reflectance", given[:3])


def _thickened(flat: Array) -> Array:
    """A transform that flattens things, with an inverse: almost as flat."""
    left, sizes, right = np.linalg.svd(flat)
    return np.asarray(left @ np.diag(np.maximum(sizes, _FLAT * sizes[0])) @ right)
