"""The temporary folder: gone with its process, and if that was killed, with the next one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fluorspar.errors import FluorsparError
from fluorspar.files import temporary
from fluorspar.files.host import HOST

ASK = "from fluorspar.files.temporary import temporary_folder; print(temporary_folder(), flush=True)"


def start(folder: Path, after: str) -> tuple[subprocess.Popen[str], Path]:
    process = subprocess.Popen(
        [sys.executable, "-c", f"{ASK}\n{after}"],
        env={**os.environ, "TMPDIR": str(folder)},
        stdout=subprocess.PIPE,
        stdin=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_goes_with_its_process(tmp_path: Path) -> None:
    process, own = start(tmp_path, "")
    process.communicate()
    assert own.parent == tmp_path
    assert not own.exists()


def test_of_a_killed_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(temporary, "_YOUNG", -1)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    other = tmp_path / "fluorspar-results"
    other.mkdir()
    killed, stale = start(tmp_path, "input()")
    alive, own = start(tmp_path, "input()")
    killed.kill()
    killed.communicate()
    assert stale.is_dir()
    temporary.remove_stale()
    assert not stale.exists()
    assert own.is_dir(), "its process lives"
    assert other.is_dir(), "it is not ours"
    alive.communicate("\n")


def test_of_another_host_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its process may live: on some network file systems a lock is seen on its own host only."""
    monkeypatch.setattr(temporary, "_YOUNG", -1)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    process, folder = start(tmp_path, "input()")
    other = folder.rename(tmp_path / folder.name.replace(HOST, "node17"))
    process.kill()
    process.communicate()
    temporary.remove_stale()
    assert other.is_dir()


def test_young_folders_are_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    killed, stale = start(tmp_path, "input()")
    killed.kill()
    killed.communicate()
    temporary.remove_stale()
    assert stale.is_dir(), "a process may be about to lock it"


def test_no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    def full() -> str:
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr("tempfile.gettempdir", full)
    with pytest.raises(FluorsparError, match="no room for temporary files"):
        temporary.temporary_folder.__wrapped__()
