"""Blender as a child: what is said when it is missing, old, crashes or hangs, and that nothing is left of it."""

from __future__ import annotations

import os
import stat
import sys
import threading
from pathlib import Path

import pytest

from fluorspar.blender.importing.import_blender import import_blender
from fluorspar.blender.process import BlenderProcess
from fluorspar.cli.blender_option import chosen_renderer
from fluorspar.errors import OptionError, RendererError
from fluorspar.files.temporary import temporary_folder
from fluorspar.rendering import render
from fluorspar.staged.renderers.cycles.renderer import CyclesRenderer

SCRIPT = Path("inside.py")


def program(folder: Path, does: str, version: str = "Blender 3.4.1") -> Path:
    """A program in place of Blender; `does` is Python that knows the mark and `answer`."""
    path = folder / "blénder with space"
    path.write_text(
        f"""#!{sys.executable}
import json, sys, time
if "--version" in sys.argv:
    print({version!r})
    raise SystemExit
def answer(**said):
    print("\\n" + sys.argv[-1], json.dumps(said), flush=True)
print("starting up", flush=True)
{does}
""",
        encoding="utf-8",
    )
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture
def left():
    """The folders of children that are there now."""
    return lambda: sorted(temporary_folder().glob("blender-*"))


def test_no_blender(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("BLENDER", raising=False)
    with pytest.raises(RendererError, match=r"not installed[\s\S]*apt install blender[\s\S]*--blender"):
        BlenderProcess(SCRIPT)
    with pytest.raises(RendererError, match="no program '/nowhere/blender'"):
        render("cornell-box", method="staged", spp=1, renderer=CyclesRenderer("/nowhere/blender"))


@pytest.mark.parametrize("version", ["Blender 2.93.18", "Blender 3.3.0"])
def test_too_old(version: str, tmp_path: Path) -> None:
    with pytest.raises(RendererError, match=r"too old[\s\S]*3.4 or newer"):
        BlenderProcess(SCRIPT, program(tmp_path, "", version))


def test_not_blender(tmp_path: Path) -> None:
    with pytest.raises(RendererError, match=r"not Blender[\s\S]*ls 9.1"):
        BlenderProcess(SCRIPT, program(tmp_path, "", "ls 9.1"))


def test_a_crash_shows_the_last_lines(tmp_path: Path, left) -> None:
    does = (
        "answer(version=[3, 4, 1]); sys.stdin.readline(); print('Segmentation fault'); raise SystemExit(11)"
    )
    with BlenderProcess(SCRIPT, program(tmp_path, does)) as blender:
        assert left() == [blender.folder]
        with pytest.raises(RendererError, match=r"ended[\s\S]*exit code 11[\s\S]*Segmentation fault"):
            blender.ask("render")
    assert not left()


def test_a_start_that_fails_shows_why(tmp_path: Path, left) -> None:
    with pytest.raises(RendererError, match="cannot open display"):
        BlenderProcess(SCRIPT, program(tmp_path, "print('cannot open display')"))
    assert not left()


def test_a_hang_is_ended(tmp_path: Path, left) -> None:
    does = "answer(version=[3, 4, 1]); print('Sample 1/2', flush=True); time.sleep(1000)"
    blender = BlenderProcess(SCRIPT, program(tmp_path, does), patience=1.0)
    with pytest.raises(RendererError, match=r"no sign of life for 1 s[\s\S]*Sample 1/2"):
        blender.ask("render")
    assert blender._child.poll() is not None
    assert not left()


def test_a_fault_of_the_script_is_told(tmp_path: Path) -> None:
    does = "answer(version=[3, 4, 1]); sys.stdin.readline(); answer(error='Traceback\\nKeyError: 7')"
    with (
        BlenderProcess(SCRIPT, program(tmp_path, does)) as blender,
        pytest.raises(RendererError, match="KeyError: 7"),
    ):
        blender.ask("render")


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_interrupt_ends_the_child(tmp_path: Path, left) -> None:
    """Rationale: Ctrl-C while Blender works. Expected: KeyboardInterrupt, no child and no folder left."""
    import signal

    does = "answer(version=[3, 4, 1]); time.sleep(1000)"
    threading.Timer(0.5, os.kill, [os.getpid(), signal.SIGINT]).start()
    with (
        pytest.raises(KeyboardInterrupt),
        BlenderProcess(SCRIPT, program(tmp_path, does)) as blender,
    ):
        blender.ask("render")
    assert blender._child.poll() is not None
    assert not left()


def test_unknown_renderer() -> None:
    with pytest.raises(OptionError, match="mitsuba, cycles"):
        render("cornell-box", method="staged", renderer="luxcore")


def test_a_blender_that_is_not_used() -> None:
    with pytest.raises(OptionError, match="--renderer cycles"):
        chosen_renderer(None, "/usr/bin/blender")
    assert isinstance(chosen_renderer("cycles", "/usr/bin/blender"), CyclesRenderer)


def test_an_interrupted_import_leaves_nothing(tmp_path: Path, left, monkeypatch: pytest.MonkeyPatch) -> None:
    before, scene = left(), tmp_path / "scene.blend"
    scene.write_bytes(b"BLENDER-v304")
    slow = program(tmp_path, "answer(version=[3, 4, 1])\ntime.sleep(60)")
    children = []

    def interrupted(process: BlenderProcess, do: str, **request: object) -> None:
        children.append(process)
        raise KeyboardInterrupt

    monkeypatch.setattr(BlenderProcess, "ask", interrupted)
    with pytest.raises(KeyboardInterrupt):
        import_blender(scene, tmp_path / "out", blender=slow)
    assert left() == before
    assert children[0]._child.poll() is not None
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([slow.name, scene.name])
