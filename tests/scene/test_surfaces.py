"""Which material and which light is on which surface: rows, sides, overrides."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluorspar import Material, Scene, Spectrum, Wavelengths, load_scene
from fluorspar.errors import MaterialError, SceneError, SpectrumError
from fluorspar.scene.surfaces import ABSORBS, NO_LIGHT, Surface

CAMERA: dict[str, Any] = {
    "type": "perspective",
    "film": {"type": "hdrfilm", "width": 8, "height": 8, "filter": {"type": "box"}},
}
SKY: dict[str, Any] = {"type": "constant", "radiance": {"type": "uniform", "value": 2.0}}


def scene(
    *, light: bool = True, materials: Any = None, matte: bool = False, **parts: dict[str, Any]
) -> Scene:
    lit = {"sky": SKY} if light else {}
    return load_scene({"type": "scene", "camera": CAMERA, **lit, **parts}, materials=materials, matte=matte)


def grey(value: float) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "spectrum", "value": value}}


def surface(of: Scene, name: str) -> Surface:
    (match,) = [s for s in of.surfaces if s.name == name]
    return match


def reflectance(of: Scene, row: int) -> float:
    return of.materials[row].reflectance.at(550)


class TestRows:
    def test_each_surface_has_its_row(self) -> None:
        loaded = scene(a={"type": "sphere", "bsdf": grey(0.2)}, b={"type": "cube", "bsdf": grey(0.7)})
        assert [reflectance(loaded, surface(loaded, name).front) for name in "ab"] == pytest.approx(
            [0.2, 0.7]
        )
        assert [surface(loaded, name).back for name in "ab"] == [ABSORBS, ABSORBS]
        assert [surface(loaded, name).light for name in "ab"] == [NO_LIGHT, NO_LIGHT]

    def test_a_shared_bsdf_is_one_row(self) -> None:
        shared = {"type": "ref", "id": "paint"}
        loaded = scene(
            paint=grey(0.3),
            a={"type": "sphere", "bsdf": shared},
            b={"type": "cube", "bsdf": shared},
            c={"type": "disk"},
        )
        assert surface(loaded, "a").front == surface(loaded, "b").front != surface(loaded, "c").front

    def test_equal_bsdfs_stay_apart(self) -> None:
        """Mitsuba merges equal BSDFs on load; an override of one must not reach the other."""
        paint = {**grey(0.3), "id": "first"}
        other = {**grey(0.3), "id": "second"}
        loaded = scene(
            a={"type": "sphere", "bsdf": paint},
            b={"type": "sphere", "bsdf": other},
            materials={"second": Material("new", Spectrum.constant(0.9))},
        )
        assert reflectance(loaded, surface(loaded, "a").front) == pytest.approx(0.3)
        assert reflectance(loaded, surface(loaded, "b").front) == 0.9

    def test_no_bsdf_is_mitsubas_default(self) -> None:
        loaded = scene(a={"type": "sphere"}, b={"type": "sphere"})
        assert surface(loaded, "a").front == surface(loaded, "b").front
        assert reflectance(loaded, surface(loaded, "a").front) == 0.5

    def test_a_lamp_without_bsdf_is_black(self) -> None:
        """As in Mitsuba; a lamp with a BSDF reflects."""
        lamp = {"type": "area", "radiance": {"type": "spectrum", "value": 3.0}}
        loaded = scene(
            a={"type": "sphere", "emitter": lamp}, b={"type": "sphere", "emitter": lamp, "bsdf": grey(0.4)}
        )
        assert surface(loaded, "a").front == ABSORBS
        assert reflectance(loaded, surface(loaded, "b").front) == pytest.approx(0.4)

    def test_fluorescent(self) -> None:
        table = {"type": "irregular", "wavelengths": "300,500,780", "values": "0,1,0"}
        dye = {
            "type": "fluorescent",
            "reflectance": 0.25,
            "emission": table,
            "excitation": table,
            "concentration": 0.5,
        }
        loaded = scene(a={"type": "sphere", "bsdf": dye})
        material = loaded.materials[surface(loaded, "a").front]
        assert material.fluorescent
        assert material.reflectance.at(500) == 0.25
        assert material.fluorophores[0].emission.at(500) == 0.5
        assert material.fluorophores[0].excitation.integral() == pytest.approx(1)

    def test_fluorescent_from_the_library(self) -> None:
        loaded = scene(
            a={
                "type": "sphere",
                "bsdf": {"type": "fluorescent", "material": "poster-red:0.4,poster-green:0.6"},
            }
        )
        assert len(loaded.materials[0].fluorophores) == 2

    def test_fluorescent_from_a_donaldson_file(self, tmp_path: Path) -> None:
        """The file is found next to the scene file."""
        (tmp_path / "sheet.csv").write_text(
            "# quantity: band\n# step: 100\n,400,500,600\n400,0.5,0,0\n500,0.2,0.4,0\n600,0.1,0.1,0.3\n"
        )
        (tmp_path / "scene.xml").write_text(
            """<scene version="3.0.0"> <sensor type="perspective"> <film type="hdrfilm">
                <rfilter type="box"/> </film> </sensor>
            <emitter type="constant"> <spectrum name="radiance" value="1"/> </emitter>
            <shape type="sphere">
            <bsdf type="fluorescent"> <string name="donaldson" value="sheet.csv"/> </bsdf> </shape>
            </scene>"""
        )
        (loaded,) = load_scene(tmp_path / "scene.xml").materials
        band = loaded.on(Wavelengths(400, 600, 100)).band()
        np.testing.assert_allclose(band, [[0.5, 0, 0], [0.2, 0.4, 0], [0.1, 0.1, 0.3]], atol=1e-12)


class TestSides:
    def test_one_bsdf_in_twosided_is_one_row(self) -> None:
        loaded = scene(a={"type": "rectangle", "bsdf": {"type": "twosided", "nested": grey(0.6)}})
        assert surface(loaded, "a").front == surface(loaded, "a").back
        assert len(loaded.materials) == 1

    def test_two_bsdfs_are_front_and_back(self, tmp_path: Path) -> None:
        (tmp_path / "scene.xml").write_text(
            """<scene version="3.0.0"> <sensor type="perspective"> <film type="hdrfilm">
                <rfilter type="box"/> </film> </sensor>
            <emitter type="constant"> <spectrum name="radiance" value="1"/> </emitter>
            <shape type="rectangle" id="a"> <bsdf type="twosided">
            <bsdf type="diffuse"> <spectrum name="reflectance" value="0.1"/> </bsdf>
            <bsdf type="diffuse"> <spectrum name="reflectance" value="0.8"/> </bsdf> </bsdf> </shape>
            </scene>"""
        )
        loaded = load_scene(tmp_path / "scene.xml")
        assert reflectance(loaded, surface(loaded, "a").front) == pytest.approx(0.1)
        assert reflectance(loaded, surface(loaded, "a").back) == pytest.approx(0.8)

    def test_fluorescent_within_twosided(self) -> None:
        nested = {"type": "fluorescent", "material": "poster-red"}
        loaded = scene(a={"type": "rectangle", "bsdf": {"type": "twosided", "nested": nested}})
        assert surface(loaded, "a").front == surface(loaded, "a").back == 0
        assert loaded.materials[0].fluorescent


class TestOverrides:
    new = Material("new", Spectrum.constant(0.9))

    def test_by_shape(self) -> None:
        loaded = scene(
            a={"type": "sphere", "bsdf": grey(0.2)},
            b={"type": "sphere", "bsdf": grey(0.2)},
            materials={"a": self.new},
        )
        assert reflectance(loaded, surface(loaded, "a").front) == 0.9
        assert surface(loaded, "a").back == ABSORBS
        assert reflectance(loaded, surface(loaded, "b").front) == pytest.approx(0.2)

    def test_by_bsdf_of_several_shapes(self) -> None:
        shared = {"type": "ref", "id": "paint"}
        loaded = scene(
            paint=grey(0.3),
            a={"type": "sphere", "bsdf": shared},
            b={"type": "cube", "bsdf": shared},
            materials={"paint": self.new},
        )
        assert (
            reflectance(loaded, surface(loaded, "a").front)
            == reflectance(loaded, surface(loaded, "b").front)
            == 0.9
        )

    def test_of_a_twosided_shape_both_sides(self) -> None:
        loaded = scene(
            a={"type": "rectangle", "bsdf": {"type": "twosided", "nested": grey(0.6)}},
            materials={"a": self.new},
        )
        assert surface(loaded, "a").front == surface(loaded, "a").back
        assert reflectance(loaded, surface(loaded, "a").back) == 0.9

    @pytest.mark.parametrize("which", ["outer", "inner"])
    def test_of_a_twosided_bsdf(self, which: str) -> None:
        bsdf = {"type": "twosided", "id": "outer", "nested": {**grey(0.6), "id": "inner"}}
        loaded = scene(a={"type": "rectangle", "bsdf": bsdf}, materials={which: self.new})
        assert (
            reflectance(loaded, surface(loaded, "a").front)
            == reflectance(loaded, surface(loaded, "a").back)
            == 0.9
        )

    def test_the_shape_wins_over_its_bsdf(self) -> None:
        bsdf = {**grey(0.2), "id": "paint"}
        other = Material("other", Spectrum.constant(0.7))
        loaded = scene(
            a={"type": "sphere", "bsdf": bsdf},
            b={"type": "sphere", "bsdf": {"type": "ref", "id": "paint"}},
            materials={"a": self.new, "paint": other},
        )
        assert reflectance(loaded, surface(loaded, "a").front) == 0.9
        assert reflectance(loaded, surface(loaded, "b").front) == 0.7

    def test_of_a_lamp(self) -> None:
        """Emission and a material on one shape: both count."""
        lamp = {"type": "area", "radiance": {"type": "spectrum", "value": 3.0}}
        loaded = scene(a={"type": "sphere", "emitter": lamp}, light=False, materials={"a": "poster-red"})
        assert loaded.materials[surface(loaded, "a").front].fluorescent
        assert surface(loaded, "a").light == 0

    def test_what_is_overridden_need_not_be_supported(self) -> None:
        loaded = scene(
            a={"type": "sphere", "bsdf": {"type": "conductor", "id": "metal"}}, materials={"metal": self.new}
        )
        assert reflectance(loaded, surface(loaded, "a").front) == 0.9

    def test_a_shape_that_is_overridden_need_not_be_supported(self) -> None:
        loaded = scene(a={"type": "sphere", "bsdf": {"type": "conductor"}}, materials={"a": self.new})
        assert reflectance(loaded, surface(loaded, "a").front) == 0.9

    def test_by_name_and_mixture(self) -> None:
        loaded = scene(
            a={"type": "sphere"},
            b={"type": "sphere"},
            materials={"a": "poster-red", "b": "poster-red:0.5,white-85:0.5"},
        )
        assert [m.name for m in loaded.materials] == ["poster-red", "poster-red:0.5,white-85:0.5"]

    def test_unknown_id(self) -> None:
        with pytest.raises(SceneError, match=r"(?s)'lft-wall'.*left-wall.*did you mean left-wall"):
            scene(**{"left-wall": {"type": "sphere"}}, materials={"lft-wall": "poster-red"})

    def test_unknown_material(self) -> None:
        with pytest.raises(MaterialError, match=r"(?s)poster-rad.*did you mean poster-red"):
            scene(a={"type": "sphere"}, materials={"a": "poster-rad"})


class TestLights:
    def test_every_kind(self) -> None:
        loaded = scene(
            light=False,
            a={"type": "sphere", "emitter": {"type": "area", "radiance": {"type": "uniform", "value": 1.5}}},
            b={"type": "point", "position": [0, 1, 0], "intensity": {"type": "uniform", "value": 2.5}},
            c={"type": "spot", "intensity": {"type": "uniform", "value": 3.5}},
            d={
                "type": "directional",
                "direction": [0, 1, 0],
                "irradiance": {"type": "uniform", "value": 4.5},
            },
            e={"type": "constant", "radiance": {"type": "uniform", "value": 5.5}},
        )
        lights = {light.plugin: (light.spectrum.at(550), light.unit) for light in loaded.lights}
        assert lights == {
            "area": (1.5, "W m-2 sr-1 nm-1"),
            "point": (2.5, "W sr-1 nm-1"),
            "spot": (3.5, "W sr-1 nm-1"),
            "directional": (4.5, "W m-2 nm-1"),
            "constant": (5.5, "W m-2 sr-1 nm-1"),
        }
        assert loaded.lights[surface(loaded, "a").light].plugin == "area"

    def test_each_shape_has_its_lamp(self) -> None:
        lamps = {
            name: {
                "type": "sphere",
                "emitter": {"type": "area", "radiance": {"type": "uniform", "value": value}},
            }
            for name, value in (("a", 1.0), ("b", 2.0), ("c", 1.0))
        }
        loaded = scene(light=False, **lamps)
        assert [loaded.lights[surface(loaded, name).light].spectrum.at(500) for name in "abc"] == [1, 2, 1]
        assert len({surface(loaded, name).light for name in "abc"}) == 3

    def test_none(self) -> None:
        with pytest.raises(SceneError, match="has no light"):
            scene(light=False, a={"type": "sphere"})

    def test_negative(self) -> None:
        lamp = {"type": "irregular", "wavelengths": "400,700", "values": "1,-1"}
        with pytest.raises((SceneError, SpectrumError), match="negat"):
            scene(a={"type": "point", "intensity": lamp})

    @pytest.mark.parametrize("plugin", ["directionalarea", "sunsky"])
    def test_unsupported(self, plugin: str) -> None:
        with pytest.raises(SceneError, match=f"'{plugin}' is not supported"):
            scene(light=False, a={"type": plugin})


class TestUnsupported:
    def test_bsdf_is_named_with_its_shape(self) -> None:
        with pytest.raises(SceneError, match=r"(?s)'circular' is not supported.*'teapot'"):
            scene(teapot={"type": "sphere", "bsdf": {"type": "circular"}})

    def test_texture_is_named_with_its_shape(self) -> None:
        varies = {"type": "volume", "volume": {"type": "gridvolume", "filename": "smoke.vol"}}
        bsdf = {"type": "diffuse", "reflectance": varies}
        with pytest.raises(SceneError, match=r"(?s)smoke.vol.*'teapot'"):
            scene(teapot={"type": "sphere", "bsdf": bsdf})

    def test_medium(self) -> None:
        medium = {"type": "homogeneous", "albedo": {"type": "constvolume", "value": 0.5}}
        with pytest.raises(SceneError, match="participating media"):
            scene(a={"type": "sphere", "bsdf": {"type": "null"}, "interior": medium})

    @pytest.mark.parametrize(
        ("inside", "matte", "fault"),
        [
            ({"type": "sphere"}, True, "is not supported with matte"),
            ({"type": "sphere", "lamp": {"type": "area"}}, False, r"(?s)copies of a light.*'a' \(sphere\)"),
            (
                {
                    "type": "cube",
                    "bsdf": grey(0.5) | {"reflectance": {"type": "mesh_attribute", "name": "face_c"}},
                },
                False,
                r"(?s)colours of its own.*'a' \(cube\)",
            ),
        ],
    )
    def test_copies(self, inside: dict[str, Any], matte: bool, fault: str) -> None:
        group = {"type": "shapegroup", "id": "group", "a": inside}
        with pytest.raises(SceneError, match=fault):
            scene(group=group, b={"type": "instance", "ref": {"type": "ref", "id": "group"}}, matte=matte)

    def test_reflectance_above_1(self) -> None:
        with pytest.raises(SpectrumError, match=r"(?s)greater than 1.*'teapot'"):
            scene(teapot={"type": "sphere", "bsdf": grey(1.2)})

    @pytest.mark.parametrize(
        "given",
        [
            {"material": "poster-red", "reflectance": 0.5},
            {"material": "poster-red", "donaldson": "x.csv"},
            {"reflectance": 0.5, "emission": 0.5},
            {"excitation": 0.5},
        ],
    )
    def test_contradictory_fluorescent_surfaces(self, given: dict[str, Any]) -> None:
        with pytest.raises(MaterialError, match=r"(?s)(contradict|belong together).*'teapot'"):
            scene(teapot={"type": "sphere", "bsdf": {"type": "fluorescent", **given}})
