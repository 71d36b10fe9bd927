"""Take the BSDFs of a scene apart into lobes, and say how each becomes a probe."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparError, SceneError, message
from fluorspar.scene.averages import MESH_ATTRIBUTE
from fluorspar.scene.lights import Light
from fluorspar.scene.lobes.dyed import fluorescent
from fluorspar.scene.lobes.lobe import ANGLES, STRAIGHT, Edit, Lobe, Lobes
from fluorspar.scene.lobes.metal import conductor
from fluorspar.scene.lobes.plastic import dielectric, plastic
from fluorspar.scene.lobes.principled import principled
from fluorspar.scene.lobes.probes import check_probes
from fluorspar.scene.lobes.side import Side, Spectral
from fluorspar.scene.lobes.table import LobeTable, ReadMaterial
from fluorspar.scene.lobes.varying_light import VaryingLights, varies
from fluorspar.scene.nodes import FLUORESCENT, below, children, kind, label, sides_of
from fluorspar.scene.plugin import COAT
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["LobeReader", "needs_lobes"]

_MOST_ROWS = 2**32 - 2  # that a log can hold


class LobeReader(LobeTable):
    """Reads BSDF nodes; `lobes` at the end.

    Parameters
    ----------
    state, read_material
        As those of `LobeTable`.
    overrides : mapping of str to Material
        Materials from outside, by shape or BSDF id.
    """

    def __init__(self, state: Any, read_material: ReadMaterial, overrides: Mapping[str, Material]) -> None:
        super().__init__(state, read_material)
        self.overrides = overrides
        self.overridden: set[str] = set()
        self.replaced: dict[int, bool] = {}
        self.lights = VaryingLights(state, self.textures)
        self.of_surface: dict[int, tuple[list[Lobe], list[Lobe]]] = {}
        self._default: Spectral | None = None
        self._bsdfs: dict[int, str] = {}  # where each is

    def light(self, index: int, row: int, shape: int | None) -> Light | None:
        """Read a light that varies with direction or place; see `VaryingLights.read`."""
        return self.lights.read(index, row, shape)

    def lobes(self) -> Lobes:
        """Everything that was read, if Mitsuba builds it."""
        first, colours = len(self.rows), sum(map(len, self.colours))
        edits = tuple(Edit(node, values, plugin) for node, (plugin, values) in self.edits.items())
        check_probes(self.state, edits, self._bsdfs)
        sides = [side for both in self.of_surface.values() for side in both]
        on_metal = any(lobe.angles and self.is_colour(lobe) for side in sides for lobe in side)
        if on_metal and first + (1 + ANGLES) * colours > _MOST_ROWS:
            raise SceneError(
                message(
                    "the textures of a scene with a texture on metal are too large",
                    got=f"{colours} texels",
                    expected=f"at most {_MOST_ROWS // (1 + ANGLES)} in all",
                    fix="make the largest pictures smaller",
                )
            )

        def placed(side: list[Lobe]) -> tuple[Lobe, ...]:
            return tuple(replace(lobe, row=number(lobe)) for lobe in side)

        def number(lobe: Lobe) -> int:
            if not self.is_colour(lobe):
                return lobe.row
            return first + colours + ANGLES * lobe.row if lobe.angles else first + lobe.row

        return Lobes(
            tuple(self.rows),
            _joined(self.colours),
            tuple(self.textures),
            {node: (placed(front), placed(back)) for node, (front, back) in self.of_surface.items()},
            edits,
            self.replaced,
            self.lights.skies,
            _joined(self.lights.colours),
            self.lights.textures_of,
            self.maps,
        )

    def surface(self, shape: int, bsdf: int | None, where: str, *, emits: bool) -> tuple[int, int]:
        """Read the BSDF of a surface; return the main material of its two sides, -1 where there is none."""
        nodes = self.state.nodes
        twosided = bsdf is not None and nodes[bsdf].props.plugin_name() == "twosided"
        name = nodes[shape].props.id()
        if name in self.overrides:
            lobes = [replace(self.outside(name), mean=1.0, unit=1.0).lobe(0)]
            self.replaced[shape] = twosided
            front, back = lobes, lobes if twosided else []
        elif bsdf is None:
            # In Mitsuba a lamp without a BSDF is black.
            front, back = [] if emits else [self.default().lobe(0)], []
        else:
            nested = sides_of(self.state, bsdf, where) if twosided else [bsdf]
            self._bsdfs.setdefault(bsdf, f"BSDF {label(nodes[bsdf], bsdf)} of {where}")
            front, back = (
                self.side(index, shape, where, nodes[bsdf].props.id()) for index in (nested[0], nested[-1])
            )
        self.of_surface[shape] = front, back
        return self._main(front), self._main(back)

    def _main(self, side: list[Lobe]) -> int:
        """The material of the first lobe that has one."""
        for lobe in side:
            row = None if self.is_colour(lobe) else self.rows[lobe.row]
            for number, material in enumerate(self.materials):
                if material is row:
                    return number
        return -1

    def default(self) -> Spectral:
        """The spectrum of a surface without BSDF."""
        if self._default is None:
            self._default = self.of_material(Material("default", Spectrum.constant(0.5, name="default")))
        return self._default

    def outside(self, name: str) -> Spectral:
        """The spectrum of a material from outside."""
        key = -1, name
        if key not in self.read:
            self.read[key] = self.of_material(self.overrides[name])
            self.overridden.add(name)
        return self.read[key]

    def side(self, bsdf: int, shape: int, where: str, name: str) -> list[Lobe]:
        """Read one side of a BSDF of this name: the lobes of a BSDF node and of all that it holds."""
        within = (name,) if name else ()
        side = Side(f"BSDF {label(self.state.nodes[bsdf], bsdf)} of {where}", shape, within)
        if name in self.overrides:
            self.become(bsdf, self.outside(name), side)
        else:
            try:
                self._walk(bsdf, side)
            except FluorsparError as err:
                raise err if where in str(err) else type(err)(f"{err}\n  in:       {side.where}") from err
        lobes = [
            spectral.lobe(channel, side.ids[channel]) for channel, spectral in sorted(side.taken.items())
        ]
        if side.straight:
            lobes.append(self.white.lobe(STRAIGHT))
        return lobes

    def _walk(self, index: int, side: Side) -> None:
        node, before = self.state.nodes[index], side.within
        if (name := node.props.id()) and name not in before:
            side.within = (*before, name)
        if name in self.overrides:
            self.become(index, self.outside(name), side)
            side.within = before
            return
        plugin = node.props.plugin_name()
        read = _PLUGINS.get(plugin)
        if read is None:
            raise SceneError(
                message(
                    f"BSDF '{plugin}' is not supported",
                    where=side.where,
                    expected=f"one of {', '.join(sorted(_PLUGINS))}",
                    fix=did_you_mean(plugin, _PLUGINS)
                    or "replace it, or render it diffuse, of its average reflectance, with --matte (matte=True)",
                )
            )
        read(self, index, side)
        side.within = before

    def nested(self, index: int, side: Side) -> None:
        """Read the BSDFs inside a node."""
        for _, child in children(self.state, index):
            if kind(self.state.nodes[child]) == "BSDF":
                self._walk(child, side)


def _joined(colours: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    return np.concatenate(colours) if colours else np.zeros((0, 4), dtype=np.float32)


def _diffuse(table: LobeTable, index: int, side: Side) -> None:
    spectral = table.spectral(index, "reflectance", 0.5, side)
    table.give(index, "reflectance", spectral, side)


def _inner(reader: LobeReader, index: int, side: Side) -> None:
    reader.nested(index, side)


def _mask(reader: LobeReader, index: int, side: Side) -> None:
    reader.nested(index, side)
    side.straight = True


_PLUGINS: dict[str, Callable[[LobeReader, int, Side], None]] = {
    "diffuse": _diffuse,
    FLUORESCENT: fluorescent,
    "plastic": plastic,
    "roughplastic": plastic,
    "dielectric": dielectric,
    "thindielectric": dielectric,
    "roughdielectric": dielectric,
    "conductor": conductor,
    "roughconductor": conductor,
    "blendbsdf": _inner,
    "bumpmap": _inner,
    "normalmap": _inner,
    "principled": principled,
    "principledthin": principled,
    "mask": _mask,
    "null": _mask,
    "twosided": _inner,
}


_TEXTURES = {"bitmap", "checkerboard", MESH_ATTRIBUTE}
_MATTE = {"diffuse", FLUORESCENT, "twosided"}


def needs_lobes(state: Any, overrides: Mapping[str, Material]) -> bool:
    """Whether a scene has a surface that is not matte, or not of one spectrum, copies, or a light that varies."""
    for index, node in enumerate(state.nodes):
        if kind(node) == "Emitter" and varies(state, index):
            return True
        if node.props.plugin_name() in ("instance", "shapegroup"):
            return True
        if kind(node) != "Shape" or node.props.id() in overrides:
            continue
        for _, bsdf in children(state, index):
            if kind(state.nodes[bsdf]) != "BSDF":
                continue
            parts = [state.nodes[part] for part in (bsdf, *below(state, bsdf))]
            plugins = {part.props.plugin_name() for part in parts}
            names = {name for part in parts for name in part.props.keys()}  # noqa: SIM118 (not a dict)
            bsdfs = {part.props.plugin_name() for part in parts if kind(part) == "BSDF"}
            coated = FLUORESCENT in plugins and names & set(COAT)
            if coated or plugins & _TEXTURES or bsdfs - _MATTE:
                return True
    return False
