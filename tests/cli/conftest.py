"""The fixture every test of the command line uses."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import CommandLine


@pytest.fixture
def fluorspar(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> CommandLine:
    """The command `fluorspar`, run in an empty folder with the shipped library of materials only."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FLUORSPAR_MATERIALS", raising=False)
    return CommandLine(tmp_path, monkeypatch, capfd)
