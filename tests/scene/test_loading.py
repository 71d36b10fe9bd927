"""Reading scenes: files, dicts, parameters, settings, cameras, and what bad scenes get."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import warnings
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from fluorspar import Material, Spectrum, Wavelengths, load_scene, register_plugins, render, trace
from fluorspar.errors import FluorsparWarning, OptionError, SceneError, SceneNotice
from fluorspar.paths.log import END
from fluorspar.paths.tracing.trace_scene import build_trace_scene
from fluorspar.scene.builtin import BUILTIN
from fluorspar.scene.variants import TRACE_VARIANTS, use_variant

GRID = Wavelengths(400, 700, 100)

SENSOR = """<sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <integer name="width" value="12"/> <integer name="height" value="8"/>
    <rfilter type="box"/> </film>
    <sampler type="independent"> <integer name="sample_count" value="4"/> </sampler> </sensor>"""
SKY = '<emitter type="constant"> <spectrum name="radiance" value="1"/> </emitter>'
POINT = '<emitter type="point"> <spectrum name="intensity" value="1"/> </emitter>'
BALL = '<shape type="sphere" id="ball"/>'


def write(folder: Path, *parts: str) -> Path:
    path = folder / "scene.xml"
    path.write_text(f'<scene version="3.0.0"> {" ".join(parts)} </scene>')
    return path


class TestSettings:
    def test_from_the_file(self, tmp_path: Path) -> None:
        integrator = (
            '<integrator type="path"> <integer name="max_depth" value="6"/>'
            '<integer name="rr_depth" value="4"/> </integrator>'
        )
        s = load_scene(write(tmp_path, integrator, SENSOR, SKY, BALL)).settings
        assert (s.width, s.height, s.spp, s.max_depth, s.rr_depth) == (12, 8, 4, 6, 4)

    def test_mitsubas_defaults(self, tmp_path: Path) -> None:
        sensor = '<sensor type="perspective"> <film type="hdrfilm"> <rfilter type="box"/> </film> </sensor>'
        s = load_scene(write(tmp_path, sensor, SKY, BALL)).settings
        assert (s.width, s.height, s.spp, s.max_depth, s.rr_depth) == (768, 576, 4, -1, 5)

    def test_direct_integrator(self, tmp_path: Path) -> None:
        assert (
            load_scene(write(tmp_path, '<integrator type="direct"/>', SENSOR, SKY, BALL)).settings.max_depth
            == 2
        )

    def test_overrides(self, tmp_path: Path) -> None:
        scene = load_scene(write(tmp_path, SENSOR, SKY, BALL))
        image = render(scene, size=(3, 2), spp=2, max_depth=3, rr_depth=7, wavelengths=GRID)
        assert image.shape == (7, 2, 3, 4)
        assert [image.attrs[key] for key in ("spp", "max_depth", "rr_depth")] == [2, 3, 7]
        assert scene.settings.width == 12, "the scene itself stays as it was"
        assert render(scene, spp=1, wavelengths=GRID).shape == (7, 8, 12, 4)

    @pytest.mark.parametrize(
        "bad",
        [{"spp": 0}, {"size": (0, 5)}, {"max_depth": 0}, {"max_depth": -2}, {"rr_depth": 0}, {"seed": -1}],
    )
    def test_out_of_range(self, bad: dict[str, Any], tmp_path: Path) -> None:
        scene = load_scene(write(tmp_path, SENSOR, SKY, BALL))
        with pytest.raises(OptionError, match=r"(?s)expected"):
            render(scene, wavelengths=GRID, **bad)

    @pytest.mark.parametrize(
        ("part", "notice"),
        [
            (SENSOR.replace('"box"', '"gaussian"'), "pixel filter 'gaussian' is replaced by a box"),
            (SENSOR + '<integrator type="volpath"/>', "integrator 'volpath' is replaced"),
            (
                SENSOR
                + '<integrator type="path"> <boolean name="hide_emitters" value="true"/> </integrator>',
                "hide_emitters is ignored",
            ),
            (SENSOR + SENSOR, "2 sensors; the first one.*--sensor"),
        ],
    )
    def test_notices(self, part: str, notice: str, tmp_path: Path) -> None:
        with pytest.warns(SceneNotice, match=notice) as notices:
            scene = load_scene(write(tmp_path, part, SKY, BALL))
        assert len(notices) == 1
        render(scene, spp=1, wavelengths=GRID)  # says nothing more


class TestBadScenes:
    def test_missing_file(self, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match=r"(?s)does not exist.*no-such\.xml.*fluorspar scenes"):
            load_scene(tmp_path / "no-such.xml")

    @pytest.mark.parametrize(
        "text", ["", "not xml", "<scene>", '<scene version="3.0.0"> <shape type="sphere"> </scene>']
    )
    def test_malformed(self, text: str, tmp_path: Path) -> None:
        (tmp_path / "bad.xml").write_text(text)
        with pytest.raises(SceneError, match=r"(?s)cannot read the scene.*bad\.xml"):
            load_scene(tmp_path / "bad.xml")

    def test_not_a_scene(self, tmp_path: Path) -> None:
        (tmp_path / "bad.xml").write_text('<shape version="3.0.0" type="sphere"/>')
        with pytest.raises(SceneError, match="not a scene"):
            load_scene(tmp_path / "bad.xml")
        with pytest.raises(SceneError, match="not a scene"):
            load_scene({"type": "sphere"})

    def test_unknown_plugin(self, tmp_path: Path) -> None:
        """Whether the parser or the builder notices, it is an error of the scene."""
        with pytest.raises(SceneError, match="no-such-shape"):
            render(
                load_scene(write(tmp_path, SENSOR, SKY, '<shape type="no-such-shape"/>')), wavelengths=GRID
            )

    def test_missing_mesh(self, tmp_path: Path) -> None:
        mesh = '<shape type="obj" id="m"> <string name="filename" value="no-such.obj"/> </shape>'
        with pytest.raises(SceneError, match=r"no-such\.obj"):
            render(load_scene(write(tmp_path, SENSOR, SKY, mesh)), wavelengths=GRID)

    @pytest.mark.parametrize("lamp", [SKY, POINT])
    def test_nothing_but_a_lamp(self, lamp: str, tmp_path: Path) -> None:
        """Pointless and legal: the sky, or darkness, which is said."""
        with nullcontext() if lamp == SKY else pytest.warns(FluorsparWarning, match="0 everywhere"):
            image = render(load_scene(write(tmp_path, SENSOR, lamp)), wavelengths=GRID)
        assert (image.total().values == (1 if lamp == SKY else 0)).all()

    @pytest.mark.parametrize(
        "bsdf",
        [
            '<bsdf type="diffuse"> <float name="reflectence" value="0.9"/> </bsdf>',
            '<bsdf type="fluorescent"> <float name="konzentration" value="2"/> </bsdf>',
        ],
    )
    def test_misspelt_property(self, bsdf: str, tmp_path: Path) -> None:
        """Stock Mitsuba refuses it; to leave it out silently would render another material."""
        with pytest.raises(
            SceneError, match=r"(?s)there is no property '(reflectence|konzentration)'.*reflectance"
        ):
            load_scene(write(tmp_path, SENSOR, SKY, f'<shape type="sphere"> {bsdf} </shape>'))

    def test_misspelt_property_of_a_light(self, tmp_path: Path) -> None:
        sky = '<emitter type="constant"> <float name="radience" value="2"/> </emitter>'
        with pytest.raises(SceneError, match="radience"):
            render(load_scene(write(tmp_path, SENSOR, sky, BALL)), wavelengths=GRID)

    def test_no_camera(self, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match="has no camera"):
            load_scene(write(tmp_path, SKY, BALL))

    @pytest.mark.parametrize("plugin", ["irradiancemeter", "radiancemeter", "batch"])
    def test_unsupported_camera(self, plugin: str, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match=f"'{plugin}' is not supported"):
            load_scene(write(tmp_path, SENSOR.replace('"perspective"', f'"{plugin}"'), SKY, BALL))

    def test_no_light(self, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match="has no light"):
            load_scene(write(tmp_path, SENSOR, BALL))

    def test_materials_for_a_loaded_scene(self, tmp_path: Path) -> None:
        with pytest.raises(OptionError, match="already loaded"):
            render(load_scene(write(tmp_path, SENSOR, SKY, BALL)), materials={"ball": "poster-red"})


class TestParameters:
    FILE = '<default name="grey" value="0.3"/> <default name="n" value="2"/>'
    PAINTED = (
        '<shape type="sphere"> <bsdf type="diffuse"> <spectrum name="reflectance" value="$grey"/>'
        "</bsdf> </shape>"
    )

    def test_defaults_and_values(self, tmp_path: Path) -> None:
        path = write(tmp_path, self.FILE, SENSOR.replace('value="4"', 'value="$n"'), SKY, self.PAINTED)
        for given, expected in ((None, (0.3, 2)), ({"grey": 0.6, "n": 16}, (0.6, 16))):
            scene = load_scene(path, parameters=given)
            assert (scene.materials[0].reflectance.at(500), scene.settings.spp) == pytest.approx(expected)

    def test_unknown_parameter(self, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match="gray"):
            load_scene(write(tmp_path, self.FILE, SENSOR, SKY, self.PAINTED), parameters={"gray": 0.6})

    @pytest.mark.parametrize("text", ["1,2,,3", "1, 2, 3,", ",1 2 3"])
    def test_a_list_with_an_empty_place_is_refused(self, text):
        with pytest.raises(OptionError, match="parameter place is a list of numbers with an empty place"):
            load_scene("furnace", parameters={"place": text})

    def test_missing_value(self, tmp_path: Path) -> None:
        with pytest.raises(SceneError, match="grey"):
            load_scene(write(tmp_path, SENSOR, SKY, self.PAINTED))


class TestBuiltinScenes:
    @pytest.mark.parametrize("name", BUILTIN)
    def test_loads_and_renders_without_a_warning(self, name: str) -> None:
        """Also on 300-780 nm: shipped tables reach that far."""
        image = render(name, size=(4, 4), spp=1, wavelengths="300:780:5")
        assert np.isfinite(image.total().values).all()

    def test_what_is_in_them(self) -> None:
        assert any(m.fluorescent for m in load_scene("cornell-box").materials)
        assert not any(m.fluorescent for m in load_scene("cornell-classic").materials)
        assert load_scene("cornell-box").settings.rr_depth == 10
        assert load_scene("cornell-box").settings.max_depth == -1

    def test_repr(self) -> None:
        text = repr(load_scene("cornell-box"))
        assert "512 x 512 pixels" in text
        assert "poster-red (fluorescent): on left-wall" in text


class TestDicts:
    def test_a_dict_is_the_same_scene(self, tmp_path: Path) -> None:
        with use_variant("scalar_rgb"):
            to_world = mi.ScalarTransform4f().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0])
        film = {"type": "hdrfilm", "width": 12, "height": 8, "filter": {"type": "box"}}
        sampler = {"type": "independent", "sample_count": 4}
        scene = load_scene(
            {
                "type": "scene",
                "camera": {
                    "type": "perspective",
                    "fov": 40.0,
                    "to_world": to_world,
                    "film": film,
                    "sampler": sampler,
                },
                "sky": {"type": "constant", "radiance": {"type": "spectrum", "value": 1.0}},
                "ball": {"type": "sphere", "bsdf": {"type": "fluorescent", "material": "poster-red"}},
            }
        )
        dyed = (
            '<shape type="sphere"> <bsdf type="fluorescent">'
            '<string name="material" value="poster-red"/> </bsdf> </shape>'
        )
        file = load_scene(write(tmp_path, SENSOR, SKY, dyed))
        from_dict, from_file = (
            render(s, seed=1, wavelengths="400:700:20").dataset["radiance"].values for s in (scene, file)
        )
        assert from_dict[2].any()
        np.testing.assert_allclose(from_dict, from_file, rtol=1e-5, atol=1e-6)


class TestPlugin:
    """Stock Mitsuba loads and previews the same file, once the plugin is registered."""

    DYED = """<shape type="sphere" id="ball"> <bsdf type="twosided"> <bsdf type="fluorescent">
        <spectrum name="reflectance" value="0.4"/> <spectrum name="emission" value="400:0, 550:0.5, 700:0"/>
        <spectrum name="excitation" value="400:0, 450:7, 500:0"/> <float name="concentration" value="0.5"/>
        </bsdf> </bsdf> </shape>"""

    @pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral"])
    def test_preview_is_the_diffuse_surface(self, variant: str, tmp_path: Path) -> None:
        path = write(tmp_path, SENSOR, SKY, self.DYED)
        grey = (
            '<bsdf type="twosided"> <bsdf type="diffuse"> <spectrum name="reflectance" value="0.4"/>'
            "</bsdf> </bsdf>"
        )
        plain = write(tmp_path / "..", SENSOR, SKY, f'<shape type="sphere"> {grey} </shape>')
        with use_variant(variant):
            register_plugins()
            ours, theirs = (
                np.array(
                    mi.render(
                        mi.load_file(str(file)), spp=16, seed=1, integrator=mi.load_dict({"type": "path"})
                    )
                )
                for file in (path, plain)
            )
        np.testing.assert_allclose(ours, theirs, rtol=1e-4)

    def test_library_material_in_stock_mitsuba(self, tmp_path: Path) -> None:
        dyed = (
            '<shape type="sphere"> <bsdf type="fluorescent">'
            '<string name="material" value="poster-red"/> </bsdf> </shape>'
        )
        with use_variant("scalar_spectral"):
            register_plugins()
            assert mi.load_file(str(write(tmp_path, SENSOR, SKY, dyed))) is not None

    def test_a_misspelt_property_is_refused(self, tmp_path: Path) -> None:
        """By stock Mitsuba, and by us: a dye that is silently left out would be the worst of all."""
        wrong = self.DYED.replace('name="emission"', 'name="emision"')
        with pytest.raises(Exception, match=r"emision|belong together"):
            load_scene(write(tmp_path, SENSOR, SKY, wrong))


class TestCameras:
    @pytest.mark.parametrize("plugin", ["perspective", "thinlens", "orthographic"])
    def test_all_see_what_stock_mitsuba_sees(self, plugin: str, tmp_path: Path) -> None:
        """A lamp of radiance 1 and 3 in two halves, seen directly: noise at edges only and where out of focus."""
        extra = {
            "thinlens": '<float name="aperture_radius" value="0.5"/> <float name="focus_distance" value="3"/>'
        }.get(plugin, "")
        fov = "" if plugin == "orthographic" else '<float name="fov" value="40"/>'
        sensor = SENSOR.replace('"perspective"', f'"{plugin}"').replace(
            '<float name="fov" value="40"/>', fov + extra
        )
        lamps = "".join(
            f"""<shape type="rectangle"> <transform name="to_world"> <scale x="0.4" y="0.7"/>
                <translate x="{x}" y="0.2"/> </transform>
            <emitter type="area"> <spectrum name="radiance" value="{value}"/> </emitter> </shape>"""
            for x, value in ((-0.4, 1.0), (0.4, 3.0))
        )
        path = write(tmp_path, sensor, lamps)
        ours = render(load_scene(path), spp=4096, max_depth=1, wavelengths=GRID, seed=1)
        with use_variant("llvm_ad_mono"):
            stock = np.array(
                mi.render(
                    mi.load_file(str(path)), spp=4096, seed=2, integrator=mi.load_dict({"type": "path"})
                )
            )[..., 0]
        # One sample scatters by up to 1.5 where lamps meet: 4096 know both to 0.023 and the largest of 96 is
        # 4 times that.
        np.testing.assert_allclose(ours.total().values[..., 0], stock, atol=0.14)
        assert abs(ours.total().values[..., 0].mean() - stock.mean()) < 0.01
        assert ours.total().values[..., 0].max() > 2

    def test_the_first_of_two_cameras(self, tmp_path: Path) -> None:
        """Whatever their ids: the first looks at the lamp, the second away from it."""
        first = SENSOR.replace('<sensor type="perspective">', '<sensor type="perspective" id="z">')
        second = SENSOR.replace('<sensor type="perspective">', '<sensor type="perspective" id="a">').replace(
            'target="0, 0, 0"', 'target="0, 0, 9"'
        )
        emitter = '<emitter type="area"> <spectrum name="radiance" value="1"/> </emitter>'
        lamp = f'<shape type="rectangle"> {emitter} </shape>'
        with pytest.warns(SceneNotice, match="2 sensors; the first one, 'z'"):
            scene = load_scene(write(tmp_path, first, second, lamp))
        assert render(scene, wavelengths=GRID).component("source").values.any()

    def test_one_of_two_cameras(self, tmp_path: Path) -> None:
        """By number or id; another process takes the same one."""
        towards = SENSOR.replace('<sensor type="perspective">', '<sensor type="perspective" id="z">')
        away = SENSOR.replace('<sensor type="perspective">', '<sensor type="perspective" id="a">').replace(
            'target="0, 0, 0"', 'target="0, 0, 9"'
        )
        emitter = '<emitter type="area"> <spectrum name="radiance" value="3"/> </emitter>'
        path = write(tmp_path, away, towards, SKY, f'<shape type="rectangle"> {emitter} </shape>')
        for sensor, sees in ((0, False), ("0", False), ("a", False), (1, True), ("z", True)):
            scene = load_scene(path, sensor=sensor)
            for same in (scene, pickle.loads(pickle.dumps(scene))):
                image = render(same, wavelengths=GRID, spp=1, size=(4, 4))
                assert (image.component("source").values == 3).any() == sees
        for unknown in (2, -1, "b"):
            with pytest.raises(OptionError, match=r"(?s)no such sensor.*0: 'a'.*1: 'z'"):
                load_scene(path, sensor=unknown)

    def test_crop_window(self, tmp_path: Path) -> None:
        crop = SENSOR.replace(
            '<rfilter type="box"/>',
            '<integer name="crop_width" value="5"/> <integer name="crop_height" value="3"/>'
            '<integer name="crop_offset_x" value="6"/>'
            '<integer name="crop_offset_y" value="2"/> <rfilter type="box"/>',
        )
        lamp = """<shape type="rectangle"> <transform name="to_world"> <translate x="1.7" y="0.3"/>
            </transform>
            <emitter type="area"> <spectrum name="radiance" value="1"/> </emitter> </shape>"""
        scene = load_scene(write(tmp_path, crop, lamp))
        assert (scene.settings.width, scene.settings.height) == (5, 3)
        part = render(scene, spp=4096, max_depth=1, wavelengths=GRID).total().values[..., 0]
        whole = (
            render(load_scene(write(tmp_path, SENSOR, lamp)), spp=4096, max_depth=1, wavelengths=GRID)
            .total()
            .values[..., 0]
        )
        np.testing.assert_allclose(part, whole[2:5, 6:11], atol=0.05)
        assert 0 < part.mean() < 1
        with pytest.raises(OptionError, match="crop window"):
            render(scene, size=(12, 8), wavelengths=GRID)

    @pytest.mark.parametrize("sampler", ["stratified", "multijitter", "orthogonal", "ldsampler"])
    def test_samplers_do_not_matter(self, sampler: str, tmp_path: Path) -> None:
        """As many samples are taken as are asked for, and spread as always."""
        scene = load_scene(write(tmp_path, SENSOR.replace('"independent"', f'"{sampler}"'), SKY, BALL))
        image = render(scene, spp=10, wavelengths=GRID)
        expected = render(load_scene(write(tmp_path, SENSOR, SKY, BALL)), spp=10, wavelengths=GRID)
        assert image.attrs["spp"] == 10
        assert np.array_equal(image.total(), expected.total())
        # a ball of reflectance 0.5 in light of radiance 1 shows 0.5, in front of 1
        ball = image.component("direct_reflection").values[..., 0]
        assert ball[3:5, 5:7].mean() == pytest.approx(0.5, abs=0.05)


class TestTraceScene:
    def test_rows_of_joined_meshes(self, tmp_path: Path) -> None:
        """Six meshes of one to three triangles, each side a material of its own, may be traced as one mesh
        or not.

        In light that comes straight along the line of sight each shows its own reflectance / pi, seen from
        the front and from the back.
        """
        shapes, front, back = "", {}, {}
        for k in range(6):
            corners = np.array([[k, 0, 0], [k + 1, 0, 0], [k + 1, 1, 0], [k, 1, 0]]) - [3, 0, 0]
            faces = [[1, 2, 3], [1, 3, 4]] if k % 2 else [[1, 2, 3], [1, 3, 4], [1, 3, 4]][: 2 + (k == 4)]
            text = "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(
                f"f {a} {b} {c}\n" for a, b, c in faces
            )
            (tmp_path / f"{k}.obj").write_text(text)
            front[f"f{k}"], back[f"b{k}"] = 0.1 + 0.1 * k, 0.9 - 0.1 * k
            shapes += f"""<shape type="obj"> <string name="filename" value="{k}.obj"/>
                <boolean name="face_normals" value="{k < 3}"/>
                <bsdf type="twosided"> <bsdf type="diffuse" id="f{k}"/> <bsdf type="diffuse" id="b{k}"/>
                </bsdf> </shape>""".lower()
        grey = {name: Material(name, Spectrum.constant(value)) for name, value in {**front, **back}.items()}
        for z, expected in ((5, list(front.values())), (-5, list(back.values())[::-1])):
            camera = f"""<sensor type="orthographic"> <transform name="to_world"> <scale x="3" y="3"/>
                <lookat origin="0, 0, {z}" target="0, 0, 0" up="0, 1, 0"/> </transform>
                <film type="hdrfilm"> <integer name="width" value="6"/> <integer name="height" value="6"/>
                <rfilter type="box"/> </film> </sensor>"""
            light = (
                '<emitter type="directional">'
                f'<vector name="direction" z="{-np.sign(z)}" x="0" y="0"/>'
                '<spectrum name="irradiance" value="1"/> </emitter>'
            )
            scene = load_scene(write(tmp_path, camera, light, shapes), materials=grey)
            image = render(scene, spp=4, max_depth=2, wavelengths=GRID).total().values[..., 0]
            seen = image[2] * np.pi
            assert seen.tolist() == pytest.approx(expected, rel=1e-5)

    def test_one_sided_surfaces_absorb_on_their_back(self, tmp_path: Path) -> None:
        scene = load_scene(write(tmp_path, SENSOR, SKY, BALL))
        with use_variant(TRACE_VARIANTS["llvm"]):
            rows = build_trace_scene(scene).rows
        assert np.count_nonzero(rows == 0) == 1, "the front"
        assert np.all((rows == 0) | (rows == END))


class TestImport:
    def check(self, code: str) -> subprocess.CompletedProcess[str]:
        env = {key: value for key, value in os.environ.items() if key != "DRJIT_LIBLLVM_PATH"}
        return subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=env
        )

    def test_importing_sets_no_variant_and_prints_nothing(self) -> None:
        done = self.check(
            "import fluorspar, mitsuba; from fluorspar import *; assert mitsuba.variant() is None, mitsuba.variant()"
        )
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")

    def test_mitsuba_may_be_imported_first(self) -> None:
        """Dr.Jit loads LLVM when it is imported. If that is one too old for it, it would abort the process."""
        done = self.check(
            "import mitsuba, fluorspar\n"
            "try: print(fluorspar.render('furnace', size=(4, 4), spp=1, wavelengths='400:700:100').shape)\n"
            "except fluorspar.errors.RendererError as err: print(err)"
        )
        assert done.returncode == 0, done.stderr[-2000:]
        assert "(7, 4, 4, 4)" in done.stdout or "DRJIT_LIBLLVM_PATH=" in done.stdout


def test_switching_variants_often_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mitsuba reloads its integrators with each switch; from the 144th on that would bring a warning of
    Dr.Jit's."""
    with use_variant("scalar_rgb"), warnings.catch_warnings(record=True) as notices:
        warnings.simplefilter("always")
        monkeypatch.setattr("drjit.ast._syntax_counter", 1000)
        with use_variant("llvm_ad_mono"):
            pass
    assert notices == []


class TestWhatIsNoScene:
    @pytest.mark.parametrize("source", [None, 5, [], b"x"])
    def test_the_legal_forms_are_listed(self, source: Any) -> None:
        for take in (load_scene, render, trace):
            with pytest.raises(SceneError, match=r"(?s)not a scene.*XML file.*cornell-box.*dict"):
                take(source)

    def test_a_loaded_scene_is_not_loaded_again(self) -> None:
        with pytest.raises(SceneError, match=r"(?s)loaded already.*use it as it is"):
            load_scene(load_scene("furnace"))  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        "options",
        [{"materials": 5}, {"materials": {"cavity": 5}}, {"parameters": "spp"}, {"library": "folder"}],
    )
    def test_options_of_another_type(self, options: dict[str, Any]) -> None:
        with pytest.raises(OptionError, match="expected"):
            load_scene("furnace", **options)
