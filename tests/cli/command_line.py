"""Running `fluorspar` inside the test's own process, and scenes small enough to render in a blink."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from fluorspar.cli import console
from fluorspar.cli.main import main
from fluorspar.progress import Progress

QUICK = ("--wavelengths", "400:700:20", "--size", "8x8", "--spp", "4")
OLD = b"an image that took a night to render"

SENSOR = """<sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <rfilter type="box"/> </film> </sensor>"""
SKY = '<emitter type="constant" id="sky"/>'
BALL = '<shape type="sphere" id="ball"/>'


def scene(*parts: str) -> str:
    """The text of a scene file."""
    return f'<scene version="3.0.0"> {" ".join(parts)} </scene>'


def ball(bsdf: str) -> str:
    """A scene: a ball with this BSDF under an even sky."""
    return scene(SENSOR, SKY, f'<shape type="sphere" id="ball"> {bsdf} </shape>')


def painted(reflectance: str) -> str:
    """A scene: a ball with this inline reflectance."""
    return ball(f'<bsdf type="diffuse" id="paint"> <spectrum name="reflectance" {reflectance}/> </bsdf>')


GOOD = scene(SENSOR, SKY, BALL)


@dataclass(frozen=True)
class Outcome:
    """What a run of the command line left behind."""

    code: int
    out: str
    err: str

    def says(self, *parts: str) -> bool:
        """Whether standard error holds these texts in this order, however its lines are broken."""
        pattern = ".*".join(r"\s+".join(re.escape(word) for word in part.split()) for part in parts)
        return re.search(pattern, self.err, re.DOTALL) is not None


class CommandLine:
    """The command `fluorspar` in a folder of its own that holds three old images and `scene.xml`."""

    def __init__(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch, capture: pytest.CaptureFixture[str]
    ) -> None:
        self.folder, self.monkeypatch, self.capture = folder, monkeypatch, capture
        self.outputs = [folder / f"old{suffix}" for suffix in (".nc", ".exr", ".png")]
        for path in self.outputs:
            path.write_bytes(OLD)

    def __call__(self, *arguments: object) -> Outcome:
        """Run `fluorspar ARGUMENTS`."""
        self.monkeypatch.setattr(sys, "argv", ["fluorspar", *map(str, arguments)])
        self.capture.readouterr()
        code: object = 0
        with warnings.catch_warnings():  # `main` chooses how warnings are shown, for the whole process
            try:
                main()
            except SystemExit as leaving:
                code = leaving.code
        out, err = self.capture.readouterr()
        assert code is None or isinstance(code, int)
        return Outcome(code or 0, out, err)

    def write(self, name: str, text: str) -> Path:
        path = self.folder / name
        path.write_text(text)
        return path

    def render(self, text: str | None, *options: object) -> Outcome:
        """Render a scene of this text over the old images."""
        if text is not None:
            self.write("scene.xml", text)
        outputs = [part for path in self.outputs for part in ("-o", path.name)]
        return self("render", "scene.xml", *QUICK, *outputs, *options)

    def refuses(self, text: str | None, *options: object) -> Outcome:
        """Check that rendering fails as it should: exit code 2, one message, and every file as it was."""
        if text is not None:
            self.write("scene.xml", text)
        before = self.files()
        outcome = self.render(text, *options)
        assert outcome.code == 2, outcome
        assert outcome.out == ""
        assert outcome.err.startswith("error: "), outcome.err
        assert outcome.err.count("error: ") == 1
        assert "Traceback" not in outcome.err
        assert self.files() == before, "no file may be touched, none left behind"
        return outcome

    def files(self) -> dict[str, bytes]:
        """Everything in the folder, hidden files too."""
        return {
            str(path.relative_to(self.folder)): path.read_bytes()
            for path in sorted(self.folder.rglob("*"))
            if path.is_file()
        }


def stop_at(pixels: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the user press Ctrl-C when so many pixels are done."""

    @contextmanager
    def progress_bar(what: str) -> Iterator[Progress]:
        def report(done: int, total: int) -> None:
            if done >= pixels:
                raise KeyboardInterrupt

        yield report

    monkeypatch.setattr(console, "progress_bar", progress_bar)
