"""What is settled once for both sides of a comparison: unit, band shape, components, scene, aperture, points."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from fluorspar.comparing.compare import compare
from fluorspar.comparing.sources import unit_of_side
from fluorspar.errors import ImageError, OptionError, SpectrumError
from fluorspar.image.components import COMPONENTS, SINGLE_BOUNCE, TOTAL, select
from fluorspar.image.converted import converted
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of
from fluorspar.image.units import is_unit_of_radiance
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.image_scene import scene_of
from fluorspar.measuring.measure import measure
from fluorspar.measuring.point_spectra import PointSpectra, read_point_spectra, write_point_spectra
from fluorspar.measuring.points import Point
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.spectral.bands import Bands
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 700, 50)
PLACES = (Point("p", (3, 4)), Point("q", (5, 6)))


def image_of(components, level=1.0, size=(12, 9), grid=GRID, error=False, **attrs):
    """The same radiance in each component."""
    radiance = np.full((len(components), *size, len(grid)), level)
    errors = {}
    if error:
        errors = {
            "standard_error": 0.1 * radiance[0],
            "component_standard_error": np.arange(1, 1 + len(radiance))[:, None, None, None] * radiance,
        }
    return SpectralImage.from_arrays(radiance, grid, attrs=attrs, components=components, **errors)


def total_of(level=1.0, **options):
    return image_of((TOTAL,), level, **options)


def said(found):
    return " ".join(found.notes)


class TestComponents:
    def test_without_reexcitation_on_one_side_both_are_without(self):
        found = compare(image_of(COMPONENTS), image_of(SINGLE_BOUNCE, single_bounce=1))
        assert found.value("rmse") == 0
        assert "single_bounce), since B does not hold it" in said(found)

    def test_also_at_points_and_the_other_way_round(self):
        a, b = image_of(SINGLE_BOUNCE, single_bounce=1), image_of(COMPONENTS)
        found = compare(a, b, points=PLACES, aperture=Aperture(1, "px"))
        np.testing.assert_array_equal(found.points.b, 6)
        assert "since A does not hold it" in said(found)

    def test_also_if_one_side_was_added_up_before(self):
        assert compare(image_of(COMPONENTS), total_of(6.0, single_bounce=1)).value("rmse") == 0

    def test_what_both_hold_is_compared_and_nothing_is_said(self):
        for components in (COMPONENTS, SINGLE_BOUNCE):
            found = compare(image_of(components), image_of(components))
            assert found.images.mean_a[0] == len(components)
            assert "single_bounce" not in said(found)

    @pytest.mark.parametrize("suffix", [".nc", ".exr", ".hdr"])
    @pytest.mark.parametrize("component", ["total", "single_bounce", "luminescent"])
    def test_a_sum_says_what_it_holds_in_every_format(self, tmp_path, suffix, component):
        whole = converted(image_of(COMPONENTS), component)
        whole.save(tmp_path / f"a{suffix}")
        with SpectralImage.open(tmp_path / f"a{suffix}") as read:
            assert read.attrs["components"] == " + ".join(select(component))
            assert "only" not in said(compare(image_of(COMPONENTS), read, component=component))

    def test_a_total_that_holds_reexcitation_against_one_without(self, tmp_path):
        """Its reexcitation cannot be taken out again, so the report must say that it is in the difference."""
        image_of(COMPONENTS).save(tmp_path / "a.hdr")
        with SpectralImage.open(tmp_path / "a.hdr") as whole:
            found = compare(whole, image_of(SINGLE_BOUNCE, single_bounce=1))
        assert found.value("bias") == pytest.approx(1 / 7)
        assert "only A holds reexcitation, which is part of the difference" in said(found)

    def test_a_sum_without_reexcitation_against_all(self):
        found = compare(converted(image_of(COMPONENTS), "single_bounce"), image_of(COMPONENTS))
        assert found.value("rmse") == 0
        assert "since A does not hold it" in said(found)

    def test_an_image_that_does_not_say_is_said(self):
        found = compare(image_of(COMPONENTS), total_of(7.0))
        assert "B is not split and does not say what light it holds: taken as that of A" in said(found)
        assert "Components" not in said(compare(total_of(), total_of()))

    def test_errors_of_a_component_are_used(self):
        image = image_of(COMPONENTS, error=True)
        spectra = measure(image, PLACES, aperture=Aperture(1, "px"), component="direct_luminescence")
        np.testing.assert_allclose(spectra.standard_error, 3)
        other = image_of(COMPONENTS, 2.0, error=True)
        assert compare(image, other, component="direct_luminescence").images.noise.known_of == "A and B"
        assert compare(image, other, component="luminescent").images.noise.known_of == "A and B"

    def test_errors_of_single_bounce_are_those_of_the_total_and_it_is_said(self):
        found = compare(
            image_of(COMPONENTS, error=True), image_of(SINGLE_BOUNCE, error=True, single_bounce=1)
        )
        assert found.images.noise.known_of == "A and B"
        assert "A: standard errors of single_bounce are those of the total" in said(found)


class TestUnits:
    @pytest.mark.parametrize(
        "unit", ["W m-2 sr-1 nm-1", "W.m^-2.sr^-1.nm^-1", "W/(m2 sr nm)", "W m⁻² sr⁻¹ nm⁻¹"]
    )
    def test_spellings_of_radiance(self, unit):
        assert is_unit_of_radiance(unit)
        assert unit_of_side(total_of(unit=unit)) == "W m-2 sr-1 nm-1"

    @pytest.mark.parametrize(
        "unit", ["mW.cm^-2.sr^-1", "W.m^-2.sr^-1", "W m-2 sr-1", "1", "not stated", "W m-2 nm-1", "W W-1"]
    )
    def test_what_is_no_radiance(self, unit):
        assert not is_unit_of_radiance(unit)

    def test_units_that_differ_are_refused(self):
        with pytest.raises(OptionError, match=r"(?s)different units.*mW\.cm.*--match luminance"):
            compare(total_of(), total_of(unit="mW.cm^-2.sr^-1"))

    def test_unless_the_scales_are_matched(self):
        found = compare(total_of(), total_of(7.0, unit="1", quantity="reflectance"), match="luminance")
        assert found.value("rmse") < 1e-6
        assert "Units: A has 'W m-2 sr-1 nm-1', B has '1'" in said(found)

    def test_a_table_in_other_units(self):
        table = PointSpectra(("p",), Bands(GRID), np.ones((1, 7)), unit="counts")
        with pytest.raises(OptionError, match="different units"):
            compare(table, total_of(), points=PLACES, aperture=Aperture(1, "px"))

    def test_radiance_of_a_whole_band_is_not_per_nm(self):
        """In an EXR file it is spelt like that; elsewhere it is what it says."""
        with pytest.raises(OptionError, match="different units"):
            compare(total_of(), total_of(unit="W m-2 sr-1"))

    @pytest.mark.parametrize(
        ("line", "unit"), [("", "not stated"), ("# unit: W m-2 sr-1 nm-1", "W m-2 sr-1 nm-1")]
    )
    def test_a_table_has_the_unit_that_it_states(self, tmp_path, line, unit):
        path = tmp_path / "a.csv"
        path.write_text(f"{line}\nwavelength,p\n400,1\n500,1\n600,1\n")
        assert unit_of_side(read_point_spectra(path)) == unit
        found = compare(path, total_of(), points=PLACES, aperture=Aperture(1, "px"))
        assert ("a line '# unit: ...' states that of a table" in said(found)) == (not line)
        assert found.absolute == bool(line)

    def test_a_table_that_is_written_states_its_unit(self, tmp_path):
        for unit in ("W m-2 sr-1 nm-1", "not stated"):
            write_point_spectra(
                PointSpectra(("p",), Bands(GRID), np.ones((1, 7)), unit=unit), tmp_path / "a.csv"
            )
            assert read_point_spectra(tmp_path / "a.csv").unit == unit

    def test_a_unit_that_is_not_stated_is_said(self):
        assert "taken as the same" in said(compare(total_of(), total_of(unit="not stated")))

    def test_no_candela_without_radiance(self):
        found = compare(*[total_of(unit="mW.cm^-2.sr^-1")] * 2, points=PLACES, aperture=Aperture(1, "px"))
        assert "cd/m2" not in said(found)
        assert not found.absolute
        assert "cd/m2" in said(compare(total_of(), total_of()))

    def test_a_measurement_has_the_unit_of_the_image(self):
        spectra = measure(total_of(unit="mW.cm^-2.sr^-1"), PLACES, aperture=Aperture(1, "px"))
        assert spectra.unit == "mW.cm^-2.sr^-1"


class TestBandShapes:
    def test_images_say_what_they_are(self):
        assert bands_of(total_of(method="paths")).fwhm == 0
        assert bands_of(total_of(method="paths", bandwidth_nm=8.0)).fwhm == 8
        assert bands_of(total_of(method="another renderer")).fwhm is None

    def test_the_shape_of_a_converted_image_counts(self):
        coarse = image_of((TOTAL,), grid=Wavelengths(400, 700, 10), method="paths", bandwidth_nm=10.0)
        found = compare(coarse, image_of((TOTAL,), grid=Wavelengths(390, 710, 5), method="paths"))
        assert "B: 390-710 nm by 5, samples, brought to" in said(found)
        assert "triangles of 10 nm" in said(found)
        assert "not known" not in said(found)

    def test_the_shape_of_another_program_is_assumed_and_said(self):
        found = compare(
            image_of((TOTAL,), grid=Wavelengths(400, 700, 10)),
            image_of((TOTAL,), grid=Wavelengths(390, 710, 5), method="paths"),
        )
        assert "A: the band shape is not known; this triangle is assumed." in said(found)

    def test_the_spectroradiometer_passes_it_on(self):
        spectra = measure(total_of(method="paths", bandwidth_nm=10.0), PLACES, aperture=Aperture(1, "px"))
        assert spectra.bands.fwhm == 10


@pytest.mark.filterwarnings("ignore:the aperture is 0.125 degrees")
class TestScene:
    white = Point("white", (278.0, 0.0, 100.0))

    def test_an_image_without_a_scene_is_of_that_of_the_other(self):
        """The aperture of 1/8 degree, and the camera, are those of A for both."""
        slope = np.arange(64.0)[:, None, None] * np.ones((64, 64, 7)) + 1
        a, b = (
            SpectralImage.from_arrays(slope[None], GRID, attrs=attrs, components=(TOTAL,))
            for attrs in ({"scene": "cornell-box"}, {"scene": "room.xml"})
        )
        for first, second in ((a, b), (b, a)):
            found = compare(first, second, points=(self.white,))
            assert found.value("rmse_max") == 0
            assert said(found).count("aperture of 0.125 degrees") == 2

    def test_the_mesh_of_a_render_is_found_again(self, tmp_path, monkeypatch):
        """A render with a plate for the built-in body is measured on the plate.

        A point on top of the body is then in mid-air, and one on the plate is seen.
        """
        monkeypatch.chdir(tmp_path)
        trimesh.creation.box((2.0, 0.1, 2.0)).export(tmp_path / "plate.obj")
        options = {"size": (16, 16), "spp": 16, "wavelengths": "400:700:20"}
        scene = load_scene("cornell-mesh", parameters={"mesh": "plate.obj"})
        top = Point("top", (278.0, 16.5, 279.6))
        image = render(scene, **options)
        staged = render(scene, method="staged", max_depth=2, **options)  # without emitters, which take long
        (tmp_path / "elsewhere").mkdir()
        monkeypatch.chdir(tmp_path / "elsewhere")
        for made in (image, staged):
            assert measure(made, (top,)).names == ("top",)
        with pytest.raises(OptionError, match=r"hidden|not on a surface"):
            measure(image, (top,), scene=load_scene("cornell-mesh"))
        (tmp_path / "plate.obj").unlink()
        with pytest.raises(
            OptionError, match=r"(?s)mesh that the image was rendered with is gone.*plate\.obj.*-D mesh"
        ):
            scene_of(image.attrs)


@pytest.mark.filterwarnings("ignore:the aperture is 0.125 degrees")
class TestPoints:
    def test_images_of_two_sizes_at_positions(self):
        a, b = (total_of(size=(n, n), scene="cornell-box") for n in (64, 32))
        found = compare(a, b, points=(TestScene.white,))
        assert found.images is None
        assert found.value("rmse_max") < 1e-6
        assert "compared at the points only" in said(found)

    def test_but_not_at_pixels(self):
        with pytest.raises(OptionError, match=r"(?s)not the same places.*p, q.*9 x 12 and 8 x 12"):
            compare(total_of(), total_of(size=(12, 8)), points=PLACES)

    def test_sizes_that_differ_without_points(self):
        with pytest.raises(ImageError, match=r"(?s)differ in size.*positions in the scene"):
            compare(total_of(), total_of(size=(12, 8)))

    def test_measured_points_without_a_place_are_named(self):
        table = PointSpectra(("p", "q", "r"), Bands(GRID), np.ones((3, 7)))
        found = compare(table, total_of(), points=PLACES, aperture=Aperture(1, "px"))
        assert found.points.names == ("p", "q")
        assert "A: not compared, since they are not in the points file: points r." in found.notes

    @pytest.mark.parametrize("points", [None, PLACES])
    def test_an_aperture_that_measures_nothing_is_refused(self, points):
        side = total_of() if points is None else PointSpectra(("p",), Bands(GRID), np.ones((1, 7)))
        with pytest.raises(OptionError, match="an aperture is given, but no image is measured at points"):
            compare(side, side, points=points, aperture=Aperture(3, "px"))

    def test_wavelengths_beyond_the_data_are_refused(self):
        with pytest.raises(SpectrumError, match=r"(?s)reach beyond the data.*400-700 nm"):
            compare(total_of(), total_of(), wavelengths=Wavelengths(350, 700, 50))
        assert compare(total_of(), total_of(), wavelengths=Wavelengths(450, 650, 50)).grid.stop == 650

    def test_an_unknown_white_lists_what_there_is(self):
        with pytest.raises(SpectrumError, match=r"(?s)no such point.*no point.*D65.*--points"):
            compare(total_of(), total_of(), white="12")
        with pytest.raises(SpectrumError, match=r"(?s)no such point.*a point \(p, q\)"):
            compare(total_of(), total_of(), white="12", points=PLACES, aperture=Aperture(1, "px"))


class TestBlack:
    def test_black_and_black_do_not_differ(self):
        found = compare(total_of(0.0), total_of(0.0), points=PLACES, aperture=Aperture(1, "px"))
        for part in (found.points, found.images):
            results = part.as_dict()
            assert (results["rmse"], results["de00_max"], results["bias"]) == (0, 0, 0)

    @pytest.mark.parametrize("match", ["none", "luminance"])
    def test_a_black_reference_is_named(self, match):
        with pytest.raises(OptionError, match="A is black"):
            compare(total_of(0.0), total_of(1.0), match=match)

    def test_a_black_point_is_named(self):
        with pytest.raises(OptionError, match=r"(?s)B is black.*point p"):
            compare(total_of(1.0), total_of(0.0), match="p", points=PLACES, aperture=Aperture(1, "px"))

    def test_pixels_are_known_if_all_bands_are(self):
        a = total_of()
        a.dataset["radiance"][0, :, :, 3] = np.nan
        with pytest.raises(ImageError, match=r"(?s)no pixel that both images have.*A and B.*not stopped"):
            compare(a, total_of())


def test_files_are_closed(tmp_path, monkeypatch):
    total_of().save(tmp_path / "a.nc")
    closed = []
    monkeypatch.setattr(SpectralImage, "close", lambda self: closed.append(self))
    image = total_of()
    compare(str(tmp_path / "a.nc"), image)
    assert len(closed) == 1
    assert closed[0] is not image


class TestExcitationBelowTheFirstWavelength:
    """Rationale: with `excitation="grid"` no light below the first wavelength of an image excites."""

    long, short = Wavelengths(300, 700, 50), Wavelengths(400, 700, 50)
    said = "Luminescence: B was rendered from 400 nm on, so what 300-400 nm excites is in A only, which is part of"

    def notes(self, second=short, component=None, method="paths", **attrs):
        a = image_of(COMPONENTS, grid=self.long, method="paths")
        b = image_of(COMPONENTS, grid=second, method=method, **attrs)
        return " ".join(compare(a, b, component=component).notes)

    @pytest.mark.parametrize("method", ["paths", "staged"])
    def test_it_is_said(self, method):
        assert self.said in self.notes(method=method)

    @pytest.mark.parametrize(
        "case",
        [
            {"second": long},
            {"excitation": "350:700:50"},  # begun earlier than asked for, as early as anything excites
            {"component": "reflected"},
            {"method": "another"},
            {"converted": "from other bands"},
        ],
    )
    def test_it_is_not_said_where_it_is_not_so_or_not_known(self, case):
        assert "Luminescence" not in self.notes(**case)

    def test_nor_where_nothing_luminesces(self):
        dark = [image_of(COMPONENTS, grid=grid, method="paths") for grid in (self.long, self.short)]
        for image in dark:
            image.dataset["radiance"][[2, 4, 5, 6]] = 0.0
        assert "Luminescence" not in " ".join(compare(*dark).notes)


class TestInputsOfAnotherType:
    image = image_of(COMPONENTS)

    @pytest.mark.parametrize(
        "options",
        [
            *({"aperture": 3}, {"bandwidth_a": "x"}, {"component": 3}, {"white": 3}, {"match": 3}),
            *({"points": [(1, 2)]}, {"points": []}, {"points": 5}),
        ],
    )
    def test_options(self, options):
        with pytest.raises(OptionError, match="expected"):
            compare(self.image, self.image, **options)

    def test_wavelengths(self):
        with pytest.raises(SpectrumError, match="not readable"):
            compare(self.image, self.image, wavelengths=5)
        assert compare(self.image, self.image, wavelengths=[400, 500, 600]).grid == Wavelengths(400, 600, 100)

    @pytest.mark.parametrize("source", [image.dataset, None])
    def test_sources(self, source):
        with pytest.raises(OptionError, match=r"(?s)cannot be compared.*expected"):
            compare(self.image, source)

    def test_a_scene_needs_points(self):
        with pytest.raises(OptionError, match=r"(?s)at points.*furnace, and no points.*\(--points\)"):
            compare(self.image, self.image, scene="furnace")
