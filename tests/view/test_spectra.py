"""Spectra of regions: the same numbers as `fluorspar.measure`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from window_parts import Ask

from fluorspar import Point, SpectralImage, Wavelengths, measure
from fluorspar.colour.xyz import lab_from_xyz
from fluorspar.image.display.appearance import appearance
from fluorspar.measuring.point_spectra import read_point_spectra, write_point_spectra
from fluorspar.measuring.regions import measure_regions
from fluorspar.view.sources import ImageSource
from fluorspar.view.workspace import Workspace


def test_a_pixel_is_what_measure_says(ask: Ask, image: SpectralImage) -> None:
    answer = ask("spectrum", source="0", region=[5, 2, 5, 2])
    point = [Point("1", (5, 2))]
    measured = measure(image, point, aperture="1px")
    assert answer["total"] == measured.at("1").tolist()
    assert measured.standard_error is not None
    assert answer["standard_error"] == measured.standard_error[0].tolist()
    for name, spectrum in answer["components"].items():
        assert spectrum == measure(image, point, aperture="1px", component=name).at("1").tolist()
    assert answer["luminance"] == measured.luminance()[0]
    assert answer["xy"] == measured.chromaticity()[0].tolist()
    assert answer["xyz"] == pytest.approx(image.xyz().values[2, 5], rel=1e-6)
    luminescent = measure(image, point, aperture="1px", component="luminescent").luminance()[0]
    assert answer["luminescent_share"] == pytest.approx(luminescent / answer["luminance"], rel=1e-6)
    assert (answer["wavelengths"], answer["unit"]) == (image.wavelengths.values.tolist(), measured.unit)


def test_a_region_is_the_mean_of_its_pixels(ask: Ask, image: SpectralImage) -> None:
    answer = ask("spectrum", source="0", region=[1, 2, 3, 5])
    part = image.total().isel(x=slice(1, 4), y=slice(2, 6)).values.reshape(12, -1)
    errors = image.standard_error().isel(x=slice(1, 4), y=slice(2, 6)).values.reshape(12, -1)
    assert answer["pixels"] == 12
    assert answer["total"] == pytest.approx(part.mean(axis=0), rel=1e-6)
    assert answer["standard_error"] == pytest.approx(np.sqrt((errors**2).sum(axis=0)) / 12, rel=1e-6)


def test_the_white_of_cielab_is_that_of_the_picture(ask: Ask, image: SpectralImage) -> None:
    """As in a comparison; or another region."""
    answer = ask("spectrum", source="0", region=[0, 0, 0, 0])
    exposure = appearance(image.dataset, image.components).exposure
    assert answer["white"][1] == pytest.approx(1 / exposure)
    assert answer["lab"] == pytest.approx(lab_from_xyz(answer["xyz"], answer["white"]))
    same = ask("spectrum", source="0", region=[4, 4, 4, 4], reference=[4, 4, 4, 4])
    assert same["lab"] == pytest.approx([100, 0, 0], abs=1e-9)
    assert same["relative"] == [1.0] * len(image.wavelengths)


def test_weights_count(ask: Ask, image: SpectralImage) -> None:
    """The error of components of different weights is not known, that of all alike is."""
    answer = ask("spectrum", source="0", region=[2, 2, 2, 2], weights={"source": 0, "direct_reflection": 2})
    factors = np.array([0, 2, 1, 1, 1, 1, 1])
    spectra = image.dataset["radiance"].isel(x=2, y=2).values
    assert answer["total"] == pytest.approx(factors @ spectra, rel=1e-6)
    assert answer["components"]["direct_reflection"] == pytest.approx(2 * spectra[1], rel=1e-6)
    assert answer["standard_error"] is None
    half = ask("spectrum", source="0", region=[2, 2, 2, 2], weights=dict.fromkeys(image.components, 0.5))
    assert half["standard_error"] == pytest.approx(0.5 * image.standard_error().values[2, 2], rel=1e-6)


def test_colour_temperature(ask: Ask) -> None:
    """Of a lamp it is known, of a green not."""
    lamp = ask(
        "spectrum",
        source="2",
        region=[0, 0, 15, 15],
        weights=dict.fromkeys(
            ("direct_luminescence", "indirect_luminescence", "luminescent_reflection", "reexcitation"), 0.0
        ),
    )
    assert 3000 < lamp["cct"] < 9000


def test_the_table_is_that_of_measure(ask: Ask, image: SpectralImage, tmp_path: Path) -> None:
    pins = [{"name": "wall, left", "region": [1, 1, 3, 2]}, {"name": "2", "region": [5, 5, 5, 5]}]
    response = ask("csv", source="0", pins=pins)
    assert 'filename="spectra.csv"' in response.headers["content-disposition"]
    write_point_spectra(
        measure_regions(image, {"wall, left": (1, 1, 3, 2), "2": (5, 5, 5, 5)}, title="box.nc"),
        tmp_path / "a.csv",
    )
    assert response.content == (tmp_path / "a.csv").read_bytes()
    (tmp_path / "b.csv").write_bytes(response.content)
    read = read_point_spectra(tmp_path / "b.csv")
    assert read.at("2") == pytest.approx(measure(image, [Point("2", (5, 5))], aperture="1px").at("2"))


def test_infrared_has_a_spectrum(ask: Ask, refused: Ask, workspace: Workspace) -> None:
    """But no colour: the picture says so instead of being black."""
    grid = Wavelengths(900, 1000, 20)
    workspace.sources["0"] = ImageSource("nir.hdr", SpectralImage.from_arrays(np.ones((7, 4, 6, 6)), grid))
    answer = ask("spectrum", source="0", region=[0, 0, 1, 1])
    assert answer["total"] == [7.0] * 6
    assert (answer["luminance"], answer["lab"], answer["cct"]) == (0.0, None, None)
    assert "900-1000 nm by 20 fix: show a band" in refused("picture", source="0")
    assert ask("picture", source="0", mode="band").status_code == 200


def test_a_pixel_that_was_not_rendered_is_named(refused: Ask, workspace: Workspace) -> None:
    radiance = np.full((7, 4, 6, 6), np.nan)
    image = SpectralImage.from_arrays(radiance, Wavelengths(500, 600, 20))
    workspace.sources["0"] = ImageSource("torn.nc", image)
    assert "not rendered where: region 1, 2 to 3, 3" in refused("spectrum", source="0", region=[1, 2, 3, 3])
