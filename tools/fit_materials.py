"""Make the material and lamp files of the library from measured data.

    python tools/fit_materials.py DATA [--out src/fluorspar/data]

DATA is a folder that holds, anywhere below it, the measured Donaldson matrices named in `SAMPLES` (RIT .BFC
files, and the ICC's and Labsphere's as Donaldson .csv) and `cornell_reflectances_4nm.csv`. Everything else
- flat reflectances, dyes from published peak positions, the lamp of the Cornell box - stands in this file.
`python tools/quality_table.py` then writes the table of fit qualities into the docs.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fluorspar.bispectral.dye import dye
from fluorspar.bispectral.files.material_csv import write_material
from fluorspar.bispectral.files.registry import read_matrix
from fluorspar.bispectral.fit.fit import fit_material
from fluorspar.bispectral.fit.report import fit_quality, report_fit
from fluorspar.bispectral.material import Material
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

RIT = (
    "S. Gonzalez, M. Fairchild, Fluorescent Database, RIT Munsell Color Science Laboratory 1999, sample {}; "
    "fitted by Fluorspar"
)
ICC = (
    "International Color Consortium, DemoIccMAX FluorescentNamedColor profile (BSD-style licence), {}; "
    "values rounded to two decimals; fitted by Fluorspar"
)
LABSPHERE = "data courtesy of Labsphere Inc. (BSD-3-Clause), {}; fitted by Fluorspar"
CORNELL = 'Cornell University Program of Computer Graphics, Cornell box data ("for public use")'


@dataclass(frozen=True)
class Sample:
    """A measured matrix: the stem of its file, the material's name, what it is, and whom to thank."""

    stem: str
    name: str
    description: str
    source: str

    @property
    def credit(self) -> str:
        return self.source.format(self.stem)


SAMPLES = (
    Sample("IXCAXPRE", "poster-red", "Fluorescent red poster paint on an index card", RIT),
    Sample("IXCCLGE", "poster-green", "Fluorescent green poster paint (Colorations) on an index card", RIT),
    Sample("IXCCLYE", "poster-yellow", "Fluorescent yellow poster paint (Colorations) on an index card", RIT),
    Sample("IXAXOR2", "poster-orange", "Fluorescent orange poster paint (Colorations) on an index card", RIT),
    Sample("PAPRED", "paper-red", "Fluorescent red paper", RIT),
    Sample("PAPORAN", "paper-orange", "Fluorescent orange paper", RIT),
    Sample("PAPYEL", "paper-yellow", "Fluorescent yellow paper", RIT),
    Sample("PAPGRE", "paper-green", "Fluorescent green paper", RIT),
    Sample("PAPMAG", "paper-magenta", "Fluorescent magenta paper", RIT),
    Sample("INCWHITE", "paper-whitened", "White index card with an optical brightener", RIT),
    Sample("neon-orange", "neon-orange", "Neon orange ink", ICC),
    Sample("neon-yellow", "neon-yellow", "Neon yellow ink", ICC),
    Sample("postit_yellow", "sticky-note-yellow", "Yellow sticky note (3M Post-it)", LABSPHERE),
    Sample("postit_pink", "sticky-note-pink", "Pink sticky note (3M Post-it)", LABSPHERE),
    Sample("MCMODRED", "chart-moderate-red", "Moderate red patch of a Macbeth ColorChecker", RIT),
    Sample("brown", "ink-brown", "Brown ink", ICC),
)

FLAT = {
    "white-85": (0.85, "White, 'standard reference white' of rendered scenes"),
    "gray-45": (0.45, "Medium grey"),
    "gray-18": (0.18, "Photographer's grey"),
    "luminaire-78": (0.78, "Luminaire of the Cornell box"),
}

LITERATURE = (
    "peak wavelengths and quantum yield: general literature values, {}; "
    "band shapes, strength and substrate assumed"
)


def main() -> None:
    parser = argparse.ArgumentParser(
        description="Make the library's material and lamp files from measured data."
    )
    parser.add_argument("data", type=Path, help="folder with the measured matrices and reflectances")
    parser.add_argument("--out", type=Path, default=Path("src/fluorspar/data"), help="folder to write to")
    arguments = parser.parse_args()
    materials, lamps = arguments.out / "materials", arguments.out / "illuminants"
    materials.mkdir(parents=True, exist_ok=True)
    lamps.mkdir(parents=True, exist_ok=True)
    fitted = {sample.name: fit_sample(sample, find(arguments.data, sample.stem)) for sample in SAMPLES}
    others = (*flat_materials(), *cornell_materials(arguments.data), *dyes())
    for material in (*fitted.values(), *others, orange_on_gray(fitted["poster-orange"])):
        write_material(materials / f"{material.name}.csv", material)
        print(f"{material.name}: {material.quality}")
    write_cornell_lamp(lamps / "cornell-lamp.csv")


def find(folder: Path, stem: str) -> Path:
    """Return the one file of that stem below a folder."""
    files = [
        path for path in sorted(folder.rglob("*")) if path.is_file() and path.stem.lower() == stem.lower()
    ]
    if len(files) != 1:
        raise SystemExit(f"{folder}: expected one file named {stem}.*, found {len(files)}")
    return files[0]


def fit_sample(sample: Sample, path: Path) -> Material:
    """Fit a sample, and say how well at the measured step and at half of it."""
    fit = fit_material(
        read_matrix(path), name=sample.name, description=sample.description, credit=sample.credit
    )
    step = fit.measured.step
    coarse, fine = (report_fit(fit.measured, fit.material, h) for h in (step, step / 2))
    return replace(fit.material, quality=fit_quality(fit, coarse, fine))


def flat_materials() -> list[Material]:
    """Reflectances that are the same at every wavelength."""
    flat = []
    for name, (value, description) in FLAT.items():
        assumed = f"reflectance {value:g} at every wavelength is assumed, not measured"
        texts = {"description": description, "credit": "a definition by Fluorspar, not a measurement"}
        reflectance = Spectrum([300.0, 780.0], [value, value], f"reflectance of {name!r}", assumed)
        flat.append(Material(name, reflectance, **texts, quality="not fluorescent", assumed=assumed))
    return flat


def cornell_materials(data: Path) -> list[Material]:
    """The measured paints of the Cornell box."""
    path = find(data, "cornell_reflectances_4nm")
    table = np.genfromtxt(path, delimiter=",", names=True)
    assumed = (
        "reflectance below 400 nm not measured, held at its value there; reflectance above 700 nm likewise"
    )
    paints = []
    for colour in ("white", "green", "red"):
        wavelengths = np.concatenate([[300.0], table["wavelength_nm"], [780.0]])
        values = np.pad(table[colour], 1, mode="edge")
        name = f"cornell-{colour}"
        paints.append(
            Material(
                name,
                Spectrum(wavelengths, values, f"reflectance of {name!r}", assumed),
                description=f"{colour.capitalize()} paint of the Cornell box, as measured",
                credit=CORNELL,
                quality="measured at 400-700 nm every 4 nm; not fluorescent",
                assumed=assumed,
            )
        )
    return paints


def orange_on_gray(orange: Material) -> Material:
    """The luminescence of an orange paint on the grey of the boxes, weakened so that photons are conserved."""
    grid = Wavelengths(300, 780, 5)
    strong = replace(orange, reflectance=Spectrum([300.0, 780.0], [0.45, 0.45]))
    weak = strong.with_concentration(0.8)
    most, most_unscaled = (m.unchecked_on(grid).photon_yield().max() for m in (weak, strong))
    assumed = "the reflectance is assumed; emission below 380 nm taken as 0"
    return replace(
        weak,
        name="orange-on-gray",
        description="fluorescent orange on grey: reflectance 0.45 at every wavelength, luminescence 0.8 times that "
        "of an orange poster paint",
        credit="luminescence fitted by Fluorspar to sample IXAXOR2 of S. Gonzalez, M. Fairchild, Fluorescent "
        "Database, RIT Munsell Color Science Laboratory 1999",
        quality=f"rank 1; emission scaled by 0.8, so that on grey 0.45 at most {most:.3f} photons leave per photon "
        f"({most_unscaled:.3f} unscaled)",
        assumed=assumed,
    )


def write_cornell_lamp(path: Path) -> None:
    """The lamp of the Cornell box, piecewise linear."""
    rows = ((300, 0.0), (400, 0.0), (500, 8.0), (600, 15.6), (700, 18.4), (780, 18.4))
    lines = [
        "# name: cornell-lamp",
        "# description: Lamp of the Cornell box, relative spectral radiance, linear between the points",
        f"# credit: {CORNELL}",
        "# assumed: 0 below 400 nm, as at 400 nm; held above 700 nm at its value there",
        "wavelength,value",
        *(f"{wavelength},{value:g}" for wavelength, value in rows),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def band(peaks: list[tuple[float, float, float]], name: str) -> Spectrum:
    """A sum of bands (peak nm, full width at half maximum nm, height), Gaussian in wavenumber, scaled to 1."""
    wavelengths = np.arange(300.0, 780.1, 5.0)
    values = np.zeros_like(wavelengths)
    for peak, width, height in peaks:
        sigma = width / peak**2 / np.sqrt(8 * np.log(2))
        values += height * np.exp(-((1 / wavelengths - 1 / peak) ** 2) / (2 * sigma**2))
    values[values < 1e-4 * values.max()] = 0.0
    return Spectrum(wavelengths, values / values.max(), name)


def dyes() -> list[Material]:
    """Dyes from published peak positions, on white."""
    shape = "excitation and emission are sums of bands that are Gaussian in wavenumber; "
    surface = "on a substrate of reflectance 0.85 at every wavelength"
    made_up = [
        dye(
            band([(491, 33, 1.0), (466, 38, 0.30), (320, 40, 0.10)], "excitation of fluorescein"),
            band([(514, 30, 1.0), (545, 45, 0.35)], "emission of fluorescein"),
            quantum_yield=0.92,
            strength=0.6,
            units="photon",
            name="dye-fluorescein",
            description="Fluorescein as in alkaline solution (peaks 491 / 514 nm, quantum yield 0.92), on white",
            credit=LITERATURE.format("fluorescein in 0.1 M NaOH"),
            assumed=f"{shape}at its peak the dye absorbs 60 % of the light, {surface}",
        ),
        dye(
            band([(530, 32, 1.0), (496, 36, 0.32), (348, 40, 0.10)], "excitation of rhodamine 6G"),
            band([(553, 31, 1.0), (588, 45, 0.32)], "emission of rhodamine 6G"),
            quantum_yield=0.95,
            strength=0.6,
            units="photon",
            name="dye-rhodamine-6g",
            description="Rhodamine 6G as in ethanol (peaks 530 / 553 nm, quantum yield 0.95), on white",
            credit=LITERATURE.format("rhodamine 6G in ethanol"),
            assumed=f"{shape}at its peak the dye absorbs 60 % of the light, {surface}",
        ),
        dye(
            band([(350, 62, 1.0)], "excitation of a stilbene brightener"),
            band([(435, 50, 1.0), (415, 30, 0.35)], "emission of a stilbene brightener"),
            quantum_yield=0.7,
            strength=0.5,
            units="photon",
            name="dye-stilbene",
            description="Stilbene optical brightener (peaks 350 / 435 nm, quantum yield 0.7), on white",
            credit=LITERATURE.format("diaminostilbene brighteners on cellulose"),
            assumed=f"{shape}at its peak the dye absorbs 50 % of the light, {surface}",
        ),
    ]
    return [
        replace(material, quality="an idealised dye: not fitted to a measured surface")
        for material in made_up
    ]


if __name__ == "__main__":
    main()
