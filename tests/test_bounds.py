"""The versions that pyproject.toml promises to work with are those that `make test-lowest` installs."""

from __future__ import annotations

import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).parents[1]


def lowest(requirement: Requirement) -> Version:
    """The lower bound of a requirement, or the version that a constraint pins."""
    (version,) = (Version(bound.version) for bound in requirement.specifier if bound.operator in (">=", "=="))
    return version


def test_every_lower_bound_is_tested() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    lines = (ROOT / "constraints-lowest.txt").read_text("utf-8").splitlines()
    pinned = {
        requirement.name.lower(): lowest(requirement)
        for requirement in (Requirement(line) for line in lines if line and not line.startswith("#"))
    }
    extras = project["optional-dependencies"]
    promised = {
        requirement.name.lower(): lowest(requirement)
        for requirement in map(
            Requirement, [*project["dependencies"], *extras["view"], *extras["denoise"], *extras["cluster"]]
        )
    }
    assert {name: pinned.get(name) for name in promised} == promised
