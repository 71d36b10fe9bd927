"""From what Blender says of a scene to a Mitsuba scene: the half that needs no Blender."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluorspar.blender.importing.import_blender import import_blender
from fluorspar.blender.importing.lights import faded
from fluorspar.blender.importing.meshes import Mesh
from fluorspar.blender.importing.scene_file import write_scene
from fluorspar.errors import ImageError, MaterialError, SceneError
from fluorspar.scene.loading import load_scene

EYE = np.eye(4).tolist()
SETTINGS = {
    "width": 8,
    "height": 6,
    "aspect": 1.0,
    "region": False,
    "transparent": False,
    "motion_blur": False,
    "exposure": 1.0,
    "samples": 4,
    "bounces": 4,
}
CAMERA = {
    "name": "eye",
    "type": "PERSP",
    "lens": 18.0,
    "sensor_fit": "AUTO",
    "sensor_width": 36.0,
    "sensor_height": 24.0,
    "shift_x": 0.0,
    "shift_y": 0.0,
    "ortho_scale": 1.0,
    "clip_start": 0.1,
    "clip_end": 1000.0,
    "matrix": np.diag([1, 1, 1, 1]).tolist(),
    "focus": None,
}


def to(number: int, output: str = "BSDF") -> dict[str, Any]:
    return {"from": number, "output": output}


def value(given: Any) -> dict[str, Any]:
    return {"value": given}


def node(kind: str, properties: dict[str, Any] | None = None, **inputs: Any) -> dict[str, Any]:
    named = {name.replace("_", " "): socket for name, socket in inputs.items()}
    return {"kind": kind, "name": kind, "properties": properties or {}, "outputs": {}, "inputs": named}


def material(name: str, nodes: Any, fluorspar: Any = None, concentration: Any = None) -> dict[str, Any]:
    return {
        "name": name,
        "key": name,
        "nodes": nodes,
        "colour": [0.8] * 3,
        "fluorspar": fluorspar,
        "concentration": concentration,
    }


def point(energy: float = 100.0, **more: Any) -> dict[str, Any]:
    said = {"name": "lamp", "type": "POINT", "matrix": EYE, "energy": energy, "color": [1, 1, 1]}
    return said | {"shadow_soft_size": 0.0, "is_portal": False, "seen": True, "nodes": None} | more


@pytest.fixture
def imported(tmp_path: Path):
    """Writes a triangle of some materials, and returns scene file and listing."""

    def write(
        materials: list[dict[str, Any]] | None = None, nodes: Any = (), lights: Any = None, **more: Any
    ):
        arrays, folder = tmp_path / "arrays", tmp_path / "scène with space"
        arrays.mkdir()
        folder.mkdir()
        np.array([0, 0, -3, 1, 0, -3, 0, 1, -3], np.float32).tofile(arrays / "points")
        np.array([0, 1, 2], np.int32).tofile(arrays / "corners")
        np.array([0, 1, 2], np.int32).tofile(arrays / "triangles")
        np.array([0], np.int32).tofile(arrays / "slots")
        np.array([0, 0, 1] * 3, np.float32).tofile(arrays / "normals")
        np.array([0, 0, 1, 0, 0, 1], np.float32).tofile(arrays / "uv")
        names = ("points", "corners", "triangles", "slots", "normals")
        mesh = {name: name for name in names} | {"uv": {"UVMap": "uv"}, "uv_rendered": "UVMap"}
        materials = [material("grey", None)] if materials is None else materials
        said = {
            "version": [4, 2, 0],
            "written_by": [4, 2, 0],
            "camera": CAMERA,
            "settings": SETTINGS,
            "world": None,
            "objects": [
                {"name": "Dreieck ü", "mesh": 0, "matrix": EYE, "materials": [one["key"]], "hidden": []}
                for one in materials
            ],
            "lights": [point()] if lights is None else lights,
            "others": [],
            "materials": materials,
            "meshes": [mesh],
            "nodes": list(nodes),
            "images": [],
            "layers": ["View Layer"],
            "libraries": [],
        }
        listing = write_scene(said | more, arrays, folder)
        return folder / "scene.xml", listing.sentences

    return write


def test_a_plain_scene_has_nothing_to_list(imported) -> None:
    scene, listed = imported()
    assert listed == []
    loaded = load_scene(scene)
    assert [surface.name for surface in loaded.surfaces] == ["Dreieck ü"]
    assert loaded.settings.max_depth == 6


def test_power_of_a_point_becomes_intensity(imported) -> None:
    scene, _ = imported(lights=[point(4 * np.pi)])
    assert '<rgb name="intensity" value="1, 1, 1" />' in scene.read_text(encoding="utf-8")


@pytest.mark.parametrize(("version", "radiance"), [([3, 4, 1], "0.25"), ([4, 0, 0], "0.318309886")])
def test_power_of_an_area_becomes_radiance(imported, version: list[int], radiance: str) -> None:
    """P / (pi A) from Blender 4.0 on, P / (4 A) before."""
    area = point(1.0, type="AREA", shape="SQUARE", size=1.0, size_y=1.0)
    scene, _ = imported(lights=[area], version=version)
    assert f'"{radiance}, {radiance}, {radiance}"' in scene.read_text(encoding="utf-8")


def test_an_old_spot_is_weaker_by_the_cosine() -> None:
    cosine = np.array([1.0, 0.9])
    np.testing.assert_allclose(faded(cosine, 1.0, 0.1, old=True), cosine * faded(cosine, 1.0, 0.1, old=False))


@pytest.mark.parametrize(
    "name", ["fluorspar:poster-red", "fluorspar:poster-red.001", "fluorspar: poster-red"]
)
def test_a_name_makes_a_surface_fluoresce(imported, name: str) -> None:
    scene, _ = imported([material(name, None)])
    assert any(made.fluorescent for made in load_scene(scene).materials)


def test_a_property_makes_a_surface_fluoresce(imported) -> None:
    scene, _ = imported([material("wall", None, "poster-red", 0.5)])
    text = scene.read_text(encoding="utf-8")
    assert '<string name="material" value="poster-red" />' in text
    assert '<float name="concentration" value="0.5" />' in text
    assert any(made.fluorescent for made in load_scene(scene).materials)


def test_an_unknown_fluorescent_material_is_refused(imported) -> None:
    with pytest.raises(MaterialError, match=r"did you mean poster-red[\s\S]*material 'wall'"):
        imported([material("wall", None, "poster-rad")])


def test_shaders_become_plugins_that_load(imported) -> None:
    """Rationale: each makes a BSDF that Fluorspar renders. Expected: nothing listed, and it loads."""
    ggx = {"distribution": "GGX"}
    white, grey = value([1, 1, 1, 1]), value([0.5, 0.5, 0.5, 1])
    nodes = [
        node("BsdfDiffuse", Color=grey, Roughness=value(0.0)),
        node("BsdfGlossy", ggx, Color=white, Roughness=value(0.3)),
        node("BsdfGlass", {"distribution": "SHARP"}, Color=white, Roughness=value(0.0), IOR=value(1.5)),
        node("BsdfTransparent", Color=white),
        node("Emission", Color=white, Strength=value(2.0)),
        node("MixShader", Fac=value(0.25), Shader=to(0), Shader_001=to(1)),
        node("MixShader", Fac=value(0.25), Shader=to(3), Shader_001=to(0)),
        node("AddShader", Shader=to(0), Shader_001=to(4)),
        node(
            "BsdfPrincipled",
            ggx,
            Base_Color=grey,
            Roughness=value(0.4),
            Metallic=value(0.0),
            Specular=value(0.5),
            Transmission=value(0.0),
            Sheen=value(0.1),
            Clearcoat=value(0.5),
            Clearcoat_Roughness=value(0.1),
            Alpha=value(0.5),
            Emission=value([0, 0, 0, 1]),
            IOR=value(1.45),
        ),
    ]
    for one in nodes:
        if one["kind"] == "MixShader" or one["kind"] == "AddShader":
            one["inputs"] = {name.replace("Shader 001", "Shader_001"): s for name, s in one["inputs"].items()}
    materials = [
        material(f"{number} {one['kind']}", {"Surface": to(number)}) for number, one in enumerate(nodes)
    ]
    scene, listed = imported(materials, nodes)
    assert listed == []
    assert len(load_scene(scene).surfaces) == 8  # the transparent one is not there


def test_what_has_no_counterpart_is_listed(imported) -> None:
    nodes = [
        node("BsdfDiffuse", Color=to(1, "Color")),
        node("TexNoise", Scale=value(5.0)),
        node("BsdfTranslucent", Color=value([0.2, 0.3, 0.4, 1])),
        node("SomethingNew"),
    ]
    materials = [material(f"m{at}", {"Surface": to(at)}) for at in (0, 2, 3)]
    scene, listed = imported(materials, nodes, others=[["smoke", "VOLUME"]])
    text = "\n".join(listed)
    for part in (
        "TexNoise",
        "(0.5, 0.5, 0.5) instead",
        "translucent",
        "SomethingNew",
        "'smoke' is or has a volume",
    ):
        assert part in text
        assert part in scene.read_text(encoding="utf-8")


def test_a_missing_image_is_listed(imported) -> None:
    properties = {"projection": "FLAT", "extension": "REPEAT", "interpolation": "Linear"}
    texture = node("TexImage", properties, Vector=value([0, 0, 0])) | {"image": 0}
    image = {"name": "wood", "space": "sRGB", "source": "FILE", "file": None, "missing": "/no/wood.png"}
    nodes = [node("BsdfDiffuse", Color=to(1, "Color")), texture]
    scene, listed = imported([material("m", {"Surface": to(0)})], nodes, images=[image])
    assert any("'wood', which is missing: /no/wood.png" in sentence for sentence in listed)
    load_scene(scene)


def test_a_black_body_is_as_luminous_as_white(imported) -> None:
    """Blender scales black bodies to the luminance of white of the same strength; sums over 10 nm: 1e-3."""
    emission = node("Emission", Color=to(1, "Color"), Strength=value(1.0))
    nodes = [emission, node("Blackbody", Temperature=value(3000.0))]
    scene, listed = imported(nodes=nodes, lights=[point(4 * np.pi, nodes={"Surface": to(0)})])
    assert listed == []
    spectrum = load_scene(scene).lights[0].spectrum
    from fluorspar.colour.observers import matching_functions

    at, observer = matching_functions(2)
    inside = (at >= 360) & (at <= 830)
    luminance = (
        np.interp(at[inside], spectrum.wavelengths, spectrum.values) * observer[inside, 1]
    ).sum() / observer[inside, 1].sum()
    assert luminance == pytest.approx(1, abs=1e-3)


def test_a_panorama_is_refused(imported) -> None:
    with pytest.raises(SceneError, match=r"no such camera[\s\S]*'eye'[\s\S]*pano"):
        imported(camera=CAMERA | {"type": "PANO"})


def test_an_open_surface_shines_to_both_sides() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    mesh = Mesh(points, np.tile(np.float32([0, 0, 1]), (3, 1)), None, np.array([[0, 1, 2]], np.int32))
    assert not mesh.is_closed
    both = mesh.with_back()
    assert both.is_closed is False
    assert len(both.faces) == 2
    corners = both.points[both.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normals[:, 2], [1, -1])


@pytest.mark.parametrize("content", [b"", b"# not a scene", b"\x89PNG\r\n"])
def test_not_a_file_of_blender(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "scene.blend"
    file.write_bytes(content)
    with pytest.raises(SceneError, match=r"no file of Blender[\s\S]*scene.blend"):
        import_blender(file, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["scene.blend"]


def test_a_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    file, folder = tmp_path / "scene.blend", tmp_path / "out"
    file.write_bytes(b"BLENDER-v304")
    folder.mkdir()
    (folder / "thesis.txt").write_text("mine")
    with pytest.raises(ImageError, match="not a folder of an import"):
        import_blender(file, folder)
    assert (folder / "thesis.txt").read_text() == "mine"
