"""Spectra of points: apertures, positions in the scene, standard errors, bandwidth, normalisation, files."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from fluorspar.comparing.compare import compare
from fluorspar.errors import ApproximationWarning, ImageError, OptionError, SpectrumError
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.aperture import Aperture, coverage, directions
from fluorspar.measuring.measure import measure
from fluorspar.measuring.normalised import normalised
from fluorspar.measuring.point_spectra import PointSpectra, read_point_spectra, write_point_spectra
from fluorspar.measuring.points import Point, read_points
from fluorspar.scene.camera import camera_of
from fluorspar.scene.loading import load_scene
from fluorspar.spectral.bands import Bands
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 700, 50)
SHORT_BLOCK = (186.0, 165.0, 168.0)


@pytest.fixture
def image():
    """Pixel (x, y) has the radiance x + 100 y in component 1, the same at every wavelength; error 3."""
    radiance = np.zeros((7, 64, 64, len(GRID)))
    radiance[1] = (np.arange(64) + 100 * np.arange(64)[:, np.newaxis])[..., np.newaxis]
    return SpectralImage.from_arrays(
        radiance, GRID, np.full(radiance.shape[1:], 3.0), {"scene": "cornell-box"}
    )


class TestAperture:
    def test_one_pixel(self, image):
        spectra = measure(image, (Point("1", (5, 7)),), aperture=Aperture(1, "px"))
        np.testing.assert_array_equal(spectra.radiance[0], 705)

    def test_weights_are_the_covered_areas(self):
        """A disc of 20 pixels around a corner of pixels: the sum of what it covers is its area, symmetric."""
        _, _, weights = coverage(np.array([32.0, 32.0]), Aperture(20, "px"), (64, 64))
        assert weights.shape == (20, 20)
        assert 1 / weights.max() == pytest.approx(np.pi * 100, rel=2e-3)
        np.testing.assert_allclose(weights, weights[::-1])
        np.testing.assert_allclose(weights, weights.T)

    def test_the_mean_of_a_slope_is_its_centre(self, image):
        spectra = measure(image, (Point("1", (20, 30)),), aperture=Aperture(9, "px"))
        np.testing.assert_allclose(spectra.radiance[0], 3020, rtol=1e-6)

    @pytest.mark.parametrize("diameter", [0.3, 1.0, 1.9, 2.5, 6.0, 37.3])
    @pytest.mark.parametrize("unit", ["px", "deg"])
    def test_only_the_edge_is_subsampled_and_the_weights_are_those_of_all_subpixels(self, diameter, unit):
        matrix = camera_of(load_scene("cornell-box").with_settings(width=64, height=64)).matrix
        aperture = Aperture(diameter if unit == "px" else diameter / 2, unit)
        random = np.random.default_rng(3)
        for centre in random.uniform(0, 64, (6, 2)):
            rows, columns, weights = coverage(centre, aperture, (64, 64), matrix)
            at = (np.arange(64 * 16) + 0.5) / 16
            points = np.stack(np.meshgrid(at, at), axis=-1)
            if unit == "px":
                inside = np.linalg.norm(points - centre, axis=-1) <= diameter / 2
            else:
                cosines = directions(points, matrix) @ directions(centre, matrix)
                inside = cosines >= np.cos(np.radians(aperture.diameter / 2))
            expected = inside.reshape(64, 16, 64, 16).mean(axis=(1, 3))
            if not expected.any():
                expected[int(centre[1]), int(centre[0])] = 1
            found = np.zeros((64, 64))
            found[rows, columns] = weights
            np.testing.assert_allclose(found, expected / expected.sum(), atol=1e-9)

    def test_a_large_aperture_is_no_large_array(self):
        """Only pixels at the edge of an aperture are subsampled.

        400 pixels across: 125,664 pixels, of which about 3 per pixel of the circumference; all of them would take
        41 million points.
        """
        tracemalloc.start()
        coverage(np.array([256.0, 256.0]), Aperture(400, "px"), (512, 512))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 150e6

    def test_degrees_are_those_of_the_camera(self):
        """39.3077 degrees over 512 pixels: 512 / (2 tan(fov / 2)) pixels for a tangent of 1."""
        matrix = camera_of(load_scene("cornell-box")).matrix
        radius = 512 / (2 * np.tan(np.radians(39.3077 / 2))) * np.tan(np.radians(1.0))
        _, _, weights = coverage(np.array([256.0, 256.0]), Aperture(2.0, "deg"), (512, 512), matrix)
        assert 1 / weights.max() == pytest.approx(np.pi * radius**2, rel=5e-3)

    def test_an_aperture_below_a_pixel_measures_that_pixel(self, image):
        with pytest.warns(ApproximationWarning, match=r"0\.001 pixels, 0\.001 pixels wide.*touches"):
            spectra = measure(image, (Point("1", (5.2, 7.3)),), aperture=Aperture(0.001, "px"))
        np.testing.assert_array_equal(spectra.radiance[0], 705)

    def test_its_width_in_pixels_is_said(self, image):
        """64 pixels of 39.3077 degrees: a tangent of 0.125 degrees is 64 / (2 tan(fov / 2)) times as many pixels."""
        width = 64 / (2 * np.tan(np.radians(39.3077 / 2))) * 2 * np.tan(np.radians(0.125 / 2))
        said = f"0.125 degrees, {width:.2g} pixels wide: the pixels it touches are measured whole"
        with pytest.warns(ApproximationWarning, match=said):
            notes = measure(image, (Point("1", (32, 32)),)).notes
        assert notes[0] == f"mean under an aperture of {said}"
        with pytest.warns(ApproximationWarning, match=said):
            compare(image, image, points=(Point("1", (32, 32)),))
        with pytest.warns(ApproximationWarning, match=r"0\.1 degrees, 0\.16 pixels wide"):
            measure(image, (Point("1", (32, 32)),), aperture="0.1deg")

    def test_an_aperture_beyond_the_image_is_said(self, image):
        with pytest.warns(ApproximationWarning, match="point 1 reaches beyond"):
            measure(image, (Point("1", (0, 7)),), aperture=Aperture(5, "px"))

    @pytest.mark.parametrize("text", ["3", "px", "-1px", "0deg", "180deg", "nanpx", "infpx", "wide"])
    def test_unreadable(self, text):
        with pytest.raises(OptionError, match="aperture"):
            Aperture.parse(text)


class TestErrors:
    def test_pixels_are_independent(self, image):
        """The mean of pixels with weights w and errors 3 has the error 3 sqrt(sum of w^2)."""
        _, _, weights = coverage(np.array([20.5, 30.5]), Aperture(7, "px"), (64, 64))
        spectra = measure(image, (Point("1", (20, 30)),), aperture=Aperture(7, "px"))
        np.testing.assert_allclose(spectra.standard_error, 3 * np.sqrt(np.sum(weights**2)), rtol=1e-6)
        assert spectra.standard_error.max() < 3 / np.sqrt(30)

    def test_a_component_has_none(self, image):
        spectra = measure(
            image, (Point("1", (20, 30)),), aperture=Aperture(1, "px"), component="direct_reflection"
        )
        assert spectra.standard_error is None

    def test_a_pixel_that_was_not_rendered(self, image):
        image.dataset["radiance"][:, 30, 20] = np.nan
        with pytest.raises(ImageError, match=r"(?s)not rendered.*point 1"):
            measure(image, (Point("1", (20, 30)),), aperture=Aperture(1, "px"))


class TestNotes:
    points = (Point("w", (20, 30), white=0.85),)

    @pytest.mark.parametrize(
        ("component", "lit"), [(None, True), ("single_bounce", True), ("direct_reflection", False)]
    )
    def test_illuminance_is_that_of_all_light(self, image, component, lit):
        spectra = measure(image, self.points, aperture=Aperture(1, "px"), component=component)
        assert bool(spectra.illuminance()) is lit

    def test_a_bandwidth_beyond_the_data_is_said(self, image):
        spectra = measure(image, self.points, aperture=Aperture(1, "px"), bandwidth=60.0)
        assert "below 400 and above 700 nm the data are continued" in spectra.notes[-1]


class TestPositions:
    def test_a_position_is_measured_where_the_camera_sees_it(self, image):
        x, y = camera_of(load_scene("cornell-box").with_settings(width=64, height=64)).project(SHORT_BLOCK)
        with pytest.warns(ApproximationWarning, match="pixels wide"):
            there = measure(image, (Point("7", SHORT_BLOCK),), aperture=Aperture(1e-3, "px"))
        assert there.radiance[0, 0] == int(x) + 100 * int(y)

    def test_a_hidden_point_is_refused(self, image):
        """Behind the tall block, on the back wall."""
        with pytest.raises(OptionError, match=r"(?s)hidden from the camera.*point 9.*a surface at"):
            measure(image, (Point("9", (330, 150, 559.2)),))

    def test_a_point_in_the_air_is_refused(self, image):
        with pytest.raises(OptionError, match="not on a surface"):
            measure(image, (Point("1", (278, 400, 100)),))

    def test_a_point_outside_the_picture_is_refused(self, image):
        with pytest.raises(OptionError, match="outside the image"):
            measure(image, (Point("1", (64, 3)),), aperture=Aperture(1, "px"))

    def test_a_point_behind_the_camera_is_refused(self, image):
        with pytest.raises(OptionError, match="behind the camera"):
            measure(image, (Point("1", (278, 273, -900)),))

    def test_pixels_and_positions_in_one_file(self, image, tmp_path):
        (tmp_path / "p.csv").write_text("point,x,y,z\npixel,5,7,\nblock,186,165,168\n")
        points = read_points(tmp_path / "p.csv")
        assert [point.is_pixel for point in points] == [True, False]
        spectra = measure(image, points, aperture=Aperture(1, "px"))
        assert spectra.at("pixel")[0] == 705

    def test_without_a_scene_there_are_no_positions(self, image):
        image.dataset.attrs["scene"] = "room.xml"
        with pytest.raises(OptionError, match=r"(?s)scene is needed.*room\.xml.*--scene"):
            measure(image, (Point("1", SHORT_BLOCK),))


class TestExamplePoints:
    """The 13 points of examples/cornell-points.csv, in the manner of the paper's Figure 17."""

    points = read_points(Path(__file__).parents[2] / "examples" / "cornell-points.csv")

    @pytest.mark.filterwarnings("ignore:the aperture is 0.125 degrees")
    def test_the_camera_sees_all_of_them(self, image):
        spectra = measure(image, self.points)
        assert spectra.names == tuple(str(number) for number in range(1, 14))
        assert spectra.whites == {"12": 0.85}

    def test_they_are_on_different_surfaces_and_apart(self):
        """No two of them closer than 10 cm, and point 7 on top of the short block, 165 mm high."""
        at = np.array([point.position for point in self.points])
        distances = np.linalg.norm(at[:, np.newaxis] - at, axis=-1)[np.triu_indices(13, 1)]
        assert distances.min() > 100
        assert self.points[6].position[1] == 165


class TestQuantities:
    spectra = PointSpectra(("a", "w"), Bands(Wavelengths(550, 560, 5)), np.array([[0, 0.1, 0], [0, 0.2, 0]]))

    def test_luminance_by_hand(self):
        """0.2 W m-2 sr-1 nm-1 over 5 nm at 555 nm: 683 cd/m2."""
        np.testing.assert_allclose(self.spectra.luminance(), [341.5, 683.0], rtol=1e-9)

    def test_illuminance_of_a_white(self):
        lit = PointSpectra(self.spectra.names, self.spectra.bands, self.spectra.radiance, whites={"w": 0.5})
        assert lit.illuminance() == {"w": pytest.approx(np.pi * 683.0 / 0.5, rel=1e-9)}

    def test_normalised_at_a_white_reference(self):
        found = normalised(self.spectra, "w")
        np.testing.assert_allclose(found.radiance, [[0, 1.5, 0], [0, 3, 0]])
        assert found.unit == "1"

    def test_normalised_by_luminance(self):
        assert normalised(self.spectra, "luminance").luminance().mean() == pytest.approx(1)

    def test_an_unknown_reference_lists_the_points(self):
        with pytest.raises(OptionError, match=r"(?s)no such point.*a, w"):
            normalised(self.spectra, "7")

    def test_bandwidth_of_a_line(self):
        """A line seen through a triangle of 10 nm keeps its area.

        Of one 5 nm sample, the height is (2 / 10) (integral from 0 to 5 of (1 - u / 5) (1 - u / 10)) = 5 / 12.
        """
        line = PointSpectra(("1",), Bands(Wavelengths(400, 700, 5)), np.eye(1, 61, 30))
        seen = line.through(10.0)
        assert seen.radiance.sum() == pytest.approx(1.0)
        assert seen.radiance.max() == pytest.approx(5 / 12)
        assert seen.bands.fwhm == 10


class TestFiles:
    spectra = PointSpectra(
        ("left wall", "7"), Bands(GRID, 5.0), np.random.default_rng(1).random((2, 7)), np.full((2, 7), 0.01)
    )

    def test_tidy_round_trip(self, tmp_path):
        write_point_spectra(self.spectra, tmp_path / "a.csv")
        read = read_point_spectra(tmp_path / "a.csv")
        assert (read.names, read.bands) == (self.spectra.names, self.spectra.bands)
        np.testing.assert_array_equal(read.radiance, self.spectra.radiance)
        np.testing.assert_array_equal(read.standard_error, self.spectra.standard_error)

    def test_one_column_for_each_point(self, tmp_path):
        (tmp_path / "a.csv").write_text("# bandwidth: 8 nm\nwavelength;p;q\n410;1,5;3\n400;1;2\n")
        read = read_point_spectra(tmp_path / "a.csv")
        assert (read.names, read.bands.fwhm) == (("p", "q"), 8.0)
        np.testing.assert_array_equal(read.radiance, [[1, 1.5], [2, 3]])

    @pytest.mark.parametrize(
        ("text", "fault"),
        [
            ("point,wavelength,radiance,colour\n1,400,1,red\n", "unknown: colour"),
            ("point,wavelength\n1,400\n", "missing: radiance"),
            ("point,wavelength,radiance,radiance\n1,400,1,2\n1,410,1,2\n", "twice: radiance"),
            ("a,b\n1,2\n", "not a table of spectra"),
            ("point,wavelength,radiance\n1,400,x\n1,410,2\n", "not a number"),
            ("point,wavelength,radiance\n1,400,1\n1,410,2\n2,400,1\n", "does not have the wavelengths"),
            ("wavelength,1\n400,1\n410,1\n425,1\n", "wavelengths"),
            ("wavelength,1\n400,nan\n410,1\n", "not a finite number"),
            ("", "no rows"),
        ],
    )
    def test_malformed(self, tmp_path, text, fault):
        (tmp_path / "a.csv").write_text(text)
        with pytest.raises(SpectrumError, match=fault):
            read_point_spectra(tmp_path / "a.csv")

    @pytest.mark.parametrize(
        ("text", "fault"),
        [
            ("point,x,y,colour\n1,2,3,red\n", "unknown: colour"),
            ("point,x\n1,2\n", "missing: y"),
            ("point,x,y\n1,2,three\n", "not a number"),
            ("point,x,y\n1,2,3\n1,2,4\n", "twice"),
            ("point,x,y,white\n1,2,3,85\n", "white is impossible"),
            ("point,x,y\n1,2\n", "wrong number of cells"),
            ("point,x,y\n,2,3\n", "a point has no name"),
        ],
    )
    def test_malformed_points(self, tmp_path, text, fault):
        (tmp_path / "p.csv").write_text(text)
        with pytest.raises(OptionError, match=fault):
            read_points(tmp_path / "p.csv")


class TestInputsOfAnotherType:
    points = (Point("1", (2, 3)),)

    @pytest.mark.parametrize("points", [[(1, 2)], np.ones((2, 2)), {"a": (1, 2)}, 5, None])
    def test_what_is_no_point(self, image, points):
        with pytest.raises(OptionError, match=r"(?s)not a point.*sequence of Point.*points file"):
            measure(image, points)

    def test_no_points(self, image):
        with pytest.raises(OptionError, match="there are no points"):
            measure(image, [])

    @pytest.mark.parametrize(
        "options", [{"aperture": 3}, {"aperture": Aperture}, {"bandwidth": "x"}, {"component": 3}]
    )
    def test_options(self, image, options):
        with pytest.raises(OptionError, match="expected"):
            measure(image, self.points, **options)

    def test_a_dataset_is_not_an_image(self, image):
        with pytest.raises(ImageError, match=r"(?s)not a spectral image.*Dataset"):
            measure(image.dataset, self.points)

    @pytest.mark.parametrize("position", [5, ("a", "b"), (1, 2, 3, 4)])
    def test_positions(self, position):
        with pytest.raises(OptionError, match="not usable"):
            Point("1", position)

    @pytest.mark.parametrize("diameter", ["3", None, -1])
    def test_diameters(self, diameter):
        with pytest.raises(OptionError, match="impossible"):
            Aperture(diameter, "px")

    def test_a_scene_by_its_name(self, image):
        by_name = measure(image, self.points, scene="cornell-box", aperture="2deg")
        loaded = measure(image, self.points, scene=load_scene("cornell-box"), aperture="2deg")
        np.testing.assert_array_equal(by_name.radiance, loaded.radiance)
