"""Renderers other than Mitsuba: what they have to bring, and what they may."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest

from floor_scene import DYE, GRID, QUICK, floor_under
from fluorspar.errors import OptionError
from fluorspar.rendering import render
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.renderers.mitsuba.renderer import MitsubaRenderer
from fluorspar.staged.renderers.protocol import EmitsPerFace, OffersIrradiance


class Flat:
    """A renderer in twenty lines: a closed cavity in which each pixel sees E = emission / (1 - albedo), by
    hand.

    It offers illumination without albedo, and shows what a renderer other than Mitsuba has to bring.
    """

    max_bands = 2

    def session(self, threads):
        return nullcontext()

    def mesh(self, scene, surface):
        return TriangleMesh(
            np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
        )

    def load(self, scene, array=None, *, keep_object=True):
        return FlatScene(scene)


class FlatByFace(Flat):
    """The same, with faces that emit differently; each emitter counts by its area."""

    def __init__(self):
        self.arrays = []

    def load_faces(self, scene, array, *, keep_object=True):
        self.arrays.append(array)
        return FlatScene(scene, array.emitting.areas)


class FlatScene:
    def __init__(self, scene, areas=None):
        self.size = (scene.settings.height, scene.settings.width)
        self.areas = areas

    def E(self, albedo, emission, max_depth):
        return np.average(emission, axis=0, weights=self.areas) * {1: 0, 2: 1}.get(
            max_depth, 1 / (1 - albedo[0])
        )

    def shown(self, albedo, emission, max_depth):
        """Radiance of the lamp and of what it lights."""
        lamp = np.average(emission, axis=0, weights=self.areas)
        return lamp + albedo[0] * self.E(albedo, emission, max_depth)

    def render(self, albedo, emission, *, max_depth, seed, scale):
        height, width = (side * scale for side in self.size)
        return np.tile(self.shown(albedo, emission, max_depth), (height, width, 1))

    def illumination(self, albedo, emission, *, max_depth, seed, scale):
        height, width = (side * scale for side in self.size)
        return np.tile(self.E(albedo, emission, max_depth), (height, width, 1))

    def rows_seen(self, *, seed, scale):
        return np.zeros([side * scale for side in self.size], dtype=np.int64)

    def probe(self, points, normals, albedo, emission, *, surface, back, offset, max_depth, seed):
        return np.tile(self.shown(albedo, emission, max_depth), (len(points), 1))


def test_any_renderer_will_do():
    """Rationale: the procedure must hold for a renderer that is nothing but the protocol. Expected: in a
    cavity of albedo S under light L, E_D = L and E_I = L / (1 - S) - L; the five components follow by hand.
    The probe of a patch sees the lamp itself, which is not subtracted from a surface that has no light: E of
    a patch is too large by L / S."""
    scene = floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 2.0}})
    image = render(scene, wavelengths=GRID, method="staged", staged=QUICK, renderer=Flat())
    D = DYE.on(GRID)
    L, S = 2.0 * np.ones(5), 0.5
    seen = {name: image.component(name).values[0, 0] for name in image.components}
    assert seen["source"] == pytest.approx(L)
    assert seen["direct_reflection"] == pytest.approx(S * L)
    assert seen["direct_luminescence"] == pytest.approx(D.apply_luminescent(L))
    assert seen["indirect_reflection"] == pytest.approx(S * L)
    assert seen["indirect_luminescence"] == pytest.approx(D.apply_luminescent(L))
    L_F = D.apply_luminescent(2 * L + L / S)
    assert seen["luminescent_reflection"] == pytest.approx(S * L_F / (1 - S))


def test_faces_that_emit_differently_stand_for_patches():
    """Rationale: a renderer with emission per face needs no mesh for each patch. Expected: one row of emission
    for each face, that of its patch, so that the image is that of K pieces."""
    scene = floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 2.0}})
    renderer = FlatByFace()
    assert isinstance(renderer, EmitsPerFace)
    assert not isinstance(Flat(), EmitsPerFace)
    assert not isinstance(MitsubaRenderer(), EmitsPerFace)
    images = [
        render(scene, wavelengths=GRID, method="staged", staged=QUICK, renderer=chosen)
        for chosen in (Flat(), renderer)
    ]
    (array,) = renderer.arrays
    assert len(array.emitting.faces) > len(array) == 4
    assert images[1].dataset.radiance.values == pytest.approx(images[0].dataset.radiance.values)


def test_render_takes_a_renderer():
    scene = floor_under({"type": "constant", "radiance": {"type": "spectrum", "value": 2.0}})
    image = render(scene, method="staged", wavelengths=GRID, staged=QUICK, renderer=Flat())
    expected = render(scene, wavelengths=GRID, method="staged", staged=QUICK, renderer=Flat())
    assert (image.dataset.radiance.values == expected.dataset.radiance.values).all()
    assert isinstance(FlatScene(scene), OffersIrradiance)
    with pytest.raises(OptionError, match="a renderer for the staged method is given"):
        render(scene, renderer=Flat())
