"""Scenes that carry the contents of their files: rendered by a fresh Python after the files are gone."""

from __future__ import annotations

import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
import trimesh
from PIL import Image

from fluorspar import Scene, load_scene, render
from fluorspar.errors import SceneError, SceneNotice
from fluorspar.files.temporary import temporary_folder

OPTIONS: dict[str, Any] = {"spp": 2, "seed": 3, "wavelengths": "400:700:50", "excitation": "grid"}
RENDER = f"""
import os, pickle, sys
from pathlib import Path
import numpy as np
import fluorspar
from fluorspar.files.temporary import temporary_folder
for path in map(Path, sys.argv[1:]):
    scene = pickle.loads(path.read_bytes())
    np.save(path.with_suffix(".npy"), fluorspar.render(scene, **{OPTIONS!r}).dataset["radiance"].values)
    del scene
print(os.listdir(temporary_folder()))
"""
SENSOR = """<sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0.3, 0.1, 5" target="0, 0, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <integer name="width" value="12"/> <integer name="height" value="8"/>
    <rfilter type="box"/> </film> </sensor>"""


def with_files_everywhere(folder: Path) -> Scene:
    """An included file, a mesh beside the scene's folder, a picture in a folder of its own, a measured spectrum."""
    for name in ("mit Leerzeichen", "méshes", "пикчи"):
        (folder / name).mkdir()
    home = folder / "mit Leerzeichen"
    trimesh.creation.icosphere(1).export(folder / "méshes" / "büste 1.ply")
    squares = np.kron([[0, 1], [1, 0]], np.full((4, 4), 255)).astype(np.uint8)
    Image.fromarray(np.stack([squares, 255 - squares, squares // 2], -1)).save(folder / "пикчи" / "wood.png")
    (home / "paint.spd").write_text("400 0.2\n500 0.7\n700 0.4\n")
    (home / "lamp.xml").write_text(
        '<scene version="3.0.0"> <emitter type="constant"> <spectrum name="radiance" value="400:1, 700:2"/>'
        "</emitter> </scene>"
    )
    path = home / "room.xml"
    path.write_text(
        f"""<scene version="3.0.0"> <path value="../пикчи"/> {SENSOR} <default name="size" value="1"/>
        <include filename="lamp.xml"/>
        <shape type="ply" id="ball"> <string name="filename" value="../méshes/büste 1.ply"/>
            <transform name="to_world"> <rotate x="0.6" y="0.8" angle="33"/> <scale value="$size"/> </transform>
            <bsdf type="fluorescent"> <spectrum name="reflectance" filename="paint.spd"/>
                <spectrum name="emission" value="500:0, 550:0.01, 600:0"/>
                <spectrum name="excitation" value="400:0, 450:1, 500:0"/> </bsdf> </shape>
        <shape type="rectangle"> <transform name="to_world"> <scale value="3"/> </transform>
            <bsdf type="diffuse"> <texture name="reflectance" type="bitmap">
                <string name="filename" value="wood.png"/> </texture> </bsdf> </shape> </scene>""",
        encoding="utf-8",
    )
    return load_scene(path, parameters={"size": 0.7})


def a_dict(folder: Path) -> Scene:
    """A mesh by a relative name, a transform and a colour."""
    trimesh.creation.icosphere(1).export(folder / "ball.ply")
    mi.set_variant("scalar_rgb")
    turned = mi.ScalarTransform4f().rotate([1, 2, 3], 40).scale([1, 0.5, 1])
    view = mi.ScalarTransform4f().look_at(origin=[0.3, 0.1, 5], target=[0, 0, 0], up=[0, 1, 0.2])
    film = {"type": "hdrfilm", "width": 12, "height": 8, "filter": {"type": "box"}}
    paint = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.5, 0.4]}}
    return load_scene(
        {
            "type": "scene",
            "camera": {"type": "perspective", "fov": 40.0, "to_world": view, "film": film},
            "lamp": {"type": "point", "position": [0, 2, 4], "intensity": {"type": "d65"}},
            "ball": {"type": "ply", "filename": "ball.ply", "to_world": turned, "bsdf": paint},
        }
    )


def mesh_of_the_users(folder: Path) -> Scene:
    ball = trimesh.creation.icosphere(2)
    trimesh.Trimesh(ball.vertices, ball.faces[10:]).export(folder / "holed.ply")
    with pytest.warns(SceneNotice, match="not watertight"):
        scene = load_scene("cornell-mesh", parameters={"mesh": "holed.ply"})
    return scene.with_settings(width=12, height=8)


SCENES = (with_files_everywhere, a_dict, mesh_of_the_users)
Images = dict[str, tuple[np.ndarray, np.ndarray]]


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> Images:
    """The radiance of each scene rendered here, and by another process that got nothing but a pickle."""
    here, pickles = {}, []
    root = tmp_path_factory.mktemp("pickles")
    for make in SCENES:
        folder = tmp_path_factory.mktemp(make.__name__)
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            scene = make(folder)
        here[make.__name__] = render(scene, **OPTIONS).dataset["radiance"].values
        pickles.append(root / f"{make.__name__}.pickle")
        pickles[-1].write_bytes(pickle.dumps(scene.carried()))
        shutil.rmtree(folder)
    other = subprocess.run(
        [sys.executable, "-W", "error", "-c", RENDER, *pickles], cwd=root, capture_output=True, text=True
    )
    assert (other.returncode, other.stderr) == (0, "")
    assert other.stdout.strip() == "['.in-use-by-fluorspar']"
    return {path.stem: (here[path.stem], np.load(path.with_suffix(".npy"))) for path in pickles}


@pytest.mark.parametrize("make", SCENES, ids=lambda make: make.__name__)
def test_another_process_needs_no_file(make: Callable[[Path], Scene], images: Images) -> None:
    """Expected: bit for bit, and not by darkness."""
    here, there = images[make.__name__]
    assert here[1].max() > 0
    np.testing.assert_array_equal(here, there)


@pytest.mark.parametrize("change", [Path.unlink, lambda path: path.write_bytes(path.read_bytes() + b" ")])
def test_a_mesh_that_is_gone_or_another_is_named(
    change: Callable[[Path], Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = a_dict(tmp_path)
    change(tmp_path / "ball.ply")
    with pytest.raises(SceneError, match=r"(?s)ball\.ply (is gone|has changed).*load the scene again"):
        scene.carried()


def test_a_file_that_two_nodes_read_travels_once(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(4)
    ball.export(tmp_path / "ball.ply")
    shapes = "".join(
        f'<shape type="ply"> <string name="filename" value="ball.ply"/> <transform name="to_world"> '
        f'<translate x="{x}"/> </transform> </shape>'
        for x in range(4)
    )
    path = tmp_path / "room.xml"
    path.write_text(f'<scene version="3.0.0"> {SENSOR} <emitter type="constant"/> {shapes} </scene>')
    size = (tmp_path / "ball.ply").stat().st_size
    assert size < len(pickle.dumps(load_scene(path).carried())) < 1.5 * size


def test_the_files_go_with_the_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    before = set(temporary_folder().iterdir())
    carried = pickle.loads(pickle.dumps(a_dict(tmp_path).carried()))
    assert set(temporary_folder().iterdir()) == before
    assert len(carried.nodes.nodes) > 1
    assert set(temporary_folder().iterdir()) != before
    del carried
    assert set(temporary_folder().iterdir()) == before
