"""Running the command line inside the test's own process, and scene files to run it on."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import pytest

from fluorspar.cli.main import main

OLD = b"an image that took a night to render"


@dataclass(frozen=True)
class Outcome:
    """What a run of the command line left behind."""

    code: int
    out: str
    err: str

    @property
    def said(self) -> str:
        """Everything it wrote to the terminal as one line, however the terminal wrapped it."""
        return re.sub(r"\s+", " ", f"{self.out} {self.err}")


Run: TypeAlias = Callable[..., Outcome]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Run `fluorspar ARGUMENTS` in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FLUORSPAR_MATERIALS", raising=False)

    def run_command(*arguments: object) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["fluorspar", *map(str, arguments)])
        capfd.readouterr()
        code: object = 0
        with warnings.catch_warnings():  # the command line shows warnings its own way
            try:
                main()
            except SystemExit as leaving:
                code = leaving.code
        out, err = capfd.readouterr()
        assert code is None or isinstance(code, int)
        return Outcome(code or 0, out, err)

    return run_command
