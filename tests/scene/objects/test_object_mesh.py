"""The object of `cornell-mesh`: made, read, fitted into the box."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fluorspar.errors import SceneError, SceneNotice
from fluorspar.scene.loading import load_scene
from fluorspar.scene.objects.object_mesh import object_file, procedural_mesh, read_mesh


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
    with pytest.warns(SceneNotice, match=r"1 stray components with 12 of 1292 triangles and 0\.12 % of"):
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


def test_many_small_components_are_kept(tmp_path: Path):
    """Rationale: leaves of a tree are each far smaller than its trunk, and together no crumb."""
    trunk, leaf = trimesh.creation.icosphere(2), trimesh.creation.icosphere(0, radius=0.09)
    leaves = [leaf.copy().apply_translation([3 + 0.5 * k, 0, 0]) for k in range(10)]
    trimesh.util.concatenate([trunk, *leaves]).export(tmp_path / "tree.ply")
    with pytest.warns(
        SceneNotice, match=r"10 small separate components with 200 of 520 .* 5\.9 % .* are kept"
    ):
        mesh = read_mesh(tmp_path / "tree.ply")
    assert len(mesh.faces) == 520


def test_bodies_that_touch_have_no_holes(tmp_path: Path):
    """Expected: the notice names edges of more than two triangles, and no light gets in."""
    cube = trimesh.creation.box((1, 1, 1))
    pair = trimesh.util.concatenate([cube, cube.copy().apply_translation([1, 0, 0])])
    pair.merge_vertices()
    pair.export(tmp_path / "pair.ply")
    with pytest.warns(SceneNotice, match="edges are shared by more than two triangles") as caught:
        mesh = read_mesh(tmp_path / "pair.ply")
    assert len(caught) == 1
    assert (len(mesh.faces), mesh.volume) == (24, pytest.approx(2))


def corner_normals(mesh: trimesh.Trimesh) -> np.ndarray:
    return np.asarray(mesh.vertex_normals)[mesh.faces]


def saved(path: Path, mesh: trimesh.Trimesh, normals: np.ndarray | None = None) -> Path:
    """Write a PLY file with the vertices and faces as they are, with normals if given."""
    columns = mesh.vertices if normals is None else np.hstack([mesh.vertices, normals])
    names = ("x", "y", "z", "nx", "ny", "nz")[: columns.shape[1]]
    head = ["ply", "format ascii 1.0", f"element vertex {len(columns)}"]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(f"{value:.9g}" for value in row) for row in columns]
    rows += [" ".join(map(str, (3, *face))) for face in mesh.faces]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb"])
def test_sharp_edges_stay_sharp(tmp_path: Path, suffix: str):
    """Expected: the corners of a cube have the normals of its faces, from files without normals, also in the
    file that is rendered."""
    without = {"include_normals": False} if suffix in (".obj", ".glb") else {}
    trimesh.creation.box((1, 1, 1)).export(tmp_path / f"cube{suffix}", **without)
    mesh = trimesh.load(object_file(tmp_path / f"cube{suffix}"), process=False)
    assert corner_normals(mesh) == pytest.approx(np.repeat(mesh.face_normals[:, np.newaxis], 3, axis=1))


@pytest.mark.parametrize(("angle", "smooth"), [(25, True), (35, False)])
def test_edges_below_30_degrees_are_smooth(tmp_path: Path, angle: float, smooth: bool):
    """A roof of two squares; the normals at its ridge are common to both up to 30 degrees."""
    slope = np.radians(angle / 2)
    x, z = np.cos(slope), -np.sin(slope)
    corners = [[0, 0, 0], [0, 1, 0], [-x, 0, z], [-x, 1, z], [x, 0, z], [x, 1, z]]
    roof = trimesh.Trimesh(corners, [[0, 1, 2], [1, 3, 2], [0, 4, 1], [1, 4, 5]], process=False)
    with pytest.warns(SceneNotice, match="not watertight"):
        mesh = read_mesh(saved(tmp_path / "roof.ply", roof))
    ridge = np.abs(mesh.vertices[:, 0]) < 1e-6
    assert ridge.sum() == (2 if smooth else 4)
    assert np.allclose(mesh.vertex_normals[ridge], [0, 0, 1], atol=0.1) == smooth


def test_a_smooth_body_without_normals_stays_smooth(tmp_path: Path):
    """Expected: no vertex of a ball is split; normals are radial within half an edge."""
    mesh = read_mesh(saved(tmp_path / "ball.ply", trimesh.creation.icosphere(3)))
    assert len(mesh.vertices) == 642
    assert mesh.vertex_normals == pytest.approx(np.asarray(mesh.vertices), abs=0.01)


@pytest.mark.parametrize("turned", [False, True])
def test_vertex_normals_of_the_file_are_kept(tmp_path: Path, turned: bool):
    """Expected: to the letter, and outwards with the faces if the file is inside out."""
    cube = trimesh.creation.box((1, 1, 1))
    given = np.asarray(cube.vertices) * [1, 2, 3]
    given /= np.linalg.norm(given, axis=1, keepdims=True)
    file = trimesh.Trimesh(cube.vertices, cube.faces[:, ::-1] if turned else cube.faces, process=False)
    path = saved(tmp_path / "cube.ply", file, -given if turned else given)
    mesh = trimesh.load(object_file(path), process=False)
    assert mesh.volume > 0
    assert len(mesh.vertices) == 8
    middle = np.asarray(mesh.vertices) - mesh.bounds.mean(axis=0)
    expected = middle * [1, 2, 3]
    assert mesh.vertex_normals == pytest.approx(
        expected / np.linalg.norm(expected, axis=1, keepdims=True), abs=1e-5
    )


def test_vertex_normals_of_transformed_parts_are_kept(tmp_path: Path):
    """A glTF scene of two smooth balls of which one is turned: 20 faces each, at 42 degrees."""
    ball = trimesh.creation.icosahedron()
    ball = trimesh.Trimesh(ball.vertices, ball.faces, vertex_normals=ball.vertices, process=False)
    parts = trimesh.Scene(ball)
    turn = trimesh.transformations.rotation_matrix(1.0, [1, 2, 3])
    turn[:3, 3] = [3, 0, 0]
    parts.add_geometry(ball, transform=turn)
    parts.export(tmp_path / "balls.glb", include_normals=True)
    mesh = read_mesh(tmp_path / "balls.glb")
    centres = np.where(mesh.vertices[:, :1] > 1.5, [3, 0, 0], 0)
    assert mesh.vertex_normals == pytest.approx(np.asarray(mesh.vertices) - centres, abs=1e-5)


def test_missing_vertex_normals_are_those_of_the_faces(tmp_path: Path):
    """Expected: the one that is 0 in the file becomes the mean of the faces around it, radial in a ball."""
    ball = trimesh.creation.icosphere(2)
    given = np.array(ball.vertices)
    given[7] = 0
    mesh = read_mesh(saved(tmp_path / "ball.ply", ball, given))
    assert mesh.vertex_normals == pytest.approx(np.asarray(mesh.vertices), abs=0.02)


@pytest.mark.parametrize("with_normals", [False, True])
def test_faces_wound_against_their_neighbours_are_turned(tmp_path: Path, with_normals: bool):
    ball = trimesh.creation.icosphere(3)
    faces = np.array(ball.faces)
    faces[:400] = faces[:400, ::-1]
    mixed = trimesh.Trimesh(ball.vertices, faces, process=False)
    path = saved(tmp_path / "mixed.ply", mixed, np.asarray(ball.vertices) if with_normals else None)
    with pytest.warns(SceneNotice, match="400 of 1280 triangles were wound against their neighbours"):
        mesh = read_mesh(path)
    assert mesh.is_winding_consistent
    assert (np.sum(mesh.face_normals * mesh.triangles_center, axis=1) > 0).all()
    assert mesh.vertex_normals == pytest.approx(np.asarray(mesh.vertices), abs=0.01)


@pytest.mark.parametrize("turned", [False, True])
def test_an_open_mesh_faces_outwards(tmp_path: Path, turned: bool):
    """A bowl. Expected: its front outside, whichever way it was wound, and said if it was turned."""
    ball = trimesh.creation.icosphere(3)
    faces = ball.faces[ball.triangles_center[:, 1] < 0.5]
    bowl = trimesh.Trimesh(ball.vertices, faces[:, ::-1] if turned else faces, process=False)
    with pytest.warns(SceneNotice) as caught:
        mesh = read_mesh(saved(tmp_path / "bowl.ply", bowl))
    said = [str(notice.message) for notice in caught]
    assert any("not watertight" in text for text in said)
    assert any("had their front on the inner side" in text for text in said) == turned
    assert (np.sum(mesh.face_normals * mesh.triangles_center, axis=1) > 0).all()


def test_each_body_faces_outwards_and_a_cavity_inwards(tmp_path: Path):
    """Three balls: one as it should be, one inside out, one hollow. Expected: their volumes add up."""
    ball, cavity = trimesh.creation.icosphere(2), trimesh.creation.icosphere(2, radius=0.5)
    cavity.invert()
    inverted = ball.copy().apply_translation([3, 0, 0])
    inverted.invert()
    hollow = trimesh.util.concatenate([ball, cavity]).apply_translation([6, 0, 0])
    mesh = trimesh.util.concatenate([ball, inverted, hollow])
    volume = ball.volume * (3 - 1 / 8)
    assert read_mesh(saved(tmp_path / "three.ply", mesh)).volume == pytest.approx(volume, rel=1e-6)
    mesh.invert()
    assert read_mesh(saved(tmp_path / "inverted.ply", mesh)).volume == pytest.approx(volume, rel=1e-6)


def test_a_surface_with_one_side_is_said(tmp_path: Path):
    """A Moebius strip of 40 quads."""
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    across = np.array([-0.3, 0.3])[:, np.newaxis]
    radius = 1 + across * np.cos(turn / 2)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), across * np.sin(turn / 2)], axis=-1)
    quads = [(k, k + 1, k + 41, k + 40) for k in range(39)] + [(39, 40, 0, 79)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    strip = trimesh.Trimesh(points.reshape(-1, 3), faces, process=False)
    with pytest.warns(SceneNotice) as caught:
        read_mesh(saved(tmp_path / "strip.ply", strip))
    assert any("one side only" in str(notice.message) for notice in caught)


def test_faces_without_area_and_stray_vertices_do_no_harm(tmp_path: Path):
    """A tetrahedron, a face with a corner twice, one along an edge, and a vertex far away that none uses."""
    (tmp_path / "spoilt.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\nv nan 0 0\n"
        "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 1 5\n"
    )
    mesh = read_mesh(tmp_path / "spoilt.obj")
    assert len(mesh.faces) == 4
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 1]]
    assert mesh.volume == pytest.approx(1 / 6)


def test_a_single_triangle_is_a_mesh(tmp_path: Path):
    (tmp_path / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.warns(SceneNotice, match=r"holes \(3 open edges\)"):
        mesh = read_mesh(tmp_path / "one.obj")
    assert mesh.vertex_normals.tolist() == [[0, 0, 1]] * 3


@pytest.mark.parametrize(
    ("name", "text", "match"),
    [
        ("gone.ply", None, "does not exist"),
        ("scan.xyz", "0 0 0", "kind of mesh file"),
        ("broken.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "mesh"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "mesh"),
        ("empty.ply", "", "mesh"),
        ("empty.stl", "solid nothing\nendsolid nothing\n", "mesh"),
        ("text.glb", "this is no mesh", "cannot be read"),
        ("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n", "not finite numbers"),
        ("inf.obj", "v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", "not finite numbers"),
        ("beyond.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "mesh"),
        ("needle.obj", "v 0 0 0\nv 1 0 0\nv 1 1e-9 0\nf 1 2 3\n", "no faces with an area"),
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


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_unit_of_a_file_does_not_matter(tmp_path: Path, scale: float):
    """A bead of a micrometre in metres has triangles of 1e-16: their normals are as good as those of a house."""
    ball = trimesh.creation.icosphere(4)
    ball.apply_scale(scale)
    mesh = trimesh.load(object_file(saved(tmp_path / "ball.ply", ball)), process=False)
    away = mesh.vertices - mesh.vertices.mean(axis=0)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    assert np.sum(away * mesh.vertex_normals, axis=1) == pytest.approx(1, abs=1e-3)


def test_a_body_beside_another_is_no_cavity_of_it(tmp_path: Path):
    """A ball in the hole of a torus lies within its bounding box and not within it: wound inwards, it is turned."""
    ring, ball = trimesh.creation.torus(2, 0.5), trimesh.creation.icosphere(2, radius=0.4)
    volume = ring.volume + ball.volume
    ball.invert()
    mesh = read_mesh(saved(tmp_path / "both.ply", trimesh.util.concatenate([ring, ball])))
    assert mesh.volume == pytest.approx(volume, rel=1e-6)
