"""Which lights and materials of a scene are exchanged, by which id."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluorspar import Material, Scene, Spectrum, load_scene
from fluorspar.bispectral.library import material
from fluorspar.errors import FluorsparWarning, OptionError
from fluorspar.scene.relit import exchangeable, relit
from fluorspar.spectral.wavelengths import Wavelengths
from xml_scene import xml_scene

GREY = '<bsdf type="diffuse" id="grey"><spectrum name="reflectance" value="0.8"/></bsdf>'
MASK = '<bsdf type="mask" id="{}"> <float name="opacity" value="0.9"/> {} </bsdf>'
TWOSIDED = '<bsdf type="twosided" id="{}"> {} </bsdf>'


def ball(number: int, bsdf: str) -> str:
    return f'<shape type="sphere" id="ball-{number}"> {bsdf} </shape>'


def names(scene: Scene) -> list[str]:
    """Of the materials of the balls."""
    found = exchangeable(scene)
    return [getattr(found[f"ball-{number}"], "name", "none") for number in range(3)]


@pytest.mark.parametrize("around", [TWOSIDED, MASK], ids=["matte", "general"])
class TestOneBsdfInSeveral:
    """Two BSDFs hold the same one, which is on a shape by itself, too."""

    @pytest.fixture
    def scene(self, around: str, tmp_path: Path) -> Path:
        outer = [around.format("a", GREY), around.format("b", '<ref id="grey"/>')]
        balls = [ball(number, f'<ref id="{name}"/>') for number, name in enumerate(("a", "b", "grey"))]
        return xml_scene(tmp_path, *outer, *balls)

    @pytest.mark.filterwarnings("ignore:the material for 'a' is not used:fluorspar.errors.SceneNotice")
    @pytest.mark.parametrize(
        ("given", "expected"),
        [
            ({"a": "poster-red"}, ["poster-red", "grey", "grey"]),
            ({"b": "poster-red"}, ["grey", "poster-red", "grey"]),
            ({"grey": "poster-red"}, ["poster-red"] * 3),
            ({"grey": "poster-red", "b": "gray-45"}, ["poster-red", "gray-45", "poster-red"]),
            ({"a": "poster-red", "ball-0": "gray-45"}, ["gray-45", "grey", "grey"]),
        ],
    )
    def test_the_surfaces_that_load_scene_gives_it_to(
        self, given: dict[str, Any], expected: list[str], scene: Path
    ) -> None:
        assert names(relit(load_scene(scene), materials=given)) == expected
        assert names(load_scene(scene, materials=given)) == expected

    def test_again(self, scene: Path) -> None:
        """The ids stay those of the surfaces."""
        once = relit(load_scene(scene), materials={"a": "poster-red"})
        assert names(relit(once, materials={"a": "gray-45"})) == ["gray-45", "grey", "grey"]
        assert names(relit(once, materials={"grey": "gray-45"})) == ["gray-45"] * 3


def test_what_two_parts_of_a_blend_share_has_the_ids_of_both(tmp_path: Path) -> None:
    parts = [MASK.format("a", GREY), MASK.format("b", '<ref id="grey"/>')]
    blend = f'<bsdf type="blendbsdf" id="blend"> <float name="weight" value="0.5"/> {" ".join(parts)} </bsdf>'
    assert set(exchangeable(load_scene(xml_scene(tmp_path, ball(0, blend))))) == {"ball-0", "blend", "grey"}


def test_surfaces_with_one_material_share_its_row() -> None:
    """As where they are loaded so: sums at the camera are those of rows, and the image is the same, bit for bit."""
    orange = material("poster-orange")
    box = relit(load_scene("cornell-box"), materials={"left-wall": orange, "floor": orange})
    assert sum(part is orange for part in box.materials) == 1


def test_surfaces_say_their_materials() -> None:
    """Also of a general scene, whose table is another one afterwards."""
    loaded = load_scene("still-life")
    changed = relit(loaded, materials={"marker": "poster-orange", "toner": "gray-45"})

    def fronts(scene: Scene) -> dict[str, str]:
        return {s.name: scene.materials[s.front].name for s in scene.surfaces if s.front >= 0}

    assert fronts(changed) == fronts(loaded) | {"print": "gray-45"}


TINTED = '<spectrum name="specular_reflectance" value="0.5"/>'


def test_a_highlight_is_no_material(tmp_path: Path) -> None:
    """The id of a plastic means its base; a dye has no equation there, whatever the highlight's colour."""
    bsdf = f'<bsdf type="plastic" id="glossy"> {TINTED} </bsdf>'
    scene = load_scene(xml_scene(tmp_path, ball(0, bsdf)))
    for key in ("glossy", "ball-0"):
        changed = relit(scene, materials={key: "gray-45"})
        assert getattr(exchangeable(changed)["glossy"], "name", "") == "gray-45"
        assert [part.name for part in changed.materials] == [
            "gray-45",
            "glossy",
        ]  # the second is the highlight
        with pytest.raises(OptionError, match="cannot get a fluorescent material"):
            relit(scene, materials={key: "poster-red"})


def test_the_tint_of_glass_is_no_material(tmp_path: Path) -> None:
    tints = TINTED + TINTED.replace("reflectance", "transmittance")
    scene = load_scene(xml_scene(tmp_path, ball(0, f'<bsdf type="dielectric" id="glass"> {tints} </bsdf>')))
    assert exchangeable(scene) == {"ball-0": "its colour is that of glass"}


def test_what_is_on_no_surface_any_more_is_not_computed(tmp_path: Path) -> None:
    """A general scene, in which a material without data for the grid makes way."""
    narrow = '<bsdf type="diffuse" id="a"><spectrum name="reflectance" value="400:0.1, 500:0.5"/></bsdf>'
    scene = load_scene(xml_scene(tmp_path, ball(0, MASK.format("mask", narrow))))
    changed = relit(scene, materials={"a": Material("flat", Spectrum.constant(0.5))})
    assert [matrix.reflectance[0] for matrix in changed.matrices(Wavelengths(700, 720, 10))][-1] == 0.5


class TestWhatIsRefused:
    @pytest.mark.parametrize("what", ["lights", "materials", "concentration"])
    @pytest.mark.parametrize("key", [5, None])
    def test_what_is_no_id(self, what: str, key: Any) -> None:
        with pytest.raises(OptionError, match=f"there is no .*'{key}'"):
            relit(load_scene("cornell-box"), **{what: {key: 0.5 if what != "materials" else "gray-45"}})

    def test_a_light_by_two_ids(self) -> None:
        with pytest.raises(OptionError, match=r"changed twice[\s\S]*'light' and 'shape 'light' \(obj\)'"):
            relit(load_scene("cornell-box"), lights={"light": 2, "shape 'light' (obj)": "D65"})

    @pytest.mark.parametrize("factor", [1e300, 1e40])
    def test_a_light_that_is_too_bright(self, factor: float) -> None:
        with pytest.raises(OptionError, match="'light' is too bright for single precision"):
            relit(load_scene("cornell-box"), lights={"light": factor})

    def test_a_library_that_is_one_name(self) -> None:
        with pytest.raises(OptionError, match="library is not readable"):
            relit(load_scene("cornell-box"), library="folder")

    @pytest.mark.parametrize("factor", ["a", None, 1j, [1], np.ones(2)])
    def test_what_is_no_number(self, factor: Any) -> None:
        with pytest.raises(OptionError, match="concentration of 'left-wall' is impossible"):
            relit(load_scene("cornell-box"), concentration={"left-wall": factor})


def test_a_concentration_of_what_does_not_luminesce_is_said() -> None:
    """Expected: a warning, as of a mixture without dyes in a study of many materials; of 1 there is none."""
    box = load_scene("cornell-box")
    with pytest.warns(FluorsparWarning, match="concentration of 'back-wall' changes nothing") as warned:
        relit(box, concentration={"back-wall": 2, "left-wall": 0.5})
    assert len(warned) == 1
    relit(box, concentration={"back-wall": 1, "left-wall": 0})
