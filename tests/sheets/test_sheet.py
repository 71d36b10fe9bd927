"""`fluorspar.sheet`: every number is the one that `image`, `measure` and `compare` give for that combination."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fluorspar
from fluorspar import LightPaths, Point, SpectralImage, sheet
from fluorspar.colour.xyz import xyz_from_radiance
from fluorspar.errors import FluorsparError, ImageError, OptionError
from fluorspar.files import memory
from fluorspar.paths.chunks import CHUNK
from fluorspar.sheets.sheet_picture import sheet_picture
from fluorspar.sheets.sheet_table import write_sheet_table

GRID = "400:700:20"
LIGHTS: dict[str, list[Any]] = {"light": ["D65", ("A", 0.5)]}
MATERIALS = {"left-wall": ["poster-red", "poster-orange", "poster-red:0.3,poster-green:0.7"]}
CHANGES: dict[str, Any] = {"lights": LIGHTS, "materials": MATERIALS}
SPOTS = [Point("wall", (2, 12)), Point("floor", (12, 19))]


@pytest.fixture(scope="module")
def paths() -> LightPaths:
    return fluorspar.trace("cornell-box", size=(24, 24), spp=4, wavelengths=GRID)


@pytest.fixture(scope="module")
def images(paths: LightPaths) -> dict[tuple[int, int], SpectralImage]:
    """The image of each combination, made by itself."""
    return {
        (n, m): paths.image(lights={"light": lamp}, materials={"left-wall": dye})
        for n, lamp in enumerate(LIGHTS["light"])
        for m, dye in enumerate(MATERIALS["left-wall"])
    }


@pytest.mark.filterwarnings("ignore:the aperture is 0.125 degrees")
class TestPoints:
    @pytest.mark.parametrize(
        ("points", "aperture"), [(SPOTS, "3px"), (SPOTS, None), (Path("cornell-points.csv"), None)]
    )
    def test_the_same_as_measure(
        self,
        paths: LightPaths,
        images: dict[tuple[int, int], SpectralImage],
        points: Any,
        aperture: str | None,
    ) -> None:
        if isinstance(points, Path):
            points = Path(__file__).parents[2] / "examples" / points
        found = sheet(paths, **CHANGES, points=points, aperture=aperture)
        for index in ((0, 0), (1, 2)):
            image = images[index]
            total, once, more = (
                fluorspar.measure(image, points, scene="cornell-box", aperture=aperture, component=component)
                for component in (None, "luminescent", "reexcitation")
            )
            assert tuple(found.point.values) == total.names
            np.testing.assert_allclose(
                found.XYZ[index], xyz_from_radiance(total.radiance, total.grid), rtol=1e-6
            )
            share = (once.luminance() + more.luminance()) / total.luminance()
            np.testing.assert_allclose(found.luminescent_share[index], share, rtol=1e-6)

    @pytest.mark.parametrize("white", [None, "A", "floor"])
    def test_colours_the_same_as_compare(
        self, paths: LightPaths, images: dict[tuple[int, int], SpectralImage], white: str | None
    ) -> None:
        found = sheet(paths, **CHANGES, points=SPOTS, aperture="3px", white=white)
        for index, image in images.items():
            compared = fluorspar.compare(images[0, 0], image, points=SPOTS, aperture="3px", white=white)
            assert compared.points is not None
            np.testing.assert_allclose(found.Lab[index], compared.points.lab_b, atol=1e-4)
            np.testing.assert_allclose(found.delta_e[index], compared.points.de00, atol=1e-4)
        assert (found.delta_e[0, 0] == 0).all()
        assert (white or "D65") in found.attrs["white"]

    def test_from_a_file(self, paths: LightPaths, tmp_path: Path) -> None:
        """The camera of a built-in scene is known, that of another one has to be given."""
        paths.save(tmp_path / "box.paths")
        spot = [Point("back wall", (278, 400, 559.2))]
        expected = sheet(paths, lights=LIGHTS, points=spot)
        assert sheet(tmp_path / "box.paths", lights=LIGHTS, points=spot).identical(expected)
        kept = fluorspar.load_paths(tmp_path / "box.paths")
        scene = kept.job.scene
        other = replace(scene, recipe=replace(scene.recipe, name="room.xml"))
        renamed = LightPaths(replace(kept.job, scene=other), kept.chunks)
        with pytest.raises(OptionError, match=r"(?s)scene is needed for positions.*room.xml"):
            sheet(renamed, lights=LIGHTS, points=spot)
        given = sheet(renamed, lights=LIGHTS, points=spot, scene="cornell-box")
        np.testing.assert_array_equal(given.XYZ, expected.XYZ)


class TestWholePicture:
    def test_mean_of_the_pixels_without_the_lamp(
        self, paths: LightPaths, images: dict[tuple[int, int], SpectralImage]
    ) -> None:
        found = sheet(paths, **CHANGES)
        assert found.point.values.tolist() == ["whole picture"]
        for index, image in images.items():
            lit = [name for name in image.components if name != "source"]
            xyz = image.xyz(lit).mean(("y", "x"))
            np.testing.assert_allclose(found.XYZ[index][0], xyz, rtol=1e-5)
            glow = image.xyz(lit[1::2] + lit[4:5]).mean(("y", "x"))  # components 2, 4, 6 and 5
            np.testing.assert_allclose(found.luminescent_share[index][0], glow[1] / xyz[1], rtol=1e-5)

    def test_a_part_that_was_traced(self, paths: LightPaths) -> None:
        """As after Ctrl-C: the mean is over what there is, the rest of the pictures is NaN."""
        above = paths.job.scene.settings.width * 12
        half = LightPaths(paths.job, (replace(paths.chunks[0], pixels=above),))
        found = sheet(half, lights=LIGHTS)
        assert found.attrs["partial"] == 1
        assert np.isnan(found.rgb[:, 12:]).all()
        assert np.isfinite(found.rgb[:, :12]).all()
        lit = [name for name in fluorspar.COMPONENTS if name != "source"]
        xyz = half.image(lights={"light": "D65"}).xyz(lit)[:12].mean(("y", "x"))
        np.testing.assert_allclose(found.XYZ[0, 0], xyz, rtol=1e-5)

    def test_darkness(self, paths: LightPaths) -> None:
        with pytest.warns(fluorspar.errors.FluorsparWarning, match="0 everywhere"):
            found = sheet(paths, lights={"light": [1, 0]})
        assert np.isnan(found.luminescent_share[1]).all()
        assert (found.XYZ[1] == 0).all()
        assert (found.rgb[1] == 0).all()
        assert float(found.exposure[1]) == float(sheet(paths, lights={"light": [1]}).exposure[0])


class TestPictures:
    def test_one_exposure_for_all(
        self, paths: LightPaths, images: dict[tuple[int, int], SpectralImage]
    ) -> None:
        found = sheet(paths, **CHANGES)
        one = min(image.srgb().attrs["exposure"] for image in images.values())
        np.testing.assert_allclose(found.exposure, one, rtol=1e-5)
        for index, image in images.items():
            np.testing.assert_allclose(found.rgb[index], image.srgb(exposure=one), atol=1e-4)

    def test_each_its_own(self, paths: LightPaths, images: dict[tuple[int, int], SpectralImage]) -> None:
        found = sheet(paths, **CHANGES, exposure="each")
        for index, image in images.items():
            np.testing.assert_allclose(found.exposure[index], image.srgb().attrs["exposure"], rtol=1e-5)

    def test_a_given_one(self, paths: LightPaths) -> None:
        assert (sheet(paths, lights=LIGHTS, exposure=0.002).exposure == 0.002).all()

    @pytest.mark.parametrize("exposure", ["all", 0.0, -1.0, float("nan"), float("inf")])
    def test_an_impossible_one(self, paths: LightPaths, exposure: Any) -> None:
        with pytest.raises(OptionError, match=r"(?s)no such exposure.*same, each, or a positive number"):
            sheet(paths, lights=LIGHTS, exposure=exposure)

    def test_rows_are_those_of_the_last_list(self, paths: LightPaths) -> None:
        wide = sheet_picture(sheet(paths, **CHANGES)).shape
        high = sheet_picture(sheet(paths, lights=LIGHTS, materials={"left-wall": ["poster-red"]})).shape
        assert wide[1] > wide[0], "2 rows of 3"
        assert wide[1] > 1.4 * high[1], "1 row of 2"


def test_what_it_says(paths: LightPaths) -> None:
    found = sheet(paths, lights=LIGHTS, concentration={"left-wall": [0, 0.5]})
    assert found["light"].values.tolist() == ["D65", "A x 0.5"]
    assert found["left-wall"].values.tolist() == [0, 0.5]
    assert found["left-wall"].attrs["long_name"] == "concentration of 'left-wall'"
    assert found.XYZ.attrs["units"] == "cd m-2"
    assert found.attrs["wavelengths"] == "400-700 nm by 20"
    assert (found.attrs["spp"], found.attrs["scene"], found.attrs["exposure"]) == (4, "cornell-box", "same")


def test_another_grid(paths: LightPaths) -> None:
    found = sheet(paths, lights={"light": ["D65"]}, wavelengths="400:700:50")
    assert found.attrs["wavelengths"] == "400-700 nm by 50"
    lit = [name for name in fluorspar.COMPONENTS if name != "source"]
    expected = paths.image(lights={"light": "D65"}, wavelengths="400:700:50").xyz(lit).mean(("y", "x"))
    np.testing.assert_allclose(found.XYZ[0, 0], expected, rtol=1e-5)


def test_a_scene_is_traced_first(paths: LightPaths) -> None:
    scene = fluorspar.load_scene("cornell-box").with_settings(width=24, height=24, spp=4)
    found = sheet(scene, lights=LIGHTS, wavelengths=GRID)
    expected = sheet(paths, lights=LIGHTS)
    assert found.rgb.shape == expected.rgb.shape
    assert found.attrs["spp"] == 4


def test_table(paths: LightPaths, tmp_path: Path) -> None:
    found = sheet(paths, **CHANGES, points=SPOTS, aperture="3px")
    write_sheet_table(found, tmp_path / "table.csv")
    lines = (tmp_path / "table.csv").read_text().splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    assert "# wavelengths: 400-700 nm by 20" in comments
    assert "# left-wall: material of 'left-wall'" in comments
    rows = [line for line in lines if not line.startswith("# ")]
    assert rows[0] == "light,left-wall,point,X,Y,Z,L*,a*,b*,delta_e,luminescent_share"
    assert len(rows) == 1 + 2 * 3 * 2
    assert rows[6].startswith('D65,"poster-red:0.3,poster-green:0.7",floor,')
    numbers = [float(number) for number in rows[6].split(",")[-8:]]
    expected = found.isel(light=0, point=1).isel({"left-wall": 2})
    values = [*expected.XYZ.values, *expected.Lab.values, expected.delta_e, expected.luminescent_share]
    np.testing.assert_allclose(numbers, values, rtol=1e-5)


class TestBadInput:
    @pytest.mark.parametrize(
        ("changes", "says"),
        [
            ({}, "nothing to combine"),
            ({"lights": {"lamp": ["A"]}}, r"(?s)no light 'lamp'.*one of .*light"),
            ({"materials": {"left_wall": ["poster-red"]}}, r"(?s)no shape or BSDF 'left_wall'.*left-wall"),
            ({"lights": {"light": ["D65", "FL99"]}}, "no such illuminant"),
            ({"materials": {"left-wall": ["poster-red", "poster-rde"]}}, "(?s)no such material.*poster-red"),
            ({"concentration": {"left-wall": [1, -1]}}, "concentration of 'left-wall' is impossible"),
            (
                {"lights": {"light": ["D65"] * 100}, "concentration": {"left-wall": [1.0] * 100}},
                "10000 combinations",
            ),
        ],
    )
    def test_is_found_before_the_first_image(
        self, paths: LightPaths, changes: dict[str, Any], says: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def image(*_: object, **__: object) -> None:
            raise AssertionError("an image was made")

        monkeypatch.setattr(LightPaths, "image", image)
        with pytest.raises(FluorsparError, match=says):
            sheet(paths, **changes)

    def test_more_combinations_if_so_many_are_meant(self, paths: LightPaths) -> None:
        many = {"light": [0.5 + n for n in range(65)]}
        with pytest.raises(OptionError, match="at most 64"):
            sheet(paths, lights=many)
        assert sheet(paths, lights=many, most=65).sizes["light"] == 65

    def test_a_point_outside(self, paths: LightPaths) -> None:
        with pytest.raises(OptionError, match="outside the image"):
            sheet(paths, lights=LIGHTS, points=[Point("1", (24, 3))], aperture="1px")

    def test_pictures_that_do_not_fit_into_memory(
        self, paths: LightPaths, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(memory, "available_memory", lambda: 2**20)
        with pytest.raises(ImageError, match=r"(?s)not fit into memory.*the sheet"):
            sheet(paths, lights={"light": [1.0] * 3000}, most=3000)

    def test_interrupted(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Not all pictures is no sheet, while an image keeps what is finished."""
        monkeypatch.setitem(CHUNK, "llvm", 16)
        paths = fluorspar.trace("cornell-box", size=(8, 8), spp=1, wavelengths=GRID)

        def stop(done: int, total: int) -> None:
            assert total == 128
            if done > 64 + 32:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            sheet(paths, lights=LIGHTS, progress=stop)
