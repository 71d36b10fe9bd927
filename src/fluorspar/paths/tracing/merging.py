"""Join the meshes of a built scene into one.

Vectorised code calls each shape that a packet of rays has hit in turn, so many small meshes are slow: the
Cornell box traces a tenth faster as one mesh than as seven. Materials do not stand in the way here, because
a traced vertex refers to a row of the material table and that may as well hang on a triangle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

__all__ = ["join_meshes", "joinable"]


def joinable(shape: Any) -> bool:
    """Whether a built shape is a mesh that can become part of another: no light, normals as its triangles have them."""
    import mitsuba as mi

    if not shape.is_mesh() or shape.is_emitter() or shape.has_flipped_normals():
        return False
    return "faces" in mi.traverse(shape)  # a `rectangle` says that it is a mesh, and has no triangles


def join_meshes(meshes: Sequence[Any], name: str) -> Any:
    """Make one mesh of several that either all have vertex normals or all have none.

    Parameters
    ----------
    meshes : sequence of mitsuba.Mesh
        Built `mitsuba.Mesh` objects; their triangles keep their order.
    name : str
        Id of the new mesh.

    Returns
    -------
    mitsuba.Mesh
    """
    import mitsuba as mi

    parts = [mi.traverse(mesh) for mesh in meshes]
    smooth = bool(meshes[0].has_vertex_normals())
    first = np.cumsum([0] + [mesh.vertex_count() for mesh in meshes])
    joined = mi.Mesh(
        name, int(first[-1]), sum(mesh.face_count() for mesh in meshes), has_vertex_normals=smooth
    )
    joined.set_id(name)
    values = mi.traverse(joined)
    values["faces"] = mi.UInt32(
        np.concatenate(
            [np.array(part["faces"]) + start for part, start in zip(parts, first, strict=False)]
        ).astype(np.uint32)
    )
    for key in ("vertex_positions", "vertex_normals") if smooth else ("vertex_positions",):
        values[key] = mi.Float(np.concatenate([np.array(part[key]) for part in parts]))
    values.update()
    return joined
