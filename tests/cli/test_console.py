"""What is printed, and where it cannot be printed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import GOOD, QUICK, CommandLine

from fluorspar import SpectralImage
from fluorspar.cli import console
from fluorspar.cli.shown_warnings import ShownWarnings

CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
RED = "\x1b[31mred\x9b"


def run(*arguments: str, stdout: str | None = None, cwd: Path) -> subprocess.CompletedProcess[str]:
    with open(stdout or os.devnull, "w") as out:
        return subprocess.run(
            [sys.executable, "-m", "fluorspar", *arguments],
            stdout=out,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            cwd=cwd,
        )


class TestControlCharacters:
    """They are shown, never obeyed, whoever wrote them."""

    def test_of_an_attribute(self, fluorspar: CommandLine) -> None:
        assert fluorspar.render(GOOD).code == 0
        with SpectralImage.open("old.nc") as image:
            dataset = image.dataset.load()
        dataset.attrs["scene"] = RED
        SpectralImage(dataset).save("red.nc")
        done = fluorspar("info", "red.nc")
        assert r"\x1b[31mred\x9b" in done.out
        assert not CONTROL.search(done.out)

    def test_of_a_material(self, fluorspar: CommandLine) -> None:
        text = f"# fluorspar-material: 1\n# description: {RED}\nwavelength,reflectance\n300,0.5\n780,0.5\n"
        fluorspar.write("red.csv", text)
        for command in ("info", "materials show", "materials inspect"):
            done = fluorspar(*command.split(), "red.csv")
            assert not CONTROL.search(done.out + done.err), command
        library = fluorspar.folder / "library"
        library.mkdir()
        (library / "red.csv").write_text(text)
        done = fluorspar("materials", "list", "--library", "library")
        assert not CONTROL.search(done.out + done.err), "in a table"

    def test_of_a_file_name_and_a_message(self, fluorspar: CommandLine) -> None:
        done = fluorspar("info", f"{RED}.nc")
        assert done.code == 2
        assert r"\x1b[31mred" in done.err
        assert not CONTROL.search(done.err)

    def test_of_an_option(self, fluorspar: CommandLine) -> None:
        assert not CONTROL.search(fluorspar("render", f"--{RED}").err)

    def test_of_the_renderer(self, fluorspar: CommandLine) -> None:
        """Mitsuba colours what it says of a scene, on standard output."""
        squeezed = '<transform name="to_world"> <scale x="1" y="2" z="3"/> </transform>'
        text = GOOD.replace('id="ball"/>', f'id="ball"> {squeezed} </shape>')
        fluorspar.write("scene.xml", text)
        done = run("render", "scene.xml", *QUICK, "-o", "new.nc", stdout="printed", cwd=fluorspar.folder)
        printed = Path("printed").read_text()
        assert printed.startswith("SpectralImage")
        assert not CONTROL.search(printed + done.stderr)
        assert done.stderr.count("Mitsuba: [Sphere]") == 1

    def test_names_that_are_no_unicode(self, fluorspar: CommandLine) -> None:
        fluorspar.write("scene.xml", GOOD)
        name = os.fsdecode(b"caf\xe9.nc")
        done = fluorspar("render", "scene.xml", *QUICK, "-o", name)
        assert done.code == 0, done.err
        assert Path(name).exists()


class TestStandardOutput:
    @pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no full device here")
    def test_full(self, fluorspar: CommandLine) -> None:
        """The files are written all the same."""
        fluorspar.write("scene.xml", GOOD)
        done = run("render", "scene.xml", *QUICK, "-o", "new.nc", stdout="/dev/full", cwd=fluorspar.folder)
        assert done.returncode == 2
        assert done.stderr.endswith("error: standard output cannot be written\n  got:      [Errno 28] "
                                    "No space left on device\n")  # fmt: skip
        with SpectralImage.open("new.nc") as image:
            assert image.dataset.sizes["y"] == 8


def test_a_working_folder_that_is_gone(tmp_path: Path) -> None:
    """Not one of the commands."""
    program = (
        "import os, sys; os.rmdir(os.getcwd()); sys.argv = ['fluorspar', 'render', 'furnace', '-o', 'a.nc']\n"
        "from fluorspar.__main__ import main; main()"
    )
    folder = tmp_path / "gone"
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.startswith("error: the working folder does not exist any more\n")


@pytest.mark.parametrize("fault", [OSError(28, "No space left on device", "box.nc"), MemoryError()])
def test_what_the_system_refuses(
    fault: Exception, fluorspar: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full temporary folder, too little memory: nothing of Fluorspar's, so no exit code 70."""

    def refuse(*_: object, **__: object) -> None:
        raise fault

    monkeypatch.setattr("fluorspar.scene.loading.load_scene", refuse)
    fluorspar.refuses(GOOD)


def test_a_name_with_dollars_in_a_figure(fluorspar: CommandLine) -> None:
    """No formula."""
    fluorspar.write(
        "a $$ b.csv", "# fluorspar-material: 1\n# name: $$\nwavelength,reflectance\n300,0.5\n780,0.5\n"
    )
    done = fluorspar("materials", "inspect", "a $$ b.csv", "--plot", "figure.png")
    assert done.code == 0, done.err


class TestUsage:
    """Mistakes in a command are told as all others."""

    def test_a_misspelt_command(self, fluorspar: CommandLine) -> None:
        done = fluorspar("rendr")
        assert done.code == 2
        assert done.err.startswith("error: no such command 'rendr'")

    def test_a_missing_argument(self, fluorspar: CommandLine) -> None:
        done = fluorspar("render")
        assert (done.code, done.out) == (2, "")
        assert done.err.startswith("error: missing argument 'scene'\n  fix: ")

    def test_a_misspelt_scene(self, fluorspar: CommandLine) -> None:
        assert fluorspar("render", "cornel-box", "-o", "a.nc").says("did you mean cornell-box")
        assert fluorspar("info", "cornel-box").says("did you mean cornell-box")

    @pytest.mark.parametrize("group", [(), ("materials",)])
    def test_summaries_are_whole(self, group: tuple[str, ...], fluorspar: CommandLine) -> None:
        done = fluorspar(*group, "--help")
        assert done.code == 0
        _, _, commands = done.out.partition("Commands:\n")
        assert commands.count("\n") > 5
        assert "..." not in commands
        assert all(line.endswith(".") for line in commands.splitlines())


def test_progress_is_drawn_on_real_terminals_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Jupyter sets FORCE_COLOR in its cells, whose output is a file in which nothing can be drawn over."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    with console.progress_bar("rendering") as progress:
        progress(1, 2)
    with console.err.status("writing") as status:
        status.update("still writing")
    console.note("done")
    assert capsys.readouterr().err == "done\n"


class TestWarnings:
    def test_forty_alike(self, capsys: pytest.CaptureFixture[str]) -> None:
        shown = ShownWarnings()
        for number in range(40):
            assert shown.is_shown(f"shape 'tile-{number}' is averaged to {number / 40}") == (number < 2)
        assert shown.is_shown("the film's filter is ignored"), "another kind"
        shown.finish()
        assert capsys.readouterr().err == "38 more warnings like these: 'fluorspar -v ...' prints them\n"

    def test_all_when_asked(self, capsys: pytest.CaptureFixture[str]) -> None:
        shown = ShownWarnings(everything=True)
        assert all(shown.is_shown(f"shape {number}") for number in range(40))
        assert not shown.is_shown("shape 3"), "said before"
        shown.finish()
        assert capsys.readouterr().err == ""
