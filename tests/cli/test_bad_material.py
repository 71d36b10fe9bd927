"""What an unknown or impossible material gets."""

from __future__ import annotations

import re

import pytest
from command_line import GOOD, CommandLine, ball


def dye(photons: float) -> str:
    """A material file whose photon yield is about `photons`, greatest for light of 400 nm."""
    emission = (photons - 0.05) * 400 / 560
    rows = ["400,0.05,0,0.01", "500,0.05,0,0.01"]
    rows += [f"510,0.05,{emission},0", f"610,0.05,{emission},0", "620,0.05,0,0", "700,0.05,0,0"]
    return "\n".join(
        ["# fluorspar-material: 1", "# name: lamp oil", "wavelength,reflectance,emission,excitation", *rows]
    )


def donaldson(transposed: bool) -> str:
    """A Donaldson file in which a third of the light of each wavelength goes to longer ones, or the reverse."""
    w = range(400, 701, 50)
    rows = ["# quantity: band", "# step: 50", "nm," + ",".join(map(str, w))]
    for row in w:
        cells = [0.3 if row == column else 0.05 if (row > column) != transposed else 0.001 for column in w]
        rows.append(f"{row}," + ",".join(map(str, cells)))
    return "\n".join(rows)


class TestUnknown:
    MESSAGE = (
        "there is no such material",
        "got: 'poster-rad'",
        "expected: a file (.csv, .bfc), a mixture A:0.3,B:0.7, or one of:",
        "fix: did you mean poster-red",
    )

    def test_name_from_outside(self, fluorspar: CommandLine) -> None:
        assert fluorspar.refuses(GOOD, "--material", "ball=poster-rad").says(*self.MESSAGE)

    def test_name_in_a_mixture(self, fluorspar: CommandLine) -> None:
        assert fluorspar.refuses(GOOD, "--material", "ball=poster-rad:0.5,gray-45:0.5").says(*self.MESSAGE)

    def test_name_in_the_scene(self, fluorspar: CommandLine) -> None:
        named = ball(
            '<bsdf type="fluorescent" id="dye"> <string name="material" value="poster-rad"/> </bsdf>'
        )
        assert fluorspar.refuses(named).says(*self.MESSAGE, "BSDF 'dye' (fluorescent) of shape 'ball'")

    def test_shape(self, fluorspar: CommandLine) -> None:
        said = fluorspar.refuses(GOOD, "--material", "bal=poster-red")
        assert said.says(
            "no shape or BSDF has the id 'bal'", "expected: one of ball", "fix: did you mean ball?"
        )

    def test_file(self, fluorspar: CommandLine) -> None:
        said = fluorspar.refuses(GOOD, "--material", "ball=none.csv")
        assert said.says("the material file does not exist", "where: none.csv", "fix: check the name")

    def test_kind_of_file(self, fluorspar: CommandLine) -> None:
        fluorspar.write("mine.csv", "400,0.5\n700,0.5\n")
        said = fluorspar.refuses(GOOD, "--material", "ball=mine.csv")
        assert said.says(
            "does not say what it holds",
            "where: mine.csv",
            "expected: a line '# fluorspar-material: 1'",
        )


class TestTransposed:
    MESSAGE = (
        "a Donaldson matrix shifts light to shorter wavelengths",
        "where: sheet.csv",
        "above the diagonal",
        "expected: rows are emission, columns excitation wavelengths",
        "fix: transpose the matrix",
    )

    def test_from_outside(self, fluorspar: CommandLine) -> None:
        fluorspar.write("sheet.csv", donaldson(transposed=True))
        assert fluorspar.refuses(GOOD, "--material", "ball=sheet.csv").says(*self.MESSAGE)

    def test_in_the_scene(self, fluorspar: CommandLine) -> None:
        fluorspar.write("sheet.csv", donaldson(transposed=True))
        named = ball(
            '<bsdf type="fluorescent" id="dye"> <string name="donaldson" value="sheet.csv"/> </bsdf>'
        )
        assert fluorspar.refuses(named).says(*self.MESSAGE, "BSDF 'dye' (fluorescent) of shape 'ball'")

    def test_noise_above_the_diagonal_is_no_fault(self, fluorspar: CommandLine) -> None:
        fluorspar.write("sheet.csv", donaldson(transposed=False))
        done = fluorspar.render(GOOD, "--material", "ball=sheet.csv")
        assert (done.code, done.err) == (0, "")


class TestPhotonYield:
    def test_below_1_says_nothing(self, fluorspar: CommandLine) -> None:
        fluorspar.write("oil.csv", dye(photons=0.9))
        done = fluorspar.render(GOOD, "--material", "ball=oil.csv")
        assert (done.code, done.err) == (0, "")

    def test_a_little_above_1_warns(self, fluorspar: CommandLine) -> None:
        fluorspar.write("oil.csv", dye(photons=1.08))
        done = fluorspar.render(GOOD, "--material", "ball=oil.csv")
        assert done.code == 0
        assert done.says(
            "warning:", "lamp oil", "excitation 400 nm:", "photons out per photon in; used as it is"
        )
        assert done.err.count("warning:") == 1
        told = re.search(r"([\d.]+) photons", done.err)
        assert told
        assert 1 < float(told[1]) <= 1.15

    def test_far_above_1_is_refused(self, fluorspar: CommandLine) -> None:
        fluorspar.write("oil.csv", dye(photons=1.3))
        assert fluorspar.refuses(GOOD, "--material", "ball=oil.csv").says(
            "gives out more photons than it gets",
            "where:",
            "lamp oil",
            "excitation 400 nm",
            "photons out per photon in",
            "expected: at most 1 (up to 1.15 passes as measurement error)",
            "fix: check the quantity (band or density), the step and the concentration",
        )

    def test_concentration_in_the_scene(self, fluorspar: CommandLine) -> None:
        strong = ball(
            '<bsdf type="fluorescent"> <string name="material" value="poster-red"/>'
            ' <float name="concentration" value="5"/> </bsdf>'
        )
        assert fluorspar.refuses(strong).says("more photons than it gets", "where:", "poster-red")

    @pytest.mark.parametrize(
        ("value", "fault"), [("-1", "a concentration is impossible"), ("nan", "this is not a finite number")]
    )
    def test_impossible_concentration(self, fluorspar: CommandLine, value: str, fault: str) -> None:
        negative = ball(
            '<bsdf type="fluorescent" id="dye"> <string name="material" value="poster-red"/>'
            f' <float name="concentration" value="{value}"/> </bsdf>'
        )
        said = fluorspar.refuses(negative)
        assert said.says(fault, f"got: {value}")
        assert "'dye'" in said.err
