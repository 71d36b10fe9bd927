"""Spectra out of every kind of property a Mitsuba scene can hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from fluorspar import Scene, Spectrum, load_scene
from fluorspar.errors import ApproximationWarning, SceneError, SpectrumError
from fluorspar.scene.variants import use_variant

SKY = '<emitter type="constant"> <spectrum name="radiance" value="1"/> </emitter>'
FILM = '<sensor type="perspective"> <film type="hdrfilm"> <rfilter type="box"/> </film> </sensor>'


def loaded(folder: Path, *, surface: str = "", light: str = "", matte: bool = False) -> Scene:
    """A sphere with `surface` as its reflectance under a sky with `light` as its radiance, as XML properties."""
    (folder / "scene.xml").write_text(
        f"""<scene version="3.0.0"> {FILM} <emitter type="constant"> {light} </emitter>
        <shape type="sphere" id="ball"> <bsdf type="diffuse"> {surface} </bsdf> </shape> </scene>"""
    )
    return load_scene(folder / "scene.xml", matte=matte)


def reflectance(folder: Path, prop: str) -> Spectrum:
    return loaded(folder, surface=prop).materials[0].reflectance


def radiance(folder: Path, prop: str) -> Spectrum:
    return loaded(folder, light=prop).lights[0].spectrum


def mitsuba_says(
    plugin: dict[str, Any] | float, wavelengths: list[float], *, light: bool = False
) -> list[float]:
    """What Mitsuba's own spectral variant evaluates a texture to."""
    with use_variant("scalar_spectral"):
        texture = mi.load_dict({"type": "constant", "radiance": plugin} if light else plugin)
        si = mi.SurfaceInteraction3f()
        values = []
        for w in wavelengths:
            si.wavelengths = [w] * 4
            values.append(float(np.array(texture.eval(si))[0]))
    return values


def test_numbers(tmp_path: Path) -> None:
    for prop in ('<float name="reflectance" value="0.3"/>', '<spectrum name="reflectance" value="0.3"/>'):
        spectrum = reflectance(tmp_path, prop)
        assert spectrum.is_constant
        assert spectrum.at(300) == pytest.approx(0.3)


def test_nothing_is_mitsubas_default(tmp_path: Path) -> None:
    assert reflectance(tmp_path, "").at(300) == 0.5
    white = mitsuba_says(1.0, [400.0, 560.0], light=True)
    assert white != [1.0, 1.0], "a light of a plain number is D65 in Mitsuba"
    assert [radiance(tmp_path, "").at(w) for w in (400, 560)] == pytest.approx(white, rel=1e-5)
    number = radiance(tmp_path, '<float name="radiance" value="2"/>')
    assert [number.at(w) for w in (400, 560)] == pytest.approx([2 * w for w in white], rel=1e-5)


def test_a_light_of_0_is_dark(tmp_path: Path) -> None:
    assert not radiance(tmp_path, '<float name="radiance" value="0"/>').values.any()


def test_a_negative_light_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"light '.*' is negative"):
        radiance(tmp_path, '<float name="radiance" value="-1"/>')


def test_inline_table(tmp_path: Path) -> None:
    spectrum = reflectance(tmp_path, '<spectrum name="reflectance" value="300:0.1, 450:0.4, 800:0.2"/>')
    assert spectrum.support == (300, 800)
    assert [spectrum.at(w) for w in (300, 375, 450, 625)] == pytest.approx([0.1, 0.25, 0.4, 0.3])


def test_evenly_spaced_inline_table(tmp_path: Path) -> None:
    """Mitsuba takes an evenly spaced table for a `regular` spectrum; nothing may be lost or shifted."""
    spectrum = reflectance(
        tmp_path, '<spectrum name="reflectance" value="400:0.1, 500:0.4, 600:0.2, 700:0.3"/>'
    )
    assert spectrum.support == pytest.approx((400, 700), abs=0.01)
    assert [spectrum.at(w) for w in (400, 450, 500, 600, 700)] == pytest.approx(
        [0.1, 0.25, 0.4, 0.2, 0.3], abs=1e-4
    )


def test_table_for_a_light(tmp_path: Path) -> None:
    """The values are W m-2 sr-1 nm-1 as they stand; Mitsuba's scaling of lights must not enter."""
    spectrum = radiance(tmp_path, '<spectrum name="radiance" value="300:1, 450:4, 800:2"/>')
    assert [spectrum.at(w) for w in (300, 450, 800)] == pytest.approx([1, 4, 2])


def test_file(tmp_path: Path) -> None:
    (tmp_path / "paint.spd").write_text("# measured\n380 0.2\n500 0.6\n720 0.4\n")
    spectrum = reflectance(tmp_path, '<spectrum name="reflectance" filename="paint.spd"/>')
    assert spectrum.support == (380, 720)
    assert spectrum.at(440) == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("xml", "plugin"),
    [
        ('type="uniform"> <float name="value" value="0.35"/>', {"type": "uniform", "value": 0.35}),
        (
            'type="regular"> <float name="wavelength_min" value="400"/>'
            '<float name="wavelength_max" value="700"/>'
            '<string name="values" value="0.1, 0.5, 0.2, 0.4"/>',
            {
                "type": "regular",
                "wavelength_min": 400.0,
                "wavelength_max": 700.0,
                "values": "0.1, 0.5, 0.2, 0.4",
            },
        ),
        (
            'type="irregular"> <string name="wavelengths" value="400, 450, 700"/>'
            '<string name="values" value="0.1, 0.5, 0.2"/>',
            {"type": "irregular", "wavelengths": "400, 450, 700", "values": "0.1, 0.5, 0.2"},
        ),
        (
            'type="srgb"> <rgb name="color" value="0.8, 0.3, 0.1"/>',
            {"type": "srgb", "color": [0.8, 0.3, 0.1]},
        ),
    ],
)
def test_spectrum_plugins(xml: str, plugin: dict[str, Any], tmp_path: Path) -> None:
    spectrum = reflectance(tmp_path, f'<texture name="reflectance" {xml} </texture>')
    wavelengths = [410.0, 455.0, 543.0, 690.0]
    assert [spectrum.at(w) for w in wavelengths] == pytest.approx(mitsuba_says(plugin, wavelengths), abs=2e-4)


def test_rgb_reflectance(tmp_path: Path) -> None:
    """As Mitsuba's spectral variants see it, over the range for which its upsampling is meant."""
    spectrum = reflectance(tmp_path, '<rgb name="reflectance" value="0.8, 0.3, 0.1"/>')
    assert spectrum.support == (360, 830)
    wavelengths = [400.0, 480.0, 560.0, 700.0]
    expected = mitsuba_says({"type": "rgb", "value": [0.8, 0.3, 0.1]}, wavelengths)
    assert [spectrum.at(w) for w in wavelengths] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("value", ["1.5, 1, 1", "0.5, -0.1, 0"])
def test_impossible_rgb_reflectance(value: str, tmp_path: Path) -> None:
    with pytest.raises(SpectrumError, match=r"(?s)outside 0 to 1.*ball"):
        reflectance(tmp_path, f'<rgb name="reflectance" value="{value}"/>')


def test_rgb_light(tmp_path: Path) -> None:
    """A light of an rgb colour has the spectrum of D65 times that colour, as in Mitsuba."""
    spectrum = radiance(tmp_path, '<rgb name="radiance" value="2.0, 1.0, 0.5"/>')
    wavelengths = [400.0, 480.0, 560.0, 700.0]
    expected = mitsuba_says({"type": "rgb", "value": [2.0, 1.0, 0.5]}, wavelengths, light=True)
    assert [spectrum.at(w) for w in wavelengths] == pytest.approx(expected, rel=1e-3)


def test_blackbody(tmp_path: Path) -> None:
    """Planck's law in W m-2 sr-1 nm-1, in the ultraviolet too, where Mitsuba's plugin ends by default."""
    spectrum = radiance(
        tmp_path,
        '<spectrum type="blackbody" name="radiance"> <float name="temperature" value="5000"/> </spectrum>',
    )
    for nm in (300, 380, 560, 780):
        w = nm * 1e-9
        planck = (
            2
            * 6.62607015e-34
            * 2.99792458e8**2
            / w**5
            / np.expm1(6.62607015e-34 * 2.99792458e8 / (w * 1.380649e-23 * 5000))
        )
        assert spectrum.at(nm) == pytest.approx(planck * 1e-9, rel=2e-3)


def test_d65(tmp_path: Path) -> None:
    spectrum = radiance(
        tmp_path, '<spectrum type="d65" name="radiance"> <float name="scale" value="2"/> </spectrum>'
    )
    ratio = spectrum.at(460) / spectrum.at(560)
    assert ratio == pytest.approx(1.178, rel=0.005), "CIE D65: 117.8 at 460 nm, 100 at 560 nm"


def test_a_texture_that_varies(tmp_path: Path) -> None:
    name = '<string name="name" value="vertex_color"/>'
    with pytest.raises(SceneError, match=r"(?s)no attribute 'vertex_color'"):
        reflectance(tmp_path, f'<texture name="reflectance" type="mesh_attribute"> {name} </texture>')


class TestMatte:
    """`--matte`: what is not matte, or varies, becomes a diffuse surface of its average, with a warning each."""

    def test_texture(self, tmp_path: Path) -> None:
        checks = """<texture name="reflectance" type="checkerboard">
            <spectrum name="color0" value="0.2"/> <spectrum name="color1" value="0.6"/> </texture>"""
        with pytest.warns(ApproximationWarning, match="'ball'"):
            made = loaded(tmp_path, surface=checks, matte=True)
        # 512 random points, one half each: 0.4 +- 0.2 / sqrt(512)
        assert made.materials[0].reflectance.at(550) == pytest.approx(0.4, abs=4 * 0.2 / np.sqrt(512))

    def test_lossless_mirror(self, tmp_path: Path) -> None:
        (tmp_path / "scene.xml").write_text(
            f"""<scene version="3.0.0"> {FILM} {SKY} <shape type="sphere" id="ball">
            <bsdf type="conductor"> <string name="material" value="none"/> </bsdf> </shape> </scene>"""
        )
        with pytest.warns(ApproximationWarning, match="'ball'"):
            made = load_scene(tmp_path / "scene.xml", matte=True)
        np.testing.assert_allclose(made.materials[0].reflectance.values, 1, atol=1e-5)

    def test_plastic_reflects_less_than_all(self, tmp_path: Path) -> None:
        (tmp_path / "scene.xml").write_text(
            f"""<scene version="3.0.0"> {FILM} {SKY} <shape type="sphere" id="ball">
            <bsdf type="plastic"> <spectrum name="diffuse_reflectance" value="0.5"/> </bsdf> </shape>
            </scene>"""
        )
        with pytest.warns(ApproximationWarning, match="'ball'"):
            made = load_scene(tmp_path / "scene.xml", matte=True)
        assert 0.3 < made.materials[0].reflectance.at(550) < 0.6

    def test_glossy_within_twosided(self, tmp_path: Path) -> None:
        (tmp_path / "scene.xml").write_text(
            f"""<scene version="3.0.0"> {FILM} {SKY}
                <shape type="rectangle" id="sheet"> <bsdf type="twosided">
            <bsdf type="roughplastic"/> </bsdf> </shape> </scene>"""
        )
        with pytest.warns(ApproximationWarning, match="'sheet'"):
            made = load_scene(tmp_path / "scene.xml", matte=True)
        assert made.surfaces[0].front == made.surfaces[0].back

    def test_environment_map(self, tmp_path: Path) -> None:
        """A map of radiance 2, 1, 0.5 (rgb) everywhere is a constant light of that colour."""
        image = np.broadcast_to(np.array([2.0, 1.0, 0.5], dtype=np.float32), (4, 8, 3)).copy()
        with use_variant("scalar_rgb"):
            mi.Bitmap(image).write(str(tmp_path / "sky.exr"))
        (tmp_path / "scene.xml").write_text(
            f"""<scene version="3.0.0"> {FILM} <shape type="sphere"/>
            <emitter type="envmap" id="sky"> <string name="filename" value="sky.exr"/> </emitter> </scene>"""
        )
        with pytest.warns(ApproximationWarning, match="'sky'"):
            (light,) = load_scene(tmp_path / "scene.xml", matte=True).lights
        expected = mitsuba_says({"type": "rgb", "value": [2.0, 1.0, 0.5]}, [450.0, 620.0], light=True)
        assert [light.spectrum.at(w) for w in (450, 620)] == pytest.approx(expected, rel=0.02)
