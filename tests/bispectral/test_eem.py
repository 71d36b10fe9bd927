"""A relative EEM of a known dye, with scattered light: the dye comes back, as strong as the quantum yield says."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.bispectral.eem import Eem, material_from_eem
from fluorspar.errors import ApproximationWarning, MaterialError, OptionError, SpectrumError
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

EM = np.arange(380.0, 701.0, 2.0)
EX = np.concatenate([np.arange(300.0, 400.0, 10.0), np.arange(400.0, 501.0, 5.0)])  # uneven, as measured
GRID = Wavelengths(300, 780, 1)


def emitted(w: np.ndarray) -> np.ndarray:
    return np.asarray(np.exp(-(((w - 560) / 25) ** 2)))


def excited(w: np.ndarray) -> np.ndarray:
    return np.asarray(np.exp(-(((w - 450) / 25) ** 2)) + 0.3 * np.exp(-(((w - 350) / 15) ** 2)))


def eem(units: str = "photon", scatter: float = 1e5) -> Eem:
    """Photons of a dye, in counts; or its energy, for excitation of equal energy."""
    cells = 4e4 * np.outer(emitted(EM), excited(EX))
    if units == "energy":
        cells = cells / EM[:, None] * EX
    em = EM[:, None]
    for line, strength in ((EX, 1), (2 * EX, 0.5), (1e7 / (1e7 / EX - 3400), 0.1)):
        cells = cells + strength * scatter * np.exp(-(((em - line) / 3) ** 2))
    return Eem(EM, EX, cells, units, "mine")


@pytest.mark.parametrize("units", ["photon", "energy"])
def test_the_dye_comes_back(units: str) -> None:
    """Q of the absorbed photons leave; the emission of 560 nm lies clear of the excitation of 450 nm and less."""
    material = material_from_eem(eem(units), 0.8, strength=0.6, substrate=0.9)
    D = material.on(GRID)
    w = GRID.values
    absorbed = 0.6 * excited(w) / excited(w).max()
    at = np.isin(w, [340, 350, 430, 450])
    assert D.luminescent_photon_yield()[at] == pytest.approx(0.8 * absorbed[at], rel=3e-3)
    assert D.reflectance[at] == pytest.approx(0.9 * (1 - absorbed[at]), abs=2e-3)
    photons = material.fluorophores[0].emission.on(GRID, outside="zero") * w
    assert photons / photons.max() == pytest.approx(emitted(w), abs=4e-3)
    assert "within 15 nm of Rayleigh (also second order) and Raman" in material.assumed
    assert "leaves 0" in material.quality


def test_scatter_that_is_not_left_out_spoils_it() -> None:
    """Which shows that the lines of the test are strong enough to be noticed."""
    with pytest.raises(MaterialError, match="shorter wavelengths"), pytest.warns(ApproximationWarning):
        material_from_eem(eem(), 0.8, strength=0.6, scatter=0)


def test_a_reflectance_says_what_is_absorbed() -> None:
    reflectance = Spectrum([300, 450, 780], [0.3, 0.4, 0.9])
    material = material_from_eem(eem(), 0.5, reflectance=reflectance)
    assert material.reflectance.at(450) == pytest.approx(0.4)
    assert material.reflectance.at(615) == pytest.approx(0.65)
    at = int(450 - GRID.start)
    assert material.on(GRID).luminescent_photon_yield()[at] == pytest.approx(0.5 * 0.6, rel=3e-3)


def test_two_dyes_are_noticed() -> None:
    second = np.outer(np.exp(-(((EM - 660) / 15) ** 2)), np.exp(-(((EX - 350) / 20) ** 2)))
    mixed = Eem(EM, EX, eem().cells + 4e4 * second, "photon", "mixed")
    with pytest.warns(ApproximationWarning, match="mixed: one fluorophore leaves .* unexplained"):
        material_from_eem(mixed, 0.8, strength=0.6)


@pytest.mark.parametrize(
    ("options", "error", "complaint"),
    [
        ({}, OptionError, "(?s)has to be given once.*--strength.*--reflectance"),
        ({"strength": 0.5, "reflectance": 0.5}, OptionError, "has to be given once"),
        ({"strength": 0.5, "units": "energy"}, MaterialError, r"disagree on its units"),
        ({"strength": 1.5}, MaterialError, "strength of a dye is impossible"),
        ({"strength": 0.5, "quantum_yield": 80}, MaterialError, "quantum yield of a dye is impossible"),
        ({"strength": 0.5, "scatter": 500}, MaterialError, "(?s)no luminescence is left.*--scatter"),
        ({"strength": 0.5, "scatter": -1}, OptionError, "width of scattered light"),
        ({"reflectance": 40}, SpectrumError, "fractions, not percent"),
        (
            {"reflectance": Spectrum([500, 700], [0.5, 0.5])},
            SpectrumError,
            "(?s)not measured at the peak.*450 nm",
        ),
    ],
)
def test_what_is_refused(options: dict[str, object], error: type[Exception], complaint: str) -> None:
    with pytest.raises(error, match=complaint):
        material_from_eem(eem(), **({"quantum_yield": 0.8} | options))


def test_units_are_never_guessed() -> None:
    with pytest.raises(MaterialError, match=r"(?s)an EEM needs the units.*--units"):
        material_from_eem(Eem(EM, EX, eem().cells), 0.8, strength=0.5)


@pytest.mark.parametrize("cells", [np.ones((2, 2)), np.zeros((len(EM), len(EX)))])
def test_what_is_no_eem(cells: np.ndarray) -> None:
    with pytest.raises(MaterialError, match="not an excitation-emission matrix"):
        Eem(EM, EX, cells)
