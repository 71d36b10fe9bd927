"""What the staged method asks of a renderer. A renderer is one file that provides `Renderer` and `LoadedScene`.

It reads from the `Scene`: `settings` (width, height, rr_depth; samples come as seeds and scale), `surfaces` (of each
shape the material rows of front and back, `ABSORBS` for a side that is black, and its row in the table of lights),
`lights` (kind, unit), and the geometry and the camera from `nodes`, Mitsuba's parsed scene, or from whatever form of
the same scene the renderer has its own: `surfaces` and `lights` are in the order of the scene file and bear its ids.
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fluorspar.scene.scene import Scene
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.emitters.patches import EmitterArray

__all__ = ["EmitsPerFace", "LoadedScene", "OffersIrradiance", "Renderer"]

Array = NDArray[np.float64]


class LoadedScene(Protocol):
    """A scene whose geometry is fixed and whose spectra are set anew for each render.

    Arrays: `albedo` (rows of the material table, B) and `emission` (emitters, B), with B at most
    `Renderer.max_bands`. The emitters are the scene's lights in their order, or the patches of an array.
    """

    def render(
        self, albedo: Array, emission: Array, *, max_depth: int, seed: int, scale: int
    ) -> NDArray[np.float32]:
        """Render one sample per pixel of an image `scale` times as wide and as high as the scene's.

        One sample per small pixel means that no small pixel shows two surfaces. Renders that differ only in
        `max_depth` follow each other, for a renderer that can answer them from one.

        Parameters
        ----------
        albedo : ndarray of shape (rows, B)
            Diffuse reflectance, 0 to 1.
        emission : ndarray of shape (emitters, B)
            Radiance, intensity or irradiance, as the light has it.
        max_depth : int
            1: emitters seen directly; 2: direct light too; -1: all bounces.
        seed : int
            The same seed gives the same light paths up to `max_depth`, whatever the spectra.
        scale : int
            Small pixels per pixel along each side.

        Returns
        -------
        ndarray of shape (scale Y, scale X, B)
            Linear radiance.
        """
        ...

    def rows_seen(self, *, seed: int, scale: int) -> NDArray[np.int64]:
        """Material row of what each small pixel shows with this seed, -1 for none; shape (scale Y, scale
        X)."""
        ...

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
        """Estimate, with one light path each, the radiance that leaves points of a surface along the normal.

        What the surface itself emits may be left out, at all depths alike.

        Parameters
        ----------
        points, normals : ndarray of shape (n, 3)
            Where; the normals point away from the side in question.
        surface, back : int, bool
            Number of the surface in `Scene.surfaces`, and whether its back is meant. In a scene loaded with
            an array, the patches of the array are the surface that they stand for, unless they are black.
        offset : float
            How far above the surface the probe looks from.

        Returns
        -------
        ndarray of shape (n, B)
            NaN for a point from above which that side of that surface is not the first thing seen: something
            lies on it there. So for one from which nothing but black backs is seen, in the directions of
            `looking_around`: it is inside a hollow object, and its light reaches nothing. Its patch is then judged by
            its other points.
        """
        ...


@runtime_checkable
class OffersIrradiance(Protocol):
    """What a loaded scene may offer beyond: illumination without albedo, so that images of E need no division.

    The light on emitters is taken from `LoadedScene.probe` all the same.
    """

    def illumination(
        self, albedo: Array, emission: Array, *, max_depth: int, seed: int, scale: int
    ) -> NDArray[np.float32]:
        """As `render`, but E of the surface seen instead of S E."""
        ...


class Renderer(Protocol):
    """A renderer of diffuse surfaces and lights in a few linear bands."""

    max_bands: int

    def load(
        self, scene: Scene, array: EmitterArray | None = None, *, keep_object: bool = True
    ) -> LoadedScene:
        """Load the scene with its lights; or, with `array`, without them and with an emitter array in their
        place.

        Parameters
        ----------
        scene : Scene
            Geometry, camera and size.
        array : EmitterArray, optional
            The pieces `array.emitters()` take the place of the surface they are made of, reflectance
            included. Where the array is a coarse copy (`array.copy`), black pieces are added to the scene
            instead.
        keep_object : bool
            False: the emitting object is left out, and its emitters are black.
        """
        ...

    def mesh(self, scene: Scene, surface: int) -> TriangleMesh:
        """Triangles of a surface of the scene in world coordinates."""
        ...

    def session(self, threads: int | None) -> Any:
        """Context manager inside which the other methods may be called."""
        ...


@runtime_checkable
class EmitsPerFace(Protocol):
    """What a renderer may offer beyond: faces of one mesh that emit differently, instead of K meshes."""

    def load_faces(self, scene: Scene, array: EmitterArray, *, keep_object: bool = True) -> LoadedScene:
        """As `Renderer.load` with an array, but each face of `array.emitting` is an emitter.

        The emission that the loaded scene gets has a row for each of these faces, in their order.
        """
        ...
