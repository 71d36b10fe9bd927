"""Take the BSDFs of a scene apart into lobes, and say how each becomes a probe."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.material import Material
from fluorspar.errors import ApproximationWarning, SceneError, message
from fluorspar.scene.lights import Light, light_names
from fluorspar.scene.lobes.lobe import (
    CHANNELS,
    DARK,
    FULL,
    HALF,
    STRAIGHT,
    DyeMap,
    Edit,
    Lobe,
    LobeRow,
    Lobes,
    Texture,
)
from fluorspar.scene.lobes.rows import ANGLES, Coated, Luminescence, Metal, Operated, Reflection
from fluorspar.scene.lobes.textures import (
    bitmap_colours,
    placement,
    sigmoid,
    sky_colours,
    sky_placement,
)
from fluorspar.scene.nodes import FLUORESCENT, build, children, copy_nodes, kind, label
from fluorspar.scene.plugin import COAT
from fluorspar.scene.plugin_spectra import plugin_spectrum, white_light
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["LobeReader", "needs_lobes"]

_VISIBLE = np.arange(400.0, 701.0, 10.0)
_DARKEST = 0.02  # probe: a lobe of a black colour still needs a coefficient
_PRIMARIES = np.array(
    [1.0, 450.0, 545.0, 610.0, 1e5]
)  # nm; the three of an rgb index of refraction, held outside

Value = float | str | tuple[float, float, float] | None
ReadMaterial = Callable[[Any, int, int], Material]


@dataclass(frozen=True)
class _Spectral:
    """A spectrum-valued property: its lobe but for the channel, and the value of its probe."""

    row: int
    in_colours: bool
    mean: float
    unit: float
    texture: int = -1
    angles: int = 0

    def lobe(self, channel: int) -> Lobe:
        return Lobe(channel, self.row, self.unit, self.texture, self.angles)


@dataclass
class _Side:
    """One side of a BSDF while it is read: which spectrum has which channel."""

    where: str
    shape: int
    taken: dict[int, _Spectral] = field(default_factory=dict)
    straight: bool = False

    def channel(self, spectral: _Spectral, wanted: int | None) -> int:
        """Give a spectrum a channel; equal ones share it."""
        for channel, other in self.taken.items():
            if other == spectral and wanted in (None, channel):
                return channel
        free = [c for c in range(CHANNELS) if c not in self.taken]
        if wanted is not None:
            free = [c for c in free if c == wanted]
        if not free:
            raise SceneError(
                message(
                    "a BSDF has too many different spectra",
                    where=self.where,
                    expected=f"at most {CHANNELS} in one surface, blends included",
                    fix="give some of its parts one spectrum, or render it diffuse with --matte (matte=True)",
                )
            )
        self.taken[free[0]] = spectral
        return free[0]


class LobeReader:
    """Reads BSDF nodes; `lobes` at the end.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    read_material : callable
        Makes the material of a node that is matte and of one spectrum: takes nodes, its number, and that of a shape
        that it is on.
    overrides : mapping of str to Material
        Materials from outside, by shape or BSDF id.
    """

    def __init__(self, state: Any, read_material: ReadMaterial, overrides: Mapping[str, Material]) -> None:
        self.state = state
        self.read_material = read_material
        self.overrides = overrides
        self.overridden: set[str] = set()
        self.replaced: dict[int, bool] = {}
        self.skies: dict[int, NDArray[np.float32]] = {}
        self.light_colours: list[NDArray[np.float32]] = []
        self.light_textures: dict[int, tuple[int, int]] = {}
        self.maps: dict[int, DyeMap] = {}
        self._default: _Spectral | None = None
        self.materials: list[Material] = []
        self.rows: list[LobeRow] = []
        self.colours: list[NDArray[np.float32]] = []
        self.textures: list[Texture] = []
        self.of_surface: dict[int, tuple[list[Lobe], list[Lobe]]] = {}
        self._edits: dict[int, tuple[str | None, dict[str, Value]]] = {}
        self._spectral: dict[tuple[int, str], _Spectral] = {}
        self._channel: dict[tuple[int, str], int] = {}  # of a property of a node
        self._in_colours: set[tuple[int, int]] = set()
        self._white = _Spectral(0, False, 1.0, 1.0)
        self.rows.append(Material("white", Spectrum.constant(1.0, name="white")))

    def light(self, index: int, row: int, shape: int | None) -> Light | None:
        """Read a light that varies with direction or place; None if this one does not.

        Parameters
        ----------
        index : int
            Its node.
        row : int
            The row of the light table that it gets.
        shape : int or None
            The node of the shape that it is on.
        """
        import mitsuba as mi

        props = self.state.nodes[index].props
        plugin = props.plugin_name()
        name, _ = light_names(self.state, index, shape)
        if plugin == "envmap":
            width, _ = mi.Bitmap(str(mi.file_resolver().resolve(props["filename"]))).size()
            colours, scale = sky_colours(self.state, index, int(width), f"light '{name}'")
            self.skies[index] = scale
            texture = sky_placement(*scale.shape)
            spectrum = white_light(1.0, f"radiance of light '{name}'")
        elif plugin == "area" and props.type("radiance") == mi.Properties.Type.ResolvedReference:
            child = props["radiance"].index()
            if self.state.nodes[child].props.plugin_name() != "bitmap":
                return None
            colours = bitmap_colours(self.state, child, f"radiance of light '{name}'")
            texture = placement(self.state, child, *colours.shape[:2])
            spectrum = Spectrum.constant(1.0, f"radiance of light '{name}'")
        else:
            return None
        flat = colours.reshape(-1, 3)
        self.light_textures[row] = len(self.textures), sum(map(len, self.light_colours))
        self.textures.append(texture)
        self.light_colours.append(np.concatenate([flat, np.full((len(flat), 1), row, np.float32)], axis=1))
        return Light(name, plugin, spectrum, "W m-2 sr-1 nm-1", index)

    def lobes(self) -> Lobes:
        """Everything that was read."""
        first = len(self.rows)

        def placed(side: list[Lobe]) -> tuple[Lobe, ...]:
            return tuple(
                replace(lobe, row=first + lobe.row) if self._is_colour(lobe) else lobe for lobe in side
            )

        return Lobes(
            tuple(self.rows),
            _joined(self.colours),
            tuple(self.textures),
            {node: (placed(front), placed(back)) for node, (front, back) in self.of_surface.items()},
            tuple(Edit(node, values, plugin) for node, (plugin, values) in self._edits.items()),
            self.replaced,
            self.skies,
            _joined(self.light_colours),
            self.light_textures,
            self.maps,
        )

    def _is_colour(self, lobe: Lobe) -> bool:
        return lobe.texture >= 0 and (lobe.texture, lobe.row) in self._in_colours

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
            front, back = (
                [] if emits else [self.default().lobe(0)],
                [],
            )  # in Mitsuba a lamp without a BSDF is black
        else:
            nested = [child for _, child in children(self.state, bsdf)] if twosided else [bsdf]
            front, back = (
                self.side(index, shape, where, nodes[bsdf].props.id()) for index in (nested[0], nested[-1])
            )
        self.of_surface[shape] = front, back
        return self._main(front), self._main(back)

    def _main(self, side: list[Lobe]) -> int:
        """The material of the first lobe that has one."""
        for lobe in side:
            row = None if self._is_colour(lobe) else self.rows[lobe.row]
            for number, material in enumerate(self.materials):
                if material is row:
                    return number
        return -1

    def default(self) -> _Spectral:
        """The spectrum of a surface without BSDF."""
        if self._default is None:
            self._default = self.of_material(Material("default", Spectrum.constant(0.5, name="default")))
        return self._default

    def outside(self, name: str) -> _Spectral:
        """The spectrum of a material from outside."""
        key = -1, name
        if key not in self._spectral:
            self._spectral[key] = self.of_material(self.overrides[name])
            self.overridden.add(name)
        return self._spectral[key]

    def side(self, bsdf: int, shape: int, where: str, name: str) -> list[Lobe]:
        """Read one side of a BSDF of this name: the lobes of a BSDF node and of all that it holds."""
        side = _Side(f"BSDF {label(self.state.nodes[bsdf], bsdf)} of {where}", shape)
        if name in self.overrides:
            self._becomes(bsdf, self.outside(name), side)
        else:
            self._walk(bsdf, side)
        lobes = [spectral.lobe(channel) for channel, spectral in sorted(side.taken.items())]
        if side.straight:
            lobes.append(self._white.lobe(STRAIGHT))
        return lobes

    def _walk(self, index: int, side: _Side) -> None:
        node = self.state.nodes[index]
        if (name := node.props.id()) in self.overrides:
            self._becomes(index, self.outside(name), side)
            return
        plugin = node.props.plugin_name()
        read = _PLUGINS.get(plugin)
        if read is None:
            raise SceneError(
                message(
                    f"BSDF '{plugin}' is not supported",
                    where=side.where,
                    expected=f"one of {', '.join(sorted(_PLUGINS))}",
                    fix="replace it, or render it diffuse, of its average reflectance, with --matte (matte=True)",
                )
            )
        read(self, index, side)

    def _becomes(self, index: int, spectral: _Spectral, side: _Side) -> None:
        """Make a node a diffuse surface of a spectrum."""
        self.edit(index, {}, plugin="diffuse")
        self.give(index, "reflectance", spectral, side)

    def nested(self, index: int, side: _Side) -> None:
        """Read the BSDFs inside a node."""
        for _, child in children(self.state, index):
            if kind(self.state.nodes[child]) == "BSDF":
                self._walk(child, side)

    def give(self, index: int, name: str, spectral: _Spectral, side: _Side) -> None:
        """Make a property of a node the probe of a spectrum."""
        channel = side.channel(spectral, self._channel.get((index, name)))
        self._channel[index, name] = channel
        colour = [0.0] * CHANNELS
        colour[channel] = spectral.mean
        self.edit(index, {name: (colour[0], colour[1], colour[2])})

    def edit(self, index: int, values: dict[str, Value], plugin: str | None = None) -> None:
        """Note what a node has to become."""
        before, known = self._edits.get(index, (None, {}))
        self._edits[index] = plugin or before, {**known, **values}

    def spectral(self, index: int, name: str, default: float, where: str) -> _Spectral:
        """Read a spectrum-valued property of a node, textures too."""
        if (index, name) not in self._spectral:
            self._spectral[index, name] = self._read(index, name, default, where)
        return self._spectral[index, name]

    def _read(self, index: int, name: str, default: float, where: str) -> _Spectral:
        import mitsuba as mi

        props = self.state.nodes[index].props
        if name not in props and default == 1.0:
            return self._white
        if name in props and props.type(name) == mi.Properties.Type.ResolvedReference:
            child = props[name].index()
            plugin = self.state.nodes[child].props.plugin_name()
            if plugin == "bitmap":
                return self._bitmap(child, where)
            if plugin == "checkerboard":
                return self._checkerboard(child, where)
        spectrum = plugin_spectrum(self.state, index, name, default=default, label=where)
        return self.of_material(Material(props.id() or where, spectrum))

    def of_material(self, material: Material) -> _Spectral:
        """A new row for a material."""
        self.materials.append(material)
        self.rows.append(material)
        mean = max(_DARKEST, float(np.mean([material.reflectance.at(w) for w in _VISIBLE])))
        return _Spectral(len(self.rows) - 1, False, mean, mean)

    def _bitmap(self, index: int, where: str) -> _Spectral:
        texels = bitmap_colours(self.state, index, where)
        height, width, _ = texels.shape
        self.textures.append(placement(self.state, index, height, width))
        row = sum(map(len, self.colours))
        flat = texels.reshape(-1, 3)
        self.colours.append(np.concatenate([flat, np.zeros((len(flat), 1), np.float32)], axis=1))
        mean = max(_DARKEST, float(np.mean(sigmoid(flat[:: max(1, len(flat) // 4096)], _VISIBLE))))
        texture = len(self.textures) - 1
        self._in_colours.add((texture, row))
        return _Spectral(row, True, mean, mean, texture)

    def _checkerboard(self, index: int, where: str) -> _Spectral:
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
        self.textures.append(replace(placement(self.state, index, 2, 2), bilinear=False))
        mean = (colours[0].mean + colours[1].mean) / 2
        return _Spectral(row, False, mean, mean, len(self.textures) - 1)

    def operated(self, spectral: _Spectral, operation: float, mean: float, unit: float) -> _Spectral:
        """What a lobe makes of a spectrum, see `operate`; with another probe."""
        count = 1
        if spectral.texture >= 0:
            count = self.textures[spectral.texture].width * self.textures[spectral.texture].height
        if spectral.in_colours:
            row = sum(map(len, self.colours))
            flat = np.concatenate(self.colours)[spectral.row : spectral.row + count].copy()
            flat[:, 3] = operation
            self.colours.append(flat)
            self.textures.append(self.textures[spectral.texture])
            self._in_colours.add((len(self.textures) - 1, row))
            return _Spectral(row, True, mean, unit, len(self.textures) - 1)
        row = len(self.rows)
        for below in self.rows[spectral.row : spectral.row + count]:
            assert isinstance(below, Material)
            self.rows.append(Operated(below, operation))
        return _Spectral(row, False, mean, unit, spectral.texture)


def _joined(colours: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    return np.concatenate(colours) if colours else np.zeros((0, 4), dtype=np.float32)


def _diffuse(reader: LobeReader, index: int, side: _Side) -> None:
    spectral = reader.spectral(index, "reflectance", 0.5, side.where)
    reader.give(index, "reflectance", spectral, side)


def _fluorescent(reader: LobeReader, index: int, side: _Side) -> None:
    import mitsuba as mi

    props = reader.state.nodes[index].props
    coat = {name: props[name] for name in COAT if name in props}
    maps = [
        name
        for name in ("reflectance", "concentration")
        if name in props
        and props.type(name) == mi.Properties.Type.ResolvedReference
        and _is_bitmap(reader.state, props[name])
    ]
    if maps and coat:
        raise SceneError(
            message(
                "a coated fluorescent surface with a texture is not supported",
                where=side.where,
                got=f"{', '.join(coat)} and a texture as {', '.join(maps)}",
                expected="a coat, or a texture",
            )
        )
    key = index, "material"
    if key not in reader._spectral:
        state = copy_nodes(reader.state)
        for name in (*maps, *coat):
            del state.nodes[index].props[name]
        if "reflectance" in maps:
            state.nodes[index].props["reflectance"] = 0.0
        reader._spectral[key] = reader.of_material(reader.read_material(state, index, side.shape))
    whole = reader._spectral[key]
    if coat:
        _coated(reader, index, side, whole, coat)
    elif maps:
        _dyed(reader, index, side, whole, maps)
    else:
        reader._becomes(index, whole, side)


def _is_bitmap(state: Any, reference: Any) -> bool:
    return state.nodes[reference.index()].props.plugin_name() == "bitmap"


def _coated(reader: LobeReader, index: int, side: _Side, whole: _Spectral, coat: dict[str, Any]) -> None:
    """A fluorescent base under the coat of a plastic, smooth or rough."""
    key = index, "coated"
    plugin = "roughplastic" if "alpha" in coat or "distribution" in coat else "plastic"
    reader.edit(index, dict(coat), plugin=plugin)
    if key not in reader._spectral:
        r = _internal_reflectance({"type": plugin, **coat})
        base = reader.rows[whole.row]
        assert isinstance(base, Material)
        reader.rows.append(Coated(base, r))
        # The probe is a linear plastic, whose base answers with 1 / (1 - r) to 1.
        reader._spectral[key] = _Spectral(len(reader.rows) - 1, False, whole.mean, whole.mean / (1 - r))
    reader.give(index, "diffuse_reflectance", reader._spectral[key], side)
    reader.give(index, "specular_reflectance", reader._white, side)


def _dyed(reader: LobeReader, index: int, side: _Side, whole: _Spectral, maps: list[str]) -> None:
    """A fluorescent surface whose reflectance, or the concentration of whose dye, is a picture."""
    key = index, "reflected"
    if key not in reader._spectral:
        base = reader.rows[whole.row]
        assert isinstance(base, Material)
        reader.rows += [Luminescence(base), Reflection(base)]
        reader._spectral[index, "dye"] = _Spectral(len(reader.rows) - 2, False, 1.0, 1.0)
        reader._spectral[key] = (
            reader._bitmap(
                reader.state.nodes[index].props["reflectance"].index(), f"reflectance of {side.where}"
            )
            if "reflectance" in maps
            else replace(whole, row=len(reader.rows) - 1)
        )
    reflected, dye = reader._spectral[key], reader._spectral[index, "dye"]
    first = side.channel(reflected, reader._channel.get(key))
    second = side.channel(dye, reader._channel.get((index, "dye")))
    reader._channel[key], reader._channel[index, "dye"] = first, second
    colour = [0.0] * CHANNELS
    colour[first], colour[second] = reflected.mean, 1.0
    reader.edit(index, {"reflectance": (colour[0], colour[1], colour[2])}, plugin="diffuse")
    if "concentration" in maps:
        child = reader.state.nodes[index].props["concentration"].index()
        reader.maps[index] = DyeMap(child, second, first, reflected.mean)


def _plastic(reader: LobeReader, index: int, side: _Side) -> None:
    key = index, "diffuse_reflectance"
    spectral = reader.spectral(*key, 0.5, f"diffuse_reflectance of {side.where}")
    if reader.state.nodes[index].props.get("nonlinear", False):
        nonlinear = index, "diffuse_reflectance, nonlinear"
        if nonlinear not in reader._spectral:
            r, m = _internal_reflectance_of(reader.state, index), spectral.mean
            reader._spectral[nonlinear] = reader.operated(spectral, r, m, m * (1 - r) / (1 - r * m))
        spectral = reader._spectral[nonlinear]
    reader.give(*key, spectral, side)
    _specular(reader, index, side, "specular_reflectance")


def _internal_reflectance_of(state: Any, index: int) -> float:
    """The r of a plastic of the scene."""
    props = state.nodes[index].props
    coat = {name: props[name] for name in COAT if name in props}
    return _internal_reflectance({"type": props.plugin_name(), **coat})


def _internal_reflectance(plastic: dict[str, Any]) -> float:
    """The r of a plastic, from its value with two colours: S / (1 - r S) for S = 1/2 and 1, without highlight."""
    import mitsuba as mi

    values = []
    for S in (0.5, 1.0):
        bsdf = mi.load_dict(
            {**plastic, "diffuse_reflectance": S, "specular_reflectance": 0.0, "nonlinear": True}
        )
        si = mi.SurfaceInteraction3f()
        si.wi = [0.0, 0.0, 1.0]
        si.wavelengths = [550.0] * 4
        values.append(float(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0.6, 0.0, 0.8))[0]))
    ratio = values[0] / values[1]
    return (1 - 2 * ratio) / (1 - ratio)


def _dielectric(reader: LobeReader, index: int, side: _Side) -> None:
    _specular(reader, index, side, "specular_reflectance")
    _specular(reader, index, side, "specular_transmittance")


def _specular(reader: LobeReader, index: int, side: _Side, name: str) -> None:
    reader.give(index, name, reader.spectral(index, name, 1.0, f"{name} of {side.where}"), side)


def _conductor(reader: LobeReader, index: int, side: _Side) -> None:
    name = "specular_reflectance"
    if (index, name) not in reader._spectral:
        reader._spectral[index, name] = _metal(reader, index, side.where)
    reader.edit(index, {"material": "none", "eta": None, "k": None})
    reader.give(index, name, reader._spectral[index, name], side)


def _metal(reader: LobeReader, index: int, where: str) -> _Spectral:
    """Rows for all angles of a conductor."""
    import mitsuba as mi

    name = "specular_reflectance"
    specular = reader.spectral(index, name, 1.0, f"{name} of {where}")
    if specular.texture >= 0:
        raise SceneError(
            message(
                "a conductor with a texture as specular reflectance is not supported",
                where=where,
                expected="one spectrum",
            )
        )
    props = reader.state.nodes[index].props
    eta, k = (
        (_index(reader.state, index, part, where) for part in ("eta", "k"))
        if "eta" in props or "k" in props
        else _preset(mi.traverse(build(reader.state, index)), props)
    )
    factor = reader.rows[specular.row]
    assert isinstance(factor, Material)
    row = len(reader.rows)
    cosines = np.linspace(0, 1, ANGLES) ** 2
    metals = [Metal(eta, k, factor.reflectance, float(cosine)) for cosine in cosines]
    reader.rows += metals
    return _Spectral(row, False, 1.0, 1.0, angles=ANGLES)


def _preset(values: Any, props: Any) -> tuple[Spectrum, Spectrum]:
    """Index and extinction of a material that Mitsuba knows by name."""
    if "eta.wavelengths" not in values:  # "none": a perfect mirror
        return Spectrum.constant(0.0, "eta"), Spectrum.constant(1.0, "k")
    eta, k = (
        Spectrum(
            np.array(values[f"{part}.wavelengths"]),
            np.array(values[f"{part}.values"]),
            f"{part} of {props.get('material', 'Cu')}",
        )
        for part in ("eta", "k")
    )
    return eta, k


def _index(state: Any, index: int, name: str, where: str) -> Spectrum:
    """An index of refraction of a scene, numbers for red, green and blue included."""
    import mitsuba as mi

    props = state.nodes[index].props
    if name in props and props.type(name) == mi.Properties.Type.Color:
        r, g, b = (float(c) for c in props[name])
        warnings.warn(
            f"{name} of {where} is given as rgb: taken at 610, 545 and 450 nm, linear in between",
            ApproximationWarning,
            stacklevel=2,
        )
        return Spectrum(_PRIMARIES, np.array([b, b, g, r, r]), f"{name} of {where}")
    return plugin_spectrum(state, index, name, default=0.0, label=f"{name} of {where}")


def _inner(reader: LobeReader, index: int, side: _Side) -> None:
    reader.nested(index, side)


def _mask(reader: LobeReader, index: int, side: _Side) -> None:
    reader.nested(index, side)
    side.straight = True


def _principled(reader: LobeReader, index: int, side: _Side) -> None:
    props = reader.state.nodes[index].props
    for tint, strength in (("spec_tint", 1.0), ("sheen_tint", props.get("sheen", 0.0))):
        if strength != 0.0 and props.get(tint, 0.0) != 0.0:
            raise SceneError(
                message(
                    f"'{tint}' is not supported",
                    where=side.where,
                    got=props[tint],
                    expected="0: its colour is one of red, green and blue, and not of wavelengths",
                )
            )
    spectral = reader.spectral(index, "base_color", 0.5, f"base_color of {side.where}")
    # The value is a polynomial of the second degree in the root of the base colour, so three of them tell it.
    nodes = ((FULL, 1.0), (DARK, 0.0), (HALF, 0.25))
    for channel, (operation, base) in enumerate(nodes):
        key = index, f"base_color, {operation}"
        if key not in reader._spectral:
            reader._spectral[key] = reader.operated(spectral, operation, base, 1.0)
        side.channel(reader._spectral[key], channel)
    reader.edit(index, {"base_color": (1.0, 0.0, 0.25)})


_PLUGINS: dict[str, Callable[[LobeReader, int, _Side], None]] = {
    "diffuse": _diffuse,
    FLUORESCENT: _fluorescent,
    "plastic": _plastic,
    "roughplastic": _plastic,
    "dielectric": _dielectric,
    "thindielectric": _dielectric,
    "roughdielectric": _dielectric,
    "conductor": _conductor,
    "roughconductor": _conductor,
    "blendbsdf": _inner,
    "bumpmap": _inner,
    "normalmap": _inner,
    "principled": _principled,
    "principledthin": _principled,
    "mask": _mask,
    "null": _mask,
    "twosided": _inner,
}


def needs_lobes(state: Any, overrides: Mapping[str, Material]) -> bool:
    """Whether a scene has a surface that is not matte, or not of one spectrum."""

    def below(index: int) -> Iterator[int]:
        for _, child in children(state, index):
            yield child
            yield from below(child)

    for index, node in enumerate(state.nodes):
        if kind(node) == "Emitter" and _varies(state, index):
            return True
        if kind(node) != "Shape" or node.props.id() in overrides:
            continue
        for _, bsdf in children(state, index):
            if kind(state.nodes[bsdf]) != "BSDF":
                continue
            plugins = [state.nodes[part].props.plugin_name() for part in (bsdf, *below(bsdf))]
            names = {name for part in (bsdf, *below(bsdf)) for name in state.nodes[part].props.keys()}  # noqa: SIM118
            coated = FLUORESCENT in plugins and names & set(COAT)
            if coated or set(plugins) & (_GENERAL | {"bitmap", "checkerboard"}):
                return True
    return False


def _varies(state: Any, index: int) -> bool:
    """Whether a light is one that `LobeReader.light` reads."""
    plugins = [state.nodes[child].props.plugin_name() for _, child in children(state, index)]
    plugin = state.nodes[index].props.plugin_name()
    return plugin == "envmap" or (plugin == "area" and "bitmap" in plugins)


_GENERAL = set(_PLUGINS) - {"diffuse", FLUORESCENT, "twosided"}
