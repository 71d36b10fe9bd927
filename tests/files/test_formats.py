"""The tables of file formats: what they name is there."""

from __future__ import annotations

import pytest

from fluorspar.bispectral.files import registry as materials
from fluorspar.files.formats import Format, _function, suffixes_read, suffixes_written
from fluorspar.image.formats import registry as images
from fluorspar.scene.objects import mesh_file

TABLES = {"images": images.FORMATS, "materials": materials.FORMATS, "meshes": mesh_file.FORMATS}


@pytest.mark.parametrize("formats", TABLES.values(), ids=TABLES)
def test_readers_and_writers_are_there(formats: dict[str, Format]) -> None:
    for suffix, kind in formats.items():
        assert suffix.startswith(".")
        assert suffix == suffix.lower()
        assert kind.reader or kind.writer
        for reference in filter(None, (kind.reader, kind.writer)):
            assert callable(_function(reference))


def test_suffixes() -> None:
    assert images.SUFFIXES == suffixes_read(images.FORMATS) == (".nc", ".exr", ".hdr", ".zarr")
    assert (
        images.SUFFIXES_WRITTEN
        == suffixes_written(images.FORMATS)
        == (".nc", ".exr", ".hdr", ".zarr", ".png")
    )
    assert (materials.SUFFIXES, materials.SUFFIXES_WRITTEN) == ((".csv", ".bfc"), (".csv",))
