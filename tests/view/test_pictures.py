"""Pictures of a view: the same numbers as those of the Python functions."""

from __future__ import annotations

import base64
import io
import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from window_parts import GRID, Ask, image_of

from fluorspar import SpectralImage
from fluorspar.image.display.appearance import appearance, auto_exposure, show
from fluorspar.view import kept_image, sources
from fluorspar.view.image_cache import ImageCache
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.sources import ImageSource
from fluorspar.view.workspace import Workspace


def pixels_of(response: Any) -> NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(response.content)))


def facts_of(response: Any) -> Any:
    return json.loads(response.headers["X-Fluorspar"])


@pytest.mark.parametrize("white", [None, "A", [0.9, 1.0, 0.5]])
@pytest.mark.parametrize("exposure", [None, 1e-3])
def test_colours(ask: Ask, image: SpectralImage, white: Any, exposure: float | None) -> None:
    response = ask("picture", source="0", white=white, exposure=exposure)
    shown = appearance(image.dataset, image.components, exposure, white=white)
    assert np.array_equal(pixels_of(response), shown.bytes)
    facts = facts_of(response)
    assert facts["exposure"] == shown.exposure
    assert facts["white_at"] == pytest.approx(1 / shown.exposure)
    assert facts["out_of_gamut"] == shown.out_of_gamut
    assert (facts["unit"], facts["generation"], facts["coarse"]) == ("W m-2 sr-1 nm-1", 0, False)


def test_weights(ask: Ask, image: SpectralImage) -> None:
    """A component switched off is not there, another counts twice; visible lamps do not count for the exposure."""
    weights = {"source": 0.5, "direct_luminescence": 0.0, "reexcitation": 2.0}
    factors = [weights.get(name, 1.0) for name in image.components]
    xyz = [factor * image.xyz(name).values for factor, name in zip(factors, image.components, strict=True)]
    exposure = auto_exposure(sum(xyz[1:], np.zeros(3)))
    response = ask("picture", source="0", weights=weights)
    assert facts_of(response)["exposure"] == pytest.approx(exposure, rel=1e-6)
    expected = show(sum(xyz, np.zeros(3)), exposure).bytes.astype(int)
    assert np.abs(pixels_of(response) - expected).max() <= 1  # where rounding tips


def test_what_srgb_cannot_show_is_marked(ask: Ask) -> None:
    response = ask("picture", source="0", gamut=True, exposure=1e-2)
    marked = (pixels_of(response) == (255, 0, 255)).all(axis=-1)
    assert marked.mean() == facts_of(response)["out_of_gamut"] > 0


def test_a_band_in_false_colour(ask: Ask, image: SpectralImage) -> None:
    """The ends of the colours are those of the range that is asked for."""
    mean = image.total().sel(wavelength=slice(500, 540)).mean("wavelength").values
    limits = [float(mean.min()), float(mean.max())]
    response = ask("picture", source="0", mode="band", band=[540, 500], range=limits)
    pixels = pixels_of(response)
    assert facts_of(response)["range"] == limits
    assert pixels[np.unravel_index(mean.argmin(), mean.shape)].tolist() == [68, 1, 84]
    assert pixels[np.unravel_index(mean.argmax(), mean.shape)].tolist() == [253, 231, 37]


def test_maps_of_errors(ask: Ask, image: SpectralImage) -> None:
    error = image.standard_error().values.mean(axis=-1)
    relative = error / image.total().values.mean(axis=-1)
    for mode, values, unit in (
        ("standard_error", error, "W m-2 sr-1 nm-1"),
        ("relative_error", relative, "1"),
    ):
        facts = facts_of(ask("picture", source="0", mode=mode))
        assert facts["range"] == pytest.approx([0.0, np.percentile(values, 99)], rel=1e-5)
        assert facts["unit"] == unit


def test_the_error_of_one_component(ask: Ask, other: SpectralImage) -> None:
    """It is known where the file has it."""
    alone = {name: 0.0 for name in other.components if name != "direct_luminescence"}
    facts = facts_of(
        ask("picture", source="1", mode="standard_error", weights=alone | {"direct_luminescence": 2})
    )
    error = 2 * other.dataset["component_standard_error"].sel(component="direct_luminescence").mean(
        "wavelength"
    )
    assert facts["range"][1] == pytest.approx(float(np.percentile(error, 99)), rel=1e-5)


def test_components(ask: Ask, image: SpectralImage) -> None:
    answer = ask("components", source="0")
    luminance = {name: float(image.luminance(name).sum()) for name in image.components}
    whole = sum(luminance.values())
    for row in answer["components"]:
        assert row["share"] == pytest.approx(luminance[row["name"]] / whole, rel=1e-5)
        head, _, data = row["png"].partition(",")
        assert head == "data:image/png;base64"
        assert Image.open(io.BytesIO(base64.b64decode(data))).size == (8, 6)
    for group in ("reflected", "luminescent"):
        assert answer[group] == pytest.approx(float(image.luminance(group).sum()) / whole, rel=1e-5)
    assert [row["number"] for row in answer["components"]] == list(range(7))


def test_pixels_that_were_not_rendered_are_grey(workspace: Any, ask: Ask) -> None:
    values = np.ones((7, 6, 8, len(GRID)))
    values[:, 3:] = np.nan
    workspace.sources["0"]._image = SpectralImage.from_arrays(values, GRID, attrs={"partial": True})
    for mode in ("colour", "band"):
        pixels = pixels_of(ask("picture", source="0", mode=mode))
        assert (pixels[3:] == 51).all()
        assert not (pixels[:3] == 51).all()
    assert ask("components", source="0")["components"][0]["share"] == pytest.approx(1 / 7)


def test_the_cache_is_bounded() -> None:
    size = KeptImage(image_of(0)).nbytes
    cache = ImageCache(3 * size)
    for number in range(10):
        cache.put((str(number),), KeptImage(image_of(number)))
    assert [number for number in range(10) if cache.get((str(number),)) is not None] == [7, 8, 9]


def test_an_image_that_is_not_split(workspace: Any, ask: Ask, refused: Ask) -> None:
    """Of another program: one component, no standard error, and a quantity that has no luminance."""
    attrs = {"unit": "1", "quantity": "reflectance"}
    values = np.linspace(0.1, 0.9, 48).reshape(1, 6, 8, 1) * np.ones(len(GRID))
    sheet = SpectralImage.from_arrays(values, GRID, attrs=attrs, components=["total"])
    workspace.sources["0"] = ImageSource("sheet.hdr", sheet)
    facts = facts_of(ask("picture", source="0", weights={"total": 0.5}))
    assert (facts["white_at"], facts["unit"]) == (None, "1")
    answer = ask("components", source="0")
    assert [(row["name"], row["number"], row["share"]) for row in answer["components"]] == [
        ("total", None, 1.0)
    ]
    assert (answer["total"], answer["reflected"], answer["luminescent"]) == (1.0, None, None)
    spectrum = ask("spectrum", source="0", region=[0, 0, 0, 0], weights={"total": 2})
    assert spectrum["total"] == pytest.approx([0.2] * len(GRID))
    assert (spectrum["luminescent_share"], spectrum["standard_error"]) == (None, None)
    assert "no standard error" in refused("picture", source="0", mode="standard_error")
    assert "no such component" in refused("picture", source="0", weights={"source": 1})


def test_everything_switched_off_is_black(ask: Ask, image: SpectralImage) -> None:
    nothing = dict.fromkeys(image.components, 0.0)
    assert not pixels_of(ask("picture", source="0", weights=nothing)).any()
    assert ask("components", source="0", weights=nothing)["components"][0]["share"] is None
    spectrum = ask("spectrum", source="0", region=[0, 0, 1, 1], weights=nothing, reference=[0, 0, 0, 0])
    assert (spectrum["luminance"], spectrum["xy"], spectrum["cct"]) == (0, [None, None], None)


def test_visible_lamps_alone(ask: Ask, image: SpectralImage) -> None:
    """Have the exposure that `appearance` gives them; black suggests none."""
    others = dict.fromkeys(image.components[1:], 0.0)
    response = ask("picture", source="0", weights=others)
    shown = appearance(image.dataset, ["source"])
    assert facts_of(response)["exposure"] == shown.exposure
    assert np.array_equal(pixels_of(response), shown.bytes)
    black = facts_of(ask("picture", source="0", weights=others | {"source": 0.0}))
    assert (black["exposure"], black["white_at"]) == (None, None)


class TestLargeImages:
    """Shown in pieces: some of the pixels of the whole, and all of those that one looks at."""

    @pytest.fixture(autouse=True)
    def small_screens(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(sources, "_LARGE", 6)
        monkeypatch.setattr(sources, "_OVERVIEW", 3)

    def test_the_whole_has_some_of_its_pixels(self, ask: Ask, image: SpectralImage) -> None:
        response = ask("picture", source="0")
        width, height = image.size
        every = -(-max(width, height) // 3)
        part = image.dataset.isel(x=slice(None, None, every), y=slice(None, None, every))
        assert np.array_equal(pixels_of(response), appearance(part, image.components).bytes)
        assert facts_of(response)["size"] == [width, height]
        assert f"of every {every} rows and columns one is shown" in facts_of(response)["notes"][0]

    def test_a_window_has_all_of_its_pixels(self, ask: Ask, image: SpectralImage) -> None:
        response = ask("picture", source="0", window=[2, 1, 6, 5], exposure=1e-3)
        whole = appearance(image.dataset, image.components, 1e-3).bytes
        assert np.array_equal(pixels_of(response), whole[1:6, 2:7])
        assert facts_of(response)["notes"] == []

    def test_a_window_reads_only_the_rows_and_columns_it_shows(
        self, ask: Ask, workspace: Workspace, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        seen = []
        read = kept_image.xyz_of
        monkeypatch.setattr(
            kept_image, "xyz_of", lambda dataset, names: (seen.append(dataset.sizes), read(dataset, names))[1]
        )
        ask("picture", source="0", window=[0, 0, 3, 1], exposure=1.0)
        assert {(sizes["x"], sizes["y"]) for sizes in seen} == {(4, 2)}

    def test_a_window_outside_is_refused(self, refused: Ask) -> None:
        assert "the window is outside the image" in refused("picture", source="0", window=[0, 0, 999, 1])

    def test_spectra_and_files_are_of_all_pixels(self, ask: Ask, image: SpectralImage) -> None:
        spectrum = ask("spectrum", source="0", region=[7, 5, 7, 5])
        assert np.allclose(spectrum["total"], image.spectrum_at(7, 5).total, rtol=1e-6)
        saved = ask("save", source="0", format="exr")
        assert saved.content[:4] == b"\x76\x2f\x31\x01"
        assert len(saved.content) > 4 * image.size[0] * image.size[1]
