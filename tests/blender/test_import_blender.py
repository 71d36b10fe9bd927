"""Scenes built in Blender, imported and rendered, against Cycles' own images of them."""

from __future__ import annotations

import os
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from fluorspar.bispectral.library import material, materials
from fluorspar.blender.importing.import_blender import import_blender
from fluorspar.blender.process import BlenderProcess
from fluorspar.colour.observers import matching_functions
from fluorspar.errors import ApproximationWarning, SceneError
from fluorspar.files.temporary import temporary_folder
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene

pytestmark = pytest.mark.blender

BLENDER = os.environ.get("BLENDER")
SAMPLES = 128
BLOCKS = 4


@pytest.fixture(scope="module")
def blender() -> Iterator[BlenderProcess]:
    with BlenderProcess(Path(__file__).with_name("built_scenes.py"), BLENDER) as process:
        yield process


def luminance_of_cycles(file: Path) -> np.ndarray:
    with OpenEXR.File(str(file)) as image:
        channels = image.channels()
        pixels = channels["RGBA" if "RGBA" in channels else "RGB"].pixels
    return np.asarray(pixels[..., :3] @ [0.212671, 0.715160, 0.072169])


def luminance(scene: Path) -> np.ndarray:
    """Of a render, as rgb counts it: 1 is the luminance of a spectrum that is 1 everywhere."""
    image = render(load_scene(scene), wavelengths="400:700:10", spp=SAMPLES).total()
    at, observer = matching_functions(2)
    weights = np.interp(image.wavelength, at, observer[:, 1])
    return np.asarray(image.transpose("y", "x", "wavelength").values @ weights / weights.sum())


def blocks(image: np.ndarray) -> np.ndarray:
    height, width = image.shape
    return image.reshape(BLOCKS, height // BLOCKS, BLOCKS, width // BLOCKS).mean(axis=(1, 3))


@pytest.mark.parametrize(
    "kind",
    [
        "rectangle", "ellipse", "point", "spot", "sun", "world", "environment",
        "textured", "glowing", "shapes", "shifted", "upright", "parallel", "focused",
        "cut_out", "formats", "inside_a_lamp",
    ],
)  # fmt: skip
def test_images_are_those_of_cycles(blender: BlenderProcess, tmp_path: Path, kind: str) -> None:
    """Rationale: lights, surfaces, textures and cameras mean the same. Expected: means of blocks within noise.

    The noise is at most 1 % of the mean of the image in a block, and 0.3 % in the mean.
    """
    file, out = tmp_path / f"{kind} ü.blend", tmp_path / "cycles.exr"
    blender.ask("build", kind=kind, blend=str(file), out=str(out), samples=SAMPLES)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ApproximationWarning)  # area lights are seen
        scene = import_blender(file, tmp_path / "scene", blender=BLENDER)
    theirs, ours = luminance_of_cycles(out), luminance(scene)
    assert ours.shape == theirs.shape
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.005)
    np.testing.assert_allclose(blocks(ours), blocks(theirs), rtol=0.01, atol=0.015 * theirs.mean())


def test_what_is_left_out_is_listed(blender: BlenderProcess, tmp_path: Path) -> None:
    file, folder = tmp_path / "surfaces.blend", tmp_path / "scene"
    blender.ask("build", kind="surfaces", blend=str(file))
    with pytest.warns(ApproximationWarning) as caught:
        scene = import_blender(file, folder, blender=BLENDER)
    listed = (folder / "import.txt").read_text(encoding="utf-8")
    assert "material '6 BsdfTranslucent' has the shader translucent: it is matte instead" in listed
    assert all(str(one.message) in listed for one in caught)
    assert any(made.fluorescent for made in load_scene(scene).materials)


def test_a_damaged_file_leaves_everything_as_it_was(blender: BlenderProcess, tmp_path: Path) -> None:
    file, folder = tmp_path / "sun.blend", tmp_path / "scene"
    blender.ask("build", kind="sun", blend=str(file))
    before = import_blender(file, folder, blender=BLENDER).read_bytes()
    file.write_bytes(b"BLENDER-v304" + b"\0" * 100)
    with pytest.raises(SceneError, match="cannot open"):
        import_blender(file, folder, blender=BLENDER)
    assert (folder / "scene.xml").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene", "sun.blend"]
    assert len(list(temporary_folder().glob("blender-*"))) == 1  # that of the fixture


def test_no_camera(blender: BlenderProcess, tmp_path: Path) -> None:
    file = tmp_path / "empty.blend"
    blender.ask("build", kind="no_camera", blend=str(file))
    with pytest.raises(SceneError, match=r"no camera[\s\S]*empty.blend[\s\S]*add a camera"):
        import_blender(file, tmp_path / "scene", blender=BLENDER)


def test_the_panel_says_what_fluoresces(blender: BlenderProcess, tmp_path: Path) -> None:
    """Rationale: the add-on of the examples is the way without custom properties. Expected: they are what it sets."""
    file, panel = tmp_path / "sun.blend", Path(__file__).parents[2] / "examples" / "blender_panel.py"
    blender.ask("build", kind="sun", blend=str(file))
    answer = blender.ask("use_panel", panel=str(panel), blend=str(file))
    assert answer["shown"] == ["poster-red", 0.5]
    assert answer["names"] == [name for name in materials() if material(name).fluorescent]
    scene = load_scene(import_blender(file, tmp_path / "scene", blender=BLENDER))
    assert [made.name for made in scene.materials if made.fluorescent] == ["poster-red"]
    half = ET.parse(tmp_path / "scene" / "scene.xml").find(
        ".//bsdf[@type='fluorescent']/float[@name='concentration']"
    )
    assert half is not None
    assert float(half.get("value", "")) == 0.5
