"""Reading a study: what its tables mean, and what is wrong with them before anything is rendered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluorspar.errors import OptionError
from fluorspar.studies.groups import groups_of
from fluorspar.studies.study import Study, read_study

BOX = {"scene": "cornell-box"}


def settings_of(study: Study) -> list[dict[str, Any]]:
    return [dict(row.settings) for row in study.rows]


def written(tmp_path: Path, text: str, name: str = "lamps.toml") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


class TestTables:
    def test_every_row_with_every_combination(self) -> None:
        study = read_study(
            {
                "render": BOX | {"spp": 4},
                "product": {"light": {"light": ["A", "D65"]}, "seed": [1, 2]},
                "rows": [{"spp": 8}, {"material": {"left-wall": "poster-red"}}],
            }
        )
        found = settings_of(study)
        assert len(found) == 8
        assert found[0] == {"scene": "cornell-box", "spp": 8, "light.light": "A", "seed": 1}
        assert found[-1] == BOX | {
            "spp": 4,
            "material.left-wall": "poster-red",
            "light.light": "D65",
            "seed": 2,
        }
        assert [row.number for row in study.rows] == list(range(1, 9))

    def test_a_range_has_both_ends(self, tmp_path: Path) -> None:
        text = """
            render.scene = "cornell-box"
            [product]
            concentration.left-wall = { start = 0, stop = 0.3, number = 4 }
            seed = { start = 1, stop = 3, number = 3 }
        """
        found = settings_of(read_study(written(tmp_path, text)))
        assert [row["concentration.left-wall"] for row in found[::3]] == [0, 0.1, 0.2, 0.3]
        assert [row["seed"] for row in found[:3]] == [1, 2, 3]
        assert isinstance(found[0]["seed"], int)

    def test_toml_and_csv_say_the_same(self, tmp_path: Path) -> None:
        text = 'render.scene = "furnace"\nrows = [{ spp = 4, D.width = "x", light.sky = "A" }, { spp = 8 }]'
        csv = "scene,spp,D.width,light.sky\nfurnace,4,x,A\n# not yet\nfurnace,8,,\n".replace(
            "# not yet\n", ""
        )
        found = [settings_of(read_study(written(tmp_path, *one))) for one in ((text,), (csv, "lamps.csv"))]
        assert found[0] == found[1]

    def test_files_are_beside_the_study(self, tmp_path: Path) -> None:
        study = read_study(written(tmp_path, "scene,seed\nfurnace,1\nfurnace,2\n", "lamps.csv"))
        assert [row.outputs for row in study.rows] == [
            (tmp_path / "lamps-1.nc",),
            (tmp_path / "lamps-2.nc",),
        ]
        assert study.index == tmp_path / "lamps-index"

    def test_a_row_may_name_its_file(self, tmp_path: Path) -> None:
        study = read_study(written(tmp_path, "scene,output\nfurnace,a.png\nfurnace,\n", "lamps.csv"))
        assert [row.outputs[0].name for row in study.rows] == ["a.png", "lamps-2.nc"]
        assert "output" not in study.rows[0].settings

    def test_lines_without_a_cell_are_none(self, tmp_path: Path) -> None:
        """As spreadsheets leave them."""
        for comma in ",;":
            text = ",,,,\nscene,seed,,,\nfurnace,1,,,\n,,,,\nfurnace,2,,,\n,,,,\n".replace(",", comma)
            rows = read_study(written(tmp_path, text, "lamps.csv")).rows
            assert [(row.number, row.settings["seed"]) for row in rows] == [(1, 1), (2, 2)]

    def test_what_python_has(self) -> None:
        render = {"scene": Path("box.xml"), "size": (8, 6), "spp": np.int64(4)}
        study = read_study({"render": render, "product": {"concentration": {"wall": np.linspace(0, 1, 3)}}})
        assert settings_of(study)[1] == {
            "scene": "box.xml",
            "size": "8x6",
            "spp": 4,
            "concentration.wall": 0.5,
        }

    def test_a_file_may_be_named_by_its_path(self, tmp_path: Path) -> None:
        (row,) = read_study({"render": BOX, "output": tmp_path / "a.nc"}).rows
        assert row.outputs == (tmp_path / "a.nc",)

    def test_several_files_a_row(self) -> None:
        study = read_study({"render": BOX, "output": ["a.nc", "a.png"]})
        assert [path.name for path in study.rows[0].outputs] == ["a.nc", "a.png"]


@pytest.mark.parametrize(
    ("tables", "parts"),
    [
        ({"rendr": BOX}, ("no 'rendr'", "did you mean render?")),
        ({"render": BOX | {"sp": 4}}, ("no option 'sp'", "did you mean spp?")),
        (
            {"render": BOX | {"lights": {"lamp": "A"}}},
            ("no option 'lights.lamp'", "did you mean light.lamp?"),
        ),
        ({"render": BOX | {"light": "A"}}, ("no option 'light'", "light.ID")),
        ({"render": BOX | {"spp": 4.5}}, ("not readable", "render, spp", "a whole number")),
        ({"render": BOX | {"spp": True}}, ("not readable", "render, spp")),
        ({"render": BOX | {"spp": [4, 8]}}, ("not readable", "render, spp")),
        ({"render": BOX | {"matte": "perhaps"}}, ("not readable", "true or false")),
        ({"render": BOX | {"size": "8"}}, ("not readable", "WIDTHxHEIGHT")),
        ({"render": {"spp": 4}}, ("a row has no scene",)),
        ({"render": BOX, "product": {"seed": 4}}, ("not a list of values", "product, seed", "start = 0")),
        ({"render": BOX, "product": {"seed": []}}, ("not a list of values",)),
        (
            {"render": BOX, "product": {"seed": {"start": 1, "stop": 4, "count": 2}}},
            ("not a list of values",),
        ),
        (
            {"render": BOX, "product": {"seed": {"start": "a", "stop": 4, "number": 2}}},
            ("range is not readable",),
        ),
        ({"render": BOX, "product": {"seed": {"start": 0, "stop": 1, "number": 3}}}, ("not readable", "0.5")),
        ({"render": BOX, "product": {"seed": [1]}, "rows": [{"seed": 2}]}, ("both in a row and", "seed")),
        ({"render": BOX, "rows": {"seed": 1}}, ("rows are not readable",)),
        ({"render": BOX, "output": "{lamp}.nc"}, ("no 'lamp'", "row 1")),
        ({"render": BOX | {"light": {"lamp": "A"}}, "output": "{lght}.nc"}, ("did you mean light",)),
        ({"render": BOX, "output": "{scene.nc"}, ("pattern",)),
        ({"render": BOX, "output": "a.jpg"}, ("cannot be written", ".nc")),
        ({"render": BOX, "output": 5}, ("output is not readable", "row 1", "5", "a pattern")),
        ({"render": BOX, "output": 0}, ("output is not readable", "0")),
        ({"render": BOX, "output": []}, ("output is not readable",)),
        ({"render": BOX, "output": ["a.nc", 5]}, ("output is not readable", "['a.nc', 5]")),
        ({"render": BOX, "rows": [{}, {"output": 5}]}, ("output is not readable", "row 2")),
        ({"render": BOX, "output": "{seed:c}.nc", "rows": [{"seed": 2**40}]}, ("pattern", "row 1")),
        ({5: 3}, ("no '5'",)),
        ({"render": BOX | {5: 3}}, ("no option '5'", "render")),
        ({"render": BOX, "product": {5: [3]}}, ("no option '5'", "product")),
        ({"render": BOX, "output": "a\0b.nc"}, ("output is not readable", r"a\x00b")),
        ({"render": BOX, "output": "{seed:c}.nc", "rows": [{"seed": 0}]}, ("pattern", "row 1")),
        ({"render": {"scene": "a\0b.xml"}}, ("not readable", "render, scene", r"a\x00b")),
        ({"render": BOX, "product": {"light.lamp": ["A\0"]}}, ("not readable", "light.lamp", r"A\x00")),
        ({"render": BOX, "rows": [{"D.a": "\0"}]}, ("not readable", "row 1, D.a")),
        ({"render": BOX | {"light.a\0": "A"}}, (r"no option 'light.a\x00'",)),
        ({"render": BOX | {"library": "a\ud800"}}, ("not readable", "library", r"a\ud800")),
        (
            {"render": BOX, "product": {"seed": [1, 2], "spp": [4, 8]}, "output": "{spp}.nc"},
            ("two renders have the same output", "rows 1 and 3", "{seed}"),
        ),
        ({"render": BOX, "rows": [{}, {}], "output": "a.nc"}, ("same output", "the rows are the same")),
    ],
)
def test_what_is_wrong_is_said(tables: dict[str, Any], parts: tuple[str, ...]) -> None:
    with pytest.raises(OptionError) as raised:
        read_study(tables)
    for part in parts:
        assert part in str(raised.value)


@pytest.mark.parametrize(
    ("name", "text", "part"),
    [
        ("lamps.toml", "render = ", "not valid TOML"),
        ("lamps.json", "{}", "cannot be a study"),
        ("lamps.csv", "scene,spp,spp\nfurnace,4,8\n", "the same name"),
        ("lamps.csv", "scene,spp\nfurnace\n", "number of cells"),
        ("lamps.csv", "", "(?s)no rows\n.*names of the columns"),
        ("lamps.csv", "scene,spp\n", "(?s)no rows\n.*names of the columns"),
        ("lamps.csv", "scene,spp\n,,,\n", "no rows\n"),
    ],
)
def test_a_file_that_is_none(name: str, text: str, part: str, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=part):
        read_study(written(tmp_path, text, name))


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="does not exist"):
        read_study(tmp_path / "nothing.toml")


@pytest.mark.parametrize(
    ("key", "value", "pattern", "name"),
    [
        ("light.lamp", "lamps/warm.csv", "{light}.nc", "warm.nc"),
        ("material.wall", "a/b:c d", "{material.wall}.nc", "b:c_d.nc"),
        ("concentration.left-wall", 0.25, "{concentration:.1f}.nc", "0.2.nc"),
        ("D.width", 3, "{D.width:03d}.nc", "003.nc"),
        ("seed", 3, "{scene}/{study}-{number}.nc", "cornell-box/render-1.nc"),
    ],
)
def test_names(key: str, value: object, pattern: str, name: str) -> None:
    kind, _, of = key.partition(".")
    given = {kind: {of: value}} if of else {key: value}
    (row,) = read_study({"render": BOX | given, "output": pattern}).rows
    assert row.outputs == (Path.cwd() / name,)


class TestGroups:
    def grouped(self, **tables: Any) -> list[list[int]]:
        rows = read_study({"render": BOX} | tables).rows
        return [[row.number for row in group.rows] for group in groups_of(rows, rows)]

    def test_spectra_share_light_paths(self) -> None:
        product: dict[str, list[Any]] = {
            "wavelengths": ["400:700:10", "400:700:20"],
            "stokes": ["half", "strict"],
        }
        assert self.grouped(product=product) == [[1, 2, 3, 4]]

    @pytest.mark.parametrize(
        "key", ["seed", "spp", "max_depth", "rr_depth", "D.a", "matte", "sensor", "variant"]
    )
    def test_what_is_traced_does_not(self, key: str) -> None:
        rows = [{key: "0", "light.light": "A"}, {key: "1", "light.light": "A"}]
        assert self.grouped(rows=rows) == [[1], [2]]

    @pytest.mark.parametrize("other", [{"until": "error=1%"}, {"method": "staged"}])
    def test_passes_and_stages_do_not(self, other: dict[str, str]) -> None:
        assert self.grouped(rows=[other | {"stokes": "half"}, other | {"stokes": "strict"}]) == [[1], [2]]

    def test_lights_follow_one_another(self) -> None:
        """Unpacked paths serve all lights."""
        product = {"light.light": ["A", "D65"], "material.left-wall": ["poster-red", "white-85"]}
        assert self.grouped(product=product) == [[1, 3, 2, 4]]

    def test_what_is_done_changes_nothing(self) -> None:
        """The same scene is loaded and traced for the rows that are left."""
        product = {"light.light": ["A", "D65"], "material.left-wall": ["poster-red", "white-85"]}
        rows = read_study({"render": BOX, "product": product}).rows
        (whole,), (left,) = groups_of(rows, rows), groups_of(rows, rows[:1])
        assert left.common == whole.common == BOX
        assert left.traced
