"""The table of spectra that lobes refer to and the edits that make probes, while the BSDFs of a scene are read."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.material import Material
from fluorspar.errors import ApproximationWarning
from fluorspar.scene.averages import MESH_ATTRIBUTE, uses_mesh
from fluorspar.scene.lobes.lobe import CHANNELS, DyeMap, Lobe, LobeRow, Texture
from fluorspar.scene.lobes.rows import Operated
from fluorspar.scene.lobes.side import Side, Spectral
from fluorspar.scene.lobes.textures import placement, read_attribute, read_bitmap, sigmoid
from fluorspar.scene.nodes import build
from fluorspar.scene.plugin_spectra import plugin_spectrum
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["LobeTable", "ReadMaterial"]

_VISIBLE = np.arange(400.0, 701.0, 10.0)
_DARKEST = 0.02  # probe: a lobe of a black colour still needs a coefficient

Value = float | str | tuple[float, float, float] | None
ReadMaterial = Callable[[Any, int, int], Material]


class LobeTable:
    """Grows while BSDFs are read.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    read_material : callable
        Makes the material of a node that is matte and of one spectrum: takes nodes, its number, and that of a shape
        that it is on.

    Attributes
    ----------
    rows, colours, textures, maps
        As in `Lobes`.
    materials : list of Material
        Those rows that are materials.
    edits : dict of int to (str or None, dict)
        Plugin and properties that a node gets.
    read : dict of (int, str) to Spectral
        What was read, by node and property.
    channel_of : dict of (int, str) to int
        The channel of a property of a node.
    white : Spectral
        Reflectance 1, of highlights and glass.
    """

    def __init__(self, state: Any, read_material: ReadMaterial) -> None:
        self.state = state
        self.read_material = read_material
        self.materials: list[Material] = []
        self.rows: list[LobeRow] = [Material("white", Spectrum.constant(1.0, name="white"))]
        self.colours: list[NDArray[np.float32]] = []
        self.textures: list[Texture] = []
        self.maps: dict[int, DyeMap] = {}
        self.edits: dict[int, tuple[str | None, dict[str, Value]]] = {}
        self.read: dict[tuple[int, str], Spectral] = {}
        self.channel_of: dict[tuple[int, str], int] = {}
        self.white = Spectral(0, False, 1.0, 1.0, gloss=True)
        self._warned = False
        self._in_colours: set[tuple[int, int]] = set()

    def key(self, index: int, name: str, shape: int) -> tuple[int, str]:
        """Where in `read` a property of a node on a shape is: colours of vertices and faces are the shape's own."""
        return index, f"{name}, {shape}" if uses_mesh(self.state, index) else name

    def spectral(self, index: int, name: str, default: float, side: Side) -> Spectral:
        """Read a spectrum-valued property of a node, textures too."""
        key = self.key(index, name, side.shape)
        if key not in self.read:
            where = side.where if name == "reflectance" else f"{name} of {side.where}"
            self.read[key] = self._read(index, name, default, where, side.shape)
        return self.read[key]

    def _read(self, index: int, name: str, default: float, where: str, shape: int) -> Spectral:
        import mitsuba as mi

        props = self.state.nodes[index].props
        if name not in props and default == 1.0:
            return self.white
        if name in props and props.type(name) == mi.Properties.Type.ResolvedReference:
            child = props[name].index()
            plugin = self.state.nodes[child].props.plugin_name()
            if plugin == "bitmap":
                return self.bitmap(child, where)
            if plugin == "checkerboard":
                return self.checkerboard(child, where)
            if plugin == MESH_ATTRIBUTE:
                colours, texture = read_attribute(self.state, child, shape, where)
                return replace(self.texels(colours, texture), mean=0.5, unit=0.5)  # one probe on all shapes
        spectrum = plugin_spectrum(self.state, index, name, default=default, label=where)
        return self.of_material(Material(props.id() or where, spectrum))

    def of_material(self, material: Material) -> Spectral:
        """A new row for a material."""
        self.materials.append(material)
        self.rows.append(material)
        mean = _of_probe(float(np.mean([material.reflectance.at(w) for w in _VISIBLE])))
        return Spectral(len(self.rows) - 1, False, mean, mean)

    def bitmap(self, index: int, where: str) -> Spectral:
        """New colours for the texels of a bitmap node."""
        flat, texture = read_bitmap(self.state, index, where)
        return self.texels(flat, texture)

    def texels(self, flat: NDArray[np.float32], texture: Texture) -> Spectral:
        """New colours for the texels of a texture: sigmoid coefficients of shape (texels, 3)."""
        self.textures.append(texture)
        row = sum(map(len, self.colours))
        self.colours.append(np.concatenate([flat, np.zeros((len(flat), 1), np.float32)], axis=1))
        mean = _of_probe(float(np.mean(sigmoid(flat[:: max(1, len(flat) // 4096)], _VISIBLE))))
        number = len(self.textures) - 1
        self._in_colours.add((number, row))
        return Spectral(row, True, mean, mean, number)

    def checkerboard(self, index: int, where: str) -> Spectral:
        """New rows for a checkerboard node."""
        colours = [
            self.of_material(
                Material(
                    f"{name} of {where}",
                    plugin_spectrum(self.state, index, name, default=default, label=f"{name} of {where}"),
                )
            )
            for name, default in (("color0", 0.4), ("color1", 0.2))
        ]
        row = len(self.rows)
        first, second = (self.rows[colour.row] for colour in colours)
        self.rows += [first, second, second, first]
        self.textures.append(placement(self.state, index, build(self.state, index), 2, 2))
        mean = _of_probe((colours[0].mean + colours[1].mean) / 2)
        return Spectral(row, False, mean, mean, len(self.textures) - 1)

    def operated(self, spectral: Spectral, operation: float, mean: float, unit: float) -> Spectral:
        """What a lobe makes of a spectrum, see `operate`; with another probe."""
        if spectral.in_colours:
            row = sum(map(len, self.colours))
            first = np.cumsum([0, *map(len, self.colours)])
            flat = self.colours[int(np.searchsorted(first, spectral.row))].copy()
            flat[:, 3] = operation
            self.colours.append(flat)
            self.textures.append(self.textures[spectral.texture])
            self._in_colours.add((len(self.textures) - 1, row))
            return Spectral(row, True, mean, unit, len(self.textures) - 1)
        row = len(self.rows)
        self.rows += [Operated(below, operation) for below in self.rows_of(spectral)]
        return Spectral(row, False, mean, unit, spectral.texture)

    def rows_of(self, spectral: Spectral) -> list[Material]:
        """The materials of a spectrum that is not of colours: one, or one for each texel."""
        count = 1
        if spectral.texture >= 0:
            count = self.textures[spectral.texture].width * self.textures[spectral.texture].height
        rows = self.rows[spectral.row : spectral.row + count]
        return [row for row in rows if isinstance(row, Material)]

    def warn_of_interpolation(self, spectral: Spectral, where: str) -> None:
        """Warn, once, of an interpolated texture whose colours are used in a way that is not linear."""
        if spectral.texture < 0 or not self.textures[spectral.texture].bilinear or self._warned:
            return
        self._warned = True
        warnings.warn(
            f"{where} does not depend linearly on the colours of its texture: between texels its reflectance is "
            "interpolated, and not the colours as in Mitsuba, which makes random texels 0.04 to 0.24 % brighter (so "
            "for others like it in the scene)",
            ApproximationWarning,
            stacklevel=2,
        )

    def give(self, index: int, name: str, spectral: Spectral, side: Side) -> None:
        """Make a property of a node the probe of a spectrum."""
        channel = side.channel(spectral, self.channel_of.get((index, name)))
        self.channel_of[index, name] = channel
        colour = [0.0] * CHANNELS
        colour[channel] = spectral.mean
        self.edit(index, {name: (colour[0], colour[1], colour[2])})

    def edit(self, index: int, values: dict[str, Value], plugin: str | None = None) -> None:
        """Note what a node has to become."""
        before, known = self.edits.get(index, (None, {}))
        self.edits[index] = plugin or before, {**known, **values}

    def become(self, index: int, spectral: Spectral, side: Side) -> None:
        """Make a node a diffuse surface of a spectrum."""
        self.edit(index, {}, plugin="diffuse")
        self.give(index, "reflectance", spectral, side)

    def is_colour(self, lobe: Lobe) -> bool:
        """Whether the row of a lobe is one of `colours`."""
        return lobe.texture >= 0 and (lobe.texture, lobe.row) in self._in_colours


def _of_probe(mean: float) -> float:
    """A probe for a mean reflectance: one of a few, so that BSDFs that differ in colour only have one probe."""
    return float(2 ** (round(2 * np.log2(max(mean, _DARKEST))) / 2))
