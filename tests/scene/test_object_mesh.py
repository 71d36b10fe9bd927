"""The object of `cornell-mesh`: made, read, fitted into the box."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fluorspar.errors import SceneError, SceneNotice
from fluorspar.scene.object_mesh import object_file, procedural_mesh, read_mesh
from fluorspar.scene.scene import load_scene


def test_the_procedural_object_is_closed_and_smooth():
    """Expected: watertight, faces outwards, and neighbouring faces at less than 10 degrees."""
    mesh = procedural_mesh()
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert np.degrees(mesh.face_adjacency_angles.max()) < 10


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb"])
def test_a_mesh_is_centred_scaled_and_set_on_the_floor(tmp_path: Path, suffix: str):
    """Expected: over (278, 279.6), 330 mm large, lowest point on the floor; the same from every format."""
    trimesh.creation.capsule(height=3.0, radius=0.5).export(tmp_path / f"pill{suffix}")
    mesh = trimesh.load(object_file(tmp_path / f"pill{suffix}"), force="mesh")
    low, high = mesh.bounds
    assert (low + high)[[0, 2]] / 2 == pytest.approx([278, 279.6], abs=0.01)
    assert low[1] == pytest.approx(0, abs=1e-3)
    assert (high - low).max() == pytest.approx(330, rel=1e-5)
    assert mesh.volume > 0


def test_stray_components_are_dropped_with_a_notice(tmp_path: Path):
    body, crumb = trimesh.creation.icosphere(3), trimesh.creation.box((0.05, 0.05, 0.05))
    crumb.apply_translation([3, 0, 0])
    trimesh.util.concatenate([body, crumb]).export(tmp_path / "body.ply")
    with pytest.warns(SceneNotice, match="1 stray components with 12 of 1292 triangles"):
        mesh = read_mesh(tmp_path / "body.ply")
    assert len(mesh.faces) == 1280


def test_a_mesh_with_a_hole_is_taken_with_a_warning(tmp_path: Path):
    ball = trimesh.creation.icosphere(2)
    trimesh.Trimesh(ball.vertices, ball.faces[10:]).export(tmp_path / "holed.ply")
    with pytest.warns(SceneNotice, match="not watertight: light gets in"):
        read_mesh(tmp_path / "holed.ply")


def test_a_mesh_inside_out_is_turned(tmp_path: Path):
    ball = trimesh.creation.icosphere(2)
    trimesh.Trimesh(ball.vertices, ball.faces[:, ::-1], process=False).export(tmp_path / "inverted.ply")
    assert read_mesh(tmp_path / "inverted.ply").volume > 0


@pytest.mark.parametrize(
    ("name", "text", "match"),
    [
        ("gone.ply", None, "does not exist"),
        ("scan.xyz", "0 0 0", "kind of mesh file"),
        ("broken.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "mesh"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "mesh"),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no faces with an area"),
    ],
)
def test_files_that_are_no_meshes_are_refused(tmp_path: Path, name: str, text: str | None, match: str):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(SceneError, match=match) as caught:
        load_scene("cornell-mesh", parameters={"mesh": tmp_path / name})
    assert name in str(caught.value)


def test_the_built_in_scene_needs_no_file_and_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = load_scene("cornell-mesh")
        object_row = next(surface.front for surface in scene.surfaces if surface.name == "object")
        from fluorspar.spectral.wavelengths import Wavelengths

        matrix = scene.materials[object_row].on(Wavelengths(300, 780, 5))
    assert matrix.photon_yield().max() < 1
    assert matrix.is_fluorescent
