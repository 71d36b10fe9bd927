"""Names of files that are no text, or no files."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fluorspar.errors import ImageError
from fluorspar.files.names import check_source, encodable


def test_a_name_that_is_no_text_has_one_meanwhile(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"caf\xe9")
    path.write_text("here")
    with encodable(path) as name:
        assert name.encode()
        assert Path(name).read_text() == "here"
    assert not Path(name).exists()
    assert path.read_text() == "here"


def test_a_name_that_is_too_long(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"(?s)cannot be read.*too long"):
        check_source(tmp_path / ("x" * 300))
