"""Materials of every kind in the renderer: measured matrices, several fluorophores, mixtures, concentrations.

Rationale
    In uniform light L a convex body shows D L at every point, whatever its shape. Each sample's light is L times
    one number g that depends on geometry alone, so a pixel is g D L: its *spectrum* is held to D L to rounding,
    in all bands and components at once, and only g is left to statistics.
Expected
    D L is computed here from the cells or curves, band-weighted, without Fluorspar. Relative to the largest
    value, spectra agree to 2e-6, a few roundings of float32. g has mean 1 over pixels, which are the independent
    observations, and its z-scores a standard deviation of 0.95 to 1.05.
Result
    Spectra within 4e-7, for 1 to 4 dyes, a full noisy matrix, a mixture of both and scaled ones. z-scores of
    2304 pixels: mean 0.02, standard deviation 1.02. A fit, from the noisy cells of an instrument to the rendered file,
    shows the dye that went into them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import (
    FINE,
    Array,
    bell,
    bound,
    curve,
    light_values,
    luminescence,
    paint,
    sampled,
    sensor,
    values_and_errors,
    write,
    z_scores,
)

from fluorspar import Fluorophore, Material, SpectralImage, Spectrum, Wavelengths, load_scene, render
from fluorspar.bispectral.files.material_csv import write_material
from fluorspar.bispectral.fit.fit import fit_material
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import ExtrapolationWarning, MaterialError

GRID = Wavelengths(400, 700, 10)
W = GRID.values
L = sampled(light_values(), GRID)
S = 0.15 + 0.4 * (FINE - 300) / 480
DYES = (
    (bell(500, 25, 0.30), bell(430, 30)),
    (bell(560, 30, 0.35), bell(500, 35)),
    (bell(620, 35, 0.25), bell(470, 60)),
    (bell(650, 20, 0.10), bell(580, 25)),
)
ROUNDING = 2e-6

SPHERE = '<shape type="sphere" id="ball"> {} </shape>'


def scene(folder: Path, bsdf: str = '<bsdf type="diffuse"/>', size: int = 8, spp: int = 16) -> Path:
    """A ball that fills the view, in light of one radiance from everywhere."""
    sky = f'<emitter type="constant"> {curve("radiance", light_values())} </emitter>'
    camera = sensor(size, spp, origin="0, 0, 10", target="0, 0, 0", fov=5)
    return write(folder, f'<scene version="3.0.0"> {camera} {sky} {SPHERE.format(bsdf)} </scene>')


def assert_shows(image: SpectralImage, reflected: Array, luminescent: Array) -> None:
    """Each pixel is one number times these spectra; the mean of the numbers is 1."""
    values = image.dataset["radiance"].values.astype(float)
    expected = np.zeros_like(values[:, 0, 0])
    expected[1], expected[2] = reflected, luminescent
    total = reflected + luminescent
    strongest = int(total.argmax())
    g = values.sum(0)[..., strongest] / total[strongest]
    difference = values - g[None, :, :, None] * expected[:, None, None, :]
    assert np.abs(difference).max() < ROUNDING * total.max() * g.max()
    assert luminescent.max() > 0.05 * total.max(), "or the test would not see luminescence"
    pixels = g.size
    assert abs(g.mean() - 1) < bound(1) * g.std(ddof=1) / np.sqrt(pixels)
    assert g.std(ddof=1) < 0.2


def band_weighted(dyes: int) -> Array:
    """h D_L of the first so many dyes, half weight at equality."""
    return sum((luminescence(alpha, beta, GRID) for alpha, beta in DYES[:dyes]), np.zeros((len(W), len(W))))


def several(dyes: int) -> Material:
    fluorophores = tuple(
        Fluorophore(Spectrum(FINE, alpha), Spectrum(FINE, beta)) for alpha, beta in DYES[:dyes]
    )
    return Material("several", Spectrum(FINE, S), fluorophores)


def measured_cells() -> Array:
    """What an instrument would give: two dyes, noise of 0.003 per cell on both sides of the diagonal."""
    noise = np.random.default_rng(5).normal(0, 0.003, (len(W), len(W)))
    return np.diag(sampled(S, GRID)) + np.tril(band_weighted(2), -1) + noise


def sheet(folder: Path, cells: Array, name: str = "sheet.csv") -> Path:
    rows = ["# quantity: band", f"# step: {GRID.step:g}", "nm," + ",".join(f"{w:g}" for w in W)]
    rows += [f"{w:g}," + ",".join(f"{cell:.9g}" for cell in row) for w, row in zip(W, cells, strict=True)]
    return write(folder, "\n".join(rows), name)


@pytest.mark.parametrize("dyes", [1, 2, 3, 4])
def test_several_fluorophores(dyes: int, tmp_path: Path) -> None:
    image = render(
        load_scene(scene(tmp_path), materials={"ball": several(dyes)}),
        wavelengths=GRID,
        excitation="grid",
        seed=dyes,
    )
    assert_shows(image, sampled(S, GRID) * L, band_weighted(dyes) @ L)


def test_measured_matrix_in_full(tmp_path: Path) -> None:
    """On its own wavelengths a measured matrix is used cell by cell, noise above the diagonal included."""
    cells = measured_cells()
    sheet(tmp_path, cells)
    bsdf = '<bsdf type="fluorescent"> <string name="donaldson" value="sheet.csv"/> </bsdf>'
    image = render(
        load_scene(scene(tmp_path, bsdf, size=48, spp=64)), wavelengths=GRID, excitation="grid", seed=3
    )
    S_cells = np.diag(cells)
    D_L = cells - np.diag(S_cells)
    assert_shows(image, S_cells * L, D_L @ L)
    assert np.abs(np.triu(D_L, 1) @ L).max() > 100 * ROUNDING * (cells @ L).max(), "noise above counts"
    values, errors = values_and_errors(image)
    z = z_scores(values, errors, cells @ L, spp=64)[..., 10]  # all bands of a pixel say the same
    assert abs(z.mean()) < bound(1) / np.sqrt(z.size)
    assert 0.95 < z.std() < 1.05


def test_matrix_and_its_factors_are_the_same_surface(tmp_path: Path) -> None:
    """A full matrix made of two dyes shows what the two dyes show, sample by sample."""
    D_L = band_weighted(2)
    np.fill_diagonal(D_L, 0.0)  # a file holds S there and no half cell of luminescence
    sheet(tmp_path, np.diag(sampled(S, GRID)) + D_L)
    path = scene(tmp_path)
    factors = load_scene(path, materials={"ball": several(2)})
    matrix = load_scene(path, materials={"ball": str(tmp_path / "sheet.csv")})
    strict = render(factors, wavelengths=GRID, excitation="grid", seed=4, stokes="strict")
    full = render(matrix, wavelengths=GRID, excitation="grid", seed=4)
    a, b = (image.dataset["radiance"].values for image in (strict, full))
    assert np.abs(a - b).max() < ROUNDING * a.max()


def test_mixture_in_a_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """D is mixed linearly: 0.3 of a paint with factors, 0.7 of a measured matrix."""
    cells = measured_cells()
    (tmp_path / "paints").mkdir()
    sheet(tmp_path / "paints", cells, "B.csv")
    w = np.arange(300, 781, 1.0)
    rows = zip(w, S, DYES[2][0], DYES[2][1], strict=True)
    table = "\n".join(",".join(f"{value:.9g}" for value in row) for row in rows)
    head = "# fluorspar-material: 1\nwavelength,reflectance,emission,excitation\n"
    write(tmp_path / "paints", head + table, "A.csv")
    monkeypatch.setenv("FLUORSPAR_MATERIALS", str(tmp_path / "paints"))
    bsdf = '<bsdf type="fluorescent"> <string name="material" value="A:0.3,B:0.7"/> </bsdf>'
    image = render(load_scene(scene(tmp_path, bsdf)), wavelengths=GRID, excitation="grid", seed=6)
    S_cells = np.diag(cells)
    dye = luminescence(*DYES[2], GRID)
    reflected = (0.3 * sampled(S, GRID) + 0.7 * S_cells) * L
    assert_shows(image, reflected, 0.3 * dye @ L + 0.7 * (cells - np.diag(S_cells)) @ L)


@pytest.mark.parametrize("kind", ["factors", "matrix"])
def test_concentration_scales_luminescence_only(kind: str, tmp_path: Path) -> None:
    cells = measured_cells()
    sheet(tmp_path, cells)
    alpha, beta = DYES[1]
    what = (
        f"""{curve("reflectance", S)} <spectrum name="emission" value="{_pairs(alpha)}"/>
        <spectrum name="excitation" value="{_pairs(beta)}"/>"""
        if kind == "factors"
        else '<string name="donaldson" value="sheet.csv"/>'
    )
    bsdf = f'<bsdf type="fluorescent"> {what} <float name="concentration" value="0.4"/> </bsdf>'
    image = render(load_scene(scene(tmp_path, bsdf)), wavelengths=GRID, excitation="grid", seed=7)
    if kind == "factors":
        assert_shows(image, sampled(S, GRID) * L, 0.4 * luminescence(alpha, beta, GRID) @ L)
    else:
        S_cells = np.diag(cells)
        assert_shows(image, S_cells * L, 0.4 * (cells - np.diag(S_cells)) @ L)


def test_concentration_that_makes_photons_is_refused(tmp_path: Path) -> None:
    """The photon yield is checked after scaling: 0.35 of emission times 10 cannot be."""
    strong = paint("strong", S, *DYES[1]).with_concentration(10)
    with pytest.raises(MaterialError, match="more photons"):
        render(load_scene(scene(tmp_path), materials={"ball": strong}), wavelengths=GRID, excitation="grid")


def _pairs(values: Array) -> str:
    return ", ".join(f"{w:g}:{v:.9g}" for w, v in zip(FINE, values, strict=True))


WIDE = Wavelengths(300, 780, 10)
EMITTED = WIDE.values >= 380


def instrument() -> tuple[Array, Array]:
    """What a bispectral instrument gives of one dye, emission 380-780 by excitation 300-780 nm; S on all of WIDE."""
    own = sampled(S, WIDE)
    cells = luminescence(*DYES[1], WIDE, equal=0.5) + np.diag(own)
    cells += np.random.default_rng(8).normal(0, 0.001, cells.shape)
    return cells[EMITTED], own


def instrument_scene(folder: Path) -> Path:
    sky = '<emitter type="constant"> <spectrum name="radiance" value="300:0.5, 780:1.3"/> </emitter>'
    camera = sensor(8, 16, origin="0, 0, 10", target="0, 0, 0", fov=5)
    ball = SPHERE.format('<bsdf type="diffuse"/>')
    return write(folder, f'<scene version="3.0.0"> {camera} {sky} {ball} </scene>')


LIGHT = 0.5 + 0.8 * (WIDE.values - 300) / 480


def test_matrix_of_an_instrument_in_full(tmp_path: Path) -> None:
    """More columns than rows: below 380 nm nothing was measured, S is held there and nothing luminesces."""
    cells, _ = instrument()
    w = WIDE.values
    matrix = Material.from_matrix("sheet", MeasuredMatrix(w[EMITTED], w, cells))
    with pytest.warns(ExtrapolationWarning, match="reflectance measured for 380-780 nm"):
        image = render(
            load_scene(instrument_scene(tmp_path), materials={"ball": matrix}), wavelengths=WIDE, seed=9
        )
    D = np.vstack([np.zeros((8, len(w))), cells])
    own = np.diag(D).copy()
    own[:8] = own[8]
    D_L = D - np.diag(np.diag(D))
    assert_shows(image, own * LIGHT, D_L @ LIGHT)


def test_fit_of_an_instrument_shows_what_the_fit_says(tmp_path: Path) -> None:
    """The rank-1 fit, written to a file and rendered: alpha beta^T of the file, summed here, to 6 digits of the table.

    And close to the truth: noise of 0.001 in 49 cells of a row makes 0.007 of L; smoothing shares that between rows.
    """
    cells, own = instrument()
    w = WIDE.values
    fit = fit_material(MeasuredMatrix(w[EMITTED], w, cells, "sheet"))
    assert fit.rank == 1
    file = write_material(tmp_path / "fitted.csv", fit.material)
    lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    table = np.genfromtxt(lines, delimiter=",", names=True)
    at = np.searchsorted(table["wavelength"], w)
    alpha, beta = table["emission"][at], table["excitation"][at]
    D_L = WIDE.step * np.outer(alpha, beta / np.trapezoid(table["excitation"], table["wavelength"]))
    D_L = np.tril(D_L, -1) + 0.5 * np.diag(np.diag(D_L))
    image = render(
        load_scene(instrument_scene(tmp_path), materials={"ball": str(file)}), wavelengths=WIDE, seed=10
    )
    assert_shows(image, table["reflectance"][at] * LIGHT, D_L @ LIGHT)
    true = luminescence(*DYES[1], WIDE) @ LIGHT
    assert np.abs((D_L @ LIGHT - true)[EMITTED]).max() < 0.007
    assert np.abs(table["reflectance"][at] - own)[EMITTED].max() < 0.004
