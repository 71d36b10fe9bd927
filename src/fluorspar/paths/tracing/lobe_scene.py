"""The scene that light paths of general surfaces are traced in: the user's, with probes in place of its colours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.tracing.trace_scene import lights_of_emitters, pointer_of
from fluorspar.scene.extent import warn_of_extent
from fluorspar.scene.lights import give_spectrum
from fluorspar.scene.lobes.lobe import STRAIGHT, DyeMap, Lobe, Lobes
from fluorspar.scene.lobes.pictures import build_picture
from fluorspar.scene.lobes.probes import apply_edits
from fluorspar.scene.nodes import build, children, copy_nodes, grouped, kind, label, parser_config, resolving
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import set_camera

__all__ = ["LobeScene", "Slots", "build_lobe_scene"]

_ABSENT = STRAIGHT + 1  # channel of a slot that a surface does not need


@dataclass(frozen=True)
class Slots:
    """What the slots of a vertex hold, by `(first_of_shape[p] + side) x terms + slot`; see `Lobe`.

    Attributes
    ----------
    channel, row, angles : ndarray of uint32
    texture : ndarray of int32
        -1: none.
    scale : ndarray of float32
        1 / unit.
    found, sent : ndarray of bool
        Whether it is for the light found by next-event estimation, and for the path's continuation.
    """

    channel: NDArray[np.uint32]
    row: NDArray[np.uint32]
    angles: NDArray[np.uint32]
    texture: NDArray[np.int32]
    scale: NDArray[np.float32]
    found: NDArray[np.bool_]
    sent: NDArray[np.bool_]


@dataclass(frozen=True)
class LobeScene:
    """A built Mitsuba scene of probes, and what its pointers mean.

    Attributes
    ----------
    mitsuba_scene, sensor : object
        Objects of the variant that was set, one with colours.
    first_of_shape : ndarray of shape (P,), uint32
        Front side of the shape whose Dr.Jit pointer is p, among all sides.
    slots : Slots
        Of all sides; side 0 is a placeholder that no shape has.
    terms : int
        Slots of a vertex.
    light_of_emitter : ndarray of shape (P,), uint32
        Light row of the emitter whose Dr.Jit pointer is p.
    lobes : Lobes
    lights : int
        Rows of the light table; the texels of lights that vary follow.
    sky_row : int
        Light row of its environment map, -1 if it has none.
    to_sky : ndarray of shape (3, 3), optional
        Turns directions of the scene to those of its environment map.
    beams : mapping of int to ndarray of shape (3, 3)
        By light row of spots with a picture: turns directions towards them to (x, y, z), for which the place on the
        picture is (1 + x / z) / 2, (1 + y / z) / 2.
    """

    mitsuba_scene: Any
    sensor: Any
    first_of_shape: NDArray[np.uint32]
    slots: Slots
    terms: int
    light_of_emitter: NDArray[np.uint32]
    lobes: Lobes
    lights: int
    sky_row: int
    to_sky: NDArray[np.float64] | None
    beams: Mapping[int, NDArray[np.float64]]


def build_lobe_scene(scene: Scene) -> LobeScene:
    """Build the scene in the variant that is set, at the size and samples of `scene.settings`; the last is kept."""
    built: LobeScene = scene.made(_built)
    warn_of_extent(built.mitsuba_scene)
    assert scene.lobes is not None
    # Its rows are those of this scene: they may be numbered in another way.
    slots = _slots(scene, scene.lobes)
    return replace(built, slots=slots, lobes=scene.lobes)


def _built(scene: Scene) -> LobeScene:
    import mitsuba as mi

    lobes = scene.lobes
    assert lobes is not None
    state = copy_nodes(scene.nodes)
    nodes = state.nodes
    beams = {}
    for row, light in enumerate(scene.lights):
        props = nodes[light.node].props
        if light.node in lobes.skies:
            del props["filename"]
            props["bitmap"] = mi.Bitmap(np.repeat(lobes.skies[light.node][..., np.newaxis], 3, axis=2))
        elif light.plugin == "projector":
            texture = lobes.textures[lobes.light_textures[row][0]]
            for name in {"irradiance", "scale"} & set(props.keys()):
                del props[name]
            white = mi.Bitmap(np.ones((texture.height, texture.width, 3), np.float32))
            props["irradiance"] = mi.load_dict({"type": "bitmap", "bitmap": white, "raw": True})
        else:
            give_spectrum(props, light, 1.0)
            if light.plugin == "spot" and "texture" in props:
                beams[row] = _to_picture(props)
                del props["texture"]
        props.set_id(f"light-{light.node}")
    apply_edits(state, lobes.edits)
    with resolving(*scene.folders):
        for node, dye in lobes.maps.items():
            del nodes[node].props["reflectance"]
            nodes[node].props["reflectance"] = _dye_map(state, dye)
    for surface in scene.surfaces:
        props = nodes[surface.node].props
        props.set_id(f"surface-{surface.node}")
        if surface.node in lobes.replaced:
            for key, child in list(children(state, surface.node)):
                if kind(nodes[child]) == "BSDF":
                    del props[key]
            probe = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [1.0, 0.0, 0.0]}}
            props["bsdf"] = mi.load_dict(
                {"type": "twosided", "bsdf": probe} if lobes.replaced[surface.node] else probe
            )
    for key, child in list(children(state, 0)):
        if kind(nodes[child]) in ("Integrator", "BSDF", "Texture"):
            del nodes[0].props[key]
    set_camera(state, scene.settings)
    for node in nodes:
        if kind(node) in ("BSDF", "Texture"):
            node.props.set_id("")
    # A rough plastic takes 0.1 s to build, and each BSDF more makes all of them slower.
    mi.parser.transform_merge_equivalent(parser_config(mi.variant()), state)
    with resolving(*scene.folders):
        copied = _build_groups(state)
        built = build(state)

    sky = [emitter for emitter in built.emitters() if emitter.class_name() == "EnvironmentMapEmitter"]
    to_sky = None
    if sky:
        to_world = np.array(sky[0].world_transform().matrix, dtype=np.float64).reshape(4, 4)
        to_sky = np.linalg.inv(to_world)[:3, :3].astype(np.float64)
    pointers = {shape.id(): pointer_of(mi.ShapePtr(shape)) for shape in [*built.shapes(), *copied]}
    first_of_shape = np.zeros(max(pointers.values(), default=0) + 1, dtype=np.uint32)
    for number, surface in enumerate(scene.surfaces):
        first_of_shape[pointers[f"surface-{surface.node}"]] = 1 + 2 * number
    light_of_emitter = lights_of_emitters(built, scene)
    sensor = built.sensors()[0]
    return LobeScene(
        built,
        sensor,
        first_of_shape,
        _slots(scene, lobes),
        lobes.terms,
        light_of_emitter,
        lobes,
        len(scene.lights),
        int(light_of_emitter[pointer_of(mi.EmitterPtr(sky[0]))]) if sky else -1,
        to_sky,
        beams,
    )


def _build_groups(state: Any) -> list[Any]:
    """Build the shapes of all groups and put them into their nodes: a built group does not say what it holds."""
    nodes = state.nodes
    shapes: list[Any] = []
    bsdfs: dict[int, Any] = {}  # each once, with its pictures
    for shape, group in grouped(state).items():
        for key, child in list(children(state, shape)):
            if kind(nodes[child]) == "BSDF":
                bsdfs[child] = bsdfs.get(child) or build(state, child)
                _put(nodes[shape], key, bsdfs[child])
        shapes.append(build(state, shape))
        key = next(key for key, child in children(state, group) if child == shape)
        _put(nodes[group], key, shapes[-1])
    return shapes


def _put(node: Any, key: str, built: Any) -> None:
    del node.props[key]
    node.props[key] = built


def _to_picture(spot: Any) -> NDArray[np.float64]:
    """See `LobeScene.beams`."""
    edge = np.tan(np.radians(spot.get("cutoff_angle", 20.0)))
    to_world = np.array(spot["to_world"].matrix) if "to_world" in spot else np.eye(4)
    return np.asarray(-np.linalg.inv(to_world)[:3, :3] / [[edge], [edge], [1.0]])


def _dye_map(state: Any, dye: DyeMap) -> Any:
    """The texture that says the concentration of a dye in one channel, and in another what is reflected."""
    import mitsuba as mi

    props = state.nodes[dye.picture].props
    props["format"] = "variant"  # linear numbers; else 8 bits stay 8 bits, 0 to 255
    built = build_picture(state, dye.picture, f"concentration {label(state.nodes[dye.picture], dye.picture)}")
    concentration = np.array(mi.traverse(built)["data"])
    concentration = (
        concentration[..., :1]
        if concentration.shape[2] == 1
        else concentration[..., :3].mean(axis=2, keepdims=True)
    )
    texels = np.zeros((*concentration.shape[:2], 3), dtype=np.float32)
    texels[..., dye.channel], texels[..., dye.reflected] = concentration[..., 0], dye.mean
    kept = {name: props[name] for name in ("to_uv", "filter_type", "wrap_mode") if name in props}
    return mi.load_dict({"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True, **kept})


def _expanded(side: tuple[Lobe, ...]) -> list[tuple[Lobe, bool, bool]]:
    """The slots of one side: lobes, whether for light found, whether for light sent on."""
    slots = []
    for lobe in side:
        slots += [(lobe, True, False), (lobe, False, True)] if lobe.angles else [(lobe, True, True)]
    return slots


def _slots(scene: Scene, lobes: Lobes) -> Slots:
    sides: list[list[tuple[Lobe, bool, bool]]] = [[]]
    for surface in scene.surfaces:
        sides += [_expanded(side) for side in lobes.of_surface[surface.node]]
    terms = lobes.terms
    absent = Lobe(_ABSENT, 0, 1.0), False, False
    filled = [slot for side in sides for slot in (*side, *[absent] * (terms - len(side)))]
    return Slots(
        np.array([lobe.channel for lobe, _, _ in filled], dtype=np.uint32),
        np.array([lobe.row for lobe, _, _ in filled], dtype=np.uint32),
        np.array([lobe.angles for lobe, _, _ in filled], dtype=np.uint32),
        np.array([lobe.texture for lobe, _, _ in filled], dtype=np.int32),
        np.array([1 / lobe.unit for lobe, _, _ in filled], dtype=np.float32),
        np.array([found for _, found, _ in filled], dtype=np.bool_),
        np.array([sent for _, _, sent in filled], dtype=np.bool_),
    )
