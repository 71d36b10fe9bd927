"""Measured matrices: exact on their own wavelengths, interpolated as a density on others, never made up."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fluorspar.bispectral.files.registry import read_matrix
from fluorspar.bispectral.material import Material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import (
    ApproximationWarning,
    ExtrapolationWarning,
    MaterialError,
    PhotonYieldWarning,
    SpectrumError,
)
from fluorspar.spectral.wavelengths import Wavelengths

EMISSION = np.arange(380.0, 781.0, 10.0)
EXCITATION = np.arange(300.0, 781.0, 10.0)


def plane(em: np.ndarray, ex: np.ndarray) -> np.ndarray:
    """Return a density in 1/nm that linear interpolation meets exactly, 0 on and above the diagonal."""
    density = 1e-4 + 2e-6 * (em[:, None] - 380) - 1e-6 * (ex[None, :] - 300)
    return np.where(em[:, None] > ex[None, :], density, 0.0)


def reflectance(w: np.ndarray) -> np.ndarray:
    return 0.1 + (w - 380) / 2000


def plane_matrix(emission: np.ndarray = EMISSION, excitation: np.ndarray = EXCITATION) -> MeasuredMatrix:
    same = emission[:, None] == excitation[None, :]
    cells = np.where(same, reflectance(emission)[:, None], 10 * plane(emission, excitation))
    return MeasuredMatrix(emission, excitation, cells, "sheet")


def noisy_matrix() -> MeasuredMatrix:
    clean = plane_matrix()
    noise = np.random.default_rng(7).normal(0, 0.002, clean.cells.shape)
    return MeasuredMatrix(EMISSION, EXCITATION, clean.cells + noise, "noisy")


def sampled(matrix: MeasuredMatrix, grid: Wavelengths) -> tuple[np.ndarray, np.ndarray]:
    """S and D_L on a grid."""
    D = matrix.on(grid)
    return D.reflectance, D.density()


class TestOnItsOwnWavelengths:
    """Same step, measured wavelengths: back comes what was measured, noise above the diagonal included."""

    @pytest.mark.parametrize(
        "grid", [Wavelengths(380, 780, 10), Wavelengths(400, 700, 10), Wavelengths(550, 560, 10)]
    )
    def test_every_cell_is_as_given(self, grid: Wavelengths) -> None:
        matrix = noisy_matrix()
        S, density = sampled(matrix, grid)
        rows, columns = np.searchsorted(EMISSION, grid.values), np.searchsorted(EXCITATION, grid.values)
        cells = matrix.cells[np.ix_(rows, columns)]
        assert np.array_equal(S, np.diag(cells))
        assert 10 * density + np.diag(S) == pytest.approx(cells, rel=1e-15)
        assert np.count_nonzero(np.triu(density, 1)) == len(grid) * (len(grid) - 1) / 2

    def test_excitation_that_reaches_further_than_emission(self) -> None:
        """Rows below the first emission of 380 nm are 0, which is said; all other cells are as measured."""
        matrix = noisy_matrix()
        words = r"noisy: used on 300-780 nm by 10.*reflectance.* 380-780 nm.*emission measured for 380-780 nm"
        with pytest.warns(ExtrapolationWarning, match=words) as said:
            S, density = sampled(matrix, Wavelengths(300, 780, 10))
        assert len(said) == 1
        assert "excitation" not in str(said[0].message)
        assert not density[:8].any()
        assert 10 * density[8:, :8] == pytest.approx(matrix.cells[:, :8], rel=1e-15)
        assert (S[:8] == matrix.cells[0, 8]).all()


class TestOnOtherGrids:
    @pytest.mark.parametrize("step", [1, 2, 2.5, 5, 20])
    def test_a_linear_density_is_met_exactly_up_to_the_diagonal(self, step: float) -> None:
        """The diagonal holds S and says nothing of D_L; the plane through its neighbours fills it."""
        grid = Wavelengths(400, 760, step)
        reflected, density = sampled(plane_matrix(), grid)
        assert reflected == pytest.approx(reflectance(grid.values), rel=1e-12)
        assert density == pytest.approx(plane(grid.values, grid.values), rel=1e-9, abs=1e-15)

    def test_a_grid_between_the_samples(self) -> None:
        grid = Wavelengths(403, 753, 10)
        reflected, density = sampled(plane_matrix(), grid)
        assert density == pytest.approx(plane(grid.values, grid.values), rel=1e-9, abs=1e-15)
        assert reflected == pytest.approx(reflectance(grid.values))

    def test_up_to_the_ends_of_the_data(self) -> None:
        """The last cells of the diagonal have only one neighbour each; theirs is held."""
        _, density = sampled(plane_matrix(), Wavelengths(380, 780, 5))
        inner = plane(*2 * (Wavelengths(380, 780, 5).values,))
        assert density[:-2] == pytest.approx(inner[:-2], rel=1e-9, abs=1e-15)
        assert density[-1, -2] == pytest.approx(inner[-1, -2], rel=0.02)

    def test_either_side_of_the_diagonal_is_interpolated_by_itself(self) -> None:
        """A matrix given in full is used as given, noise above its diagonal included, on every grid."""
        matrix = plane_matrix()
        above = 0.01 * plane(matrix.excitation, matrix.emission).T
        noisy = replace(matrix, cells=matrix.cells + 10 * above)
        w = Wavelengths(400, 760, 5).values
        _, density = sampled(noisy, Wavelengths(400, 760, 5))
        assert density == pytest.approx(plane(w, w) + 0.01 * plane(w, w).T, rel=1e-9, abs=1e-15)

    def test_reflectance_that_was_not_measured_leaves_room_for_luminescence(self) -> None:
        """S is 0.8 at 400 nm; light of 360 nm gives out 0.35 photons: 0.8 held there would make 1.15."""
        em, ex = np.arange(400.0, 601.0, 10.0), np.arange(350.0, 601.0, 10.0)
        cells = 0.8 * (em[:, None] == ex[None, :])
        cells[em == 450, ex == 360] = 0.35 * 360 / 450
        with pytest.warns(ExtrapolationWarning, match="or less where luminescence leaves no room"):
            S, _ = sampled(MeasuredMatrix(em, ex, cells, "brightened"), Wavelengths(350, 600, 10))
        assert S[:3] == pytest.approx([0.8, 0.64, 0.8])
        assert S[5:] == pytest.approx(0.8)

    def test_from_10_to_5_nm_cells_halve_and_the_diagonal_stays(self) -> None:
        matrix = plane_matrix()
        S, density = sampled(matrix, Wavelengths(400, 700, 5))
        assert S[::2] == pytest.approx(np.diag(matrix.cells[2:33, 10:41]))
        assert 5 * density[20, 0] == pytest.approx(0.5 * matrix.cells[12, 10])

    def test_light_shifted_in_all_is_the_same_on_every_grid(self) -> None:
        """Flat light from 400-500 nm into 520-640 nm: the double integral of the plane."""
        totals = []
        for step in (2, 5, 10):
            grid = Wavelengths(380, 780, step)
            _, density = sampled(plane_matrix(), grid)
            em, ex = (grid.values >= 520) & (grid.values <= 640), (grid.values >= 400) & (grid.values <= 500)
            block = density[np.ix_(em, ex)]
            block[[0, -1]] /= 2
            block[:, [0, -1]] /= 2
            totals.append(step**2 * block.sum())
        # the plane's mean times its area: em 580, ex 450
        assert totals == pytest.approx([120 * 100 * (1e-4 + 2e-6 * 200 - 1e-6 * 150)] * 3, rel=1e-9)

    def test_beyond_the_excitation_nothing_is_made_up(self) -> None:
        with pytest.warns(
            ExtrapolationWarning, match=r"excitation measured for 300-780 nm \(0 assumed outside\)"
        ):
            S, density = sampled(plane_matrix(), Wavelengths(250, 800, 5))
        w = Wavelengths(250, 800, 5).values
        assert not density[:, w < 300].any()
        assert not density[w > 780].any()
        assert (S[w > 780] == reflectance(np.array([780.0]))).all()

    def test_within_the_data_nothing_is_said(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            plane_matrix().on(Wavelengths(380, 780, 2.5))

    def test_no_overlap(self) -> None:
        with pytest.raises(SpectrumError, match="do not overlap"):
            plane_matrix().on(Wavelengths(800, 900, 10))


@pytest.mark.parametrize("step", [1, 2.5, 5, 10])
def test_noise_on_part_of_a_fine_grid_is_not_a_transposed_matrix(step: float) -> None:
    """Interpolated noise is correlated, and a part of a matrix may hold no luminescence: the whole was checked."""
    cells = np.where(EMISSION[:, None] == EXCITATION[None, :], 0.5, 0.0)
    cells += np.random.default_rng(3).normal(0, 0.003, cells.shape)
    chip = Material.from_matrix("chip", MeasuredMatrix(EMISSION, EXCITATION, cells))
    for start in range(380, 700, 40):
        for stop in range(start + 40, 781, 40):
            chip.on(Wavelengths(start, stop, step))


def test_reflectance_that_was_not_measured_does_not_depend_on_concentration() -> None:
    """S held at 0.8 below 400 nm; 0.15 photons at 370 nm, six times as strong, make 1.7 and are refused."""
    em, ex = np.arange(400.0, 701.0, 10.0), np.arange(300.0, 701.0, 10.0)
    cells = 0.8 * (em[:, None] == ex[None, :])
    cells[em == 450, ex == 370] = 0.15 * 370 / 450
    sheet = Material.from_matrix("sheet", MeasuredMatrix(em, ex, cells))
    with pytest.warns(ExtrapolationWarning):
        S = [sheet.with_concentration(k).on(Wavelengths(300, 700, 10)).reflectance for k in (1, 0.5)]
    assert np.array_equal(*S)
    with pytest.warns(ExtrapolationWarning), pytest.raises(MaterialError, match=r"1\.7 photons out"):
        sheet.with_concentration(6).on(Wavelengths(300, 700, 10))


def test_a_reflectance_beyond_1_within_noise_is_set_to_1() -> None:
    cells = np.where(EMISSION[:, None] == EXCITATION[None, :], 0.999, 0.0)
    cells += np.random.default_rng(4).normal(0, 0.002, cells.shape)
    with pytest.warns(ApproximationWarning, match=r"a reflectance of 1\.00\d* at \d+ nm is set to 1: noise"):
        chip = Material.from_matrix("chip", MeasuredMatrix(EMISSION, EXCITATION, cells))
    assert chip.reflectance.values.max() == 1
    cells = np.where(EMISSION[:, None] == EXCITATION[None, :], 1.3, 0.0)
    with pytest.raises(SpectrumError, match="greater than 1"):
        Material.from_matrix("percent", MeasuredMatrix(EMISSION, EXCITATION, cells))


@pytest.mark.parametrize("step", [10.0, 5.0, 2.0, 1.0])
def test_whether_photons_are_conserved_does_not_depend_on_the_grid(step: float) -> None:
    """1.13 at 10 nm is measurement error; a finer grid continues cells up to the diagonal, and so adds to it."""
    w = np.arange(400.0, 701.0, 10.0)
    near = np.exp(-(w[:, None] - w[None, :]) / 15) * (w[:, None] > w[None, :])
    luminescent = near * np.exp(-(((w - 500) / 40) ** 2))
    cells = 0.4 * np.eye(31) + luminescent
    matrix = MeasuredMatrix(w, w, cells, "sheet")
    matrix = matrix.scaled_luminescence(0.73 / matrix.luminescent_photon_yield().max())
    assert 1.12 < matrix.photon_yield().max() < 1.15
    material = Material.from_matrix("sheet", matrix)
    with pytest.warns(PhotonYieldWarning, match="1.13 photons"):
        fine = material.on(Wavelengths(400, 700, step))
    if step == 1.0:
        assert fine.photon_yield().max() > 1.15  # what was judged before
    with pytest.raises(MaterialError, match="more photons"):
        material.with_concentration(1.1).on(Wavelengths(400, 700, step))


def test_the_stokes_side_of_a_matrix() -> None:
    """The diagonal and what is below stay, to the cell, on its own grid; on others nothing is above either."""
    w = np.arange(400.0, 501.0, 10.0)
    cells = np.random.default_rng(1).uniform(0, 0.02, (11, 11)) + 0.3 * np.eye(11)
    material = Material.from_matrix("sheet", MeasuredMatrix(w, w, cells))
    for D in (
        material.stokes_side().on(Wavelengths(400, 500, 10)),
        material.on(Wavelengths(400, 500, 10), "strict"),
    ):
        assert D.band() == pytest.approx(np.tril(cells), abs=1e-12)
    assert not np.triu(material.stokes_side().on(Wavelengths(400, 500, 2)).density(), 1).any()


def test_photon_yield_by_hand() -> None:
    w = np.array([400.0, 500.0])
    matrix = MeasuredMatrix(w, w, [[0.1, 0.0], [0.4, 0.7]])
    assert matrix.photon_yield() == pytest.approx([0.1 + 0.4 * 1.25, 0.7])


def test_scaled_luminescence_leaves_the_diagonal() -> None:
    w = np.array([400.0, 500.0])
    assert MeasuredMatrix(w, w, [[0.1, 0.0], [0.4, 0.7]]).scaled_luminescence(2).cells.tolist() == [
        [0.1, 0],
        [0.8, 0.7],
    ]


class TestFaults:
    def test_transposed(self) -> None:
        matrix = noisy_matrix()
        with pytest.raises(MaterialError, match=r"(?s)shifts light to shorter.*transpose"):
            MeasuredMatrix(EXCITATION, EMISSION, matrix.cells.T)

    @pytest.mark.parametrize(
        ("emission", "excitation", "complaint"),
        [
            ([400, 420, 410], [400, 410, 420], "emission wavelengths.*do not ascend"),
            ([400, 410, 420], [420, 410, 400], "excitation wavelengths.*do not ascend"),
            ([400, 410, 425], [400, 410, 420], "not evenly spaced"),
            ([400, 405, 410], [400, 410, 420], "not evenly spaced"),
            ([405, 415, 425], [400, 410, 420], "fewer than two cells"),
            ([500, 510, 520], [400, 410, 420], "fewer than two cells"),
            ([400, 410], [400, 410, 420], "do not fit"),
        ],
    )
    def test_wavelengths(self, emission: list[float], excitation: list[float], complaint: str) -> None:
        with pytest.raises(MaterialError, match=complaint):
            MeasuredMatrix(emission, excitation, np.zeros((3, 3)))

    def test_not_a_number(self) -> None:
        cells = plane_matrix().cells.copy()
        cells[5, 2] = np.nan
        with pytest.raises(MaterialError, match="emission 430 nm, excitation 320 nm"):
            MeasuredMatrix(EMISSION, EXCITATION, cells)


FILE = "# quantity: {quantity}\n# step: {step}\nemission\\excitation,{columns}\n400,0.5,0\n410,0.02,0.6\n"


def written(folder: Path, quantity: str = "band", step: str = "10", columns: str = "400,410") -> Path:
    file = folder / "sheet.csv"
    file.write_text(FILE.format(quantity=quantity, step=step, columns=columns))
    return file


class TestFile:
    @pytest.mark.parametrize(("quantity", "cell"), [("band", 0.02), ("density", 0.2)])
    def test_quantities(self, tmp_path, quantity: str, cell: float) -> None:
        matrix = read_matrix(written(tmp_path, quantity))
        assert matrix.cells.tolist() == [[0.5, 0], [cell, 0.6]]
        assert (matrix.emission.tolist(), matrix.excitation.tolist()) == ([400, 410], [400, 410])

    @pytest.mark.parametrize(
        ("parts", "complaint"),
        [
            ({"quantity": "percent"}, "(?s)'percent'.*'band' or 'density'"),
            ({"step": "ten"}, "(?s)does not state its step.*'ten'"),
            ({"step": "nan"}, "(?s)does not state its step.*'nan'"),
            ({"columns": "400,nan"}, "(?s)not a wavelength.*header, cell 3.*'nan'"),
            ({"step": "5"}, "(?s)step.*5 nm.*10 nm"),
            ({"columns": "400,x"}, "(?s)not a wavelength.*header, cell 3.*'x'"),
        ],
    )
    def test_malformed(self, tmp_path, parts: dict[str, str], complaint: str) -> None:
        with pytest.raises(MaterialError, match=complaint):
            read_matrix(written(tmp_path, **parts))

    def test_missing_header_and_missing_file(self, tmp_path) -> None:
        file = written(tmp_path)
        file.write_text("# quantity: band\n# step: 10\n400,0.5,0\n410,0.2,0.6\n")
        with pytest.raises(MaterialError, match="does not name every column"):
            read_matrix(file)
        with pytest.raises(MaterialError, match="does not exist"):
            read_matrix(tmp_path / "none.csv")
