"""Where an image goes while it is made."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from fluorspar.image import streaming


@pytest.mark.parametrize("free", [0, 2**40])
def test_a_large_image_is_kept_in_a_file_where_there_is_room_for_one(
    free: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streaming, "is_large", lambda needed: True)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=free))
    with streaming.streamed_to([Path("a.exr")], (16, 16), 69) as path:
        assert (path is not None) == (free > 0)


@pytest.mark.parametrize(
    ("outputs", "options", "expected"),
    [
        (["a.png", "a.nc"], {}, "a.nc"),
        (["a.nc"], {"only_large": True}, "a.nc"),
        (["a.nc"], {"denoise": True, "temporary": False}, None),
        (["a.png"], {"temporary": False}, None),
    ],
)
@pytest.mark.parametrize("large", [True, False])
def test_one_of_its_files_or_memory(
    outputs: list[str],
    options: dict[str, bool],
    expected: str | None,
    large: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(streaming, "is_large", lambda needed: large)
    if options.get("only_large") and not large:
        expected = None
    with streaming.streamed_to([Path(name) for name in outputs], (16, 16), 69, **options) as path:
        assert path == (expected and Path(expected))
