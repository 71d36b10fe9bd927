"""The scene that light paths are traced in: the user's geometry, lights of unit spectrum, no materials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.log import END
from fluorspar.paths.tracing.merging import join_meshes, joinable
from fluorspar.scene.extent import warn_of_extent
from fluorspar.scene.lights import give_spectrum
from fluorspar.scene.nodes import build, children, copy_nodes, kind, resolving
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import set_camera
from fluorspar.scene.surfaces import ABSORBS, Surface

__all__ = ["TraceScene", "build_trace_scene", "lights_of_emitters", "pointer_of"]

_FEW = 64  # nodes of a scene that are built one by one


@dataclass(frozen=True)
class TraceScene:
    """A built Mitsuba scene, and what its pointers mean.

    Attributes
    ----------
    mitsuba_scene, sensor : object
        Objects of the variant that was set.
    first_row_of_shape : ndarray of shape (P,), uint32
        where the rows of the shape whose Dr.Jit pointer is p begin in `rows`.
    rows_per_primitive : ndarray of shape (P,), uint32
        2 if each triangle of the shape has rows of its own, 0 if all share them.
    rows : ndarray of uint32
        Material rows of front and back in turn; `END` where a side absorbs everything. The row of a hit is
        `rows[first_row_of_shape[p] + rows_per_primitive[p] * primitive + side]`.
    light_of_emitter : ndarray of shape (P,), uint32
        light row of the emitter whose Dr.Jit pointer is p.
    """

    mitsuba_scene: Any
    sensor: Any
    first_row_of_shape: NDArray[np.uint32]
    rows_per_primitive: NDArray[np.uint32]
    rows: NDArray[np.uint32]
    light_of_emitter: NDArray[np.uint32]


def build_trace_scene(scene: Scene) -> TraceScene:
    """Build the scene in the variant that is set, at the size and samples of `scene.settings`.

    Raises
    ------
    OptionError
        If the size is changed although the film has a crop window.
    """
    import mitsuba as mi

    state = copy_nodes(scene.nodes)
    nodes = state.nodes
    for light in scene.lights:
        props = nodes[light.node].props
        give_spectrum(props, light, 1.0)
        props.set_id(f"light-{light.node}")
    for surface in scene.surfaces:
        props = nodes[surface.node].props
        for key, child in list(children(state, surface.node)):
            if kind(nodes[child]) != "Emitter":
                del props[key]
        props.set_id(f"surface-{surface.node}")
    for key, child in list(children(state, 0)):
        if kind(nodes[child]) in ("Integrator", "BSDF", "Texture"):
            del nodes[0].props[key]
    set_camera(state, scene.settings)

    with resolving(*scene.folders):
        parts = _parts(state)
    surface_of_id = {f"surface-{surface.node}": surface for surface in scene.surfaces}
    shapes = [part for part in parts if isinstance(part, mi.Shape)]
    joined = _join([_Rows(shape, [surface_of_id[shape.id()]]) for shape in shapes])
    others = [part for part in parts if not isinstance(part, mi.Shape)]
    # A key becomes the id of what it holds, and ids say which light is which.
    named = {part.id(): part for part in (*others, *(part.shape for part in joined))}
    built = mi.load_dict({"type": "scene", **named}, optimize=False)
    warn_of_extent(built)
    sensor = built.sensors()[0]

    pointers = [pointer_of(mi.ShapePtr(part.shape)) for part in joined]
    first_row = np.zeros(max(pointers, default=0) + 1, dtype=np.uint32)
    per_primitive = np.zeros_like(first_row)
    rows = [
        np.full(2, END, dtype=np.uint32)
    ]  # a placeholder that no shape has, so that the table is never empty
    for pointer, part in zip(pointers, joined, strict=True):
        first_row[pointer] = sum(map(len, rows))
        per_primitive[pointer] = 2 if len(part.surfaces) > 1 else 0
        rows.append(part.rows())
    return TraceScene(
        built,
        sensor,
        first_row,
        per_primitive,
        np.concatenate(rows),
        lights_of_emitters(built, scene),
    )


def lights_of_emitters(built: Any, scene: Scene) -> NDArray[np.uint32]:
    """The light row of each emitter of a built scene, by Dr.Jit pointer; their ids are `light-` and the node."""
    import mitsuba as mi

    row_of_id = {f"light-{light.node}": row for row, light in enumerate(scene.lights)}
    rows = {pointer_of(mi.EmitterPtr(emitter)): row_of_id[emitter.id()] for emitter in built.emitters()}
    table = np.zeros(max(rows) + 1, dtype=np.uint32)
    table[list(rows)] = list(rows.values())
    return table


def _parts(state: Any) -> list[Any]:
    """Build the sensor, the lights that are no surfaces, and the shapes.

    One by one, because a scene around them would build a tree of all triangles that is not used; at once where there
    are many, because each by itself costs a copy of the nodes.
    """
    found = [child for _, child in children(state, 0)]
    if len(found) <= _FEW:
        return [build(state, child) for child in found]
    built = build(state)
    shapes = built.shapes()
    of_shapes = {shape.emitter().id() for shape in shapes if shape.is_emitter()}
    lights = [emitter for emitter in built.emitters() if emitter.id() not in of_shapes]
    return [built.sensors()[0], *lights, *shapes]


@dataclass(frozen=True)
class _Rows:
    """A built shape and the surfaces it stands for; several if it was joined of them."""

    shape: Any
    surfaces: list[Surface]
    triangles: tuple[int, ...] = (1,)

    def rows(self) -> NDArray[np.uint32]:
        """Rows of front and back, for each triangle if there are several surfaces."""
        sides = [(surface.front, surface.back) for surface in self.surfaces]
        table = np.array(sides, dtype=np.int64).repeat(self.triangles, axis=0)
        return np.where(table == ABSORBS, END, table).astype(np.uint32).ravel()


def _join(shapes: list[_Rows]) -> list[_Rows]:
    """Join plain meshes, those with and those without vertex normals apart."""
    kept = [part for part in shapes if not joinable(part.shape)]
    for smooth in (False, True):
        group = [
            part for part in shapes if joinable(part.shape) and part.shape.has_vertex_normals() == smooth
        ]
        if len(group) > 1:
            mesh = join_meshes([part.shape for part in group], f"joined-{'smooth' if smooth else 'flat'}")
            group = [
                _Rows(
                    mesh,
                    [part.surfaces[0] for part in group],
                    tuple(part.shape.face_count() for part in group),
                )
            ]
        kept += group
    return kept


def pointer_of(pointer: Any) -> int:
    """The number under which Dr.Jit knows an object inside vectorised code."""
    import drjit as dr
    import mitsuba as mi

    return int(dr.reinterpret_array(mi.UInt32, pointer)[0])
