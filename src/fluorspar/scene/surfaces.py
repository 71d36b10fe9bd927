"""Which material and which light is on which surface."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.errors import SceneError, SceneNotice, message
from fluorspar.scene.averages import uses_mesh
from fluorspar.scene.lights import LIGHTS, Light, read_light
from fluorspar.scene.lobes.lobe import Lobes
from fluorspar.scene.lobes.reader import LobeReader, needs_lobes
from fluorspar.scene.nodes import children, grouped, kind, label, sides_of
from fluorspar.scene.recipe import Recipe
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.scene.surface_material import DEFAULT_REFLECTANCE, read_material
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["ABSORBS", "NO_LIGHT", "Surface", "SurfaceTable", "read_surfaces"]

ABSORBS = -1  # in place of a material row: a side that reflects nothing
NO_LIGHT = -1  # in place of a light row: a surface that does not emit

_COPIES = ("instance", "shapegroup")  # what they hold are surfaces


@dataclass(frozen=True)
class Surface:
    """A shape of the scene.

    Attributes
    ----------
    name : str
        Its id, or its plugin and number.
    node : int
        Its number in `Scene.nodes`.
    front, back : int
        Rows of the material table for its two sides; `ABSORBS` where one reflects nothing.
    light : int
        Row of the light table; `NO_LIGHT` where it does not emit.
    front_ids, back_ids : tuple of str
        Ids of the BSDFs that a matte side is read from, the outermost first; of others each lobe has its own.
    """

    name: str
    node: int
    front: int
    back: int
    light: int
    front_ids: tuple[str, ...] = ()
    back_ids: tuple[str, ...] = ()


@dataclass
class SurfaceTable:
    """Everything in a scene that has a spectrum: the rows that traced paths refer to."""

    materials: list[Material] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    surfaces: list[Surface] = field(default_factory=list)
    lobes: Lobes | None = None


def read_surfaces(state: Any, recipe: Recipe) -> SurfaceTable:
    """Find the material rows and light rows of all shapes of a parsed scene.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    recipe : Recipe
        What it was parsed from: its folder, materials from outside, `matte` and libraries.

    Raises
    ------
    SceneError
        If a plugin cannot be handled, an id is unknown, or there is no light.
    """
    return _Reader(state, recipe).read()


class _Reader:
    """Walks over the nodes once; each distinct BSDF becomes one row, however many shapes use it."""

    def __init__(self, state: Any, recipe: Recipe) -> None:
        self.state = state
        self.recipe = recipe
        self.overrides = recipe.materials
        self.unused = set(recipe.materials)
        self.table = SurfaceTable()
        self.row_of_node: dict[tuple[int, int | None], int] = {}
        self.row_of_override: dict[str, int] = {}
        self.default_row: int | None = None
        self.lobes: LobeReader | None = None
        self.grouped = grouped(state)
        if not recipe.matte and needs_lobes(state, self.overrides):
            self.lobes = LobeReader(
                state, lambda nodes, i, shape: read_material(nodes, i, shape, recipe), self.overrides
            )

    def read(self) -> SurfaceTable:
        ids = []
        for index, node in enumerate(self.state.nodes):
            if kind(node) in ("Shape", "BSDF") and node.props.id():
                ids.append(node.props.id())
            if kind(node) == "Shape":
                self.shape(index)
            elif kind(node) == "Volume" or kind(node) == "Medium":
                raise SceneError(
                    message(
                        "participating media are not supported",
                        where=label(node, index),
                        expected="surfaces only",
                    )
                )
        for _, index in children(self.state, 0):
            if kind(self.state.nodes[index]) == "Emitter":
                self.light(index)
        if self.lobes is not None:
            self.table.lobes = self.lobes.lobes()
            self.table.materials = self.lobes.materials
            self.unused -= self.lobes.overridden
        self.check_overrides(ids)
        if not self.table.lights:
            raise SceneError(
                message(
                    "the scene has no light",
                    expected=f"an emitter, one of {', '.join(LIGHTS)}",
                    fix="add an emitter to the scene",
                )
            )
        if not self.table.materials:  # lamps alone: a table has a row
            self.add(Material("black", Spectrum.constant(0.0, name="black")))
        return self.table

    def check_overrides(self, ids: list[str]) -> None:
        """Refuse materials from outside for ids that the scene has not, and say which are not used."""
        if unknown := self.unused - set(ids):
            name = sorted(unknown)[0]
            raise SceneError(
                message(
                    f"no shape or BSDF has the id '{name}', which is to get a material",
                    expected=f"one of {', '.join(sorted(set(ids))) or '(the scene gives no ids)'}",
                    fix=did_you_mean(name, ids) or "give the shape an id in the scene file",
                )
            )
        for name in sorted(self.unused):
            text = f"the material for '{name}' is not used: no surface refers to it, or those that do have another"
            warnings.warn(text, SceneNotice, stacklevel=5)

    def shape(self, index: int) -> None:
        """Add a shape with its materials and its light."""
        node = self.state.nodes[index]
        where = f"shape {label(node, index)}"
        if (plugin := node.props.plugin_name()) == "merge" or (plugin in _COPIES and self.lobes is None):
            raise SceneError(
                message(
                    f"'{plugin}' is not supported" + " with matte" * self.recipe.matte,
                    where=where,
                    expected="plain shapes",
                    fix="write the copies out as shapes",
                )
            )
        if plugin in _COPIES:
            return
        if index in self.grouped:
            self.check_grouped(index, where)
        bsdf, light = None, NO_LIGHT
        for _, child in children(self.state, index):
            if kind(self.state.nodes[child]) == "BSDF":
                bsdf = child
            elif kind(self.state.nodes[child]) == "Emitter":
                light = self.light(child, shape=index)
            elif kind(self.state.nodes[child]) == "Medium":
                raise SceneError(
                    message("participating media are not supported", where=where, expected="surfaces only")
                )
        if self.lobes is not None:
            front, back = self.lobes.surface(index, bsdf, where, emits=light != NO_LIGHT)
            self.table.surfaces.append(
                Surface(node.props.id() or label(node, index), index, front, back, light)
            )
            return
        ids: tuple[tuple[str, ...], ...] = ((), ())
        if (name := node.props.id()) in self.overrides:
            # Its own BSDF is not read: what it is does not matter, except whether it has a back.
            front = back = self.override(name)
            if bsdf is None or self.state.nodes[bsdf].props.plugin_name() != "twosided":
                back = ABSORBS
        else:
            front, back = self.sides(bsdf, index, emits=light != NO_LIGHT)
            ids = self.ids(bsdf, index)
        self.table.surfaces.append(Surface(name or label(node, index), index, front, back, light, *ids))

    def check_grouped(self, index: int, where: str) -> None:
        """Refuse a shape of a group that sends out light, or has colours of its own vertices or faces."""
        emits = any(kind(self.state.nodes[child]) == "Emitter" for _, child in children(self.state, index))
        if emits or uses_mesh(self.state, index):
            raise SceneError(
                message(
                    f"copies of {'a light' if emits else 'a mesh with colours of its own'} are not supported",
                    where=where,
                    expected="shapes without light or 'mesh_attribute' in a 'shapegroup'",
                    fix="write the copies out as shapes",
                )
            )

    def sides(self, bsdf: int | None, shape: int, *, emits: bool) -> tuple[int, int]:
        """Material rows of the two sides of a surface with this BSDF node."""
        if bsdf is None and emits:
            return ABSORBS, ABSORBS  # in Mitsuba a lamp without a BSDF is black
        if bsdf is None:
            if self.default_row is None:
                self.default_row = self.add(
                    Material("default", Spectrum.constant(DEFAULT_REFLECTANCE, name="default"))
                )
            return self.default_row, ABSORBS
        node = self.state.nodes[bsdf]
        if node.props.plugin_name() != "twosided":
            return self.row(bsdf, shape), ABSORBS
        nested = sides_of(self.state, bsdf, f"shape {label(self.state.nodes[shape], shape)}")
        if node.props.id() in self.overrides:
            row = self.override(node.props.id())
            return row, row
        return self.row(nested[0], shape), self.row(nested[-1], shape)

    def row(self, index: int, shape: int) -> int:
        """Material row of a one-sided BSDF node on a shape."""
        node = self.state.nodes[index]
        if (name := node.props.id()) in self.overrides:
            return self.override(name)
        key = (index, shape if uses_mesh(self.state, index) else None)
        if key not in self.row_of_node:
            self.row_of_node[key] = self.add(read_material(self.state, index, shape, self.recipe))
        return self.row_of_node[key]

    def ids(self, bsdf: int | None, shape: int) -> tuple[tuple[str, ...], ...]:
        """Ids of the BSDF nodes that both sides of a surface are read from."""
        if bsdf is None:
            return (), ()
        parts = [(bsdf,), ()]
        if self.state.nodes[bsdf].props.plugin_name() == "twosided":
            nested = sides_of(self.state, bsdf, f"shape {label(self.state.nodes[shape], shape)}")
            parts = [(bsdf, nested[0]), (bsdf, nested[-1])]
        names = [[self.state.nodes[node].props.id() for node in part] for part in parts]
        return tuple(tuple(filter(None, both)) for both in names)

    def override(self, name: str) -> int:
        """Material row of a material from outside."""
        self.unused.discard(name)
        if name not in self.row_of_override:
            self.row_of_override[name] = self.add(self.overrides[name])
        return self.row_of_override[name]

    def light(self, index: int, shape: int | None = None) -> int:
        """Light row of an emitter node."""
        varying = None if self.lobes is None else self.lobes.light(index, len(self.table.lights), shape)
        self.table.lights.append(varying or read_light(self.state, index, shape, matte=self.recipe.matte))
        return len(self.table.lights) - 1

    def add(self, material: Material) -> int:
        """Row of a material that is new."""
        self.table.materials.append(material)
        return len(self.table.materials) - 1
