"""Comparisons, files to be taken away, and command lines."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner
from window_parts import Ask, image_of

from fluorspar import LightPaths, SpectralImage, compare
from fluorspar.cli.main import app
from fluorspar.view.sources import ImageSource


def test_a_comparison_is_that_of_compare(ask: Ask, image: SpectralImage, other: SpectralImage) -> None:
    answer = ask("compare", a={"source": "0"}, b={"source": "1"})
    comparison = compare(image, other)
    assert comparison.images is not None
    results = comparison.images.as_dict()
    for name, key in (
        ("mean", "de00_mean"),
        ("p95", "de00_95"),
        ("max", "de00_max"),
        ("rmse", "rmse"),
        ("bias", "bias"),
    ):
        assert answer[name] == results[key]
    assert answer["median"] == float(np.median(comparison.images.de00))
    assert answer["png"].startswith("data:image/png;base64,")


def test_weights_are_compared(ask: Ask, image: SpectralImage) -> None:
    alone = {name: 0.0 for name in image.components if name != "direct_reflection"}
    answer = ask("compare", a={"source": "0", "weights": alone}, b={"source": "0"})
    assert answer["bias"] == pytest.approx(
        float(image.total().sum() / image.component("direct_reflection").sum()) - 1, rel=1e-4
    )
    assert ask("compare", a={"source": "0"}, b={"source": "0"})["max"] == 0


def test_sizes_that_differ(workspace: Any, refused: Ask) -> None:
    small = image_of(0)
    workspace.sources["1"] = ImageSource("small", SpectralImage(small.dataset.isel(x=slice(0, 4))))
    assert "8 x 6 pixels and 4 x 6 pixels" in refused("compare", a={"source": "0"}, b={"source": "1"})


@pytest.mark.parametrize("suffix", ["nc", "exr"])
def test_a_saved_image_is_the_image(ask: Ask, paths: LightPaths, tmp_path: Path, suffix: str) -> None:
    """Weights are a way of looking: all components are there as they are."""
    relight = {"lights": {"light": {"factor": 2}}}
    response = ask(
        "save", source="2", format=suffix, name="../my room.paths", relight=relight, weights={"source": 0}
    )
    assert response.headers["content-disposition"] == f'attachment; filename="my_room.{suffix}"'
    file = tmp_path / f"saved.{suffix}"
    file.write_bytes(response.content)
    expected = paths.image(lights={"light": 2.0})
    with SpectralImage.open(file) as saved:
        assert np.array_equal(saved.dataset["radiance"].values, expected.dataset["radiance"].values)
        assert saved.attrs["spp"] == 8


def test_a_saved_picture_is_what_is_seen(ask: Ask) -> None:
    view: dict[str, Any] = {"source": "0", "weights": {"source": 0.5}, "white": "A"}
    assert ask("save", format="png", **view).content == ask("picture", **view).content


def test_a_saved_table_is_that_of_the_pins(ask: Ask) -> None:
    pins = [{"name": "1", "region": [0, 0, 1, 1]}]
    assert (
        ask("save", source="0", format="csv", pins=pins).content == ask("csv", source="0", pins=pins).content
    )
    assert b"all" in ask("save", source="0", format="csv").content


def test_the_command_line_of_paths(client: TestClient, ask: Ask, lamp_file: bytes) -> None:
    upload = client.post(
        "api/upload",
        params={"name": "my dye.csv", "kind": "material"},
        content=(b"# fluorspar-material: 1\nwavelength,reflectance\n300,0.2\n780,0.2\n"),
    ).json()["id"]
    answer = ask(
        "command",
        source="2",
        relight={
            "lights": {"light": {"factor": 2, "spectrum": {"blackbody": 3000}}},
            "materials": {"left-wall": upload},
            "concentration": {"right-wall": 0.5},
        },
        white="A",
    )
    relight, convert = (shlex.split(line) for line in answer["command"].splitlines())
    assert relight == [
        "fluorspar",
        "relight",
        "box.paths",
        "--light",
        "light=light.csv",
        "--material",
        "left-wall=my dye.csv",
        "--concentration",
        "right-wall=0.5",
        "-o",
        "image.nc",
    ]
    assert convert == ["fluorspar", "convert", "image.nc", "picture.png", "--white", "A"]
    curve = ask("curve", source="2", id="light", light={"factor": 2, "spectrum": {"blackbody": 3000}})
    rows = [line.split(",") for line in answer["files"]["light.csv"].splitlines()[1:]]
    assert [float(value) for _, value in rows] == curve["values"]


def test_the_command_line_of_an_image_runs(
    ask: Ask, image: SpectralImage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    image.save("box.nc")
    program, *words = shlex.split(ask("command", source="0", white="A")["command"])
    assert program == "fluorspar"
    assert CliRunner().invoke(app, words).exit_code == 0
    assert Path("picture.png").is_file()


def test_the_white_of_a_light_is_in_the_command_line(ask: Ask) -> None:
    """As its XYZ: a command knows no lights of the scene; and what it does not do is said."""
    view = {"source": "2", "white": {"light": "light"}}
    words = shlex.split(ask("command", **view)["command"])
    white = [float(value) for value in words[words.index("--white") + 1].split(",")]
    facts = json.loads(ask("picture", **view).headers["X-Fluorspar"])
    assert white == pytest.approx(facts["white"], rel=1e-5)
    assert "plain colour" in " ".join(ask("command", source="0", mode="band")["notes"])
    assert ask("command", source="0")["notes"] == []


def test_factors_are_not_rounded(ask: Ask) -> None:
    relight = {"lights": {"light": {"factor": 0.3333333}}, "concentration": {"right-wall": 0.1234567}}
    words = shlex.split(ask("command", source="2", relight=relight)["command"])
    assert {"light=0.3333333", "right-wall=0.1234567"} <= set(words)


def test_names_are_chosen_from_the_library(client: TestClient) -> None:
    library = client.get("api/about").json()["library"]
    paint = next(row for row in library["materials"] if row["name"] == "poster-red")
    assert paint["fluorescent"] is True
    assert len(paint["srgb"]) == 7
    assert {"A", "D65", "FL11"} <= {row["name"] for row in library["illuminants"]}
