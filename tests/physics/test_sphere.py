"""A sphere of two materials, both emitting, each with its own spectrum.

Rationale
    Inside a sphere every element of surface sends the same share of its light to every other, so the incident
    light is uniform whatever is where: E = sum a_i (L_i + D_i E) with area fractions a_i (`lab.two_part_sphere`).
    Unlike a furnace this has light that luminesces on one material and is reflected by the other, two
    material rows and two light rows: a row taken for another shows at once.
Expected
    The mean of each component over the pixels of each material within 0.5 % of the closed form.
Geometry
    The sphere is a mesh of 20480 flat triangles, split at z = 0.2 into a cap and the rest; area fractions are
    those of the mesh. A radiosity solution with 320, 1280 and 5120 triangles gave errors of the mean
    illumination of 0.35 %, 0.08 % and 0.023 % on the cap, a quarter for each step: 0.006 % for this mesh, far
    below 0.5 %. Between flat triangles that meet at small angles Mitsuba's rays lose 0.035 % of the direct
    light, in stock `path` as here. (Mitsuba's analytic `sphere` would not do: lit from inside, stock `path`
    shows direct light 0.42 % too bright.)
Samples
    Components scatter by up to 0.7 of their value per sample; 64 x 64 pixels of 512 samples, half of them on
    the cap, know each mean to 0.1 % or better, and 0.5 % is 5 standard errors.
Result
    Largest deviation 0.18 % (component 6 on the cap, 2.5 standard errors), of the total 0.06 %.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import (
    FINE,
    Array,
    bell,
    curve,
    integrator,
    light_values,
    luminescence,
    paint,
    sampled,
    sensor,
    two_part_sphere,
    write,
)

from fluorspar import COMPONENTS, SpectralImage, Wavelengths, load_scene, render

GRID = Wavelengths(400, 700, 20)
S = [0.3 + 0.4 * (FINE - 300) / 480, 0.7 - 0.3 * (FINE - 300) / 480]
DYES = [(bell(560, 40, 0.5), bell(500, 40)), (bell(620, 30, 0.3), bell(540, 50))]
L = [light_values(), 0.4 * light_values()[::-1]]


def sphere() -> Array:
    """Triangles of a subdivided icosahedron that face inwards, ndarray of shape (20480, 3, 3)."""
    golden = (1 + np.sqrt(5)) / 2
    ring = np.array([(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0)], dtype=float)
    corners = np.concatenate([ring, np.roll(ring, 1, axis=1), np.roll(ring, 2, axis=1)]) / np.hypot(1, golden)
    distance = np.linalg.norm(corners[:, None] - corners, axis=2)
    near = distance < 1.1 * np.unique(distance.round(6))[1]
    triangles = corners[
        [
            (i, j, k)
            for i in range(12)
            for j in range(i)
            for k in range(j)
            if near[i, j] and near[j, k] and near[i, k]
        ]
    ]
    for _ in range(5):
        a, b, c = triangles.swapaxes(0, 1)
        ab, bc, ca = (
            (p + q) / np.linalg.norm(p + q, axis=1, keepdims=True) for p, q in ((a, b), (b, c), (c, a))
        )
        triangles = np.concatenate(
            [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    outwards = (
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) * triangles[:, 0]
    ).sum(1) > 0
    return np.where(outwards[:, None, None], triangles[:, ::-1], triangles)


def write_obj(path: Path, triangles: Array) -> None:
    vertices = "\n".join(f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in triangles.reshape(-1, 3))
    faces = "\n".join(f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(triangles)))
    path.write_text(vertices + "\n" + faces + "\n")


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> tuple[SpectralImage, Array]:
    """The image, and the closed form of shape (2, 7, N)."""
    folder = tmp_path_factory.mktemp("sphere")
    triangles = sphere()
    assert len(triangles) == 20480
    cap = triangles.mean(1)[:, 2] > 0.2
    area = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    shapes = ""
    for number, (name, chosen) in enumerate([("cap", cap), ("rest", ~cap)]):
        write_obj(folder / f"{name}.obj", triangles[chosen])
        shapes += f"""<shape type="obj" id="{name}"> <string name="filename" value="{name}.obj"/>
            <boolean name="face_normals" value="true"/>
            <emitter type="area"> {curve("radiance", L[number])} </emitter> </shape>"""
    camera = sensor(64, 512, origin="0.1, 0, 0", target="1, 0, 0.3", fov=100, up="0, 0, 1")
    scene = load_scene(
        write(folder, f'<scene version="3.0.0"> {integrator()} {camera} {shapes} </scene>'),
        materials={"cap": paint("cap", S[0], *DYES[0]), "rest": paint("rest", S[1], *DYES[1])},
    )
    share = np.array([area[cap].sum(), area[~cap].sum()]) / area.sum()
    expected = two_part_sphere(
        share,
        np.array([sampled(s, GRID) for s in S]),
        np.array([luminescence(*dye, GRID) for dye in DYES]),
        np.array([sampled(light, GRID) for light in L]),
    )
    return render(scene, wavelengths=GRID, excitation="grid", seed=3), expected


@pytest.mark.parametrize("part", [0, 1], ids=["cap", "rest"])
@pytest.mark.parametrize("name", [*COMPONENTS, "total"])
def test_sphere_of_two_materials(rendered: tuple[SpectralImage, Array], name: str, part: int) -> None:
    image, closed = rendered
    emitted = image.component("source").values
    # a pixel belongs to a material if all of it shows that material's lamp
    mine = np.isclose(emitted, closed[part, 0], rtol=1e-5).all(-1)
    assert mine.sum() > 800
    values = (image.total() if name == "total" else image.component(name)).values[mine].astype(float)
    expected = closed[part].sum(0) if name == "total" else closed[part, COMPONENTS.index(name)]
    scale = np.maximum(expected, 0.05 * expected.max())
    assert (values.std(0) / np.sqrt(len(values)) / scale < 0.005 / 4).all(), "0.5 % is 4 standard errors"
    assert np.abs((values.mean(0) - expected) / scale).max() < 0.005
