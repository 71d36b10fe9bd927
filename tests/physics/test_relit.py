"""Light paths traced among some materials and lights give the images of others.

Rationale
    A traced path holds no spectrum. Its directions do not depend on the materials, and the chances of Russian roulette
    do, but they are part of the record; so exchanged spectra must give an unbiased image, with honest errors.
Expected
    Lights: the image that `render` makes of the changed scene with the same seed, bit for bit, since so few
    have no part in the choice of paths. Materials: images of independent seeds, z-scores of pixels N(0, 1): with n
    pixels their mean within 3.5 / sqrt(n), their standard deviation within 3.5 / sqrt(2 n) of 1.
Result
    Lights equal; z-scores -0.03 +- 0.03 and 1.007 (box), 0.00 and 1.002 (still life).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lab import FINE, bell, paint

from fluorspar import (
    COMPONENTS,
    LightPaths,
    Material,
    RenderJob,
    Spectrum,
    Wavelengths,
    load_paths,
    load_scene,
    material,
    trace,
)
from fluorspar.errors import FluorsparWarning, OptionError, SpectrumError
from fluorspar.rendering import render_job
from fluorspar.scene.relit import relit
from fluorspar.spectral.light import light_on

GRID = "400:700:20"
SLATE = Material("slate", Spectrum.constant(0.2))
# The lines of the ultraviolet lamp on a coarse grid are told of.
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*its light lies between:fluorspar.errors.ApproximationWarning"
)
SMALL: dict[str, Any] = {"size": (16, 12), "spp": 16, "wavelengths": GRID, "seed": 2}


@pytest.fixture(scope="module")
def box() -> LightPaths:
    return trace("cornell-box", **SMALL)


@pytest.fixture(scope="module")
def still() -> LightPaths:
    return trace("still-life", **SMALL)


@pytest.mark.parametrize(
    ("scene", "lights"),
    [
        ("cornell-box", {"light": "D65"}),
        ("cornell-box", {"light": ("D50", 0.25)}),
        ("cornell-box", {"shape 'light' (obj)": Spectrum([350, 400, 800], [0.0, 2.0, 1.0], "mine")}),
        ("still-life", {"uv-lamp": 3.0, "dusk": "D50"}),
        ("still-life", {"uv-lamp": 0, "dusk": 2}),
    ],
)
def test_lights_bit_for_bit(scene: str, lights: dict[str, Any]) -> None:
    paths = trace(scene, **SMALL)
    changed = relit(load_scene(scene).with_settings(width=16, height=12, spp=16), lights=lights)
    expected = render_job(RenderJob(changed, paths.job.grid, seed=2, component_errors=True))
    found = paths.image(lights=lights, component_errors=True)
    for name in ("radiance", "standard_error", "component_standard_error"):
        assert np.array_equal(found.dataset[name].values, expected.dataset[name].values), name


@pytest.mark.parametrize(
    ("scene", "change"),
    [
        (
            "cornell-box",
            {
                "lights": {"light": "D65"},
                "materials": {"left-wall": "poster-orange", "tall-block": "poster-green", "white": "gray-45"},
                "concentration": {"right-wall": 0.3},
            },
        ),
        (
            "still-life",
            {
                "lights": {"uv-lamp": 0.5, "dusk": "D50"},
                "materials": {"glaze": "poster-green", "marker": "poster-orange", "black": SLATE},
                "concentration": {"paper": 0.5},
            },
        ),
    ],
)
def test_lights_and_materials_at_once(scene: str, change: dict[str, Any]) -> None:
    """Against renders of the changed scene with other seeds, on another grid than that of tracing."""
    size, spp, seeds = (24, 18), 64, range(4)
    loaded = load_scene(scene)
    grid = "420:680:20"
    kept = [trace(loaded, size=size, spp=spp, seed=seed).image(**change, wavelengths=grid) for seed in seeds]
    changed = relit(loaded.with_settings(width=size[0], height=size[1], spp=spp), **change)
    fresh = [render_job(RenderJob(changed, kept[0].wavelengths, seed=100 + seed)) for seed in seeds]
    difference = sum(image.total().values for image in kept) - sum(image.total().values for image in fresh)
    variance = sum(image.dataset.standard_error.values**2 for image in (*kept, *fresh))
    walls = ~np.any([image.component("source").values.any(axis=-1) for image in (*kept, *fresh)], axis=0)
    difference, variance = difference[walls, 5], variance[walls, 5]
    z, n = difference / np.sqrt(variance), difference.size
    # Skew: the sums of both sides have it alike, so it cancels in the difference.
    assert abs(z.mean()) < 3.5 / np.sqrt(n)
    # Neighbours share errors, which are right on average and not for each of the unlike pixels of so small an image.
    assert abs(np.sqrt(np.mean(difference**2) / np.mean(variance)) - 1) < 3.5 / np.sqrt(2 * n) + 0.02


def test_a_factor_is_a_factor(box: LightPaths) -> None:
    bright, plain = box.image(lights={"light": 4}), box.image()
    np.testing.assert_array_equal(bright.dataset.radiance.values, 4 * plain.dataset.radiance.values)


@pytest.mark.parametrize("ids", [("light", "shape 'light' (obj)"), ("shape 'light' (obj)", "light")])
def test_a_lamp_is_named_once(ids: tuple[str, str]) -> None:
    """By the id that it was traced with, also if it is changed again by that of its shape."""
    paths = trace("cornell-box", size=(4, 4), spp=1, lights={ids[0]: "A"})
    assert paths.image(lights={ids[1]: 0.5}).attrs["lights"] == {ids[0]: "A x 0.5"}
    assert paths.image(lights={ids[1]: "D50"}).attrs["lights"] == {ids[0]: "D50"}


def test_lights_add_up(still: LightPaths) -> None:
    images = still.light_images()
    assert list(images) == [light.name for light in still.lights]
    whole = still.image().dataset.radiance.values
    np.testing.assert_allclose(
        sum(image.dataset.radiance.values for image in images.values()),
        whole,
        rtol=2e-5,
        atol=1e-6 * whole.max(),
    )
    mixed = still.light_images(lights={"uv-lamp": 2})
    np.testing.assert_allclose(
        mixed["shape 'uv-lamp' (rectangle)"].dataset.radiance.values,
        2 * images["shape 'uv-lamp' (rectangle)"].dataset.radiance.values,
        rtol=1e-6,
    )


def test_concentration(box: LightPaths) -> None:
    """Light that luminesced once is proportional to it, what never did stays; 0 takes it all."""
    walls = {"left-wall": 0.5, "right-wall": 0.5}
    half, plain = box.image(concentration=walls), box.image()
    for name in COMPONENTS:
        if name in ("direct_luminescence", "indirect_luminescence"):
            expected = 0.5 * plain.component(name).values
        elif name in ("source", "direct_reflection", "indirect_reflection"):
            expected = plain.component(name).values
        else:
            continue
        np.testing.assert_allclose(half.component(name).values, expected, rtol=1e-5)
    none = box.image(concentration=dict.fromkeys(walls, 0.0))
    assert none.luminescent().values.max() == 0


def test_a_dye_where_none_was() -> None:
    """In a scene without fluorescence; the material comes from a `Material`."""
    dye = paint("dye", 0.3, bell(600, 30, 0.02), bell(450, 40))
    paths = trace("cornell-classic", **SMALL)
    assert paths.image().luminescent().values.max() == 0
    assert (
        paths.image(materials={"left": dye} if "left" in paths.surfaces else {"left-wall": dye})
        .luminescent()
        .values.max()
        > 0
    )


@pytest.mark.parametrize("name", ["D50", "FL11"])
def test_an_illuminant_keeps_the_luminance(name: str, box: LightPaths) -> None:
    """Of the lamp itself, seen directly."""
    plain, new = (
        box.image(lights=lights, wavelengths="380:780:5").luminance("source")
        for lights in (None, {"light": name})
    )
    lit = plain.values > 0
    np.testing.assert_allclose(new.values[lit], plain.values[lit], rtol=5e-3)


def test_a_file_is_taken_at_its_word(box: LightPaths, tmp_path: Any) -> None:
    values = np.interp(FINE, [300, 780], [1.0, 2.0])
    np.savetxt(
        tmp_path / "lamp.csv",
        np.column_stack([FINE, values]),
        delimiter=",",
        header="wavelength,radiance",
        comments="",
    )
    seen = box.image(lights={"light": str(tmp_path / "lamp.csv")}).component("source").values
    plain = box.image().component("source").values
    new, old = (
        light_on(lamp, Wavelengths(400, 700, 20)) for lamp in (Spectrum(FINE, values), box.lights[0].spectrum)
    )
    lit = plain[..., 5] > 0
    np.testing.assert_allclose(seen[lit] / plain[lit], np.broadcast_to(new / old, (lit.sum(), 16)), rtol=1e-5)
    same = box.image(lights={"light": tmp_path / "lamp.csv"}, same_luminance=True, wavelengths="380:760:5")
    lit = box.image(wavelengths="380:760:5").luminance("source").values
    np.testing.assert_allclose(same.luminance("source").values[lit > 0], lit[lit > 0], rtol=5e-3)


def test_ultraviolet_on_a_finer_grid(box: LightPaths) -> None:
    """The lamp and the dyes that the paths are asked for decide what is computed, not those of tracing."""
    image = box.image(lights={"light": "D65"}, wavelengths="300:700:5")
    changed = relit(
        load_scene("cornell-box").with_settings(width=16, height=12, spp=16), lights={"light": "D65"}
    )
    expected = render_job(RenderJob(changed, image.wavelengths, seed=2))
    # Roulette has followed other bands: the means agree, the images do not.
    assert image.dataset.sizes["wavelength"] == 81
    a, b = (i.total().values.mean(axis=(0, 1)) for i in (image, expected))
    np.testing.assert_allclose(a[12:], b[12:], rtol=2e-3)


class TestWhatIsRefused:
    def test_an_unknown_light(self, box: LightPaths) -> None:
        with pytest.raises(OptionError, match=r"no light 'lihgt'[\s\S]*one of light,"):
            box.image(lights={"lihgt": "A"})

    def test_an_unknown_surface(self, box: LightPaths) -> None:
        with pytest.raises(OptionError, match=r"no shape or BSDF 'left'[\s\S]*left-wall"):
            box.image(materials={"left": "poster-red"})
        with pytest.raises(OptionError, match=r"no shape or BSDF 'left'[\s\S]*left-wall"):
            box.image(concentration={"left": 1})

    @pytest.mark.parametrize(
        ("name", "reason"),
        [
            ("table", "its colour is a texture"),
            ("tin", "that of a metal"),
            ("tumbler", "no colour of its own"),
            ("uv-lamp", "no BSDF and absorbs"),
            ("page", "paper, marker"),
        ],
    )
    def test_a_material_that_cannot_be_exchanged(self, name: str, reason: str, still: LightPaths) -> None:
        assert isinstance(still.surfaces[name], str)
        with pytest.raises(OptionError, match=f"cannot be exchanged: .*{reason}"):
            still.image(materials={name: "poster-red"})

    def test_a_dye_under_a_gloss_without_equation(self, still: LightPaths) -> None:
        with pytest.raises(OptionError, match="'cap' cannot get a fluorescent material"):
            still.image(materials={"cap": "poster-red"})
        assert (
            still.image(materials={"cap": Material("dark", Spectrum.constant(0.01))}).total().values.max() > 0
        )

    @pytest.mark.parametrize("factor", [-1, float("nan"), float("inf"), True])
    def test_factors(self, factor: Any, box: LightPaths) -> None:
        with pytest.raises(OptionError, match="impossible"):
            box.image(lights={"light": factor})
        with pytest.raises(OptionError, match="impossible"):
            box.image(concentration={"left-wall": factor})

    @pytest.mark.parametrize("samples", [0, -3, 2.5, "4"])
    def test_samples(self, samples: Any, box: LightPaths) -> None:
        with pytest.raises(OptionError, match=r"samples is not a whole|number of samples is out of range"):
            box.image(samples=samples)

    def test_what_is_no_dict_or_material(self, box: LightPaths) -> None:
        with pytest.raises(OptionError, match="lights are not readable"):
            box.image(lights="A")  # type: ignore[arg-type]
        with pytest.raises(OptionError, match="not a material"):
            box.image(materials={"left-wall": 0.5})  # type: ignore[dict-item]
        with pytest.raises(SpectrumError, match="no such illuminant"):
            box.image(lights={"light": "FL99"})


def test_much_brighter_materials_are_warned_of(box: LightPaths) -> None:
    with pytest.warns(FluorsparWarning, match=r"'tall-block' is much brighter now \(white-85.*rr_depth"):
        box.image(materials={"tall-block": "white-85"})


def test_the_image_says_what_was_changed(box: LightPaths) -> None:
    grey = Material("grey", Spectrum.constant(0.4))
    image = box.image(
        lights={"light": ("D50", 2)}, materials={"floor": grey}, concentration={"left-wall": 0.5}
    )
    assert image.attrs["relit"] == {
        "lights": {"light": "D50 x 2"},
        "materials": {"floor": "grey"},
        "concentration": {"left-wall": 0.5},
    }
    assert "relit" not in box.image().attrs
    numbers = box.image(lights={"light": np.float32(0.5)}, concentration={"left-wall": np.int64(1)})
    assert numbers.attrs["relit"] == {"lights": {"light": 0.5}, "concentration": {"left-wall": 1}}
    assert "grey" in image.attrs["materials"]


def test_from_a_file(box: LightPaths, still: LightPaths, tmp_path: Any) -> None:
    """What is exchanged in paths in memory is exchanged in paths in a file."""
    for paths, change in (
        (box, {"materials": {"left-wall": "poster-orange"}, "lights": {"light": "D50"}}),
        (still, {"materials": {"glaze": "poster-green", "marker": material("poster-red")}}),
    ):
        paths.save(tmp_path / "kept.paths")
        a, b = paths.image(**change), load_paths(tmp_path / "kept.paths").image(**change)  # type: ignore[arg-type]
        assert np.array_equal(a.dataset.radiance.values, b.dataset.radiance.values)
