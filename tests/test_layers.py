"""The structure of the package: layers import one way, no modules in a circle, and importing has no side effects."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import fluorspar

ROOT = Path(fluorspar.__file__).parent
# Each file or folder may import from those before it. `paths` and `staged` do not know each other.
LAYERS = [
    "errors",
    "progress",
    "version",
    "files",
    "spectral",
    "colour",
    "bispectral",
    "image",
    "scene",
    "job",
    "paths",
    "staged",
    "rendering",
    "relighting",
    "measuring",
    "comparing",
    "figures",
    "cli",
    "__main__",
]
MODULES = sorted(ROOT.rglob("*.py"))


def name_of(path: Path) -> str:
    """Name of the module that a file is."""
    return ".".join(("fluorspar", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


NAMES = {name_of(path) for path in MODULES}


def imported(path: Path) -> set[str]:
    """Names of all modules that a file imports, wherever in the file."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return names


def layer_of(name: str) -> str | None:
    parts = name.split(".")
    return parts[1] if parts[0] == "fluorspar" and len(parts) > 1 else None


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_layers_import_one_way(path: Path) -> None:
    own = path.relative_to(ROOT).parts[0].removesuffix(".py")
    if own == "__init__":
        return  # lists the public names, lazily
    for name in imported(path):
        other = layer_of(name)
        if other is None:
            continue
        assert LAYERS.index(other) <= LAYERS.index(own), f"{own} imports {name}"
        assert {own, other} != {"paths", "staged"}, f"{own} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_mitsuba_is_imported_in_its_layers_only(path: Path) -> None:
    own = path.relative_to(ROOT).parts[0].removesuffix(".py")
    roots = {name.partition(".")[0] for name in imported(path)}
    if roots & {"mitsuba", "drjit"}:
        assert own in ("scene", "paths", "staged"), f"{own} imports Mitsuba"


def run(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes of a file except those that only type checkers look at."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            yield node
            yield from run(node)


def needed(path: Path) -> set[str]:
    """Modules of Fluorspar that a file imports, also within functions; not the packages it is in."""
    found = set()
    for node in run(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in NAMES else node.module for name in inner}
    return {name for name in found & NAMES if not f"{name_of(path)}.".startswith(f"{name}.")}


def test_no_modules_import_in_a_circle() -> None:
    try:
        TopologicalSorter({name_of(path): needed(path) for path in MODULES}).prepare()
    except CycleError as err:
        pytest.fail(f"a circle of imports: {' <- '.join(err.args[1])}")


def test_importing_everything_has_no_side_effects() -> None:
    """No module sets a Mitsuba variant, prints, or opens a data file when it is imported."""
    code = f"""
import importlib, sys
opened = []
def watch(event, args):
    if event == "open" and isinstance(args[0], str) and "/fluorspar/data/" in args[0]:
        opened.append(args[0])
sys.addaudithook(watch)
for name in {sorted(name for name in NAMES if not name.endswith("__main__"))!r}:
    importlib.import_module(name)
import mitsuba
assert mitsuba.variant() is None, mitsuba.variant()
assert not opened, opened
"""
    done = subprocess.run(
        [sys.executable, "-W", "error::UserWarning", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""


def test_public_names_are_there() -> None:
    for name in fluorspar.__all__:
        assert getattr(fluorspar, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        fluorspar.nothing  # noqa: B018


def test_no_public_name_is_hidden_by_a_module() -> None:
    """Importing a submodule sets it as an attribute of the package, in place of a public name that is the same."""
    modules = {path.relative_to(ROOT).parts[0].removesuffix(".py") for path in MODULES}
    assert not modules & set(fluorspar.__all__)
