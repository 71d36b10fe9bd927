"""Tables of measured spectra as people and spreadsheets write them."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.errors import ApproximationWarning, OptionError, SpectrumError
from fluorspar.measuring.point_spectra import PointSpectra, read_point_spectra, write_point_spectra
from fluorspar.measuring.points import read_points
from fluorspar.spectral.bands import Bands
from fluorspar.spectral.wavelengths import Wavelengths

HEAD = "point,wavelength,radiance,standard_error\n"


@pytest.fixture
def read(tmp_path):
    def from_text(text):
        (tmp_path / "a.csv").write_text(text)
        return read_point_spectra(tmp_path / "a.csv")

    return from_text


class TestNames:
    def test_a_name_may_begin_with_a_hash(self, read, tmp_path):
        spectra = PointSpectra(("#1", "2"), Bands(Wavelengths(400, 410, 10)), np.array([[1.0, 2], [3, 4]]))
        write_point_spectra(spectra, tmp_path / "b.csv")
        assert read_point_spectra(tmp_path / "b.csv").names == ("#1", "2")
        (tmp_path / "p.csv").write_text("# places\npoint,x,y\n#1,2,3\n2,4,5\n")
        assert [point.name for point in read_points(tmp_path / "p.csv")] == ["#1", "2"]

    def test_a_comment_below_the_header_is_an_error_that_says_where_to_put_it(self, read):
        with pytest.raises(SpectrumError, match=r"(?s)wrong number of cells.*line 3.*before the header"):
            read("wavelength,1\n400,1\n# half time\n410,2\n")

    @pytest.mark.parametrize("end", [",", ",,"])
    def test_empty_columns_at_the_end_do_not_count(self, read, end):
        spectra = read(f"wavelength,1{end}\n400,1{end}\n410,2{end}\n")
        assert spectra.names == ("1",)
        np.testing.assert_array_equal(spectra.radiance, [[1, 2]])

    def test_a_column_without_a_name(self, read):
        with pytest.raises(SpectrumError, match=r"(?s)a column has no name.*line 2, column 3"):
            read("# measured\nwavelength,1,\n400,1,2\n410,2,3\n")

    def test_a_point_without_a_name(self, read):
        with pytest.raises(SpectrumError, match="a point has no name"):
            read(HEAD + ",400,1,0\n,410,1,0\n")


class TestErrors:
    @pytest.mark.parametrize("error", ["nan", "-0.1", "inf"])
    def test_an_impossible_one(self, read, error):
        with pytest.raises(
            SpectrumError, match=rf"(?s)standard error is impossible.*point 7, 410 nm.*{error}"
        ):
            read(f"{HEAD}7,400,1,0.1\n7,410,1,{error}\n")

    @pytest.mark.parametrize(
        ("line", "correlated"),
        [
            ("# errors: Correlated", True),
            ("# errors: correlated, as in a render", True),
            ("# errors: INDEPENDENT", False),
            ("", False),
        ],
    )
    def test_correlated_or_independent(self, read, line, correlated):
        assert read(f"{line}\n{HEAD}7,400,1,0.1\n7,410,1,0.1\n").correlated is correlated

    @pytest.mark.parametrize("word", ["uncorrelated", "yes", ""])
    def test_another_word_is_refused(self, read, word):
        with pytest.raises(SpectrumError, match=r"(?s)not known.*errors: correlated"):
            read(f"# errors: {word}\n{HEAD}7,400,1,0.1\n7,410,1,0.1\n")

    def test_degrees_of_freedom(self, read):
        spectra = read("point,wavelength,radiance,standard_error,freedom\n7,400,1,0.1,3\n7,410,1,0.1,3\n")
        np.testing.assert_array_equal(spectra.freedom, [3])

    @pytest.mark.parametrize("number", ["0", "-1", "nan"])
    def test_impossible_degrees_of_freedom(self, read, number):
        with pytest.raises(SpectrumError, match=r"(?s)degrees of freedom are impossible.*point 7"):
            read(f"point,wavelength,radiance,standard_error,freedom\n7,400,1,0.1,{number}\n7,410,1,0.1,3\n")

    def test_degrees_of_freedom_of_no_errors(self, read):
        with pytest.raises(SpectrumError, match="missing: standard_error"):
            read("point,wavelength,radiance,freedom\n7,400,1,3\n7,410,1,3\n")

    def test_those_that_are_not_known_are_not_written(self, tmp_path):
        ones = np.ones((1, 2))
        spectra = PointSpectra(("1",), Bands(Wavelengths(400, 410, 10)), ones, np.nan * ones)
        write_point_spectra(spectra, tmp_path / "a.csv")
        assert read_point_spectra(tmp_path / "a.csv").standard_error is None


class TestBandwidth:
    @pytest.mark.parametrize("text", ["", "wide", "-5", "nan"])
    def test_an_impossible_one(self, read, text):
        with pytest.raises(SpectrumError, match=r"(?s)bandwidth is impossible.*a\.csv.*# bandwidth: 8"):
            read(f"# bandwidth: {text}\nwavelength,1\n400,1\n410,2\n")


class TestWavelengths:
    def test_rounded_ones_are_those_they_were(self, read):
        """Thirds of 10 nm with two digits: nothing is interpolated, so nothing is said."""
        spectra = read("wavelength,1\n400.00,1\n403.33,2\n406.67,5\n410,3\n")
        assert len(spectra.grid) == 4
        np.testing.assert_array_equal(spectra.radiance, [[1, 2, 5, 3]])

    def test_slightly_uneven_ones_are_interpolated_and_said(self, read):
        """Thirds of 10 nm in whole nm: 403 + 1/3 is a twelfth of the way from 403 to 407."""
        rows = [(400, 1), (403, 2), (407, 5), (410, 3)]
        text = HEAD + "".join(f"1,{at},{value},{value}\n" for at, value in rows)
        with pytest.warns(ApproximationWarning, match=r"not evenly spaced \(steps of 3 to 4 nm\)"):
            spectra = read(text)
        np.testing.assert_allclose(spectra.radiance, [[1, 2 + 3 / 12, 5 - 3 / 12, 3]])
        np.testing.assert_allclose(spectra.standard_error, spectra.radiance)

    def test_a_gap_is_refused_and_shown(self, read):
        with pytest.raises(SpectrumError) as caught:
            read("wavelength,1\n400,1\n410,1\n430,1\n440,1\n")
        said = str(caught.value)
        assert "10 nm after 400, 20 nm after 410" in said
        assert said.count("got:") == 1
        assert "fix:" in said

    @pytest.mark.parametrize(
        "text", [HEAD + "1,400,1,0\n1,400,2,0\n1,410,1,0\n", "wavelength,1\n400,1\n400,2\n410,1\n"]
    )
    def test_one_that_occurs_twice(self, read, text):
        with pytest.raises(SpectrumError, match="400 nm occurs twice"):
            read(text)

    def test_one_that_a_point_lacks_is_named(self, read):
        with pytest.raises(SpectrumError, match=r"(?s)point 2.*410 nm at one of the two only.*point 1"):
            read(HEAD + "1,400,1,0\n1,410,2,0\n2,400,1,0\n")

    def test_micrometres(self, read):
        with pytest.raises(
            SpectrumError, match=r"(?s)too short for light.*0\.4 to 0\.7 nm.*micrometres times 1000"
        ):
            read("wavelength,1\n0.4,1\n0.7,2\n")

    @pytest.mark.parametrize("head", ["Wavelength [nm]", "wavelength/nm", "nm"])
    def test_their_unit_in_the_header(self, read, head):
        assert read(f"{head},1\n400,1\n410,2\n").names == ("1",)

    def test_only_one(self, read):
        with pytest.raises(SpectrumError, match="only one wavelength"):
            read("wavelength,1\n400,1\n")


def test_a_points_file_of_a_spreadsheet(tmp_path):
    (tmp_path / "p.csv").write_text("point,x,y,\n1,2,3,\n")
    assert read_points(tmp_path / "p.csv")[0].position == (2, 3)
    (tmp_path / "p.csv").write_text("point,x,y,\n1,2,3,4\n")
    with pytest.raises(OptionError, match="a column has no name"):
        read_points(tmp_path / "p.csv")
