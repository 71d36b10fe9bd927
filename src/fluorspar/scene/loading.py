"""Load a scene: from a file, by the name of a built-in one, or from a dict."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.errors import SceneError, SceneNotice, message
from fluorspar.scene.kept_nodes import KeptNodes
from fluorspar.scene.nodes import children, kind, label, resolving
from fluorspar.scene.recipe import recipe_of
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import film_node, sensor_node
from fluorspar.scene.settings import UNLIMITED, Settings
from fluorspar.scene.surfaces import read_surfaces
from fluorspar.scene.variants import SPECTRUM_VARIANT, use_variant

__all__ = ["load_scene"]

_FILM_PROPERTIES = (
    *("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y", "sample_border"),
    *("file_format", "pixel_format", "component_format", "compensate"),
)


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
    source : str, Path or dict
        Path of an XML file, name of a built-in scene, or a scene dict as for `mitsuba.load_dict`
        (plain values and transforms; objects that are already built belong to another variant).
    materials : mapping of str to str, Path or Material
        Materials from outside, by shape or BSDF id: a `Material`, a name or mixture from the library, or a file.
    matte : bool
        Render textured, glossy and other surfaces as diffuse ones of their average reflectance, and
        environment maps as constant light, with a warning each.
    parameters : mapping of str to object
        Values for the `$key` substitutions of an XML file.
    library : sequence of str or Path
        Folders with materials of your own, looked into before those of the environment variable
        `FLUORSPAR_MATERIALS` and the shipped ones.

    Returns
    -------
    Scene
        It can be pickled; a process that unpickles it reads its files again, by absolute paths.

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
    with use_variant(SPECTRUM_VARIANT):
        recipe = recipe_of(source, materials=materials, matte=matte, parameters=parameters, library=library)
        with resolving(recipe.base):
            state = recipe.parse()
            settings = _settings(state)
            table = read_surfaces(state, recipe)
            nodes = KeptNodes(recipe, state)
    return Scene(
        tuple(table.materials),
        tuple(table.lights),
        tuple(table.surfaces),
        settings,
        recipe,
        nodes,
        table.lobes,
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
