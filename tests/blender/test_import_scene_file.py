"""From what Blender says of a scene to a Mitsuba scene: the half that needs no Blender."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fluorspar.blender.importing.emitted import Emitted
from fluorspar.blender.importing.import_blender import import_blender
from fluorspar.blender.importing.lights import faded
from fluorspar.blender.importing.listing import Listing
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
        folder.mkdir(exist_ok=True)
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
    # a ball, as the light of a point would not pass what is transparent
    scene, listed = imported(materials, nodes, lights=[point(shadow_soft_size=0.1)])
    assert listed == []
    shapes = [surface for surface in load_scene(scene).surfaces if surface.name.startswith("Dreieck")]
    assert len(shapes) == 8  # the transparent one is not there


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
    with pytest.raises(SceneError, match=r"not a file of Blender[\s\S]*scene.blend"):
        import_blender(file, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["scene.blend"]


@pytest.mark.parametrize("name", [".", "inner/.."])
def test_the_folder_that_is_worked_in_cannot_be_exchanged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    file, folder = tmp_path / "scene.blend", tmp_path / "out"
    file.write_bytes(b"BLENDER-v304")
    folder.mkdir()
    monkeypatch.chdir(folder)
    if name != ".":
        (tmp_path / "out" / "inner").mkdir()
    with pytest.raises(ImageError, match=r"folder"):
        import_blender(file, name)


def test_a_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    file, folder = tmp_path / "scene.blend", tmp_path / "out"
    file.write_bytes(b"BLENDER-v304")
    folder.mkdir()
    (folder / "thesis.txt").write_text("mine")
    with pytest.raises(ImageError, match="not a folder of an import"):
        import_blender(file, folder)
    assert (folder / "thesis.txt").read_text() == "mine"


def test_names_that_scene_files_cannot_hold(imported) -> None:
    """A dollar sign would be a parameter; control characters and doubled hyphens in a comment are no XML."""
    names = ["$cost -- --- a", "tab\x01<&>\"'", "_under.001"]
    scene, listed = imported([material(name, None) for name in names], others=[["a -- --- \x02b", "VOLUME"]])
    assert len(listed) == 1
    assert len(load_scene(scene).surfaces) == 3


def test_materials_of_one_name_from_two_files(imported) -> None:
    """Expected: each keeps its colour."""
    red, blue = material("paint", None), material("paint", None) | {"key": "paint [a.blend]"}
    scene, _ = imported([red | {"colour": [1, 0, 0]}, blue | {"colour": [0, 0, 1]}])
    text = scene.read_text(encoding="utf-8")
    assert '<ref id="paint" />' in text
    assert '<ref id="paint#2" />' in text


@pytest.mark.parametrize("concentration", [-1.0, float("nan"), float("inf"), "much", [1.0, 2.0]])
def test_a_wrong_concentration_is_refused(imported, concentration: Any) -> None:
    with pytest.raises(
        SceneError, match=r"concentration[\s\S]*material 'wall'[\s\S]*fluorspar_concentration"
    ):
        imported([material("wall", None, "poster-red", concentration)])


def test_a_concentration_of_nothing_is_listed(imported) -> None:
    _, listed = imported([material("wall", None, None, 2.0)])
    assert listed == [
        "material 'wall' has a concentration, but no name of a fluorescent material: it is left out"
    ]


@pytest.mark.parametrize("kind", ["AREA", "SUN", "SPOT"])
def test_a_lamp_of_no_size_is_left_out(imported, kind: str) -> None:
    flat = np.zeros((4, 4)).tolist()
    nothing = point(
        type=kind, matrix=flat, shape="SQUARE", size=1.0, spot_size=1.0, spot_blend=0.1, angle=0.0
    )
    scene, listed = imported(lights=[point(), nothing])
    assert listed == ["light 'lamp' has no size, or is scaled to nothing: it is left out"]
    assert len(load_scene(scene).lights) == 1


def test_a_lamp_whose_strength_grows_with_its_size_is_listed(imported) -> None:
    _, listed = imported(lights=[point(normalize=False)])
    assert any("grows with its size" in sentence for sentence in listed)


def test_the_coldest_black_body() -> None:
    listing = Listing()
    cold, coldest = (Emitted((1, 1, 1), kelvin).element("radiance", "", listing) for kelvin in (0.0, 800.0))
    assert cold.get("value") == coldest.get("value")


def test_clipping_planes_of_the_camera(imported) -> None:
    scene, _ = imported(camera=CAMERA | {"clip_start": 2.5, "clip_end": 7.0})
    text = scene.read_text(encoding="utf-8")
    assert '<float name="near_clip" value="2.5" />' in text
    assert '<float name="far_clip" value="7" />' in text


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_depth_of_field(imported, kind: str) -> None:
    """A radius of lens / (2 f-number): 18 mm / (2 x 0.1) = 0.09 m; what cannot be taken over is listed."""
    focus = {"distance": 3.0, "fstop": 0.1, "round": False}
    scene, listed = imported(camera=CAMERA | {"type": kind, "focus": focus})
    text = scene.read_text(encoding="utf-8")
    assert ('<float name="aperture_radius" value="0.09" />' in text) == (kind == "PERSP")
    assert len(listed) == 1
    load_scene(scene)


@pytest.mark.parametrize("setting", ["region", "motion_blur", "transparent"])
def test_settings_that_are_left_out_are_listed(imported, setting: str) -> None:
    _, listed = imported(settings=SETTINGS | {setting: True})
    assert len(listed) == 1


def test_a_file_of_a_newer_blender_is_listed(imported) -> None:
    _, listed = imported(written_by=[5, 0, 1])
    assert listed == ["the file was written by Blender 5.0 and read by 4.2: what is new may be lost"]


def test_a_flattened_thing_is_there_and_one_of_no_extent_is_not(imported) -> None:
    things = [
        {"name": name, "mesh": 0, "matrix": np.diag(sizes).tolist(), "materials": [], "hidden": []}
        for name, sizes in (("flat", (1.0, -2.0, 0.0, 1.0)), ("thread", (1.0, 0.0, 0.0, 1.0)))
    ]
    scene, listed = imported(objects=things)
    assert listed == ["object 'thread' is scaled to nothing: it is left out"]
    assert [surface.name for surface in load_scene(scene).surfaces] == ["flat"]


def test_what_faces_inwards_is_not_closed() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
    outwards = Mesh(corners, corners, None, faces)
    assert outwards.is_closed
    assert not outwards.mirrored().is_closed


def picture(folder: Path, alpha: list[list[float]] | None) -> dict[str, Any]:
    """A picture in the folder of a scene, and what is said of it."""
    (folder / "textures").mkdir(parents=True)
    pixels = np.full((2, 2, 4), 255, np.uint8)
    if alpha is not None:
        pixels[..., 3] = np.array(alpha) * 255
    Image.fromarray(pixels).save(folder / "textures" / "0-leaf.png")
    return {"name": "leaf", "space": "sRGB", "source": "FILE", "file": "0-leaf.png", "alpha": "STRAIGHT"}


IMAGE_NODE = {"projection": "FLAT", "extension": "REPEAT", "interpolation": "Linear"}


@pytest.mark.parametrize("mode", ["STRAIGHT", "NONE"])
def test_alpha_of_an_image_is_a_mask(imported, tmp_path: Path, mode: str) -> None:
    """Expected: a grey picture of it as opacity; none if Blender ignores the alpha of the image."""
    alpha = [[0.0, 1.0], [1.0, 0.2]]
    folder = tmp_path / "scène with space"
    leaf = picture(folder, alpha) | {"alpha": mode}
    texture = node("TexImage", IMAGE_NODE, Vector=value([0, 0, 0])) | {"image": 0}
    nodes = [node("BsdfPrincipled", Base_Color=to(1, "Color"), Alpha=to(1, "Alpha")), texture]
    scene, listed = imported([material("m", {"Surface": to(0)})], nodes, images=[leaf])
    masked = mode == "STRAIGHT"
    assert ('type="mask"' in scene.read_text(encoding="utf-8")) == masked
    assert any("opaque shadow" in sentence for sentence in listed) == masked
    if masked:
        grey = np.asarray(Image.open(folder / "textures" / "0-leaf-alpha.png"))
        np.testing.assert_array_equal(grey, np.array(alpha) * 255)
    load_scene(scene)


def test_a_transparent_image_whose_alpha_is_not_used_is_listed(imported, tmp_path: Path) -> None:
    """Two materials have nodes that are equal; the one that uses the alpha does not speak for the other."""
    leaf = picture(tmp_path / "scène with space", [[0.0, 1.0], [1.0, 1.0]])
    texture = node("TexImage", IMAGE_NODE, Vector=value([0, 0, 0])) | {"image": 0}
    principled = node("BsdfPrincipled", Base_Color=to(1, "Color"), Alpha=to(1, "Alpha"))
    nodes = [principled, texture, node("BsdfDiffuse", Color=to(3, "Color")), dict(texture)]
    materials = [material("uses", {"Surface": to(0)}), material("does not", {"Surface": to(2)})]
    _, listed = imported(materials, nodes, images=[leaf])
    assert [sentence for sentence in listed if "not darker" in sentence] == [
        "material 'does not' has the image 'leaf', which is transparent in parts: they are not darker here"
    ]


def test_an_image_without_uv_map_shows_its_corner(imported, tmp_path: Path) -> None:
    leaf = picture(tmp_path / "scène with space", None)
    texture = node("TexImage", IMAGE_NODE, Vector=value([0, 0, 0])) | {"image": 0}
    names = ("points", "corners", "triangles", "slots", "normals")
    bare = {name: name for name in names} | {"uv": {}, "uv_rendered": None}
    nodes = [node("BsdfDiffuse", Color=to(1, "Color")), texture]
    scene, listed = imported([material("m", {"Surface": to(0)})], nodes, images=[leaf], meshes=[bare])
    assert listed == ["object 'Dreieck ü' has images but no UV map: their lower left corner is everywhere"]
    assert b"property float u\n" in (scene.parent / "meshes" / "0-0.ply").read_bytes()


def test_light_of_a_surface_is_as_strong_as_its_alpha(imported) -> None:
    glow = {"Emission Color": value([1, 1, 1, 1]), "Emission Strength": value(2.0), "Alpha": value(0.25)}
    shader = node("BsdfPrincipled")
    shader["inputs"] = glow
    scene, _ = imported([material("m", {"Surface": to(0)})], [shader])
    assert '<rgb name="radiance" value="0.5, 0.5, 0.5" />' in scene.read_text(encoding="utf-8")


def test_blendings_that_are_not_computed_are_listed(imported) -> None:
    colours = {"Factor_Float": value(1.0), "A_Color": value([0.2] * 3), "B_Color": value([0.3] * 3)}
    numbers = {"Factor_Float": value(1.0), "A_Float": value(0.1), "B_Float": value(0.9)}
    nodes = [
        node("BsdfDiffuse", Color=to(1, "Result")),
        node("Mix", {"blend_type": "SCREEN"}) | {"inputs": colours},
        node("BsdfPrincipled", Roughness=to(3, "Result")),
        node("Mix", {"blend_type": "MIX"}) | {"inputs": numbers},
    ]
    scene, listed = imported([material("a", {"Surface": to(0)}), material("b", {"Surface": to(2)})], nodes)
    assert len(listed) == 1
    assert "material 'a'" in listed[0]
    assert '<float name="roughness" value="0.9' in scene.read_text(encoding="utf-8")


def test_a_colour_beyond_1_is_listed(imported) -> None:
    _, listed = imported(
        [material("m", {"Surface": to(0)})], [node("BsdfDiffuse", Color=value([2.0, 0.5, 0.5, 1]))]
    )
    assert listed == ["material 'm' has a colour beyond 0 to 1 (2, 0.5, 0.5): it is clipped"]


def test_metal_of_an_index_of_refraction(imported) -> None:
    """It has no base colour."""
    metal = node("BsdfMetallic", {"distribution": "GGX"}, Roughness=value(0.3))
    scene, listed = imported([material("m", {"Surface": to(0)})], [metal])
    assert len(listed) == 1
    load_scene(scene)


def test_images_as_numbers_of_principled(imported, tmp_path: Path) -> None:
    image = picture(tmp_path / "scène with space", None)
    texture = node("TexImage", IMAGE_NODE, Vector=value([0, 0, 0])) | {"image": 0}
    shader = node("BsdfPrincipled")
    names = ("Roughness", "Metallic", "Sheen", "Transmission", "Anisotropic")
    shader["inputs"] = {name: to(1, "Color") for name in names}
    scene, _ = imported([material("m", {"Surface": to(0)})], [shader, texture], images=[image])
    load_scene(scene)
