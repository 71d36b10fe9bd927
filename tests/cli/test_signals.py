"""Ctrl-C and SIGTERM at any moment: the command ends, in order, with its exit code."""

from __future__ import annotations

import importlib
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import CommandLine

from fluorspar.cli.signals import Signals


def is_stopped(work: Callable[[], object]) -> bool:
    """Whether a signal stops what comes after some work."""
    try:
        work()
        wait()
    except KeyboardInterrupt:
        return True
    return False


def wait() -> None:
    end = time.monotonic() + 20
    while time.monotonic() < end:
        time.sleep(0.01)


def test_while_a_module_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A module that swallows it, as extension modules do, would go on."""
    source = "import signal\ntry:\n    signal.raise_signal(signal.SIGINT)\nexcept BaseException:\n    lost = True\n"
    (tmp_path / "swallows.py").write_text(f"lost = False\n{source}")
    monkeypatch.syspath_prepend(tmp_path)
    with Signals() as signals:
        assert is_stopped(lambda: importlib.import_module("swallows"))
    assert not sys.modules["swallows"].lost
    assert signals.exit_code == 130


def test_in_a_destructor() -> None:
    """Python passes no exception on from there."""

    class Dying:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGTERM)

    with Signals() as signals:
        assert is_stopped(Dying)
    assert signals.exit_code == 143


def test_handlers_are_given_back() -> None:
    before = signal.getsignal(signal.SIGTERM), sys.unraisablehook
    with Signals():
        assert signal.getsignal(signal.SIGTERM) != before[0]
    assert (signal.getsignal(signal.SIGTERM), sys.unraisablehook) == before


def test_ignored_signals_stay_so() -> None:
    """A shell starts background jobs so, and `nohup`."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Signals():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


def test_wrapped_by_other_code(fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    """C++ passes an exception on as another one: that is no fault of Fluorspar."""

    def interrupted(*_: object, **__: object) -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt as err:
            raise RuntimeError(f"while building: {type(err).__name__}") from None

    monkeypatch.setattr("fluorspar.scene.loading.load_scene", interrupted)
    fluorspar.write("scene.xml", "")
    done = fluorspar.render(None)
    assert (done.code, done.err) == (143, "error: interrupted\n")


def test_within_code_that_swallows_it() -> None:
    """trimesh catches all exceptions where it tries something, and goes on."""
    source = "try:\n    stop()\nexcept BaseException:\n    swallowed.append(1)\n"
    theirs = compile(source, "/site-packages/trimesh/geometry.py", "exec")
    swallowed: list[int] = []

    def call() -> None:
        exec(theirs, {"stop": lambda: signal.raise_signal(signal.SIGTERM), "swallowed": swallowed})
        for _ in range(1000):  # a long sleep is not ended by what comes once more
            time.sleep(0.01)

    with Signals() as signals, pytest.raises(KeyboardInterrupt):
        call()
    assert not swallowed
    assert signals.exit_code == 143


PROGRAM = """if True:
    import signal
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a process in the background would ignore it
    from fluorspar.__main__ import main
    print("begun", flush=True)
    main()"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("moment", [0.1, 0.6, 1.4])
def test_while_it_starts(moment: float, number: signal.Signals, fluorspar: CommandLine) -> None:
    """Whatever is being imported or started then: trimesh, scipy, Dr.Jit, LLVM, Numba."""
    command = ["render", "cornell-mesh", "--spp", "60000", "-o", "mesh.exr"]
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *command],
        cwd=fluorspar.folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        time.sleep(moment)
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 128 + number, err
    assert "Traceback" not in err
