"""Images that are not finite are errors, dark ones are said; by both methods, in memory and in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar import Wavelengths, render, trace
from fluorspar.errors import FluorsparWarning, RendererError
from fluorspar.image.pixels import FinishedPixels, Pixels
from xml_scene import xml_scene

GRID = Wavelengths(400, 600, 100)
FLOOR = '<shape type="rectangle"/>'


def sky(radiance: float) -> str:
    return f'<emitter type="constant"> <spectrum name="radiance" value="{radiance:g}"/> </emitter>'


def pixels(value: float = 1.0) -> Pixels:
    made = Pixels.empty(6, 3, component_errors=True)
    made.radiance[...], made.standard_error[...], made.component_standard_error[...] = value, 0.1, np.nan  # type: ignore[index]
    return made


class TestOnePlace:
    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e20])
    def test_names_component_pixel_and_band(self, bad: float) -> None:
        run = pixels()
        run.radiance[2, 3:5, 1] = bad
        text = r"(?s)not finite.*direct_luminescence, first in pixel \(1, 2\) at 500 nm.*2 of 6 pixels"
        with pytest.raises(RendererError, match=text):
            FinishedPixels(GRID, width=4).add(6, run)

    def test_standard_errors(self) -> None:
        run = pixels()
        run.standard_error[5, 2] = np.inf
        with pytest.raises(RendererError, match="a standard error, first in pixel"):
            FinishedPixels(GRID, width=4).add(0, run)

    def test_large_values_that_are_finite(self) -> None:
        """The sum of their squares is not."""
        FinishedPixels(GRID, width=4).add(0, pixels(9e17))

    def test_tiny_values_are_not_darkness(self) -> None:
        """The sum of their squares is."""
        finished = FinishedPixels(GRID, width=4)
        finished.add(0, pixels(0.0))
        finished.add(6, pixels(1e-30))
        finished.finish()


@pytest.mark.parametrize("method", ["paths", "staged"])
@pytest.mark.parametrize("streamed", [True, False])
class TestRenders:
    def test_too_bright(self, method: str, streamed: bool, tmp_path: Path) -> None:
        path = xml_scene(tmp_path, FLOOR, light=sky(1e25))
        output = tmp_path / "image.nc" if streamed else None
        with pytest.raises(RendererError, match="not finite"):
            render(path, wavelengths=GRID, method=method, output=output)
        assert sorted(tmp_path.iterdir()) == [path]

    def test_dark(self, method: str, streamed: bool, tmp_path: Path) -> None:
        path = xml_scene(tmp_path, FLOOR, light=sky(0))
        output = tmp_path / "image.nc" if streamed else None
        with pytest.warns(FluorsparWarning, match=r"0 everywhere.*400-600 nm") as said:
            render(path, wavelengths=GRID, method=method, output=output)
        assert len(said) == 1


def test_images_of_light_paths(tmp_path: Path) -> None:
    with pytest.warns(FluorsparWarning, match="0 everywhere"):
        trace(xml_scene(tmp_path, FLOOR, light=sky(0)), wavelengths=GRID).image()
    with pytest.raises(RendererError, match="not finite"):
        trace(xml_scene(tmp_path, FLOOR, light=sky(1e25)), wavelengths=GRID).image()
