"""IES TM-27 files: the spectrum of a luminaire, in XML."""

from __future__ import annotations

from pathlib import Path

import pytest

from fluorspar.errors import SpectrumError
from fluorspar.spectral.spectrum import read_spectrum

HEAD = '<?xml version="1.0" encoding="utf-8"?><IESTM2714 xmlns="http://www.ies.org/iestm2714" version="1.0">'
ROWS = (
    '<SpectralData wavelength="400">1.0</SpectralData><SpectralData wavelength="500">{value}</SpectralData>'
)
SPECTRUM = "<SpectralDistribution><SpectralQuantity>relative</SpectralQuantity>{rows}</SpectralDistribution>"


def written(
    folder: Path, value: str = "3.0", spectra: int = 1, rows: str = ROWS, end: str = "</IESTM2714>"
) -> Path:
    file = folder / "Lamp.SPDX"
    file.write_text(HEAD + "<Header/>" + SPECTRUM.format(rows=rows.format(value=value)) * spectra + end)
    return file


def test_the_spectrum(tmp_path: Path) -> None:
    lamp = read_spectrum(written(tmp_path))
    assert (lamp.at(450), lamp.support, lamp.name) == (2, (400, 500), "Lamp.SPDX")


@pytest.mark.parametrize(
    ("parts", "complaint"),
    [
        ({"value": "much"}, "(?s)not a number.*'much'"),
        ({"value": ""}, "not a number|empty|at least two"),
        ({"spectra": 0}, "does not hold one spectrum"),
        ({"spectra": 2}, "does not hold one spectrum"),
        ({"rows": ""}, "no rows"),
        ({"end": ""}, "not readable as XML"),
    ],
)
def test_what_is_refused(tmp_path: Path, parts: dict[str, object], complaint: str) -> None:
    with pytest.raises(SpectrumError, match=complaint):
        read_spectrum(written(tmp_path, **parts))


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(SpectrumError, match="does not exist"):
        read_spectrum(tmp_path / "no.spdx")
