"""Where an image goes while it is made."""

from __future__ import annotations

import shutil
from types import SimpleNamespace

import pytest

from fluorspar.image import streaming


@pytest.mark.parametrize("free", [0, 2**40])
def test_a_large_image_is_kept_in_a_file_where_there_is_room_for_one(
    free: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streaming, "is_large", lambda needed: True)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=free))
    with streaming.streamed_to(None, (16, 16), 69) as path:
        assert (path is not None) == (free > 0)
