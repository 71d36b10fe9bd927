"""Spectra beside a scene that Mitsuba's parser cannot read: those of lamps as they are exported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar.errors import ApproximationWarning, SceneError
from fluorspar.scene.loading import load_scene

SCENE = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm"/></sensor>
<emitter type="constant" id="sky"><spectrum name="radiance" filename="{name}"/></emitter></scene>
"""
SPDX = """<IESTM2714 xmlns="http://www.ies.org/iestm2714"><SpectralDistribution>
<SpectralData wavelength="300">1</SpectralData><SpectralData wavelength="800">2</SpectralData>
</SpectralDistribution></IESTM2714>"""
COLUMNS = "nm,warm,cold\n300,1,5\n800,2,7\n"


def light(folder: Path, name: str, text: str, named: str = "") -> tuple[list[float], list[float]]:
    file = folder / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    (folder / "scene.xml").write_text(SCENE.format(name=named or name))
    spectrum = load_scene(folder / "scene.xml").lights[0].spectrum
    return spectrum.wavelengths.tolist(), spectrum.values.tolist()


@pytest.mark.parametrize(
    ("name", "text", "named"),
    [
        ("lamp.spdx", SPDX, ""),
        ("lamps/lamp.spdx", SPDX, ""),
        ("lamp.csv", "wavelength,value\n300,1\n800,2\n", ""),
        ("lamp.csv", "800;2,0\n300;1,0\n", ""),
        ("lamp.csv", COLUMNS, "lamp.csv:warm"),
        ("lamp.txt", "Date: today\n>>>>>Begin Spectral Data<<<<<\n300\t1\n800\t2\n", ""),
        ("lamp.spd", "300 1\n800 2\n", ""),
    ],
)
def test_lamps_as_they_are_exported(tmp_path: Path, name: str, text: str, named: str) -> None:
    assert light(tmp_path, name, text, named) == ([300, 800], [1, 2])


@pytest.mark.parametrize("separator", [",", " "])
def test_small_negative_noise_is_set_to_0(tmp_path: Path, separator: str) -> None:
    text = "300 -0.001\n400 0.5\n800 1\n".replace(" ", separator)
    with pytest.warns(ApproximationWarning, match="light 'sky': 1 negative values, down to -0.001"):
        assert light(tmp_path, "lamp.csv", text)[1] == pytest.approx([0, 0.5, 1])


def test_what_is_advised_against_several_columns_works(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"(?s)lamp\.csv.*several spectra.*such as 'lamp\.csv:warm'"):
        light(tmp_path, "lamp.csv", COLUMNS)
    assert light(tmp_path, "lamp.csv", COLUMNS, "lamp.csv:warm")[1] == [1, 2]


def test_mitsuba_looks_for_files_where_it_did_before(tmp_path: Path) -> None:
    import mitsuba as mi

    mi.set_variant("scalar_spectral")
    before = [str(place) for place in mi.file_resolver()]
    light(tmp_path, "lamp.spdx", SPDX)
    assert [str(place) for place in mi.file_resolver()] == before


def test_values_are_exact(tmp_path: Path) -> None:
    values = np.random.default_rng(1).random(5).astype(np.float32)  # as Mitsuba keeps them
    rows = "\n".join(f"{w},{v:.9g}" for w, v in zip(range(300, 800, 100), values, strict=True))
    assert light(tmp_path, "lamp.csv", rows)[1] == pytest.approx(values.tolist(), rel=1e-7)
