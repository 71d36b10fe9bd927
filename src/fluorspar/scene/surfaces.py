"""Which material and which light is on which surface."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

from fluorspar.bispectral.library import material
from fluorspar.bispectral.material import Material
from fluorspar.errors import ApproximationWarning, FluorsparError, SceneError, SceneNotice, message
from fluorspar.scene.nodes import children, kind, label
from fluorspar.scene.plugin import FLUORESCENT, SPECTRA, STRINGS, check_properties, material_of_spectra
from fluorspar.scene.plugin_spectra import (
    SpatialVariation,
    average_light,
    average_reflectance,
    plugin_spectrum,
)
from fluorspar.scene.recipe import Recipe
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["ABSORBS", "NO_LIGHT", "Light", "Surface", "SurfaceTable", "read_surfaces"]

ABSORBS = -1  # in place of a material row: a side that reflects nothing
NO_LIGHT = -1  # in place of a light row: a surface that does not emit

# Property that holds the spectrum, Mitsuba's default, unit.
_LIGHTS = {
    "area": ("radiance", 1.0, "W m-2 sr-1 nm-1"),
    "constant": ("radiance", 1.0, "W m-2 sr-1 nm-1"),
    "point": ("intensity", 1.0, "W sr-1 nm-1"),
    "spot": ("intensity", 1.0, "W sr-1 nm-1"),
    "directional": ("irradiance", 1.0, "W m-2 nm-1"),
}
_PROPERTIES = {"diffuse": ("reflectance",), FLUORESCENT: (*SPECTRA, *STRINGS, "concentration")}
_AVERAGED_ENVIRONMENTS = ("envmap", "sunsky")
_NOT_A_SURFACE = ("instance", "shapegroup", "merge")
_DEFAULT_REFLECTANCE = 0.5  # Mitsuba's, of `diffuse` and of a shape without BSDF


@dataclass(frozen=True)
class Light:
    """A light source and its spectral power distribution.

    `spectrum` is the radiance, intensity or irradiance that Mitsuba gives this kind of light; `unit` says which.
    """

    name: str
    plugin: str
    spectrum: Spectrum
    unit: str
    node: int


@dataclass(frozen=True)
class Surface:
    """A shape of the scene: rows of the material table for its two sides, row of the light table.

    `front` and `back` are `ABSORBS` where a side reflects nothing, `light` is `NO_LIGHT` where it does not emit.
    """

    name: str
    node: int
    front: int
    back: int
    light: int


@dataclass
class SurfaceTable:
    """Everything in a scene that has a spectrum: the rows that traced paths refer to."""

    materials: list[Material] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    surfaces: list[Surface] = field(default_factory=list)


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
        self.base = recipe.base
        self.overrides = recipe.materials
        self.unused = set(recipe.materials)
        self.matte = recipe.matte
        self.library = recipe.library
        self.table = SurfaceTable()
        self.row_of_node: dict[int, int] = {}
        self.row_of_override: dict[str, int] = {}
        self.default_row: int | None = None

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
                self.light(index, where="the scene")
        if unknown := self.unused - set(ids):
            name = sorted(unknown)[0]
            close = get_close_matches(name, ids, n=3)
            raise SceneError(
                message(
                    f"no shape or BSDF has the id '{name}', which is to get a material",
                    expected=f"one of {', '.join(sorted(set(ids))) or '(the scene gives no ids)'}",
                    fix=f"did you mean {' or '.join(close)}?"
                    if close
                    else "give the shape an id in the scene file",
                )
            )
        for name in sorted(self.unused):
            text = (
                f"the material for '{name}' is not used: no surface that has no other material refers to it"
            )
            warnings.warn(text, SceneNotice, stacklevel=4)
        if not self.table.lights:
            raise SceneError(
                message(
                    "the scene has no light",
                    expected=f"an emitter, one of {', '.join(_LIGHTS)}",
                    fix="add an emitter to the scene",
                )
            )
        if not self.table.materials:
            self.add(
                Material("black", Spectrum.constant(0.0, name="black"))
            )  # lamps alone: a table has a row
        return self.table

    def shape(self, index: int) -> None:
        node = self.state.nodes[index]
        where = f"shape {label(node, index)}"
        if node.props.plugin_name() in _NOT_A_SURFACE:
            raise SceneError(
                message(
                    f"'{node.props.plugin_name()}' is not supported",
                    where=where,
                    expected="plain shapes",
                    fix="write the copies out as shapes",
                )
            )
        bsdf, light = None, NO_LIGHT
        for _, child in children(self.state, index):
            if kind(self.state.nodes[child]) == "BSDF":
                bsdf = child
            elif kind(self.state.nodes[child]) == "Emitter":
                light = self.light(child, where=where)
            elif kind(self.state.nodes[child]) == "Medium":
                raise SceneError(
                    message("participating media are not supported", where=where, expected="surfaces only")
                )
        if (name := node.props.id()) in self.overrides:
            # Its own BSDF is not read: what it is does not matter, except whether it has a back.
            front = back = self.override(name)
            if bsdf is None or self.state.nodes[bsdf].props.plugin_name() != "twosided":
                back = ABSORBS
        else:
            front, back = self.sides(bsdf, where, emits=light != NO_LIGHT)
        self.table.surfaces.append(Surface(name or label(node, index), index, front, back, light))

    def sides(self, bsdf: int | None, where: str, *, emits: bool) -> tuple[int, int]:
        """Material rows of the two sides of a surface with this BSDF node."""
        if bsdf is None and emits:
            return ABSORBS, ABSORBS  # in Mitsuba a lamp without a BSDF is black
        if bsdf is None:
            if self.default_row is None:
                self.default_row = self.add(
                    Material("default", Spectrum.constant(_DEFAULT_REFLECTANCE, name="default"))
                )
            return self.default_row, ABSORBS
        node = self.state.nodes[bsdf]
        if node.props.plugin_name() != "twosided":
            return self.row(bsdf, where), ABSORBS
        nested = [child for _, child in children(self.state, bsdf)]
        if node.props.id() in self.overrides:
            row = self.override(node.props.id())
            return row, row
        return self.row(nested[0], where), self.row(nested[-1], where)

    def row(self, index: int, where: str) -> int:
        """Material row of a one-sided BSDF node."""
        node = self.state.nodes[index]
        if (name := node.props.id()) in self.overrides:
            return self.override(name)
        if index not in self.row_of_node:
            self.row_of_node[index] = self.add(self.material(index, f"BSDF {label(node, index)} of {where}"))
        return self.row_of_node[index]

    def override(self, name: str) -> int:
        self.unused.discard(name)
        if name not in self.row_of_override:
            self.row_of_override[name] = self.add(self.overrides[name])
        return self.row_of_override[name]

    def add(self, surface_material: Material) -> int:
        self.table.materials.append(surface_material)
        return len(self.table.materials) - 1

    def material(self, index: int, where: str) -> Material:
        """Read the material of a `diffuse` or `fluorescent` node; average any other under `--matte`."""
        node = self.state.nodes[index]
        plugin, props = node.props.plugin_name(), node.props
        name = props.id() or where
        if plugin in _PROPERTIES and (unknown := sorted(set(props.keys()) - set(_PROPERTIES[plugin]))):
            # The BSDF is never built, so Mitsuba does not see it.
            raise SceneError(
                message(
                    f"there is no property '{unknown[0]}'",
                    where=where,
                    expected=", ".join(_PROPERTIES[plugin]),
                )
            )
        try:
            if plugin == "diffuse":
                return Material(name, self.spectrum(index, "reflectance", _DEFAULT_REFLECTANCE, where))
            if plugin == FLUORESCENT:
                return self.fluorescent(index, name, where)
        except SpatialVariation:
            if not self.matte:
                raise
        except FluorsparError as err:
            raise err if where in str(err) else type(err)(f"{err}\n  in:       {where}") from err
        if plugin == FLUORESCENT or not self.matte:
            raise SceneError(
                message(
                    f"BSDF '{plugin}' is not a matte surface of one spectrum",
                    where=where,
                    expected=f"diffuse, twosided or {FLUORESCENT}, with spectra that are the same all over the surface",
                    fix="replace it, or render it diffuse, of its average reflectance, with --matte (matte=True)",
                )
            )
        warnings.warn(
            f"{where} is rendered as a diffuse surface of its average reflectance",
            ApproximationWarning,
            stacklevel=2,
        )
        return Material(name, average_reflectance(self.state, index, name))

    def fluorescent(self, index: int, name: str, where: str) -> Material:
        props = self.state.nodes[index].props
        check_properties(set(props.keys()), where)
        if "material" in props:
            made = material(props["material"], self.library, base=self.base)
        elif "donaldson" in props:
            made = material(self.base / props["donaldson"])
        else:
            has_dye = "emission" in props
            reflectance, emission, excitation = (
                self.spectrum(index, part, _DEFAULT_REFLECTANCE, f"{part} of {where}")
                if has_dye or part == "reflectance"
                else None
                for part in SPECTRA
            )
            assert reflectance is not None
            made = material_of_spectra(name, reflectance, emission, excitation)
        return made.with_concentration(float(props["concentration"])) if "concentration" in props else made

    def spectrum(self, index: int, name: str, default: float, where: str) -> Spectrum:
        return plugin_spectrum(self.state, index, name, default=default, label=where)

    def light(self, index: int, where: str) -> int:
        """Add the light row of an emitter node."""
        node = self.state.nodes[index]
        plugin, props = node.props.plugin_name(), node.props
        name = props.id() or where
        if plugin in _LIGHTS:
            prop, default, unit = _LIGHTS[plugin]
            if plugin == "spot" and "texture" in props:
                raise SceneError(
                    message(
                        "a spot light with a texture is not supported",
                        where=f"light {label(node, index)} of {where}",
                    )
                )
            try:
                spectrum = plugin_spectrum(
                    self.state, index, prop, default=default, label=f"{prop} of light '{name}'", emissive=True
                )
            except SpatialVariation:
                if not self.matte:
                    raise
                spectrum = self.average(index, name)
        elif plugin in _AVERAGED_ENVIRONMENTS and self.matte:
            spectrum, unit = self.average(index, name), _LIGHTS["constant"][2]
        else:
            raise SceneError(
                message(
                    f"light '{plugin}' is not supported",
                    where=f"light {label(node, index)} of {where}",
                    expected=f"one of {', '.join(_LIGHTS)}",
                    fix="use --matte (matte=True) for a constant light of its average"
                    if plugin in _AVERAGED_ENVIRONMENTS
                    else "replace it",
                )
            )
        if (spectrum.values < 0).any():
            raise SceneError(
                message(
                    "a light is negative",
                    where=f"light '{name}'",
                    got=float(spectrum.values.min()),
                    expected=">= 0",
                )
            )
        self.table.lights.append(Light(name, plugin, spectrum, unit, index))
        return len(self.table.lights) - 1

    def average(self, index: int, name: str) -> Spectrum:
        warnings.warn(
            f"light '{name}' is rendered with its average radiance everywhere",
            ApproximationWarning,
            stacklevel=2,
        )
        return average_light(self.state, index, f"light '{name}'")
