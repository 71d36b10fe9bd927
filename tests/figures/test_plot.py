"""What is drawn of each object, and what notebooks show of it."""

from __future__ import annotations

import numpy as np
import pytest

import fluorspar
from fluorspar import Material, SpectralImage, Spectrum, Wavelengths
from fluorspar.bispectral.lamp_colour import colour_under_lamp
from fluorspar.errors import OptionError
from fluorspar.figures.style import encode
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.spectral.bands import Bands

NAME = "paint $_{5$ <b>"  # neither a formula nor HTML
GREY = Material(NAME, Spectrum([300, 800], [0.2, 0.4], NAME))
BAND = Bands(Wavelengths(400, 700, 50))
THINGS = {
    "spectrum": Spectrum([400, 500], [1, 2], NAME),
    "constant": Spectrum.constant(0.5, NAME),
    "material": GREY,
    "colour": colour_under_lamp(GREY, "D65"),
    "image": SpectralImage.from_arrays(np.ones((7, 2, 3, 7)), BAND.grid, attrs={"scene": NAME}),
    "points": PointSpectra((NAME,), BAND, np.ones((1, 7))),
}


@pytest.mark.parametrize("what", THINGS)
def test_it_is_drawn(what: str) -> None:
    assert encode(fluorspar.plot(THINGS[what]), dpi=50).startswith(b"\x89PNG")


def test_the_materials_and_lights_of_a_scene_are_drawn() -> None:
    scene = fluorspar.load_scene("furnace")
    materials, lights = fluorspar.plot(scene).axes
    assert [line.get_label() for line in materials.lines] == [material.name for material in scene.materials]
    assert len(lights.lines) == len(scene.lights)


def test_what_has_no_figure_lists_what_has() -> None:
    with pytest.raises(OptionError, match=r"(?s)no figure.*str.*Spectrum, Material"):
        fluorspar.plot("cornell-box")


@pytest.mark.parametrize("what", ["spectrum", "constant", "material", "image"])
def test_notebooks_show_names_as_they_are(what: str) -> None:
    shown = THINGS[what]._repr_html_()
    assert "<b>" not in shown
    assert "paint $_{5$ &lt;b&gt;" in shown


def test_a_notebook_shows_what_a_scene_holds() -> None:
    assert "poster-red (fluorescent): on left-wall" in fluorspar.load_scene("cornell-box")._repr_html_()
