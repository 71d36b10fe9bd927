"""Load a scene: from a file, by the name of a built-in one, or from a dict."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.errors import SceneError, SceneNotice, message
from fluorspar.scene.kept_nodes import KeptNodes
from fluorspar.scene.node_checks import check_meshes, warn_of_rotations
from fluorspar.scene.nodes import build, children, kind, label, resolving
from fluorspar.scene.recipe import recipe_of
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import film_node, sampler_node, sensor_node
from fluorspar.scene.settings import UNLIMITED, Settings, whole
from fluorspar.scene.suggestion import did_you_mean, plugin_names
from fluorspar.scene.surfaces import read_surfaces
from fluorspar.scene.variants import SPECTRUM_VARIANT, use_variant

__all__ = ["load_scene"]

_FOLLOWED = ("path", "direct")  # integrators that are taken at their word; others are replaced with a notice


def load_scene(
    source: str | Path | dict[str, Any],
    *,
    materials: Mapping[str, str | Path | Material] | None = None,
    matte: bool = False,
    parameters: Mapping[str, object] | None = None,
    library: Sequence[str | Path] = (),
    sensor: int | str | None = None,
) -> Scene:
    """Load a Mitsuba 3 scene; it may have fluorescent surfaces.

    Parameters
    ----------
    source : str, Path or dict
        Path of an XML file, name of a built-in scene, or a scene dict as for `mitsuba.load_dict`
        (plain values and transforms; objects that are already built belong to another variant).
    materials : mapping of str to str, Path or Material
        Materials from outside, by shape or BSDF id: a `Material`, a name or mixture from the library, or a file.
    matte : bool
        Render textured, glossy and other surfaces, those that are supported too, as diffuse ones of their average
        reflectance, and environment maps as constant light, with a warning each.
    parameters : mapping of str to object
        Values for the `$key` substitutions of an XML file.
    library : sequence of str or Path
        Folders with materials of your own, looked into before those of the environment variable
        `FLUORSPAR_MATERIALS` and the shipped ones.
    sensor : int or str, optional
        Number, from 0, or id of the sensor, where a scene has several. Default: the first one, with a notice.

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
    OptionError
        If the scene has no such sensor.

    Examples
    --------
    >>> scene = load_scene("cornell-box")
    >>> [m.name for m in scene.materials if m.fluorescent]
    ['poster-green', 'poster-red']
    """
    with use_variant(SPECTRUM_VARIANT):
        recipe = recipe_of(
            source,
            materials=materials,
            matte=matte,
            parameters=parameters,
            library=library,
            sensor=sensor,
        )
        with resolving(recipe.base):
            state = recipe.parse()
            check_meshes(state)
            warn_of_rotations(state)
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
        _notice(
            f"the scene has {count} sensors; the first one, {label(state.nodes[sensor], sensor)}, is used; "
            "--sensor (sensor=...) takes another"
        )
    if "srf" in state.nodes[sensor].props:
        _notice(
            "the spectral response of the camera (srf) is ignored: an image holds the radiance of each wavelength"
        )
    film = film_node(state)
    if film is None:
        where = label(state.nodes[sensor], sensor)
        raise SceneError(
            message("the camera has no film", where=where, expected="a film with width and height")
        )
    width, height = _size(state, film)
    sampler = sampler_node(state)
    spp = 4 if sampler is None else whole("sample_count", state.nodes[sampler].props.get("sample_count", 4))
    max_depth, rr_depth = UNLIMITED, 5
    for index in _integrators(state, 0):
        props, plugin = state.nodes[index].props, state.nodes[index].props.plugin_name()
        if plugin in _FOLLOWED or (plugin not in plugin_names() and did_you_mean(plugin, plugin_names())):
            build(state, index)  # Mitsuba knows best which properties it has; Fluorspar never builds it
        max_depth = whole("max_depth", props.get("max_depth", max_depth))
        rr_depth = whole("rr_depth", props.get("rr_depth", rr_depth))
        if plugin == "direct":
            max_depth = 2
        elif plugin != "path":
            _notice(f"the integrator '{plugin}' is replaced by Fluorspar's own")
        if props.get("hide_emitters", False):
            _notice(
                "hide_emitters is ignored: lights seen directly are component 'source', which can be left out"
            )
    return Settings(width, height, spp, max_depth, rr_depth)


def _size(state: Any, film: int) -> tuple[int, int]:
    """Width and height of the image; what else a film says is checked by Mitsuba, and ignored."""
    build(state, film)
    props = state.nodes[film].props
    if props.plugin_name() == "specfilm":
        _notice(
            "the bands of the film 'specfilm' are ignored: an image holds the radiance of each wavelength of its grid "
            "(--wavelengths)"
        )
    for _, child in children(state, film):
        plugin = state.nodes[child].props.plugin_name()
        if kind(state.nodes[child]) == "ReconstructionFilter" and plugin != "box":
            _notice(f"the pixel filter '{plugin}' is replaced by a box")
    return (
        int(props.get("crop_width", props.get("width", 768))),
        int(props.get("crop_height", props.get("height", 576))),
    )


def _notice(text: str) -> None:
    warnings.warn(text, SceneNotice, stacklevel=4)
