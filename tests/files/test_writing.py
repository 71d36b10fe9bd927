"""What is replaced keeps its permissions and links, and what killed writers left behind is removed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fluorspar.errors import ImageError
from fluorspar.files.beside import Temporary
from fluorspar.files.writing import check_target, replacing


def write(path: Path, text: str = "new") -> None:
    with replacing(path) as temporary:
        temporary.write_text(text)


class TestWhatIsReplaced:
    @pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
    def test_keeps_its_permissions(self, tmp_path: Path, mode: int) -> None:
        path = tmp_path / "a"
        path.write_text("old")
        path.chmod(mode)
        write(path)
        assert path.read_text() == "new"
        assert path.stat().st_mode & 0o777 == mode

    def test_a_new_file_has_the_usual_permissions(self, tmp_path: Path) -> None:
        write(tmp_path / "a")
        (tmp_path / "b").touch()
        assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode

    @pytest.mark.parametrize("there", [True, False])
    def test_a_link_stays_and_leads_to_the_new_file(self, tmp_path: Path, there: bool) -> None:
        (tmp_path / "elsewhere").mkdir()
        target, link = tmp_path / "elsewhere" / "a", tmp_path / "link"
        if there:
            target.write_text("old")
        link.symlink_to("elsewhere/a")
        write(link)
        assert link.is_symlink()
        assert target.read_text() == "new"
        assert sorted(tmp_path.rglob("*")) == sorted([target.parent, target, link])

    def test_is_not_if_it_is_read_only(self, tmp_path: Path) -> None:
        path = tmp_path / "a"
        path.write_text("old")
        path.chmod(0o444)
        with pytest.raises(ImageError, match=r"(?s)exists and is read-only.*chmod u\+w"):
            check_target(path)
        assert path.read_text() == "old"

    def test_is_not_if_it_is_no_file(self, tmp_path: Path) -> None:
        os.mkfifo(tmp_path / "a")
        with pytest.raises(ImageError, match="not a file that can be replaced"):
            check_target(tmp_path / "a")


class TestNames:
    @pytest.mark.parametrize("name", ["x" * 255, "é" * 127, os.fsdecode(b"caf\xe9"), "a[b]*?"])
    def test_any_the_file_system_takes(self, tmp_path: Path, name: str) -> None:
        write(tmp_path / name)
        assert [path.name for path in tmp_path.iterdir()] == [name]

    def test_one_that_is_too_long(self, tmp_path: Path) -> None:
        with pytest.raises(ImageError, match=r"(?s)cannot be written.*too long"):
            check_target(tmp_path / ("x" * 256))


_KILLED = """
import os, signal, sys
from pathlib import Path
from fluorspar.files.writing import replacing
with replacing(sys.argv[1]) as temporary:
    temporary.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


class TestLeftovers:
    def test_of_a_killed_writer_are_removed_by_the_next_one(self, tmp_path: Path) -> None:
        path = tmp_path / "a.nc"
        done = subprocess.run([sys.executable, "-c", _KILLED, str(path)], check=False)
        assert done.returncode == -signal.SIGKILL
        (left,) = tmp_path.iterdir()
        write(tmp_path / "b.nc")  # another name
        assert left.exists()
        write(path)
        assert sorted(each.name for each in tmp_path.iterdir()) == ["a.nc", "b.nc"]

    def test_of_a_living_writer_stay(self, tmp_path: Path) -> None:
        living = Temporary(tmp_path / "a")
        living.path.write_text("living")
        os.utime(living.path, (0, 0))
        write(tmp_path / "a")
        assert living.path.read_text() == "living"
        living.keep()
        assert (tmp_path / "a").read_text() == "living"

    @pytest.mark.parametrize(("days", "removed"), [(0, False), (6, False), (8, True)])
    def test_of_another_host_are_removed_when_they_are_old(
        self, tmp_path: Path, days: int, removed: bool
    ) -> None:
        left = tmp_path / ".a.other-0123abcd.tmp"
        left.touch()
        at = time.time() - 86400 * days
        os.utime(left, (at, at))
        write(tmp_path / "a")
        assert left.exists() != removed


def test_what_is_called_like_a_journal_of_a_folder_stays(tmp_path: Path) -> None:
    mine = tmp_path / "room.journal"
    mine.write_text("mine")
    temporary = Temporary(tmp_path / "room.zarr", folder=True)
    temporary.take_place()
    temporary.drop()
    assert [path.name for path in tmp_path.iterdir()] == ["room.journal"]
    assert mine.read_text() == "mine"


def test_two_that_begin_a_folder_at_once(tmp_path: Path) -> None:
    """Expected: one of them gets the place, and the other never replaces what that one is writing."""
    first, second = (Temporary(tmp_path / "room", folder=True) for _ in range(2))
    (first.path / "note.txt").write_text("of the first")
    first.take_place()
    for replace in (second.take_place, second.keep):
        with pytest.raises(ImageError, match="another process is writing the folder"):
            replace()
    second.drop()
    first.keep()
    assert [path.name for path in tmp_path.iterdir()] == ["room"]
    assert (tmp_path / "room" / "note.txt").read_text() == "of the first"
