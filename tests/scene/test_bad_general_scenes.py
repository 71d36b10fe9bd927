"""Scenes with impossible general surfaces, or odd ones: a clear error when they are loaded, or the right result."""

from pathlib import Path

import numpy as np
import pytest

from fluorspar import load_scene
from fluorspar.errors import ApproximationWarning, SceneError
from fluorspar.scene.lobes.textures import sigmoid
from fluorspar.scene.variants import use_variant

GREY = {"type": "diffuse", "reflectance": 0.5}
WAVELENGTHS = np.array([450.0, 550.0, 650.0])


def scene_with(bsdf, light=None):
    return {
        "type": "scene",
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
        "light": light or {"type": "constant"},
        "plate": {"type": "rectangle", "bsdf": bsdf},
    }


def picture(folder: Path, texels) -> str:
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        suffix = "png" if texels.dtype == np.uint8 else "exr"
        mi.Bitmap(texels).write(str(folder / f"texels.{suffix}"))
    return str(folder / f"texels.{suffix}")


def textured(file, **more):
    return {"type": "diffuse", "reflectance": {"type": "bitmap", "filename": file, **more}}


def colours_of(scene):
    return sigmoid(scene.lobes.colours[:, :3], WAVELENGTHS)


INSIDE = {"mask": 1, "twosided": 1, "bumpmap": 1, "normalmap": 1, "blendbsdf": 2}
PLUGINS = ["plastic", "roughplastic", "dielectric", "thindielectric", "roughdielectric", "conductor"]
PLUGINS += ["roughconductor", "principled", "principledthin", "null", "fluorescent", *INSIDE]


@pytest.mark.parametrize("plugin", PLUGINS)
def test_a_misspelt_property_is_found_at_loading(plugin):
    bsdf = {"type": plugin, "alfa": 0.3} | {f"inner{i}": GREY for i in range(INSIDE.get(plugin, 0))}
    if plugin in ("bumpmap", "normalmap"):
        bsdf["normalmap"] = {"type": "checkerboard"}
    if plugin == "blendbsdf":
        bsdf["weight"] = 0.5
    with pytest.raises(SceneError, match=r"(?s)alfa.*'plate'"):
        load_scene(scene_with(bsdf))


@pytest.mark.parametrize(
    "bsdf",
    [
        {"type": "mask"},
        {"type": "twosided"},
        {"type": "twosided", "inner": {"type": "dielectric"}},
        {"type": "blendbsdf", "weight": 0.5, "inner": GREY},
        {"type": "conductor", "material": "unobtainium"},
        {"type": "roughconductor", "material": "Au", "eta": 1.3},
        {"type": "roughplastic", "distribution": "gauss"},
        {"type": "fluorescent", "material": "poster-red", "distribution": "gauss"},
        {"type": "hair"},
        {"type": "mask", "opacity": {"type": "bitmap", "filename": "nowhere.png"}, "inner": GREY},
        textured("nowhere.png"),
        textured(__file__),
        {
            "type": "fluorescent",
            "material": "poster-red",
            "concentration": {"type": "bitmap", "filename": "no.png"},
        },
        *({"type": plugin, "int_ior": index} for plugin in PLUGINS[:5] for index in (0.0, -1.5)),
        {"type": "fluorescent", "material": "poster-red", "int_ior": 0.0},
        {"type": "fluorescent", "material": "poster-red", "int_ior": -1.5},
    ],
)
def test_what_mitsuba_cannot_build_is_named_with_its_shape(bsdf):
    with pytest.raises(SceneError, match="'plate'"):
        load_scene(scene_with(bsdf))


def test_texels_that_are_no_numbers(tmp_path):
    texels = np.full((4, 4, 3), 0.5, np.float32)
    texels[1, 2, 0] = np.nan
    file = picture(tmp_path, texels)
    with pytest.raises(SceneError, match=r"(?s)not finite.*'plate'.*1 of 48"):
        load_scene(scene_with(textured(file)))
    with pytest.raises(SceneError, match=r"(?s)not finite.*'light'.*1 of 48"):
        load_scene(scene_with(GREY, {"type": "envmap", "filename": file}))


@pytest.mark.parametrize("channels", [1, 3])
def test_values_above_1_are_clipped_and_said(channels, tmp_path):
    texels = np.full((2, 2, channels), 0.25, np.float32)
    texels[0, 0] = 7.5
    with pytest.warns(ApproximationWarning, match=r"'plate'.*0.25 to 7.5; they are clipped to 0 to 1"):
        scene = load_scene(scene_with(textured(picture(tmp_path, texels))))
    assert colours_of(scene)[0] == pytest.approx(1, abs=2e-3)
    assert colours_of(scene)[3] == pytest.approx(0.25, abs=2e-3)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_one_texel_with_alpha_or_without(channels, tmp_path):
    file = picture(tmp_path, np.full((1, 1, channels), 188, np.uint8))  # sRGB of 0.503
    assert colours_of(load_scene(scene_with(textured(file)))) == pytest.approx(0.503, abs=3e-3)


def test_raw_colours_are_linear(tmp_path):
    file = picture(tmp_path, np.full((2, 2, 3), 51, np.uint8) + np.arange(3, dtype=np.uint8))
    raw = colours_of(load_scene(scene_with(textured(file, raw=True))))
    assert raw == pytest.approx(0.2, abs=1e-2)
    assert raw[0, 0] > raw[0, 2]  # more at 450 nm: they stay colours


def test_a_wide_picture(tmp_path):
    file = picture(tmp_path, np.full((2, 16384, 3), 100, np.uint8))
    scene = load_scene(scene_with(textured(file)))
    assert len(scene.lobes.colours) == 2 * 16384
    assert scene.lobes.textures[0].width == 16384


def test_many_texels_on_metal(tmp_path, monkeypatch):
    """Each has a row for each angle, and a log holds only so many rows."""
    monkeypatch.setattr("fluorspar.scene.lobes.reader._MOST_ROWS", 2000)
    bitmaps = []
    for width in (2, 10):
        (folder := tmp_path / str(width)).mkdir()
        bitmaps.append(picture(folder, np.full((4, width, 3), 100, np.uint8)))
    few, many = bitmaps
    load_scene(scene_with(textured(many)))
    metal = {"type": "conductor", "specular_reflectance": {"type": "bitmap", "filename": few}}
    load_scene(scene_with(metal))
    metal["specular_reflectance"]["filename"] = many
    with pytest.raises(SceneError, match="texture on metal are too large"):
        load_scene(scene_with(metal))


def test_a_sky_of_one_texel_or_of_none(tmp_path):
    bright = picture(tmp_path, np.full((1, 1, 3), 2.0, np.float32))
    sky = load_scene(scene_with(GREY, {"type": "envmap", "filename": bright})).lobes.skies
    assert [scale.shape for scale in sky.values()] == [(3, 2)]  # as Mitsuba enlarges it
    dark = picture(tmp_path, np.zeros((4, 8, 3), np.float32))
    (night,) = load_scene(scene_with(GREY, {"type": "envmap", "filename": dark})).lobes.skies.values()
    assert night.shape == (4, 8)  # no column is lost, or counted twice
    assert not night.any()
    with pytest.raises(SceneError, match=r"(?s)negative.*'light'.*-1"):
        load_scene(scene_with(GREY, {"type": "envmap", "filename": bright, "scale": -1.0}))
    file = picture(tmp_path, np.full((4, 8, 3), -0.5, np.float32))
    with pytest.warns(ApproximationWarning, match=r"'light'.*clipped to 0 or more"):
        load_scene(scene_with(GREY, {"type": "envmap", "filename": file}))


@pytest.mark.parametrize(
    ("light", "fault"),
    [
        (
            {"type": "spot", "texture": {"type": "checkerboard"}},
            r"texture of a 'spot' is not a picture.*'light'",
        ),
        ({"type": "projector"}, r"irradiance of a 'projector' is not a picture.*'light'"),
        ({"type": "projector", "scale": -2.0, "irradiance": {"type": "bitmap"}}, r"negative.*'light'.*-2"),
        ({"type": "sunsky"}, r"not supported.*'light'.*envmap, projector.*make an environment map"),
    ],
)
def test_lights_that_throw_no_picture(light, fault, tmp_path):
    if "irradiance" in light:
        light = light | {
            "irradiance": {"type": "bitmap", "filename": picture(tmp_path, np.ones((2, 2, 3), "f4"))}
        }
    with pytest.raises(SceneError, match=f"(?s){fault}"):
        load_scene(scene_with({"type": "plastic"}, light))


def test_many_rough_plastics_are_built_once(monkeypatch):
    built = []
    monkeypatch.setattr("fluorspar.scene.lobes.probes.build", lambda state, index: built.append(index))
    plastics = [{"type": "roughplastic", "alpha": 0.1 + i / 100} for i in range(9)]
    plates = {f"plate{i}": {"type": "sphere", "bsdf": bsdf} for i, bsdf in enumerate(plastics)}
    load_scene(scene_with({"type": "roughplastic"}) | plates)
    assert len(built) == 2  # with alpha, and without


def test_six_deep():
    bsdf = {"type": "fluorescent", "material": "poster-red"}
    for plugin in ("twosided", "normalmap", "bumpmap", "blendbsdf", "mask"):
        bsdf = {"type": plugin, "inner": bsdf}
        if plugin.endswith("map"):
            bsdf["normalmap"] = {"type": "checkerboard"}
        if plugin == "blendbsdf":
            bsdf |= {"other": GREY, "weight": 0.5}
    scene = load_scene(scene_with(bsdf))
    front, _ = next(iter(scene.lobes.of_surface.values()))
    assert len(front) == 3  # two materials, and light that goes straight through
