"""Mitsuba as a renderer of three bands: its rgb variants and its stock `path` integrator, as they are."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, RendererError, SceneNotice, message
from fluorspar.scene.extent import warn_of_extent
from fluorspar.scene.lights import spectrum_property
from fluorspar.scene.nodes import build, resolving
from fluorspar.scene.scene import Scene
from fluorspar.scene.sensor import sampler_node
from fluorspar.scene.surfaces import ABSORBS
from fluorspar.scene.variants import usable_cores, use_variant
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.emitters.patches import EmitterArray
from fluorspar.staged.renderers.looking_around import directions
from fluorspar.staged.renderers.mitsuba.mesh import surface_mesh
from fluorspar.staged.renderers.mitsuba.scene_nodes import (
    bsdf,
    name_lights,
    one_sample_camera,
    remove_lights,
    remove_shape,
    with_materials,
)

__all__ = ["VARIANTS", "MitsubaRenderer"]

VARIANTS = {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb"}
_PROBES = 1 << 20  # light paths at a time

Array = NDArray[np.float64]


class MitsubaRenderer:
    """Three linear bands at a time, with `path` and an `independent` sampler.

    Parameters
    ----------
    backend : str
        `"llvm"` or `"cuda"`.

    Examples
    --------
    >>> MitsubaRenderer().max_bands
    3
    """

    max_bands = 3

    def __init__(self, backend: str = "llvm") -> None:
        if backend not in VARIANTS:
            raise OptionError(
                message(
                    "there is no such variant", got=repr(backend), expected=f"one of {', '.join(VARIANTS)}"
                )
            )
        self.variant = VARIANTS[backend]

    @contextmanager
    def session(self, threads: int | None = None) -> Iterator[None]:
        """Set the variant and the number of threads for a while."""
        import drjit as dr

        with use_variant(self.variant):
            before = dr.thread_count()
            cores = usable_cores()
            dr.set_thread_count(threads or cores)
            try:
                yield
            finally:
                dr.set_thread_count(before)

    def load(
        self, scene: Scene, array: EmitterArray | None = None, *, keep_object: bool = True
    ) -> _LoadedScene:
        """Load the scene, see `fluorspar.staged.renderers.protocol.Renderer`.

        Warns
        -----
        SceneNotice
            If another sampler than `independent` is replaced; once, not for each array.
        """
        sampler = sampler_node(scene.nodes)
        if array is None and sampler is not None:
            plugin = scene.nodes.nodes[sampler].props.plugin_name()
            if plugin != "independent":
                text = f"the sampler '{plugin}' is replaced by 'independent' for the staged method"
                warnings.warn(text, SceneNotice, stacklevel=2)
        return _LoadedScene(scene, array, keep_object)

    def mesh(self, scene: Scene, surface: int) -> TriangleMesh:
        """Triangles of a surface in world coordinates.

        Shapes that are not meshes are tessellated, flat ones without loss.

        Raises
        ------
        SceneError
            If the surface cannot be cut into patches.
        """
        return surface_mesh(scene, surface)


class _LoadedScene:
    """A Mitsuba scene whose spectra are three-band parameters."""

    def __init__(self, scene: Scene, array: EmitterArray | None, keep_object: bool) -> None:
        import mitsuba as mi

        self.scene = scene
        self.rr_depth = scene.settings.rr_depth
        state, self.materials = with_materials(scene)
        self.lights: list[Any] = []
        # emitters that are not the surface itself, or stand for one that is left out, reflect nothing
        self.black = array is not None and (array.copy is not None or not keep_object)
        if array is None:
            name_lights(state, scene)
        else:
            remove_lights(state, scene)
            if array.copy is None or not keep_object:
                remove_shape(state, scene.surfaces[array.surface].node)
            self._add_patches(state, array)
        one_sample_camera(state, scene)
        with resolving(*scene.folders):
            self.mitsuba_scene = build(state)
        if array is None:
            warn_of_extent(self.mitsuba_scene)
            by_id = {emitter.id(): emitter for emitter in self.mitsuba_scene.emitters()}
            self.lights = [by_id[f"light-{light.node}"] for light in scene.lights]
            self.light_keys = [f"{spectrum_property(light)}.value" for light in scene.lights]
        else:
            self.light_keys = ["radiance.value"] * len(self.lights)
        self.parameters = [mi.traverse(light) for light in self.lights]
        # the last row is for side -1, which is not a surface
        self.row_of_side = np.array([row for s in scene.surfaces for row in (s.front, s.back)] + [ABSORBS])
        sides = _sides_by_pointer(self.mitsuba_scene, scene, None if self.black else array)
        self.known = np.array(sorted(sides))
        self.sides = np.full((self.known[-1] + 1, 2), -1, dtype=np.int64)
        self.sides[list(sides)] = list(sides.values())
        self.film_size = np.array(self.mitsuba_scene.sensors()[0].film().size())

    def _add_patches(self, state: Any, array: EmitterArray) -> None:
        import mitsuba as mi

        prefix = "patch-"
        while any(key.startswith(prefix) for key in state.nodes[0].props.keys()):  # noqa: SIM118 (not a dict)
            prefix = f"emitter-{prefix}"  # the user's shapes have their names from the scene file

        surface = self.scene.surfaces[array.surface]
        sides = (surface.back, surface.front) if array.back else (surface.front, surface.back)
        painted = bsdf((ABSORBS, ABSORBS) if self.black else sides, self.materials)
        for number, piece in enumerate(array.emitters()):
            light = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": 1.0}})
            props = mi.Properties()
            props["bsdf"], props["emitter"] = painted, light
            smooth = piece.normals is not None
            mesh = mi.Mesh(
                f"{prefix}{number}",
                len(piece.vertices),
                len(piece.faces),
                has_vertex_normals=smooth,
                props=props,
            )
            parameters = mi.traverse(mesh)
            parameters["vertex_positions"] = piece.vertices.ravel().astype(np.float32)
            parameters["faces"] = piece.faces.ravel().astype(np.uint32)
            if piece.normals is not None:
                parameters["vertex_normals"] = piece.normals.ravel().astype(np.float32)
            parameters.update()
            mesh.set_id(f"{prefix}{number}")
            state.nodes[0].props[f"{prefix}{number}"] = mesh
            self.lights.append(light)

    def _set(self, albedo: Array, emission: Array) -> None:
        import drjit as dr
        import mitsuba as mi

        for material, values in zip(self.materials, albedo, strict=True):
            parameters = mi.traverse(material)
            colour = mi.Color3f(*_three(values))
            dr.make_opaque(colour)
            parameters["reflectance.value"] = colour
            parameters.update()
        for parameters, key, values in zip(self.parameters, self.light_keys, emission, strict=True):
            colour = mi.Color3f(*_three(values))
            dr.make_opaque(colour)
            parameters[key] = colour
            parameters.update()

    def _integrator(self, max_depth: int) -> Any:
        import mitsuba as mi

        return mi.load_dict({"type": "path", "max_depth": max_depth, "rr_depth": self.rr_depth})

    def _scaled_film(self, scale: int) -> None:
        import mitsuba as mi

        sensor = self.mitsuba_scene.sensors()[0]
        settings = self.scene.settings
        parameters = mi.traverse(sensor)
        size = self.film_size * scale
        if np.any(np.array(parameters["film.size"]) != size):
            crop = np.array([settings.width, settings.height]) * scale
            old = np.array(parameters["film.size"])
            offset = np.array(parameters["film.crop_offset"]) * size // old
            parameters["film.size"] = mi.ScalarVector2u(*map(int, size))
            parameters["film.crop_size"] = mi.ScalarVector2u(*map(int, crop))
            parameters["film.crop_offset"] = mi.ScalarPoint2u(*map(int, offset))
            parameters.update()

    def render(
        self, albedo: Array, emission: Array, *, max_depth: int, seed: int, scale: int
    ) -> NDArray[np.float32]:
        """See `fluorspar.staged.renderers.protocol.LoadedScene`."""
        import mitsuba as mi

        self._set(albedo, emission)
        self._scaled_film(scale)
        image = mi.render(self.mitsuba_scene, spp=1, seed=seed, integrator=self._integrator(max_depth))
        return np.array(image)[..., : albedo.shape[1]]

    def rows_seen(self, *, seed: int, scale: int) -> NDArray[np.int64]:
        """See `fluorspar.staged.renderers.protocol.LoadedScene`."""
        import mitsuba as mi

        self._scaled_film(scale)
        finder = mi.load_dict({"type": "aov", "aovs": "shape:shape_index,normal:geo_normal,place:position"})
        channels = np.array(mi.render(self.mitsuba_scene, spp=1, seed=seed, integrator=finder))
        shape, normal, place = np.split(channels[..., -7:], [1, 4], axis=-1)
        world = np.array(self.mitsuba_scene.sensors()[0].world_transform().matrix, dtype=np.float64).reshape(
            4, 4
        )
        orthographic = "orthographic" in type(self.mitsuba_scene.sensors()[0]).__name__.lower()
        view = world[:3, 2] if orthographic else place - world[:3, 3]
        back = (normal * view).sum(axis=-1) > 0
        pointer = np.rint(shape[..., 0]).astype(np.int64)
        if np.any(pointer != shape[..., 0]) or not np.isin(pointer, self.known).all():
            raise RendererError(
                message(
                    "Mitsuba does not tell which surface each sample shows",
                    where="its integrator 'aov', shape_index",
                    got="numbers that are the index of no shape",
                    expected="the index of one shape of the scene per sample",
                )
            )
        return np.asarray(self.row_of_side[self.sides[pointer, back.astype(np.int64)]])

    def probe(
        self,
        points: Array,
        normals: Array,
        albedo: Array,
        emission: Array,
        *,
        surface: int,
        back: bool,
        offset: float,
        max_depth: int,
        seed: int,
    ) -> NDArray[np.float32]:
        """See `fluorspar.staged.renderers.protocol.LoadedScene`."""
        import mitsuba as mi

        self._set(albedo, emission)
        integrator = self._integrator(max_depth)
        parts = []
        for first in range(0, len(points), _PROBES):
            here, up = points[first : first + _PROBES], normals[first : first + _PROBES]
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(seed + first // _PROBES, len(here))
            above, down = ((here + offset * up).astype(np.float32), (-up).astype(np.float32))
            ray = mi.RayDifferential3f(o=mi.Point3f(above.T), d=mi.Vector3f(down.T))
            shape, behind = self._met(ray)
            value, _, _ = integrator.sample(self.mitsuba_scene, sampler, ray)
            seen = np.array(value).T
            hidden = self.sides[shape, behind.astype(np.int64)] != 2 * surface + back
            seen[hidden | self._enclosed(above, up)] = np.nan
            parts.append(seen)
        return np.concatenate(parts)[:, : albedo.shape[1]]

    def _enclosed(self, places: NDArray[np.float32], up: Array) -> NDArray[np.bool_]:
        """Whether from places above a surface nothing is seen but black backs that the camera does not see."""
        import mitsuba as mi

        hiding, left = self._hiding, np.arange(len(places))
        for across, aside, along in directions():
            z = mi.Vector3f(up[left].astype(np.float32).T)
            x, y = mi.coordinate_system(z)
            ray = mi.Ray3f(mi.Point3f(places[left].T), across * x + aside * y + along * z)
            shape, behind = self._met(ray)
            left = left[behind & hiding[shape]]
            if not len(left):
                break
        enclosed = np.zeros(len(places), dtype=bool)
        enclosed[left] = True
        return enclosed

    @cached_property
    def _hiding(self) -> NDArray[np.bool_]:
        """By the number of a shape: whether its back is black, and not seen by the camera, as that of a room is."""
        import mitsuba as mi

        hiding = self.row_of_side[self.sides[:, 1]] == ABSORBS
        hiding[0] = False  # nothing is met
        matrix = np.array(self.mitsuba_scene.sensors()[0].world_transform().matrix, np.float32).reshape(4, 4)
        around = np.concatenate([directions(), -directions()]).astype(np.float32)
        origin = np.repeat(matrix[:3, 3:], len(around), axis=1)
        shape, behind = self._met(mi.Ray3f(mi.Point3f(origin), mi.Vector3f(around.T)))
        hiding[shape[behind]] = False
        return np.asarray(hiding)

    def _met(self, ray: Any) -> tuple[NDArray[np.uint32], NDArray[np.bool_]]:
        """The number of the shape that each ray meets first, and whether from behind."""
        import drjit as dr
        import mitsuba as mi

        hit = self.mitsuba_scene.ray_intersect(ray)
        return np.array(dr.reinterpret_array(mi.UInt32, hit.shape)), np.array(dr.dot(hit.n, ray.d) > 0)


def _three(values: Array) -> list[float]:
    """Fill up to three bands."""
    return [float(v) for v in values] + [0.0] * (3 - len(values))


def _sides_by_pointer(built: Any, scene: Scene, array: EmitterArray | None) -> dict[int, tuple[int, int]]:
    """What the front and the back of each shape are, by the number Dr.Jit gives the shape, 0 for none.

    A side is twice the number of its surface, plus 1 for the back of it; -1 is not a surface of the scene.
    """
    import drjit as dr
    import mitsuba as mi

    sides = {f"surface-{s.node}": (2 * k, 2 * k + 1) for k, s in enumerate(scene.surfaces)}
    other = (-1, -1)
    if array is not None:  # its patches are the surface, and face as it emits
        other = (2 * array.surface + array.back, 2 * array.surface + (not array.back))
    found = {0: (-1, -1)}
    for shape in built.shapes():
        pointer = int(np.array(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))).item())
        found[pointer] = sides.get(shape.id(), other)
    return found
