"""Other lights and materials: the pictures and numbers of `LightPaths.image`."""

from __future__ import annotations

import io
import json
import threading
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from PIL import Image
from window_parts import Ask

from fluorspar import LightPaths, material
from fluorspar.colour.xyz import luminance
from fluorspar.image.display.appearance import appearance
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.view.questions import View
from fluorspar.view.turns import Abandoned, Turns
from fluorspar.view.workspace import Workspace

FINE = Wavelengths(300, 830, 1)


def relit(**parts: Any) -> dict[str, Any]:
    return {"source": "2", "relight": parts}


def brightness(curve: dict[str, Any]) -> float:
    return float(luminance(np.interp(FINE.values, curve["wavelengths"], curve["values"], 0, 0), FINE))


def test_the_picture_is_that_of_the_image(ask: Ask, paths: LightPaths) -> None:
    change = relit(
        lights={"light": {"factor": 0.5, "spectrum": {"name": "A"}}},
        materials={"left-wall": "poster-orange"},
        concentration={"right-wall": 0.5},
    )
    image = paths.image(
        lights={"light": ("A", 0.5)},
        materials={"left-wall": "poster-orange"},
        concentration={"right-wall": 0.5},
    )
    response = ask("picture", **change)
    shown = appearance(image.dataset, image.components)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(response.content))), shown.bytes)
    spectrum = ask("spectrum", region=[3, 4, 3, 4], **change)
    assert spectrum["total"] == image.total().values[4, 3].astype(float).tolist()


@pytest.mark.parametrize(
    "spectrum",
    [
        {"name": "fl11"},
        {"blackbody": 2856},
        {"gaussian": [550, 30]},
        {"curve": [[700, 1], [400, 0.2], [500, 3]]},
    ],
)
def test_another_lamp_is_as_bright(client: TestClient, ask: Ask, spectrum: dict[str, Any]) -> None:
    (light,) = client.get("api/about").json()["sources"][2]["lights"]
    curve = ask("curve", source="2", id=light["id"], light={"spectrum": spectrum})
    assert brightness(curve) == pytest.approx(brightness(light["spectrum"]), rel=0.01)
    doubled = ask("curve", source="2", id="light", light={"spectrum": spectrum, "factor": 2})
    assert brightness(doubled) == pytest.approx(2 * brightness(curve))


def test_an_uploaded_lamp_is_taken_at_its_word(client: TestClient, ask: Ask, lamp_file: bytes) -> None:
    answer = client.post("api/upload", params={"name": "mine.csv", "kind": "light"}, content=lamp_file).json()
    assert (answer["name"], answer["wavelengths"], answer["values"]) == ("mine.csv", [300, 800], [1, 2])
    curve = ask("curve", source="2", id="light", light={"spectrum": {"upload": answer["id"]}, "factor": 3})
    assert curve["values"] == [3, 6]


def test_an_uploaded_material(client: TestClient, ask: Ask, paths: LightPaths, refused: Ask) -> None:
    text = b"# fluorspar-material: 1\nwavelength,reflectance\n300,0.2\n780,0.2\n"
    answer = client.post("api/upload", params={"name": "grey.csv", "kind": "material"}, content=text).json()
    assert answer["fluorescent"] is False
    change = relit(materials={"left-wall": answer["id"]})
    matrix = ask("donaldson", surface="left-wall", **change)
    assert set(matrix["reflectance"]) == {0.2}
    assert "is a material" in refused(
        "picture", **relit(lights={"light": {"spectrum": {"upload": answer["id"]}}})
    )


def test_a_matrix(ask: Ask, paths: LightPaths, refused: Ask) -> None:
    answer = ask("donaldson", source="2", surface="left-wall", relight={"concentration": {"left-wall": 2}})
    D = material("poster-red").with_concentration(2).on(paths.job.computed_grid)
    assert np.array_equal(answer["matrix"], D.density())
    assert answer["reflectance"] == D.reflectance.tolist()
    assert answer["excitation"] == answer["emission"] == paths.job.computed_grid.values.tolist()
    assert "no surface 'roof'" in refused("donaldson", source="2", surface="roof")
    assert "absorbs" in refused("donaldson", source="2", surface="left-wall", side="back")
    assert "cannot be relit" in refused("donaldson", source="0", surface="left-wall")


def test_what_is_told_of_a_scene(client: TestClient, paths: LightPaths) -> None:
    scene = client.get("api/about").json()["sources"][2]
    assert [light["id"] for light in scene["lights"]] == ["light"]
    wall = next(row for row in scene["surfaces"] if row["id"] == "left-wall")
    assert (wall["front"], wall["fluorescent"], wall["why_not"]) == ("poster-red", True, "")
    library = client.get("api/about").json()["library"]["materials"]
    assert wall["srgb"] == next(row["srgb"] for row in library if row["name"] == "poster-red")
    assert scene["size"] == [16, 16]
    assert scene["wavelengths"] == paths.job.grid.values.tolist()


def test_two_windows_do_not_mix(client: TestClient, ask: Ask) -> None:
    """Their questions, asked in turn and at once, have the answers they have alone."""
    views = [relit(lights={"light": {"factor": factor}}) | {"exposure": 1e-3} for factor in (0.2, 1.0, 3.0)]
    alone = [ask("picture", **view).content for view in views]
    assert len(set(alone)) == 3
    found: dict[int, set[bytes]] = {0: set(), 1: set(), 2: set()}

    def look(number: int) -> None:
        for _ in range(5):
            found[number].add(client.post("api/picture", json=views[number]).content)

    threads = [threading.Thread(target=look, args=(number,)) for number in found]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[number] for number in found] == [{picture} for picture in alone]


def test_a_coarse_picture_has_few_samples(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fluorspar.view.paths_source._COARSE_SAMPLES", 2 * 256)
    change = relit(lights={"light": {"factor": 2}})
    coarse = workspace.image(View(**change, coarse=True)).image
    fine = workspace.image(View(**change)).image
    assert (coarse.attrs["spp"], fine.attrs["spp"]) == (2, 8)
    means = [float(image.component("direct_reflection").mean()) for image in (coarse, fine)]
    assert means[0] == pytest.approx(means[1], rel=0.15)  # 5 of its standard errors


def test_what_was_warned_of_is_said(ask: Ask) -> None:
    facts = json.loads(
        ask("picture", **relit(lights={"light": {"spectrum": {"name": "FL11"}}})).headers["X-Fluorspar"]
    )
    again = json.loads(
        ask("picture", **relit(lights={"light": {"spectrum": {"name": "FL11"}}})).headers["X-Fluorspar"]
    )
    assert any("FL11" in note for note in facts["notes"])
    assert again["notes"] == facts["notes"]


def test_who_does_not_wait_any_more_gets_no_turn(workspace: Workspace) -> None:
    abandoned = threading.Event()
    abandoned.set()
    with pytest.raises(Abandoned):
        workspace.image(View(**relit(lights={"light": {"factor": 0.123}})), abandoned)
    turns = Turns()
    with turns.looking(None), pytest.raises(Abandoned), turns.looking(abandoned):
        pass
    assert turns.waiting == 0


def test_the_white_of_a_light(ask: Ask, paths: LightPaths) -> None:
    """As it is in the view, not as it was traced."""
    change = relit(lights={"light": {"spectrum": {"name": "A"}}})
    by_light = ask("picture", white={"light": "light"}, **change)
    by_name = ask("picture", white="A", **change)
    assert by_light.content == by_name.content
