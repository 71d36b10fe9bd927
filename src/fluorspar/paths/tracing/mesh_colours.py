"""Which colour of a mesh a place on it has: that of its face, or of one of the three vertices at random."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fluorspar.paths.tracing.lobe_scene import LobeScene

__all__ = ["MeshColours"]


class MeshColours:
    """Faces and vertices of the meshes whose colours are rows; the variant of `scene` must be set."""

    def __init__(self, scene: LobeScene) -> None:
        built = {shape.id(): shape for shape in scene.mitsuba_scene.shapes()}
        first_face, first_vertex, faces, positions = (
            [],
            [],
            [np.zeros(0, np.uint32)],
            [np.zeros(0, np.float32)],
        )
        for texture in scene.lobes.textures:
            first_face.append(sum(map(len, faces)) // 3 if texture.mesh >= 0 else -1)
            first_vertex.append(sum(map(len, positions)) // 3)
            if texture.mesh >= 0:
                values = mi.traverse(built[f"surface-{texture.mesh}"])
                faces.append(np.array(values["faces"], dtype=np.uint32))
                positions.append(np.array(values["vertex_positions"], dtype=np.float32))
        self._first_face, self._first_vertex = mi.Int32(first_face), mi.UInt32(first_vertex)
        self._per_face = mi.Bool([texture.per_face for texture in scene.lobes.textures])
        self._faces, self._positions = mi.UInt32(np.concatenate(faces)), mi.Float(np.concatenate(positions))

    def texel(self, texture: Any, si: Any, pick: Any, active: Any) -> Any:
        """The number of the colour, 0 where the texture is no mesh's.

        Parameters
        ----------
        texture : Int32
            Number of the texture, -1: none.
        si : SurfaceInteraction3f
        pick : Float
            Random number.
        active : Bool
        """
        number = mi.UInt32(dr.maximum(texture, 0))
        first = dr.gather(mi.Int32, self._first_face, number, active)
        active &= (texture >= 0) & (first >= 0)
        face = dr.gather(mi.Point3u, self._faces, mi.UInt32(dr.maximum(first, 0)) + si.prim_index, active)
        vertex = face + dr.gather(mi.UInt32, self._first_vertex, number, active)
        a, b, c = (dr.gather(mi.Point3f, self._positions, vertex[corner], active) for corner in range(3))
        u, v, p = b - a, c - a, si.p - a
        normal = dr.cross(u, v)
        area = dr.rcp(dr.dot(normal, normal))
        of_b, of_c = dr.dot(dr.cross(p, v), normal) * area, dr.dot(dr.cross(u, p), normal) * area
        corner = dr.select(pick < of_b, face.y, dr.select(pick < of_b + of_c, face.z, face.x))
        per_face = dr.gather(mi.Bool, self._per_face, number, active)
        return dr.select(active, dr.select(per_face, si.prim_index, corner), 0)
