"""Cutting surfaces into emitters."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.errors import OptionError, SceneError
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged import emission
from fluorspar.staged.emission import refine
from fluorspar.staged.emitters.mesh import TriangleMesh
from fluorspar.staged.emitters.patches import (
    EmitterArray,
    decimated_patches,
    mesh_patches,
    planar_patches,
    split_patches,
)
from fluorspar.staged.options import StagedOptions


def of(mesh, normals=False):
    return TriangleMesh(
        np.array(mesh.vertices), np.array(mesh.faces), np.array(mesh.vertex_normals) if normals else None
    )


BALL = of(trimesh.creation.icosphere(subdivisions=3, radius=2.0), normals=True)
# a skew wall of the Cornell box, and an L-shaped one
WALL = TriangleMesh(
    np.array([[552.8, 0, 0], [549.6, 0, 559.2], [556, 548.8, 559.2], [556, 548.8, 0]]),
    np.array([[0, 1, 2], [0, 2, 3]]),
)
L_SHAPE = TriangleMesh(
    np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0.0]]),
    np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]),
)


@pytest.mark.parametrize("mesh", [WALL, L_SHAPE], ids=["wall", "L"])
@pytest.mark.parametrize("count", [1, 2, 5, 16])
def test_a_grid_of_emitters_has_the_power_of_the_wall(mesh, count):
    """Expected: area for area, whatever N; emitters face as the wall does."""
    array = planar_patches(mesh, count)
    assert array.areas.sum() == pytest.approx(mesh.areas.sum(), rel=1e-6)
    assert (array.gain == 1).all()
    assert len(array) == len(array.emitters())
    assert sum(piece.areas.sum() for piece in array.emitters()) == pytest.approx(mesh.areas.sum(), rel=1e-6)
    assert (array.mesh.face_normals @ mesh.face_normals[0]).min() > 0.99


def test_a_grid_on_a_rectangle_has_equal_cells():
    array = planar_patches(
        TriangleMesh(
            np.array([[0, 0, 0], [3, 4, 0], [-1, 7, 0], [-4, 3, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
        ),
        4,
    )
    assert len(array) == 16
    assert array.areas == pytest.approx(array.areas.mean())


def test_cells_outside_a_surface_are_left_out():
    """The L covers three of the four quarters of its bounding square."""
    array = planar_patches(L_SHAPE, 2)
    assert len(array) == 3
    assert array.areas == pytest.approx(1.0)


@pytest.mark.parametrize("count", [1, 7, 100])
def test_mesh_patches_have_the_power_of_the_mesh(count):
    """Expected: exactly K patches; together the surface itself, with the normals it had."""
    array = mesh_patches(BALL, count)
    assert len(array) == count
    assert array.areas.sum() == pytest.approx(BALL.areas.sum(), rel=1e-6)
    assert array.areas.max() < 2.5 * array.areas.min()
    assert all(piece.normals is not None for piece in array.emitters())


def test_more_patches_than_faces_cut_the_faces():
    array = mesh_patches(of(trimesh.creation.box()), 100)
    assert len(array) == 100
    assert array.areas.sum() == pytest.approx(6.0)


@pytest.mark.parametrize("count", [5, 100])
def test_one_large_face_among_small_ones_is_cut(count):
    """Rationale: a box with a finely meshed knob has faces enough, but not where the area is. Expected: as
    many patches as asked for, of about the same area."""
    knob = trimesh.creation.icosphere(subdivisions=4, radius=0.1)
    array = mesh_patches(of(trimesh.util.concatenate([trimesh.creation.box(), knob])), count)
    assert len(array) == count
    assert array.areas.sum() == pytest.approx(6.0 + knob.area)
    assert array.areas.max() < 3 * array.areas.min()


def test_halving_cuts_no_other_faces():
    """Rationale: a patch of two faces is cut into more before it is halved; the rest of a large mesh must not
    be. Expected: four halvings of one of 64 cells leave the other 63 as they are."""
    array = planar_patches(WALL, 8)
    faces = np.bincount(array.patch)
    for _ in range(4):
        array, _ = split_patches(array, np.arange(len(array)) == 0)
    assert (np.bincount(array.patch)[5:] == faces[1:]).all()
    assert array.areas.sum() == pytest.approx(WALL.areas.sum())


def test_a_grid_needs_no_first_triangle():
    """A first triangle without area, as exporters write them, has no direction to start from."""
    points = np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    array = planar_patches(TriangleMesh(points, np.array([[0, 1, 1], [0, 2, 3], [0, 3, 4]])), 4)
    assert array.areas == pytest.approx(np.full(16, 1 / 16))


@pytest.mark.parametrize("count", [40, 300])
def test_decimated_emitters_conserve_power(count):
    """A decimated ball is smaller than the ball: the radiance of its faces makes up for it."""
    array = decimated_patches(BALL, count)
    power = (array.gain * array.copy.areas).sum()
    assert power == pytest.approx(BALL.areas.sum(), rel=1e-6)
    assert array.gain.mean() > 1
    assert len(array) <= count


def test_halving_chosen_patches_keeps_the_rest():
    array = mesh_patches(BALL, 5)
    chosen = np.array([True, False, False, True, False])
    halved, parent = split_patches(array, chosen)
    assert parent.tolist() == [0, 0, 1, 2, 3, 3, 4]
    assert np.bincount(parent, halved.areas) == pytest.approx(array.areas)
    assert halved.areas[0] == pytest.approx(array.areas[0] / 2, rel=0.1)


def test_points_are_spread_evenly():
    """Expected: n points on each patch; their mean is the centre of area (within 4 standard errors)."""
    array = planar_patches(WALL, 3)
    points, normals, patch = array.sample(400, seed=1)
    assert (np.bincount(patch) == 400).all()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    for number, piece in enumerate(array.emitters()):
        centre = np.average(piece.centroids, axis=0, weights=piece.areas)
        assert np.abs(points[patch == number].mean(0) - centre).max() < 4 * 183 / np.sqrt(12 * 400)


def test_bad_numbers_are_refused():
    with pytest.raises(OptionError, match="emitters"):
        StagedOptions(emitters=0)
    with pytest.raises(OptionError, match="patches"):
        StagedOptions(patches=0)
    with pytest.raises(OptionError, match="'true' or 'decimated'"):
        StagedOptions(mode="coarse")
    with pytest.raises(OptionError, match="tolerance"):
        StagedOptions(tolerance=0.0)
    with pytest.raises(OptionError, match="at least one emitter"):
        planar_patches(WALL, 0)


def test_options_must_be_numbers_of_the_right_kind():
    """Expected: the message names the option, and whose it is."""
    assert StagedOptions(patches=np.int64(4), repeats=2.0).repeats == 2
    for name, value in (("emitters", 2.5), ("patch_samples", float("nan")), ("bounces", "2")):
        with pytest.raises(
            OptionError, match=f"{name}, an option of the staged method, is not a whole number"
        ):
            StagedOptions(**{name: value})
    with pytest.raises(OptionError, match="tolerance"):
        StagedOptions(tolerance="a")
    with pytest.raises(OptionError, match="exclude_emitter_geometry with bounces=2"):
        StagedOptions(exclude_emitter_geometry=True, bounces=2)


def test_more_decimated_faces_than_there_are_is_refused():
    with pytest.raises(OptionError, match="1281 emitters, 1280 faces"):
        decimated_patches(BALL, 1281)


def test_decimating_to_nothing_is_refused():
    with pytest.raises(OptionError, match="no face of the decimated mesh has an area"):
        decimated_patches(BALL, 1)


def test_a_mesh_without_area_is_refused():
    with pytest.raises(SceneError, match="no triangle with an area"):
        TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    with pytest.raises(SceneError, match="no triangle with an area"):
        TriangleMesh(np.eye(3), np.zeros((0, 3), dtype=int))


@pytest.mark.parametrize("scale", [0.001, 1.0, 165.0, 1e6])
@pytest.mark.parametrize("count", [20, 100])
def test_decimation_does_not_depend_on_the_unit_of_length(count: int, scale: float) -> None:
    ball = trimesh.creation.icosphere(4)
    array = decimated_patches(TriangleMesh(scale * np.asarray(ball.vertices), np.asarray(ball.faces)), count)
    assert 0.9 * count <= len(array) <= count
    assert array.gain.max() < 3  # no slivers
    assert (array.gain * array.copy.areas).sum() == pytest.approx(array.mesh.areas.sum())


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"emitters": 65}, "emitters is out of range"),
        ({"patches": 5000}, "patches is out of range"),
        ({"mode": "decimated", "tolerance": 0.1}, "decimated copy are not subdivided"),
        ({"tolerance": True}, "tolerance is out of range"),
    ],
)
def test_options_that_cannot_work_are_refused(options: dict[str, object], fault: str) -> None:
    with pytest.raises(OptionError, match=fault):
        StagedOptions(**options)


def test_the_light_paths_of_one_look_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bright spot and noise beyond the tolerance: patches become more, each look costs no more than the limit."""
    monkeypatch.setattr(emission, "_MOST_PATHS", 1 << 15)
    monkeypatch.setattr(emission, "_MOST_PATCHES", 128)
    square = TriangleMesh(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    looks: list[int] = []
    rng = np.random.default_rng(1)

    def probe(array: EmitterArray, samples: int, stream: int) -> np.ndarray:
        looks.append(samples * len(array))
        middle = np.array([piece.centroids.mean(axis=0) for piece in array.emitters()])
        spot = 1 / (0.001 + ((middle[:, :2] - 0.3) ** 2).sum(axis=1))
        noise = 4 * rng.normal(0, 1, len(spot)) / np.sqrt(samples)
        return np.repeat((spot * (1 + noise))[:, None], 31, axis=1)

    w = Wavelengths(400, 700, 10)
    matrix = DonaldsonMatrix(w, np.full(31, 0.1), [np.full(31, 0.1)], [np.full(31, 1 / 300)])
    refine(planar_patches(square, 2), matrix, probe, tolerance=0.05, samples=64)
    assert max(looks) <= 1 << 15
