"""Scenes that go to another process: a fresh Python, in another folder, without a Mitsuba variant."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
import trimesh

import fluorspar.scene.recipe
from fluorspar import Material, Scene, Spectrum, load_scene, render
from fluorspar.errors import ApproximationWarning, SceneError, SceneNotice
from fluorspar.scene.variants import use_variant

OPTIONS: dict[str, Any] = {"spp": 2, "seed": 3, "wavelengths": "400:700:50", "excitation": "grid"}
RENDER = f"""
import pickle, sys
from pathlib import Path
import numpy as np
for path in map(Path, sys.argv[1:]):
    scene = pickle.loads(path.read_bytes())
    import fluorspar, mitsuba
    image = fluorspar.render(scene, **{OPTIONS!r})
    np.save(path.with_suffix(".npy"), image.dataset["radiance"].values)
"""

SENSOR = """<sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0.3, 0.1, 5" target="0, 0, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <integer name="width" value="12"/> <integer name="height" value="8"/>
    <rfilter type="box"/> </film>
    <sampler type="independent"> <integer name="sample_count" value="4"/> </sampler> </sensor>"""


def write_room(
    folder: Path, reflectance: str = '<spectrum name="reflectance" filename="paint.spd"/>'
) -> Path:
    """A scene file with a mesh, a spectrum and an included file beside it."""
    (folder / "paint.spd").write_text("400 0.2\n500 0.7\n700 0.4\n")
    for name in ("ball", "twin"):
        trimesh.creation.icosphere(1).export(folder / f"{name}.ply")
    (folder / "lamp.xml").write_text(
        '<scene version="3.0.0"> <emitter type="constant"> <spectrum name="radiance" value="400:1, 700:2"/>'
        "</emitter> </scene>"
    )
    path = folder / "room.xml"
    path.write_text(
        f"""<scene version="3.0.0"> {SENSOR} <default name="size" value="1"/> <include filename="lamp.xml"/>
        <shape type="ply" id="ball"> <string name="filename" value="ball.ply"/>
            <transform name="to_world"> <scale value="$size"/> </transform>
            <bsdf type="diffuse" id="paint"> {reflectance} </bsdf> </shape>
        <shape type="ply" id="twin"> <string name="filename" value="twin.ply"/> </shape>
        <shape type="rectangle" id="floor"> <transform name="to_world"> <scale value="3"/> </transform> </shape>
        </scene>"""
    )
    return path


def built_in(folder: Path) -> Scene:
    return load_scene("cornell-box").with_settings(width=12, height=8)


def settings_changed(folder: Path) -> Scene:
    return load_scene("furnace").with_settings(width=6, height=5, max_depth=3, rr_depth=2)


def file_by_relative_path(folder: Path) -> Scene:
    write_room(folder)
    return load_scene("room.xml", parameters={"size": 0.5})


def materials_from_outside(folder: Path) -> Scene:
    write_room(folder)
    (folder / "mine").mkdir()
    (folder / "mine" / "grey.csv").write_text(
        "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,0.6\n"
    )
    green = Material("green", Spectrum([300, 550, 800], [0.1, 0.8, 0.2]))
    return load_scene(
        Path("room.xml"), materials={"ball": green, "floor": "grey:0.5,poster-red:0.5"}, library=["mine"]
    )


def matte(folder: Path) -> Scene:
    write_room(folder, '<texture name="reflectance" type="checkerboard"/>')
    with pytest.warns(ApproximationWarning):
        return load_scene("room.xml", matte=True)


def scene_dict(folder: Path) -> Scene:
    """Transforms of two variants, a colour, a point, a mesh by a relative path."""
    trimesh.creation.icosphere(1).export(folder / "ball.ply")
    with use_variant("scalar_rgb"):
        view = mi.ScalarTransform4f().look_at(origin=[0.3, 0.1, 5], target=[0, 0, 0], up=[0, 1, 0.2])
        colour, point = mi.ScalarColor3f(0.2, 0.5, 0.4), mi.ScalarPoint3f(0, 2, 2)
    with use_variant("llvm_ad_rgb"):
        turned = mi.Transform4f().rotate([1, 2, 3], 40).scale([1, 0.5, 1])
    film = {"type": "hdrfilm", "width": 12, "height": 8, "filter": {"type": "box"}}
    return load_scene(
        {
            "type": "scene",
            "camera": {"type": "perspective", "fov": 40.0, "to_world": view, "film": film},
            "lamp": {"type": "point", "position": point, "intensity": {"type": "rgb", "value": colour}},
            "ball": {
                "type": "ply",
                "filename": "ball.ply",
                "to_world": turned,
                "bsdf": {"type": "diffuse", "reflectance": colour},
            },
            "glow": {
                "type": "sphere",
                "radius": 0.2,
                "bsdf": {"type": "fluorescent", "material": "poster-red"},
            },
        }
    )


def mesh_of_the_users(folder: Path) -> Scene:
    ball = trimesh.creation.icosphere(2)
    trimesh.Trimesh(ball.vertices, ball.faces[10:]).export(folder / "holed.ply")
    with pytest.warns(SceneNotice, match="not watertight"):
        scene = load_scene("cornell-mesh", parameters={"mesh": "holed.ply"})
    return scene.with_settings(width=12, height=8)


SCENES = (
    *(built_in, settings_changed, file_by_relative_path, materials_from_outside),
    *(matte, scene_dict, mesh_of_the_users),
)
Images = dict[str, tuple[np.ndarray, np.ndarray]]


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> Images:
    """The radiance of each scene rendered here, and by another process that got it as a pickle."""
    here, pickles = {}, []
    root = tmp_path_factory.mktemp("scenes")
    for make in SCENES:
        folder = root / make.__name__
        folder.mkdir()
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            scene = make(folder)
        pickles.append(folder / "scene.pickle")
        pickles[-1].write_bytes(pickle.dumps(scene))
        here[make.__name__] = render(scene, **OPTIONS).dataset["radiance"].values
    other = subprocess.run(
        [sys.executable, "-W", "error", "-c", RENDER, *pickles], cwd=root, capture_output=True, text=True
    )
    assert (other.returncode, other.stderr) == (0, "")
    return {path.parent.name: (here[path.parent.name], np.load(path.with_suffix(".npy"))) for path in pickles}


@pytest.mark.parametrize("make", SCENES, ids=lambda make: make.__name__)
def test_another_process_renders_the_same_image(make: Callable[[Path], Scene], images: Images) -> None:
    """Expected: bit for bit, and not by darkness."""
    here, there = images[make.__name__]
    assert here[1].max() > 0
    np.testing.assert_array_equal(here, there)


def test_recipes_name_files_by_absolute_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    recipe = file_by_relative_path(tmp_path).recipe
    assert (recipe.source, recipe.base) == (tmp_path / "room.xml", tmp_path)
    assert materials_from_outside(tmp_path).recipe.library == (tmp_path / "mine",)
    mesh = mesh_of_the_users(tmp_path).recipe.parameters["mesh"]
    assert mesh == str(tmp_path / "holed.ply")


def test_a_scene_is_parsed_once_in_each_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: nothing is read again for a scene just loaded, and copies of one that was sent share its nodes."""
    scene = load_scene(write_room(tmp_path))
    parsed = []
    parse = fluorspar.scene.recipe.parse_scene

    def counted(source: Any, parameters: Any, *, where: str) -> Any:
        parsed.append(source)
        return parse(source, parameters, where=where)

    monkeypatch.setattr(fluorspar.scene.recipe, "parse_scene", counted)
    assert scene.with_settings(spp=2).nodes is scene.nodes
    assert parsed == []
    sent = pickle.loads(pickle.dumps(scene))
    smaller = sent.with_settings(width=3)
    assert smaller.nodes is sent.nodes is sent.nodes
    assert len(parsed) == 1


def test_the_variant_of_the_caller_stays(tmp_path: Path) -> None:
    data = pickle.dumps(load_scene(write_room(tmp_path)))
    with use_variant("scalar_rgb"):
        assert len(pickle.loads(data).nodes.nodes) > 1
        assert mi.variant() == "scalar_rgb"


def test_a_dict_may_change_after_it_was_loaded() -> None:
    ball = {"type": "sphere", "radius": 1.0}
    scene = load_scene(
        {
            "type": "scene",
            "camera": {"type": "perspective", "film": {"type": "hdrfilm", "filter": {"type": "box"}}},
            "sky": {"type": "constant"},
            "ball": ball,
        }
    )
    ball["radius"] = 2.0
    assert scene.recipe.source["ball"]["radius"] == 1.0


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("room.xml", lambda path: path.write_text(path.read_text().replace('"3"', '"4"', 1))),
        ("lamp.xml", lambda path: path.write_text(path.read_text().replace("400:1", "400:3"))),
        ("ball.ply", lambda path: trimesh.creation.icosphere(2).export(path)),
        ("twin.ply", lambda path: trimesh.creation.icosphere(2).export(path)),
        ("room.xml", Path.unlink),
        ("lamp.xml", Path.unlink),
        ("ball.ply", Path.unlink),
    ],
)
def test_files_that_have_changed_or_are_gone_are_said(
    name: str, change: Callable[[Path], Any], tmp_path: Path
) -> None:
    """Expected: an error that names the file, and no other picture."""
    data = pickle.dumps(load_scene(write_room(tmp_path)))
    change(tmp_path / name)
    with pytest.raises(SceneError, match=rf"(?s){name}.*(loaded before|load the scene again)"):
        render(pickle.loads(data), **OPTIONS)


def test_a_changed_spectrum_does_not_matter(tmp_path: Path) -> None:
    """Materials and lights travel with the scene as they were loaded."""
    data = pickle.dumps(load_scene(write_room(tmp_path)))
    before = render(pickle.loads(data), **OPTIONS).dataset["radiance"].values
    (tmp_path / "paint.spd").write_text("400 0.1\n700 0.1\n")
    np.testing.assert_array_equal(render(pickle.loads(data), **OPTIONS).dataset["radiance"].values, before)
