"""Compiled code on disk: no fault of the folder or of the files in it ends a render."""

from __future__ import annotations

import importlib.util
import logging
import warnings
from collections.abc import Callable
from pathlib import Path

import numba
import pytest

from fluorspar.errors import FluorsparWarning
from fluorspar.paths.sweeping.kept_code import keep_code


@pytest.fixture
def compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """Calls a function of a file of its own, as a new process does: compiled, or read from `tmp_path / "cache"`."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    source = tmp_path / "source.py"
    source.write_text("def double(x):\n    return 2 * x\n")

    def call() -> int:
        spec = importlib.util.spec_from_file_location("source", source)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        kernel = numba.njit(module.double)
        keep_code(kernel, "the double")
        return int(kernel(21))

    return call


def files(folder: Path, suffix: str) -> list[Path]:
    found = list(folder.rglob(f"*{suffix}"))
    assert found
    return found


def half(data: bytes) -> bytes:
    return data[: len(data) // 2]


def hole(data: bytes) -> bytes:
    """As a file system leaves it that had written the length and not all blocks."""
    return data[:-200] + bytes(200)


def flipped(data: bytes) -> bytes:
    """One bit of the machine code is another: no format notices."""
    at = data.index(b"\x7fELF") + 300 if b"\x7fELF" in data else len(data) // 2
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


def test_compiled_once_and_said(compiled: Callable[[], int], caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "fluorspar"):
        assert compiled() == 42
        assert [record.message for record in caplog.records] == ["compiling the double: some seconds, once"]
        caplog.clear()
        assert compiled() == 42
        assert not caplog.records, "it is read"


@pytest.mark.parametrize(
    ("suffix", "damage"),
    [
        (".nbi", lambda data: b""),
        (".nbi", half),
        (".nbi", lambda data: bytes(len(data))),
        (".nbc", lambda data: b""),
        (".nbc", half),
        (".nbc", hole),
        (".nbc", flipped),
    ],
)
def test_damaged(
    suffix: str, damage: Callable[[bytes], bytes], compiled: Callable[[], int], tmp_path: Path
) -> None:
    compiled()
    for path in files(tmp_path, suffix):
        path.write_bytes(damage(path.read_bytes()))
    with pytest.warns(FluorsparWarning, match=r"compiled code in .* is damaged .*; it is made anew") as said:
        assert compiled() == 42
    assert len(said) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert compiled() == 42, "it was made anew"


def test_gone_data(compiled: Callable[[], int], tmp_path: Path) -> None:
    compiled()
    for path in files(tmp_path, ".nbc"):
        path.unlink()
    assert compiled() == 42


def test_no_folder(compiled: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A container that is read-only, or another user's installation."""
    (tmp_path / "cache").write_text("a file where the folder would be")
    monkeypatch.setattr(numba.config, "CACHE_LOCATOR_CLASSES", "UserProvidedCacheLocator")
    with pytest.warns(FluorsparWarning, match="no folder to keep compiled code in") as said:
        assert compiled() == 42
    assert len(said) == 1
    assert "NUMBA_CACHE_DIR" in str(said[0].message)


def test_full_disk(compiled: Callable[[], int], monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile._save_data", full)
    with pytest.warns(FluorsparWarning, match=r"cannot be written .*No space left"):
        assert compiled() == 42
