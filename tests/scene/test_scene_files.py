"""Files that a scene names: where they are looked for, when, and that Mitsuba forgets it afterwards."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mitsuba as mi
import pytest

from fluorspar import load_scene, render, trace
from fluorspar.errors import FluorsparError, SceneError
from fluorspar.scene.variants import use_variant
from xml_scene import QUAD, mesh, xml_scene

GRID = "400:700:100"
PAINTED = '<bsdf type="fluorescent"> <string name="donaldson" value="sheet.csv"/> </bsdf>'
DYED = '<shape type="sphere"> <bsdf type="fluorescent"> <string name="{}" value="{}"/> </bsdf> </shape>'
SHEET = "# quantity: band\n# step: 100\n,400,500,600\n400,0.5,0,0\n500,0.2,0.4,0\n600,0.1,0.1,0.3\n"


def folders() -> list[str]:
    return [str(folder) for folder in mi.file_resolver()]


@pytest.fixture(autouse=True)
def resolver_as_before() -> Iterator[None]:
    with use_variant("scalar_rgb"):
        before = folders()
    yield
    assert folders() == before


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    """A scene whose mesh and measured sheet lie in a folder that it names."""
    (tmp_path / "assets/meshes").mkdir(parents=True)
    (tmp_path / "assets/meshes/quad.obj").write_text(QUAD)
    (tmp_path / "assets/sheet.csv").write_text(SHEET)
    (tmp_path / "scene").mkdir()
    return xml_scene(tmp_path / "scene", '<path value="../assets"/>', mesh("meshes/quad.obj", PAINTED))


class TestPath:
    @pytest.mark.parametrize("method", ["paths", "staged"])
    def test_renders(self, scene_file: Path, method: str) -> None:
        image = render(scene_file, wavelengths="400:600:100", method=method)
        assert image.component("direct_luminescence").values.any()

    def test_traces(self, scene_file: Path) -> None:
        assert trace(scene_file, wavelengths="400:600:100").image().total().values.any()

    def test_in_another_process(self, scene_file: Path) -> None:
        """What another process reads again: the pickled scene holds no nodes."""
        again = pickle.loads(pickle.dumps(load_scene(scene_file)))
        assert render(again, wavelengths="400:600:100").total().values.any()

    def test_materials_too(self, scene_file: Path, tmp_path: Path) -> None:
        (tmp_path / "assets/grey.csv").write_text(
            "# fluorspar-material: 1\nwavelength,reflectance\n300,0.5\n780,0.5"
        )
        scene_file.write_text(
            scene_file.read_text().replace("donaldson", "material").replace("sheet", "grey")
        )
        assert load_scene(scene_file).materials[0].reflectance.at(550) == 0.5

    def test_with_an_included_file(self, scene_file: Path, tmp_path: Path) -> None:
        """The file that is included is found in the folder, and its mesh too."""
        part = f'<scene version="3.0.0"> {mesh("meshes/quad.obj", PAINTED)} </scene>'
        (tmp_path / "assets/part.xml").write_text(part)
        outer = xml_scene(
            tmp_path / "scene",
            '<default name="folder" value="../assets"/> <path value="$folder"/> <include filename="part.xml"/>',
        )
        assert render(outer, wavelengths="400:600:100").total().values.any()

    def test_a_later_scene_does_not_get_the_files_of_an_earlier_one(
        self, scene_file: Path, tmp_path: Path
    ) -> None:
        load_scene(scene_file)
        (tmp_path / "other").mkdir()
        other = xml_scene(tmp_path / "other", mesh("meshes/quad.obj"))
        with pytest.raises(SceneError, match=r"(?s)does not exist.*'mesh'.*meshes/quad\.obj"):
            load_scene(other)

    @pytest.mark.parametrize("part", ['<bsdf type="diffuse">', mesh("no-such.obj")])
    def test_also_after_failures(self, part: str, tmp_path: Path) -> None:
        """The fixture looks whether Mitsuba's folders are those of before."""
        (tmp_path / "assets").mkdir()
        with pytest.raises(FluorsparError):
            load_scene(xml_scene(tmp_path, '<path value="assets"/>', part))


def test_missing_meshes_are_found_before_anything_is_computed(tmp_path: Path) -> None:
    """The average would warn."""
    metal = '<shape type="sphere"> <bsdf type="conductor"/> </shape>'
    with pytest.raises(SceneError, match="the file of a shape does not exist"):
        load_scene(xml_scene(tmp_path, metal, mesh("no-such.obj")), matte=True)


@pytest.mark.parametrize(
    "part",
    [
        mesh("m" * 300 + ".obj"),
        DYED.format("material", "m" * 300),
        DYED.format("donaldson", "m" * 300 + ".csv"),
    ],
)
def test_names_that_are_too_long_for_a_file(part: str, tmp_path: Path) -> None:
    with pytest.raises(FluorsparError, match="mmm"):
        load_scene(xml_scene(tmp_path, part))


def test_the_name_of_a_scene_gets_a_suggestion() -> None:
    with pytest.raises(SceneError, match="did you mean cornell-box"):
        load_scene("cornel-box")


def test_a_link_to_itself_is_no_scene(tmp_path: Path) -> None:
    (tmp_path / "loop.xml").symlink_to("loop.xml")
    with pytest.raises(SceneError, match="the scene file does not exist"):
        load_scene(tmp_path / "loop.xml")


@pytest.mark.parametrize("part", [{"x": None}, {"x": {"type": "constant", "radiance": None}}])
def test_none_is_refused(part: dict[str, Any]) -> None:
    """Mitsuba's parser ends the process at it."""
    with pytest.raises(SceneError, match=r"is None\n  where:    scene dict, 'x'"):
        load_scene({"type": "scene", **part})
