"""`Scene`: a Mitsuba scene taken apart into geometry, materials and lights."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fluorspar.bispectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparError, OptionError, SceneError, SceneNotice, message
from fluorspar.scene.builtin import BUILTIN, builtin_parameters, builtin_path
from fluorspar.scene.nodes import build, children, kind, label, parse_scene, resolving
from fluorspar.scene.renderer import SPECTRUM_VARIANT, use_variant
from fluorspar.scene.surfaces import Light, Surface, read_surfaces
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["MOST_SAMPLES", "UNLIMITED", "Scene", "Settings", "load_scene", "whole"]

UNLIMITED = -1
MOST_SAMPLES = 2**16
"""Samples per pixel of one render; average renders of several seeds for more."""


def whole(name: str, value: object) -> int:
    """Return a whole number.

    Raises
    ------
    OptionError
        If it is none.

    Examples
    --------
    >>> whole("spp", 16.0)
    16
    """
    if isinstance(value, (int, np.integer)) or (isinstance(value, float) and value.is_integer()):
        return int(value)
    raise OptionError(message(f"{name} is not a whole number", got=repr(value), expected="a whole number"))


@dataclass(frozen=True)
class Settings:
    """How large and how well a scene is to be rendered, as its file says.

    Parameters
    ----------
    width, height
        Pixels of the image (of the crop window, where the film has one).
    spp
        Samples per pixel.
    max_depth
        As in Mitsuba: 1 is visible lights only, 2 adds direct light, -1 is unlimited.
    rr_depth
        Depth from which Russian roulette may end a path.
    """

    width: int
    height: int
    spp: int
    max_depth: int = UNLIMITED
    rr_depth: int = 5

    def __post_init__(self) -> None:
        for name, low, high in (
            ("width", 1, 65_536),
            ("height", 1, 65_536),
            ("spp", 1, MOST_SAMPLES),
            ("rr_depth", 1, 2**31 - 1),
        ):
            object.__setattr__(self, name, whole(name, getattr(self, name)))
            if not low <= getattr(self, name) <= high:
                raise OptionError(
                    message(f"{name} is out of range", got=getattr(self, name), expected=f"{low} to {high}")
                )
        if self.max_depth != UNLIMITED and self.max_depth < 1:
            raise OptionError(
                message(
                    "max_depth is out of range", got=self.max_depth, expected="1 or more, or -1 for unlimited"
                )
            )


@dataclass(frozen=True)
class Scene:
    """A scene ready to be rendered.

    Attributes
    ----------
    name
        File name or name of the built-in scene.
    materials
        The material table; `Surface.front` and `Surface.back` are rows of it.
    lights
        The light table.
    surfaces
        All shapes.
    settings
        Size, samples and depths from the scene file.
    nodes
        The scene as Mitsuba's parser sees it.
    base
        Folder against which its file names are resolved.
    parameters
        The values given for the `$key` substitutions of its file; that of a mesh as an absolute path.
    """

    name: str
    materials: tuple[Material, ...]
    lights: tuple[Light, ...]
    surfaces: tuple[Surface, ...]
    settings: Settings
    nodes: Any
    base: Path
    parameters: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        s = self.settings
        depths = f"max_depth {s.max_depth}, rr_depth {s.rr_depth}"
        lines = [f"<Scene '{self.name}': {s.width} x {s.height} pixels, {s.spp} samples, {depths}>"]
        lines += [f"  light    {light.name}: {light.plugin}, {light.unit}" for light in self.lights]
        for row, made in enumerate(self.materials):
            on = ", ".join(surface.name for surface in self.surfaces if row in (surface.front, surface.back))
            lines.append(f"  material {made.name}{' (fluorescent)' if made.fluorescent else ''}: on {on}")
        return "\n".join(lines)

    def matrices(self, grid: Wavelengths, stokes: Stokes = "half") -> list[DonaldsonMatrix]:
        """Return the Donaldson matrices of all materials on a grid, by row of the table.

        Parameters
        ----------
        grid
            N wavelengths.
        stokes
            See `DonaldsonMatrix`.

        Raises
        ------
        MaterialError, SpectrumError
            As `Material.on`; the message says on which surfaces the material is.
        """
        found = []
        for row, made in enumerate(self.materials):
            try:
                found.append(made.on(grid, stokes=stokes))
            except FluorsparError as err:
                on = ", ".join(s.name for s in self.surfaces if row in (s.front, s.back))
                raise type(err)(f"{err}\n  in:       material of {on}") from err
        return found

    def with_settings(self, **changes: int | None) -> Scene:
        """Copy the scene with some settings changed; None leaves a setting as it is."""
        return replace(
            self, settings=replace(self.settings, **{k: v for k, v in changes.items() if v is not None})
        )

    def with_whole_samples(self) -> Scene:
        """Copy the scene with as many samples as its sampler can do: some need a square or a power of two.

        Warns
        -----
        SceneNotice
            If that is another number.
        """
        index = sampler_node(self.nodes)
        if index is None or self.nodes.nodes[index].props.plugin_name() == "independent":
            return self
        with use_variant(SPECTRUM_VARIANT):
            sampler = build(self.nodes, index)
            sampler.set_sample_count(self.settings.spp)
            spp = int(sampler.sample_count())
        if spp != self.settings.spp:
            plugin = self.nodes.nodes[index].props.plugin_name()
            warnings.warn(
                f"the sampler '{plugin}' takes {spp} samples instead of {self.settings.spp}",
                SceneNotice,
                stacklevel=3,
            )
        return self.with_settings(spp=spp)


def load_scene(
    source: str | Path | dict[str, Any],
    *,
    materials: Mapping[str, str | Path | Material] | None = None,
    matte: bool = False,
    parameters: Mapping[str, object] | None = None,
    library: Sequence[str | Path] = (),
) -> Scene:
    """Load a Mitsuba 3 scene with fluorescent surfaces.

    Parameters
    ----------
    source
        Path of an XML file, name of a built-in scene, or a scene dict as for `mitsuba.load_dict`
        (plain values and transforms; objects that are already built belong to another variant).
    materials
        Materials from outside, by shape or BSDF id: a `Material`, a name or mixture from the library, or a file.
    matte
        Render textured, glossy and other surfaces as diffuse ones of their average reflectance, and
        environment maps as constant light, with a warning each.
    parameters
        Values for the `$key` substitutions of an XML file.
    library
        Folders with materials of your own, looked into before those of the environment variable
        `FLUORSPAR_MATERIALS` and the shipped ones.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        If the file is missing or malformed, holds a plugin the method cannot handle, or has no light or camera.
    MaterialError, SpectrumError
        If a material is unknown or impossible.

    Examples
    --------
    >>> scene = load_scene("cornell-box")
    >>> [m.name for m in scene.materials if m.fluorescent]
    ['poster-green', 'poster-red']
    """
    read: Path | dict[str, Any]
    if isinstance(source, dict):
        name, base, read = "dict", Path.cwd(), source
    else:
        name = str(source)
        read = builtin_path(name) if name in BUILTIN else Path(source)
        base = read.resolve().parent
    values = {key: str(value) for key, value in (parameters or {}).items()}
    given = dict(values)
    if name in BUILTIN:
        values = builtin_parameters(name, values)
        if "mesh" in given:
            given["mesh"] = str(Path(given["mesh"]).resolve())  # to be found from another folder too
    with use_variant(SPECTRUM_VARIANT), resolving(base):
        state = parse_scene(read, values)
        settings = _settings(state)
        table = read_surfaces(state, base=base, overrides=materials or {}, matte=matte, library=library)
    return Scene(
        name, tuple(table.materials), tuple(table.lights), tuple(table.surfaces), settings, state, base, given
    )


def sensor_node(state: Any) -> int:
    """Index of the first sensor of a parsed scene."""
    sensors = [index for _, index in children(state, 0) if kind(state.nodes[index]) == "Sensor"]
    supported = ("perspective", "thinlens", "orthographic")
    if not sensors:
        raise SceneError(
            message(
                "the scene has no camera",
                expected=f"a sensor, one of {', '.join(supported)}",
                fix="add a sensor to the scene",
            )
        )
    node = state.nodes[sensors[0]]
    if node.props.plugin_name() not in supported:
        raise SceneError(
            message(
                f"sensor '{node.props.plugin_name()}' is not supported",
                where=label(node, sensors[0]),
                expected=f"one of {', '.join(supported)}",
            )
        )
    return sensors[0]


def film_node(state: Any) -> int | None:
    """Index of the film of the first sensor, if the scene gives one."""
    return next((i for _, i in children(state, sensor_node(state)) if kind(state.nodes[i]) == "Film"), None)


def sampler_node(state: Any) -> int | None:
    """Index of the sampler of the first sensor, if the scene gives one."""
    return next(
        (i for _, i in children(state, sensor_node(state)) if kind(state.nodes[i]) == "Sampler"), None
    )


_FILM_PROPERTIES = (
    *("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y", "sample_border"),
    *("file_format", "pixel_format", "component_format", "compensate"),
)


def _check_names(props: Any, plugin: str, known: tuple[str, ...]) -> None:
    """Find misspelt properties of a plugin that is never built, so that Mitsuba does not see them."""
    import mitsuba as mi

    plain = (name for name in props.keys() if props.type(name) != mi.Properties.Type.ResolvedReference)  # noqa: SIM118
    if props.plugin_name() == plugin and (unknown := sorted(set(plain) - set(known))):
        raise SceneError(
            message(
                f"'{plugin}' has no property '{unknown[0]}'",
                where=props.id() or plugin,
                expected=", ".join(known),
            )
        )


def _integrators(state: Any, parent: int) -> Iterator[int]:
    """Go through the integrators below a node, those inside another (`aov`) too."""
    for _, index in children(state, parent):
        if kind(state.nodes[index]) == "Integrator":
            yield index
            yield from _integrators(state, index)


def _settings(state: Any) -> Settings:
    """Read size, samples and depths; what the scene leaves open is as in Mitsuba."""
    sensor = sensor_node(state)
    if (count := sum(kind(state.nodes[index]) == "Sensor" for _, index in children(state, 0))) > 1:
        text = f"the scene has {count} sensors; the first one, {label(state.nodes[sensor], sensor)}, is used"
        warnings.warn(text, SceneNotice, stacklevel=2)
    if film_node(state) is None:
        where = label(state.nodes[sensor], sensor)
        raise SceneError(
            message("the camera has no film", where=where, expected="a film with width and height")
        )
    width, height, spp = 768, 576, 4
    for _, index in children(state, sensor):
        props = state.nodes[index].props
        if kind(state.nodes[index]) == "Sampler":
            spp = int(props.get("sample_count", 4))
        elif kind(state.nodes[index]) == "Film":
            _check_names(props, "hdrfilm", _FILM_PROPERTIES)
            width = int(props.get("crop_width", props.get("width", 768)))
            height = int(props.get("crop_height", props.get("height", 576)))
            for _, child in children(state, index):
                if (
                    kind(state.nodes[child]) == "ReconstructionFilter"
                    and state.nodes[child].props.plugin_name() != "box"
                ):
                    warnings.warn(
                        f"the pixel filter '{state.nodes[child].props.plugin_name()}' is replaced by a box",
                        SceneNotice,
                        stacklevel=2,
                    )
    max_depth, rr_depth = UNLIMITED, 5
    for index in _integrators(state, 0):
        props = state.nodes[index].props
        _check_names(props, "path", ("max_depth", "rr_depth", "hide_emitters", "timeout"))
        max_depth = int(props.get("max_depth", max_depth))
        rr_depth = int(props.get("rr_depth", rr_depth))
        if props.plugin_name() == "direct":
            max_depth = 2
        elif props.plugin_name() != "path":
            warnings.warn(
                f"the integrator '{props.plugin_name()}' is replaced by Fluorspar's own",
                SceneNotice,
                stacklevel=2,
            )
        if props.get("hide_emitters", False):
            warnings.warn(
                "hide_emitters is ignored: lights seen directly are component 'source', which can be left out",
                SceneNotice,
                stacklevel=2,
            )
    return Settings(width, height, spp, max_depth, rr_depth)
