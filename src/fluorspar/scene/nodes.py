"""A scene as Mitsuba's parser sees it, before anything is built: reading and changing its nodes.

Mitsuba merges equal materials and meshes when it builds a scene. The parsed nodes are still what the
user wrote, so surfaces and lights are identified here.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fluorspar.errors import SceneError, message
from fluorspar.scene.builtin import BUILTIN
from fluorspar.scene.normals import settle_normals
from fluorspar.scene.spectrum_files import with_spectrum_files
from fluorspar.scene.suggestion import did_you_mean, plugin_names

__all__ = [
    "FLUORESCENT",
    "below",
    "build",
    "children",
    "copy_nodes",
    "grouped",
    "kind",
    "label",
    "parse_scene",
    "resolved",
    "resolving",
    "sides_of",
]

FLUORESCENT = "fluorescent"
"""Name of the BSDF plugin of fluorescent surfaces."""

_COMMON_PROPERTIES = (  # Mitsuba does not tell which ones a plugin has
    *("filename", "to_world", "center", "radius", "p0", "p1", "flip_normals", "face_normals"),
    *("radiance", "intensity", "irradiance", "position", "direction", "cutoff_angle", "beam_width", "scale"),
    *("fov", "fov_axis", "near_clip", "far_clip", "focus_distance", "aperture_radius", "shutter_open"),
    *("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y", "pixel_format"),
    *("component_format", "file_format", "sample_count", "seed", "max_depth", "rr_depth", "hide_emitters"),
    *(
        "reflectance",
        "diffuse_reflectance",
        "specular_reflectance",
        "int_ior",
        "ext_ior",
        "alpha",
        "material",
    ),
)


def parser_config(variant: str) -> Any:
    """Parser settings for `variant` that merge nothing and build in a fixed order."""
    import mitsuba as mi

    config = mi.parser.ParserConfig(variant)
    config.merge_equivalent = False
    config.merge_meshes = False
    return config


@contextmanager
def resolving(*folders: str | Path) -> Iterator[None]:
    """Let Mitsuba look for files in `folders` first, in the body of a `with` statement; then all is as before.

    A scene file that is parsed in it adds folders of its own (`<path>`).
    """
    import mitsuba as mi

    resolver = mi.file_resolver()
    before = list(resolver)
    for folder in reversed(folders):
        resolver.prepend(str(folder))
    try:
        yield
    finally:
        resolver.clear()
        for folder in before:
            resolver.append(folder)


def resolved(name: str) -> Path:
    """Find a file where Mitsuba looks for it; as it is, if it is nowhere."""
    import mitsuba as mi

    return Path(str(mi.file_resolver().resolve(name)))


def parse_scene(source: str | Path | dict[str, Any], parameters: dict[str, str], *, where: str) -> Any:
    """Parse a scene into a `mitsuba.parser.ParserState`; a variant must be set.

    Parameters
    ----------
    source : str, Path or dict
        Path of an XML file, or a Mitsuba scene dict.
    parameters : dict of str to str
        Values for the `$key` substitutions of an XML file.
    where : str
        How messages call the scene.

    Raises
    ------
    SceneError
        If the file is missing, malformed or refused by Mitsuba's parser.
    """
    import mitsuba as mi

    config = parser_config(mi.variant())
    if not isinstance(source, dict) and not os.path.isfile(source):
        raise SceneError(
            message(
                "the scene file does not exist",
                where=where,
                expected="a Mitsuba 3 XML file, or the name of a built-in scene",
                fix=did_you_mean(Path(where).name, BUILTIN)
                or "check the path; 'fluorspar scenes' lists the built-in scenes",
            )
        )
    try:
        if isinstance(source, dict):
            _refuse_none(source, where)
            state = mi.parser.parse_dict(config, source)
        else:
            state = with_spectrum_files(lambda: mi.parser.parse_file(config, str(source), **parameters))
        mi.parser.transform_all(config, state)
        for node in state.nodes:  # text that is no UTF-8 shows when it is read
            str(node.props)
    except SceneError:
        raise
    except Exception as err:  # the parser raises bare RuntimeError, TypeError and others
        raise SceneError(
            message("Mitsuba cannot read the scene", where=where, got=err, expected="a valid Mitsuba 3 scene")
        ) from err
    if len(state.nodes) == 0 or kind(state.nodes[0]) != "Scene":
        raise SceneError(
            message("this is not a scene", where=where, expected="a top-level element of type 'scene'")
        )
    _refuse_built_objects(state, where)
    if any(node.props.plugin_name() == "blendbsdf" for node in state.nodes):
        _unshare_parts(state)
    return state


def _unshare_parts(state: Any) -> None:
    """Give blends copies of BSDFs that others hold too: in each a part may need another channel of the probe."""
    import mitsuba as mi

    parts = [
        (index, key, child)
        for index in range(len(state.nodes))
        for key, child in children(state, index)
        if kind(state.nodes[child]) == "BSDF"
    ]
    holders = Counter(child for _, _, child in parts)
    for index, key, child in parts:
        if holders[child] > 1 and state.nodes[index].props.plugin_name() == "blendbsdf":
            state.nodes[index].props[key] = mi.Properties.ResolvedReference(_copied(state, child))


def _copied(state: Any, index: int) -> int:
    """The number of a copy of a BSDF node, with copies of the BSDFs that it holds."""
    import mitsuba as mi

    inner = {
        key: _copied(state, child)
        for key, child in children(state, index)
        if kind(state.nodes[child]) == "BSDF"
    }
    state.nodes.append(state.nodes[index])
    number = len(state.nodes) - 1
    for key, child in inner.items():
        state.nodes[number].props[key] = mi.Properties.ResolvedReference(child)
    return number


def _refuse_none(entries: dict[str, Any], where: str) -> None:
    """Find None in a scene dict, at which Mitsuba's parser ends the process."""
    for key, value in entries.items():
        if value is None:
            fault = "a value of the scene is None"
            raise SceneError(message(fault, where=f"{where}, '{key}'", expected="a value, or no such entry"))
        if isinstance(value, dict):
            _refuse_none(value, f"{where}, '{key}'")


def _refuse_built_objects(state: Any, where: str) -> None:
    """Find objects in a scene dict that are already built: they belong to one variant, and are not nodes."""
    import mitsuba as mi

    for index, node in enumerate(state.nodes):
        for key in node.props.keys():  # noqa: SIM118 (not a dict)
            if node.props.type(key) == mi.Properties.Type.Object:
                raise SceneError(
                    message(
                        "the scene holds an object that is already built",
                        where=f"{where}, '{key}' of {label(node, index)}",
                        expected="plain values, transforms and dicts",
                        fix="give the dict or file that it was built from",
                    )
                )


def copy_nodes(state: Any) -> Any:
    """Copy a parsed scene, so that its nodes can be changed."""
    import mitsuba as mi

    return mi.parser.ParserState(state)


def kind(node: Any) -> str:
    """The kind of a node: `"Shape"`, `"BSDF"`, `"Emitter"`, `"Sensor"`, `"Film"`, ..."""
    if node.props.plugin_name() == FLUORESCENT:
        return "BSDF"  # a scene dict names no kinds, and the plugin need not be registered
    return str(node.type).rpartition(".")[2]


def label(node: Any, index: int) -> str:
    """How messages name a node: its id if it has one, else its plugin and number."""
    name = node.props.id()
    return (
        f"'{name}' ({node.props.plugin_name()})"
        if name
        else f"{node.props.plugin_name()} (node {index}, without id)"
    )


def children(state: Any, index: int) -> Iterator[tuple[str, int]]:
    """Go through the child nodes of a node as (property name, index of the child)."""
    import mitsuba as mi

    props = state.nodes[index].props
    for key in props.keys():  # noqa: SIM118 (not a dict)
        if props.type(key) == mi.Properties.Type.ResolvedReference:
            yield key, props[key].index()


def below(state: Any, index: int) -> Iterator[int]:
    """Go through the nodes that a node holds, and those that they hold."""
    for _, child in children(state, index):
        yield child
        yield from below(state, child)


def grouped(state: Any) -> dict[int, int]:
    """The group of each shape that is in one, a `shapegroup`, of which `instance` makes copies."""
    groups = [i for i, node in enumerate(state.nodes) if node.props.plugin_name() == "shapegroup"]
    return {shape: group for group in groups for _, shape in children(state, group)}


def sides_of(state: Any, index: int, where: str) -> list[int]:
    """The one or two BSDFs that a `twosided` node holds.

    Raises
    ------
    SceneError
        If it holds another number of them, or anything else.
    """
    props = state.nodes[index].props
    nested = [child for _, child in children(state, index) if kind(state.nodes[child]) == "BSDF"]
    known = {key for key, child in children(state, index) if child in nested}
    unknown = sorted(set(props.keys()) - known)
    if unknown or len(nested) not in (1, 2):
        raise SceneError(
            message(
                f"there is no property '{unknown[0]}'" if unknown else "the number of BSDFs is wrong",
                where=f"BSDF {label(state.nodes[index], index)} of {where}",
                got=None if unknown else len(nested),
                expected="one BSDF for both sides, or two",
            )
        )
    return nested


def build(state: Any, index: int = 0) -> Any:
    """Build one node, with what hangs below it, as a Mitsuba object in the variant that is set.

    Raises
    ------
    SceneError
        With Mitsuba's reason, if it refuses.
    """
    import mitsuba as mi

    part = copy_nodes(state)
    if index:
        part.nodes[0] = part.nodes[index]
    try:
        built = mi.parser.instantiate(parser_config(mi.variant()), part)
    except Exception as err:  # a missing mesh, a value out of range, ...
        node = part.nodes[0]
        where = "the scene" if kind(node) == "Scene" else f"{kind(node).lower()} {label(node, index)}"
        raise SceneError(
            message(
                "Mitsuba cannot build this",
                where=where,
                got=err,
                expected="what Mitsuba's own renderers accept",
                fix=_suggestion(str(err)),
            )
        ) from err
    built = built[0] if isinstance(built, list) else built
    if not mi.variant().startswith("scalar"):
        shapes = (
            [built] if isinstance(built, mi.Shape) else built.shapes() if isinstance(built, mi.Scene) else []
        )
        for shape in shapes:
            settle_normals(shape)
    return built


def _suggestion(reason: str) -> str:
    """What Mitsuba calls unknown was probably meant to be another plugin or property."""
    if plugin := re.search(r'Plugin "(.*)" not found', reason):
        return did_you_mean(plugin[1], plugin_names())
    if "unreferenced propert" in reason and (name := re.search(r'- \w+ "(.*)":', reason)):
        return did_you_mean(name[1], _COMMON_PROPERTIES)
    return ""
