"""A dye from two spectra: photons, energy and the difference between them."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.bispectral.dye import dye
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import ExtrapolationWarning, MaterialError
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

W = np.arange(300.0, 781.0, 1.0)
GRID = Wavelengths(300, 780, 1)


def peak(at: float, width: float = 15.0) -> Spectrum:
    values = np.exp(-0.5 * ((W - at) / width) ** 2)
    return Spectrum(W, np.where(values < 1e-4, 0.0, values), f"peak at {at:g} nm")


def test_photons_out_per_photon_in():
    """Excited well below its emission, a dye gives back quantum yield x strength, whatever the wavelength."""
    D = dye(peak(420), peak(560), 0.8, 0.5, units="photon", substrate=0.0).on(GRID)
    share = 0.5 * peak(420).values
    assert D.photon_yield() == pytest.approx(0.8 * share, abs=2e-5)
    assert D.energy_yield()[W == 420] == pytest.approx(0.8 * 0.5 * 420 / 560, rel=2e-3)


def test_the_dye_takes_light_from_the_substrate():
    material = dye(peak(420), peak(560), 0.8, 0.5, units="photon", substrate=0.9)
    assert material.reflectance.at(420) == pytest.approx(0.45)
    assert material.reflectance.at(700) == pytest.approx(0.9)
    assert material.on(GRID).photon_yield().max() <= 1


@pytest.mark.parametrize("quantum_yield", [0.0, 1.0])
def test_limits_of_the_quantum_yield(quantum_yield):
    D = dye(peak(420), peak(560), quantum_yield, 1.0, units="photon", substrate=1.0).on(GRID)
    assert D.photon_yield().max() <= 1 + 1e-3
    assert D.photon_yield()[W == 420] == pytest.approx(quantum_yield, abs=1e-3)


def test_units_are_converted():
    """The same dye, its spectra once in photons and once in energy."""
    excitation, emission = peak(420), peak(560)
    per_energy = Spectrum(W, excitation.values * W), Spectrum(W, emission.values / W)
    in_photons = dye(excitation, emission, 0.8, 0.5, units="photon")
    in_energy = dye(*per_energy, 0.8, 0.5, units="energy")
    assert in_energy.on(GRID).band() == pytest.approx(in_photons.on(GRID).band(), abs=1e-9)


def test_outside_its_table_a_dye_neither_absorbs_nor_emits():
    """A table that ends at its peak, 480 nm: all of the substrate beyond, no line from there to the end at 780 nm."""
    excitation, emission = (
        Spectrum([400.0, 450.0, 480.0], [0.0, 1.0, 1.0]),
        Spectrum([500.0, 550.0, 600.0], [0.02, 1.0, 0.0]),
    )
    with pytest.warns(
        ExtrapolationWarning, match="absorption taken as 0 above 480 nm.*100 % of the peak"
    ) as told:
        material = dye(excitation, emission, 0.9, 1.0, units="photon")
    assert len(told) == 1  # the emission ends at 2 %
    assert [material.reflectance.at(w) for w in (300, 450, 480, 480.01, 600, 780)] == pytest.approx(
        [0.85, 0.0, 0.0, 0.85, 0.85, 0.85]
    )
    assert "absorption taken as 0 above 480 nm" in material.assumed
    assert "emission taken as 0 below 500 nm" in material.assumed
    D = material.on(GRID)
    assert not D.excitation[0, W > 480].any()
    assert not D.emission[0, W < 500].any()


def test_tables_as_wide_as_the_substrate_assume_nothing():
    wide = Spectrum([300.0, 450.0, 780.0], [0.5, 1.0, 0.0]), Spectrum([300.0, 600.0, 780.0], [0.0, 1.0, 0.5])
    assert dye(*wide, 0.5, 0.5, units="photon").assumed == ""


def test_units_matter():
    found = [
        dye(peak(420), peak(560, 40), 0.8, 0.5, units=units).on(GRID).apply(np.ones(481))
        for units in ("energy", "photon")
    ]
    assert np.abs(found[0] - found[1]).max() > 1e-3


def test_a_fluorescent_substrate_keeps_its_dyes():
    whitened = dye(peak(350), peak(440), 0.7, 0.4, units="photon", substrate=0.85, name="whitened")
    both = dye(peak(500), peak(580), 0.9, 0.4, units="photon", substrate=whitened)
    assert len(both.fluorophores) == 2
    assert both.on(GRID).photon_yield().max() <= 1


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"units": "watt"}, "units"),
        ({"quantum_yield": 1.2}, "quantum yield"),
        ({"quantum_yield": float("nan")}, "quantum yield"),
        ({"strength": -0.1}, "strength"),
        ({"emission": Spectrum([400, 500], [0.0, 0.0])}, "0 everywhere"),
        ({"excitation": Spectrum([400, 500], [-1.0, 2.0])}, "negative"),
        ({"emission": Spectrum.constant(1.0)}, "constant"),
        ({"substrate": 1.4}, "impossible"),
    ],
)
def test_impossible_dyes_are_refused(change, says):
    arguments = {
        "excitation": peak(420),
        "emission": peak(560),
        "quantum_yield": 0.8,
        "strength": 0.5,
        "units": "photon",
    }
    with pytest.raises(MaterialError, match=says):
        dye(**(arguments | change))


def test_units_have_no_default():
    with pytest.raises(TypeError, match="units"):
        dye(peak(420), peak(560), 0.8, 0.5)


def test_a_measured_substrate_is_refused():
    w = np.array([400.0, 410.0])
    sheet = Material.from_matrix("sheet", MeasuredMatrix(w, w, [[0.5, 0], [0.1, 0.5]]))
    with pytest.raises(MaterialError, match="fit it first"):
        dye(peak(420), peak(560), 0.8, 0.5, units="photon", substrate=sheet)


def test_a_dye_takes_light_from_those_below_it() -> None:
    """S and beta of the substrate's dye are both multiplied by 1 - a, so photons stay conserved."""
    w = np.arange(400.0, 701.0, 5.0)
    peak = Spectrum(w, np.exp(-(((w - 480) / 30) ** 2))), Spectrum(w, np.exp(-(((w - 560) / 25) ** 2)))
    below = dye(*peak, quantum_yield=1.0, strength=0.9, units="photon", substrate=0.9)
    both = dye(*peak, quantum_yield=1.0, strength=0.8, units="photon", substrate=below)
    grid = Wavelengths(400, 700, 5)
    old, new = below.on(grid), both.on(grid)
    left = 1 - 0.8 * peak[0].values
    assert new.reflectance == pytest.approx(left * old.reflectance)
    lower = new.emission[0][:, None] * new.excitation[0][None, :]
    assert lower == pytest.approx(
        old.emission[0][:, None] * old.excitation[0][None, :] * left, rel=1e-9, abs=1e-15
    )
    assert new.photon_yield().max() <= 1
