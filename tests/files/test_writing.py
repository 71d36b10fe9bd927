"""What is replaced keeps its permissions and links, and what killed writers left behind is removed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fluorspar.errors import FluorsparWarning, ImageError
from fluorspar.files import beside
from fluorspar.files.beside import Temporary, remove_unfinished
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

    @pytest.mark.parametrize("days", [0, 8, 800])
    @pytest.mark.parametrize("folder", [False, True])
    def test_of_another_host_are_named_and_never_removed(
        self, tmp_path: Path, days: int, folder: bool
    ) -> None:
        """Their writer may live: on some network file systems a lock is seen on its own host only."""
        left = tmp_path / ".a.node17-0123abcd.tmp"
        left.mkdir() if folder else left.touch()
        left.with_suffix(".journal").touch()
        at = time.time() - 86400 * days
        os.utime(left, (at, at))
        with pytest.warns(
            FluorsparWarning, match=r"\.a\.node17-0123abcd\.tmp beside a: left by host node17, or"
        ):
            write(tmp_path / "a")
        assert left.exists()
        assert left.with_suffix(".journal").exists()
        remove_unfinished(left)
        assert left.exists()

    def test_of_another_host_that_is_seen_to_live_is_not_told_of(self, tmp_path: Path) -> None:
        living = Temporary(tmp_path / "a")
        other = living.path.rename(tmp_path / ".a.node17-0123abcd.tmp")
        write(tmp_path / "a")
        assert other.exists()
        living.leave()


class TestFoldersInPlace:
    """A folder that has its name before it is whole, seen from another host."""

    @pytest.fixture
    def begun(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Temporary:
        with monkeypatch.context() as patch:
            patch.setattr(beside, "HOST", "node17")
            begun = Temporary(tmp_path / "room", folder=True)
            (begun.path / "note.txt").write_text("half")
            begun.take_place()
        return begun

    def unseen(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Let all locks look free, as some network file systems do."""
        monkeypatch.setattr(beside, "_lock", lambda *_, **__: True)

    def test_is_not_replaced(self, tmp_path: Path, begun: Temporary, monkeypatch: pytest.MonkeyPatch) -> None:
        self.unseen(monkeypatch)
        for quiet, text in ((60.0, "another process is writing"), (-1.0, "another host may still")):
            monkeypatch.setattr(beside, "_QUIET", quiet)
            with pytest.raises(ImageError, match=f"(?s){text}.*host node17"):
                Temporary(tmp_path / "room", folder=True)
        assert (tmp_path / "room" / "note.txt").read_text() == "half"
        assert len(list(tmp_path.iterdir())) == 2

    def test_is_not_replaced_by_who_began_before(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
    ) -> None:
        mine = Temporary(tmp_path / "room", folder=True)
        request.getfixturevalue("begun")
        self.unseen(monkeypatch)
        monkeypatch.setattr(beside, "_QUIET", -1.0)
        (mine.path / "note.txt").write_text("whole")
        for replace in (mine.take_place, mine.keep):
            with pytest.raises(ImageError, match=r"(?s)another host may still.*host node17"):
                replace()
            mine.drop() if replace == mine.keep else None
        assert (tmp_path / "room" / "note.txt").read_text() == "half"
        (aside,) = tmp_path.glob("room-*/note.txt")
        assert aside.read_text() == "whole"  # and not lost

    def test_is_gone_on_with_once_nothing_changes_there(
        self, tmp_path: Path, begun: Temporary, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        room = tmp_path / "room"
        os.close(begun._lock)  # its process is killed
        with pytest.raises(ImageError, match="another process is writing"):
            Temporary(room, room, folder=True)
        monkeypatch.setattr(beside, "_QUIET", -1.0)
        mine = Temporary(room, room, folder=True)
        monkeypatch.undo()
        for left in (None, room):
            with pytest.raises(ImageError, match="another process is writing"):
                Temporary(room, left, folder=True)
        mine.keep()
        assert [path.name for path in tmp_path.iterdir()] == ["room"]
        Temporary(room, folder=True).drop()


def test_what_is_called_like_a_journal_of_a_folder_stays(tmp_path: Path) -> None:
    mine = tmp_path / "room.journal"
    mine.write_text("mine")
    temporary = Temporary(tmp_path / "room.zarr", folder=True)
    temporary.take_place()
    temporary.drop()
    assert [path.name for path in tmp_path.iterdir()] == ["room.journal"]
    assert mine.read_text() == "mine"


def test_two_that_begin_a_folder_at_once(tmp_path: Path) -> None:
    """One of them gets the place; the other never replaces what that one is writing, and is not lost if it is whole."""
    first, second = (Temporary(tmp_path / "room", folder=True) for _ in range(2))
    (first.path / "note.txt").write_text("of the first")
    first.take_place()
    for replace in (second.take_place, second.keep):
        with pytest.raises(ImageError, match="another process is writing the folder"):
            replace()
    second.drop()
    first.keep()
    aside, room = sorted(tmp_path.iterdir(), key=lambda path: path.name == "room")
    assert room.name == "room"
    assert aside.name.startswith("room-")
    assert (tmp_path / "room" / "note.txt").read_text() == "of the first"
