"""The mark of a row changes with every file that its image depends on."""

from __future__ import annotations

import os

import pytest

from fluorspar.studies.files import mark_of
from fluorspar.studies.study import Row


@pytest.mark.parametrize(
    "file", ["room.xml", "parts/walls.xml", "parts/wall.obj", "lamps/white.spd", "paper.csv"]
)
def test_of_a_scene_and_all_that_it_names(tmp_path, file):
    texts = {
        "room.xml": '<scene version="3.0.0"><include filename="parts/walls.xml"/>'
        '<spectrum name="radiance" filename="lamps/$lamp.spd"/></scene>',
        "parts/walls.xml": '<scene version="3.0.0"><shape type="obj">'
        '<string name="filename" value="wall.obj"/></shape></scene>',
        "parts/wall.obj": "v 0 0 0",
        "lamps/white.spd": "400 1",
        "paper.csv": "wavelength,reflectance",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    row = Row(1, {"scene": "room.xml", "D.lamp": "white", "material.wall": "paper.csv"}, (), tmp_path)
    before = mark_of(row)
    assert mark_of(row) == before
    (tmp_path / file).write_text(texts[file] + " ")
    assert mark_of(row) != before


@pytest.mark.parametrize(
    "file", ["mine/paper.csv", "a.csv", "b.csv", "lamp.csv", "w1.obj", "w2.obj", "meshes/far.ply"]
)
def test_of_all_ways_to_name_a_file(tmp_path, file):
    texts = {
        "room.xml": """<scene version="3.0.0"><default name="w" value="w1"/><path value="meshes"/>
        <string name="material" value="a.csv:0.5,b.csv:0.5"/> <spectrum name='radiance' filename='lamp.csv:two'/>
        <string name='filename' value='w2.obj'/> <string name="filename" value="$w.obj"/>
        <string name="filename" value="far.ply"/></scene>""",
        **dict.fromkeys(
            ["mine/paper.csv", "a.csv", "b.csv", "lamp.csv", "w1.obj", "w2.obj", "meshes/far.ply"], "1"
        ),
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    row = Row(1, {"scene": "room.xml", "library": "mine"}, (), tmp_path)
    before = mark_of(row)
    (tmp_path / file).write_text("2")
    assert mark_of(row) != before


@pytest.mark.parametrize("value", ["x" * 300, "400:0.1, " * 1000], ids=["name", "spectrum"])
def test_a_value_that_is_no_name_hides_no_file(tmp_path, value):
    """A long text is not looked for; the folder that is named beside it still is."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "room.xml").write_text(
        f'<scene><path value="meshes"/><a value="{value}"/><b value="far.ply"/></scene>'
    )
    row = Row(1, {"scene": "room.xml", "library": value}, (), tmp_path)
    before = mark_of(row)
    (tmp_path / "meshes" / "far.ply").write_text("ply")
    assert mark_of(row) != before


def test_a_file_that_cannot_be_read_is_told_by_its_reader(tmp_path, monkeypatch):
    (tmp_path / "room.xml").write_text("<scene/>")
    row = Row(1, {"scene": "room.xml"}, (), tmp_path)
    before = mark_of(row)

    def refuse(*_):
        raise PermissionError(13, os.strerror(13), "room.xml")

    monkeypatch.setattr("fluorspar.studies.files._digest", refuse)
    assert mark_of(row) != before
