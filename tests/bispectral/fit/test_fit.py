"""Fitting measured matrices: are the spectra that went into a matrix the ones that come out, noise or no noise?

The matrices are made up (synthetic_matrix.py) on 330-720 x 380-720 nm by 10, with 0.003 of noise per cell:
what good instruments have. Bounds: a rank-1 fit has some 70 free numbers for 700 cells, so its
root-mean-square error must be well below that of a cell; 0.003 leaves room for smoothing. Where nothing but noise
limits it, alpha has the standard error of a least-squares fit with beta known, noise / (h sqrt(sum of beta^2 over the
excitation below)): it grows towards the blue end of the emission, where little excitation is left below; beta likewise.
Bound: 4 of these, and 15 % of the peak for what smoothing and the error of beta add. Of 400 seeds the worst reaches
0.9 of that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_matrix import EMISSION, EXCITATION, SHIFT, Truth, bump, random_sample

from fluorspar.bispectral.fit.factorise import Problem
from fluorspar.bispectral.fit.fit import MaterialFit, fit_material
from fluorspar.bispectral.fit.report import fit_quality, report_fit, report_lights
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.matrix_noise import estimate_noise, stokes_shift
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

NOISE = 0.003
SUPPORT = (330.0, 720.0)
seeds = st.integers(0, 10_000)


def factors(fit: MaterialFit) -> tuple[np.ndarray, np.ndarray]:
    """alpha (K, M) and beta (K, P) of a fit on the measured wavelengths, sorted by emission peak."""
    dyes = sorted(
        fit.material.fluorophores, key=lambda dye: dye.emission.wavelengths[dye.emission.values.argmax()]
    )
    alpha = np.array([[dye.emission.at(w) for w in EMISSION] for dye in dyes]).reshape(-1, len(EMISSION))
    beta = np.array([[dye.excitation.at(w) for w in EXCITATION] for dye in dyes]).reshape(-1, len(EXCITATION))
    return alpha, beta


def errors(fit: MaterialFit, truth: Truth) -> tuple[float, float]:
    """Root-mean-square error of the luminescent cells and of S."""
    alpha, beta = factors(fit)
    cells = (10 * alpha.T @ beta - truth.luminescent)[SHIFT > 0]
    S = np.array([fit.material.reflectance.at(w) for w in EMISSION]) - truth.reflectance
    return float(np.sqrt(np.mean(cells**2))), float(np.sqrt(np.mean(S**2)))


def test_without_noise_the_spectra_come_back():
    """To 0.5 %: a ridge of 1e-3 holds down what the cells do not determine."""
    truth = random_sample(1, 0)
    fit = fit_material(truth.measured(0, noise=0.0), smooth=False, support=SUPPORT)
    alpha, beta = factors(fit)
    assert fit.rank == 1
    assert np.abs(alpha - truth.alpha).max() < 5e-3 * truth.alpha.max()
    assert np.abs(beta - truth.beta).max() < 5e-3 * truth.beta.max()
    assert errors(fit, truth)[1] < 1e-4


def check_spectra(fit: MaterialFit, truth: Truth) -> None:
    """Hold alpha, beta, S and the luminescent cells of a fit to their bounds."""
    cells, S = errors(fit, truth)
    assert cells < NOISE
    assert S < 2 * NOISE
    lit = SHIFT > 0
    alpha, beta = factors(fit)
    of_alpha = NOISE / (10 * np.sqrt(truth.beta**2 @ lit.T + 1e-12))
    of_beta = NOISE / (10 * np.sqrt(truth.alpha**2 @ lit + 1e-12))
    for found, true, error in ((alpha, truth.alpha, of_alpha), (beta, truth.beta, of_beta)):
        assert np.all(np.abs(found - true) < 0.15 * true.max(axis=1, keepdims=True) + 4 * error)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=seeds)
def test_one_dye_comes_back_from_noise(seed):
    truth = random_sample(1, seed)
    fit = fit_material(truth.measured(seed, NOISE), support=SUPPORT)
    assert fit.rank == 1
    check_spectra(fit, truth)


@pytest.mark.parametrize("rank", [2, 3])
@settings(max_examples=10, deadline=None, derandomize=True)
@given(seed=seeds)
def test_several_dyes_are_counted_and_come_back(rank, seed):
    truth = random_sample(rank, seed)
    fit = fit_material(truth.measured(seed, NOISE), support=SUPPORT)
    assert fit.rank == rank
    check_spectra(fit, truth)
    peaks = EMISSION[factors(fit)[0].argmax(axis=1)]
    assert np.abs(peaks - EMISSION[truth.alpha.argmax(axis=1)]).max() <= 10


@settings(max_examples=10, deadline=None, derandomize=True)
@given(seed=seeds)
def test_noise_alone_is_not_luminescence(seed):
    """White noise and column baselines, as a chip without dye shows them, must give rank 0."""
    fit = fit_material(random_sample(0, seed).measured(seed, NOISE, baseline=0.002), support=SUPPORT)
    assert fit.rank == 0
    assert not fit.material.fluorescent


def test_column_baselines_are_not_taken_for_luminescence():
    """A baseline of 0.003 per column, added below and above the diagonal, must leave alpha beta as it is."""
    truth = random_sample(1, 5)
    plain, shifted = (
        fit_material(truth.measured(1, 0.0005, baseline=b), support=SUPPORT) for b in (0.0, 0.003)
    )
    assert errors(shifted, truth)[0] < 0.0015
    assert errors(plain, truth)[0] < 0.0010


@pytest.mark.parametrize("offset", [-0.001, 0.0005, 0.001])
def test_a_zero_error_of_the_instrument_is_not_luminescence(offset):
    """An offset of every cell alike shows above the diagonal; the photons a dye gives out must stay what they are.

    Bound: 0.02 of 0.24 photons; taken for luminescence, 0.001 in 30 rows would add 0.15.
    """
    truth = random_sample(1, 5)
    clean = truth.measured(1, 0.001)
    shifted = replace(clean, cells=clean.cells + offset)
    yields = []
    for measured in (clean, shifted):
        fit = fit_material(measured, support=SUPPORT)
        D = fit.material.on(Wavelengths(330, 720, 10))
        yields.append((D.photon_yield() - D.reflectance).max())
    assert yields[1] == pytest.approx(yields[0], abs=0.02)
    assert fit.noise.common == pytest.approx(offset, abs=0.0002)


def test_what_columns_have_in_common_by_chance_is_left_alone():
    """Baselines of single columns, mean 0: no common one is taken off."""
    measured = random_sample(1, 5).measured(1, 0.0005, baseline=0.001)
    assert fit_material(measured, support=SUPPORT).noise.common == 0.0


def test_drifts_are_no_zero_error():
    """Columns measured one after another drift by 0.0007 from each to the next; taken as independent, 15 of 60 fail."""
    found = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        drift = np.zeros(len(EXCITATION))
        for k in range(1, len(drift)):
            drift[k] = 0.7 * drift[k - 1] + rng.normal(0, 7e-4)
        tilt = rng.normal(0, 8e-4, len(EXCITATION)) * np.linspace(-1, 1, len(EMISSION))[:, np.newaxis]
        cells = drift + tilt + rng.normal(0, 4e-4, SHIFT.shape)
        found += estimate_noise(cells, SHIFT / 10).common != 0
    assert found <= 3


def test_an_offset_above_the_diagonal_that_dark_cells_do_not_have_is_no_zero_error():
    """0.0006 above, -0.0002 in the dark below: nothing may be taken off there."""
    cells = np.random.default_rng(1).normal(0, 4e-4, SHIFT.shape) + np.where(SHIFT < 0, 6e-4, -2e-4)
    assert estimate_noise(cells, SHIFT / 10).common == 0


def test_a_column_gone_wrong_is_no_dye():
    """All cells excited at 330 nm negative, and bent: no baseline is, but no dye is excited at a single wavelength."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        cells = random_sample(0, seed).measured(seed, 4e-4, baseline=5e-4).cells.copy()
        cells[:, 0] = -0.004 + 0.003 * np.sin(np.linspace(0, 2 * np.pi, len(EMISSION)) + rng.uniform(0, 6))
        fit = fit_material(MeasuredMatrix(EMISSION, EXCITATION, cells, "column"), support=SUPPORT)
        assert fit.rank == 0


def test_a_weak_brightener_is_found():
    """A photon yield of 0.013 in noise of 0.0004 a cell, the columns with baselines of 0.0005."""
    cells = np.outer(bump(EMISSION, 440, 20), bump(EXCITATION, 365, 20)) * (SHIFT > 0)
    cells *= 0.013 / (EMISSION @ cells / EXCITATION).max()
    for seed in range(4):
        measured = random_sample(0, seed).measured(seed, 4e-4, baseline=5e-4)
        fit = fit_material(replace(measured, cells=measured.cells + cells), support=SUPPORT)
        assert fit.rank == 1
        assert fit.material.fluorophores[0].emission.peak == pytest.approx(440, abs=10)


@pytest.mark.parametrize("rank", [None, 2])
def test_a_weak_brightener_beside_a_strong_dye_is_found(rank):
    """0.004 a cell beside a dye of 0.07, whose emission shifts by 6 nm with excitation as no product of spectra does.

    The fit without it misses the colour by what it adds; with it, by less than a third of that.
    """
    rng = np.random.default_rng(3)
    centre = 600 + 6 * np.tanh((EXCITATION - 500) / 60)
    strong = 0.07 * bump(EMISSION[:, np.newaxis], centre, 22) * bump(EXCITATION, 530, 35)
    weak = 0.004 * np.outer(bump(EMISSION, 440, 22), np.abs(EXCITATION - 385) < 20)
    S = 0.05 + 0.75 / (1 + np.exp(-(EXCITATION - 600) / 12))
    alone, both = (
        MeasuredMatrix(
            EMISSION,
            EXCITATION,
            (strong + extra) * (SHIFT > 0) + S * (SHIFT == 0) + rng.normal(0, 4e-4, SHIFT.shape),
            "orange",
        )
        for extra in (0.0, weak)
    )
    assert fit_material(alone, support=SUPPORT).rank == 1
    fit = fit_material(both, rank, support=SUPPORT)
    peaks = sorted(dye.emission.peak for dye in fit.material.fluorophores)
    assert peaks == pytest.approx([440, 600], abs=10)
    one = report_fit(both, fit_material(both, 1, support=SUPPORT).material)
    assert report_fit(both, fit.material).delta_e["D65"] < one.delta_e["D65"] / 3


def test_a_fit_that_misses_the_colour_says_so():
    """Of a dye left out (rank 0) the quality line tells all differences, and that they are large."""
    fit = fit_material(random_sample(1, 5).measured(1, 0.001), 0, support=SUPPORT)
    report = report_fit(fit.measured, fit.material)
    quality = fit_quality(fit, report, report_fit(fit.measured, fit.material, 5.0))
    worst = max(report.delta_e.values())
    assert worst > 1
    assert f"D65 {report.delta_e['D65']:.2f}" in quality
    assert f"the measured colour is missed by {worst:.2f} of CIEDE2000" in quality


def test_a_dye_emits_in_one_band():
    """Noise must not leave side lobes of emission: beyond 5 widths of the true band alpha is exactly 0."""
    for seed in range(4):
        truth = random_sample(1, seed)
        weak = Truth(truth.reflectance, 0.3 * truth.alpha, truth.beta)
        alpha, _ = factors(fit_material(weak.measured(seed, NOISE), rank=1, support=SUPPORT))
        peak = EMISSION[truth.alpha[0].argmax()]
        assert not alpha[:, np.abs(EMISSION - peak) > 5 * 28 + 10].any()


def test_noise_is_estimated_from_above_the_diagonal():
    cells = random_sample(1, 2).measured(3, NOISE, baseline=0.002).cells
    noise = estimate_noise(cells, stokes_shift(EMISSION, EXCITATION, 10.0))
    assert noise.white == pytest.approx(NOISE, rel=0.1)
    assert noise.offset == pytest.approx(0.002, rel=0.5)
    assert noise.resolution == 0


def test_rounded_tables_have_at_least_the_noise_of_rounding():
    cells = np.round(random_sample(1, 2).measured(3, 0.0).cells, 2)
    noise = estimate_noise(cells, stokes_shift(EMISSION, EXCITATION, 10.0))
    assert noise.resolution == 0.01
    assert noise.white >= 0.01 / np.sqrt(12)


def test_nothing_is_clipped():
    """The mean of the fit over many draws of noise is the truth: clipping cells at 0 would add 0.4 sigma to each."""
    truth = random_sample(1, 7)
    dark = np.ix_(EMISSION > 640, EXCITATION < 400)
    found = []
    for seed in range(6):
        alpha, beta = factors(fit_material(truth.measured(seed, NOISE), rank=1, support=SUPPORT))
        found.append((10 * alpha.T @ beta - truth.luminescent)[dark].mean())
    assert abs(np.mean(found)) < 0.1 * NOISE


def test_the_diagonal_of_the_fit_is_the_measured_one():
    """S has no luminescence in it: with the half cell the model adds at equality, the diagonal is what was measured."""
    measured = random_sample(1, 4).measured(4, 0.001)
    grid = Wavelengths(380, 720, 10)
    fit = fit_material(measured, rank=1, support=SUPPORT)
    assert np.abs(np.diagonal(fit.material.on(grid).band()) - measured.reflectance.values).max() < 1e-4
    assert np.any(measured.reflectance.values - fit.material.on(grid).reflectance > 0.003)


def test_yields_do_not_depend_on_the_grid():
    material = fit_material(random_sample(1, 4).measured(4, NOISE), rank=1, support=SUPPORT).material
    coarse, fine = (material.on(Wavelengths(330, 720, step)) for step in (10, 2.5))
    for of in ("photon_yield", "energy_yield"):
        assert getattr(coarse, of)() == pytest.approx(getattr(fine, of)()[::4], abs=0.003)


def test_rank_can_be_given():
    measured = random_sample(1, 4).measured(4, NOISE)
    assert [fit_material(measured, rank=k, support=SUPPORT).rank for k in (0, 1, 2)] == [0, 1, 2]


def test_smoothing_costs_no_more_than_the_noise():
    """It takes away what noise adds to the curvature of beta, and hardly anything that was there."""
    truth = random_sample(1, 11)
    measured = truth.measured(11, NOISE)
    rough, smooth = (fit_material(measured, rank=1, smooth=s, support=SUPPORT) for s in (False, True))
    bend = [
        np.sum(np.diff(fit.material.fluorophores[0].excitation.values, 2) ** 2) for fit in (rough, smooth)
    ]
    true = np.sum(np.diff(truth.beta[0], 2) ** 2)
    assert bend[0] > 1.3 * true
    assert 0.7 * true < bend[1] < true
    assert smooth.unexplained < 1.1 * rough.unexplained


def test_what_was_not_measured_is_said():
    material = fit_material(random_sample(1, 4).measured(4, NOISE), rank=1, support=(300, 780)).material
    assert material.reflectance.support == (300.0, 780.0)
    assert "reflectance below 380 nm not measured" in material.assumed
    assert "emission above 720 nm not measured, taken as 0" in material.assumed
    assert material.reflectance.at(310) == material.reflectance.at(380)


def test_luminescence_is_scaled_to_conserve_photons():
    """A matrix within measurement error of a photon yield of 1 becomes a material that is not above it."""
    truth = random_sample(1, 4)
    strong = Truth(truth.reflectance, 1.85 * truth.alpha, truth.beta)
    measured = strong.measured(4, 0.0005)
    assert 1.0 < measured.photon_yield().max() < 1.15
    fit = fit_material(measured, rank=1, support=SUPPORT)
    assert 0.85 < fit.scaled < 1
    assert fit.material.on(Wavelengths(330, 720, 10)).photon_yield().max() == pytest.approx(1, abs=1e-3)


def test_a_reflectance_that_was_not_measured_gives_way_to_luminescence():
    """A whitened paper measured from 400 nm on: S of 0.82 held below it and 0.28 luminescent photons make 1.10."""
    em, ex = np.arange(400.0, 701.0, 10.0), np.arange(300.0, 701.0, 10.0)
    bands = np.outer(np.exp(-(((em - 440) / 30) ** 2)), np.exp(-(((ex - 365) / 25) ** 2)))
    cells = 0.82 * (em[:, None] == ex[None, :]) + np.where(em[:, None] > ex[None, :], 0.045 * bands, 0.0)
    measured = MeasuredMatrix(em, ex, cells + np.random.default_rng(1).normal(0, 5e-4, cells.shape), "paper")
    lit = measured.photon_yield()[ex == 370][0]
    fit = fit_material(measured)
    D = fit.material.on(Wavelengths(300, 780, 10))
    assert fit.scaled == 1
    assert 0.25 < lit < 0.3
    assert (D.photon_yield() - D.reflectance)[7] == pytest.approx(lit, rel=0.03)
    assert D.reflectance[[0, 10]] == pytest.approx(0.82, abs=0.003)
    assert D.photon_yield().max() < 1
    assert "held at its value there, or less where luminescence leaves no room" in fit.material.assumed


def test_one_wavelength_without_room_does_not_weaken_the_others():
    """S = 1 at 620 nm, where the excitation has a tail: S gives way there, by less than its noise, and nothing else."""
    truth = random_sample(1, 4)
    white = Truth(np.where(EMISSION == 620, 0.9995, truth.reflectance), truth.alpha, truth.beta)
    fits = [fit_material(sample.measured(4, 0.0005), rank=1, support=SUPPORT) for sample in (truth, white)]
    assert fits[1].scaled > 0.99
    peaks = [fit.material.fluorophores[0].emission.values.max() for fit in fits]
    assert peaks[1] == pytest.approx(peaks[0], rel=0.01)


@pytest.mark.parametrize(("rank", "seed"), [(0, 1), (0, 2), (1, 3), (1, 4)])
def test_noise_is_found_where_somebody_zeroed_the_cells_above_the_diagonal(rank, seed):
    """Nothing is left above to tell the noise: its size comes from the roughness of the cells below, to 20 %."""
    measured = random_sample(rank, seed).measured(seed, NOISE)
    cleaned = replace(measured, cells=np.where(SHIFT < 0, 0.0, measured.cells))
    fit = fit_material(cleaned, support=SUPPORT)
    assert fit.noise.white == pytest.approx(NOISE, rel=0.2)
    assert fit.rank == rank


@pytest.mark.parametrize("rank", [-1, 1.5, True])
def test_an_impossible_rank_is_refused(rank):
    with pytest.raises(MaterialError, match="number of fluorophores"):
        fit_material(random_sample(0, 1).measured(1), rank=rank, support=SUPPORT)


def test_a_support_without_data_is_refused():
    with pytest.raises(MaterialError, match=r"(?s)850-900 nm.*380-720 nm.*--wavelengths"):
        fit_material(random_sample(1, 1).measured(1), support=(850.0, 900.0))


def test_terms_that_find_nothing_are_left_out():
    """No luminescence at all, or none within the support, whatever rank is asked for."""
    plain = MeasuredMatrix(EMISSION, EXCITATION, np.where(SHIFT == 0, 0.5, 0.0), "white")
    assert fit_material(plain, rank=2, support=SUPPORT).rank == 0
    red = fit_material(random_sample(1, 1).measured(1, 0.0005), rank=1, support=(640.0, 720.0))
    assert red.rank == 0


@pytest.mark.parametrize("S", [-0.2, 1.1])
def test_an_impossible_reflectance_is_refused(S):
    cells = np.where(SHIFT == 0, S, 0.0)
    with pytest.raises(MaterialError, match=r"reflectance .* outside 0 to 1"):
        fit_material(MeasuredMatrix(EMISSION, EXCITATION, cells, "sheet"))


def test_band_cells_taken_for_a_density_are_refused():
    """Cells that were multiplied with the step once too often give out more photons than they get."""
    measured = random_sample(1, 4).measured(4, 0.001)
    cells = np.where(SHIFT == 0, measured.cells, 10 * measured.cells)
    with pytest.raises(MaterialError, match="more photons than it gets") as error:
        fit_material(MeasuredMatrix(EMISSION, EXCITATION, cells, "sheet"))
    assert "sheet, excitation" in str(error.value)
    assert "density" in str(error.value)


def test_a_transposed_matrix_is_refused():
    measured = random_sample(1, 4).measured(4, 0.001)
    with pytest.raises(MaterialError, match="transpose"):
        MeasuredMatrix(EXCITATION, EMISSION, measured.cells.T, "sheet")


def test_mirrored_problem_finds_only_noise():
    measured = random_sample(1, 4).measured(4, NOISE)
    noise = estimate_noise(measured.cells, SHIFT / 10)
    gains = []
    for mirrored in (False, True):
        problem = Problem(measured.cells, SHIFT / 10, noise, mirrored=mirrored)
        gains.append(problem.nothing().misfit - problem.grow(problem.nothing()).misfit)
    assert gains[0] > 20 * gains[1]


def test_report_of_a_nearly_perfect_material_is_nearly_zero():
    measured = random_sample(1, 4).measured(4, 0.0)
    material = fit_material(measured, smooth=False, support=SUPPORT).material
    report = report_fit(measured, material)
    assert max(report.delta_e.values()) < 0.05
    assert report.unexplained < 5e-3
    known = report.grid.values >= 380  # where S was measured
    assert report.photon_yield[known] == pytest.approx(report.measured_photon_yield[known], abs=0.02)
    assert np.isnan(report.measured_photon_yield[~known]).all()


def test_report_sees_a_difference():
    """5 % more luminescence must show, most in light rich in ultraviolet and violet and least without it."""
    measured = random_sample(2, 4).measured(4, 0.0)
    material = fit_material(measured, rank=2, support=SUPPORT).material
    report = report_fit(measured, material.with_concentration(1.05))
    assert report.delta_e["D65"] > 0.2
    assert report.delta_e["D65+UV"] > report.delta_e["D65-UV"]


def test_report_against_a_computation_written_out():
    """CIEDE2000 under D65 between two greys, from XYZ summed by hand."""
    w = np.arange(380.0, 721.0, 10.0)
    measured = MeasuredMatrix(w, w, 0.30 * np.eye(35), "grey")
    report = report_fit(measured, Material("grey", Spectrum.constant(0.32)))
    L = [116 * np.cbrt(value) - 16 for value in (0.30, 0.32)]
    weight = 1 + 0.015 * (np.mean(L) - 50) ** 2 / np.sqrt(20 + (np.mean(L) - 50) ** 2)
    assert report.delta_e["D65"] == pytest.approx((L[1] - L[0]) / weight, rel=1e-6)
    assert report.delta_e_all_cells == pytest.approx(report.delta_e)


def test_lights_of_the_report():
    grid = Wavelengths(300, 780, 5)
    lights = report_lights(grid)
    w = grid.values
    assert np.all(lights["D65-UV"][w < 400] == 0)
    assert np.array_equal(lights["D65-UV"][w >= 400], lights["D65"][w >= 400])
    assert lights["D65+UV"][w == 365] - lights["D65"][w == 365] == pytest.approx(300)
