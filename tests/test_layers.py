"""The structure of the package: layers import one way, no modules in a circle, and importing has no side effects."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import fluorspar

ROOT = Path(fluorspar.__file__).parent
# Each file or folder may import from those before it.
LAYERS = [
    "errors",
    "extras",
    "progress",
    "version",
    "notebook",
    "files",
    "spectral",
    "colour",
    "bispectral",
    "image",
    "scene",
    "blender",
    "until",
    "job",
    "fingerprint",
    "paths",
    "cluster",
    "staged",
    "rendering",
    "measuring",
    "denoising",
    "comparing",
    "figures",
    "sheets",
    "studies",
    "view",
    "cli",
    "__main__",
]
# These do not know each other.
STRANGERS = [("paths", "staged"), ("paths.tracing", "paths.sweeping")]
# Mitsuba and Dr.Jit are imported here only.
MITSUBA = ("scene", "paths.chunks", "paths.tracing", "staged.renderers.mitsuba")
MODULES = sorted(ROOT.rglob("*.py"))


def name_of(path: Path) -> str:
    """Name of the module that a file is."""
    return ".".join(("fluorspar", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


NAMES = {name_of(path) for path in MODULES}


def imports_of(source: str, module: str) -> set[str]:
    """Names of all modules that the source of a module imports, wherever in it; `from a import b` may mean `a.b`."""
    names = set()
    package = (
        module
        if (ROOT / Path(*module.split(".")[1:]) / "__init__.py").exists()
        else module.rpartition(".")[0]
    )
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            origin = ".".join([*parts, *([node.module] if node.module else [])])
            inner = {f"{origin}.{alias.name}" for alias in node.names}
            names |= {name if name in NAMES or origin == "fluorspar" else origin for name in inner}
    return names


def home_of_public_name(name: str) -> str:
    """Module that a name of the package `fluorspar` itself comes from."""
    if name in NAMES or not name.startswith("fluorspar.") or name.count(".") > 1:
        return name
    return str(getattr(fluorspar, name.partition(".")[2]).__module__)


def is_in(module: str, part: str) -> bool:
    return f"{module}.".startswith(f"fluorspar.{part}.")


def faults(source: str, module: str) -> list[str]:
    """What is wrong with the imports of a module."""
    found = []
    own = module.split(".")[1]
    for name in map(home_of_public_name, imports_of(source, module)):
        if name == "fluorspar":
            found.append("imports the package as a whole")
        if name.partition(".")[0] in ("mitsuba", "drjit") and not any(
            is_in(module, part) for part in MITSUBA
        ):
            found.append(f"imports {name}")
        if name.startswith("fluorspar."):
            if LAYERS.index(name.split(".")[1]) > LAYERS.index(own):
                found.append(f"imports {name}, which is above it")
            for a, b in STRANGERS:
                if (is_in(module, a) and is_in(name, b)) or (is_in(module, b) and is_in(name, a)):
                    found.append(f"imports {name}, which it is not to know")
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_layers_import_one_way(path: Path) -> None:
    if path.parent != ROOT or path.name != "__init__.py":  # that one lists the public names, lazily
        assert not faults(path.read_text(encoding="utf-8"), name_of(path))


def test_every_file_and_folder_has_a_layer() -> None:
    there = {path.relative_to(ROOT).parts[0].removesuffix(".py") for path in MODULES} - {"__init__"}
    assert there == set(LAYERS)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("spectral.even", "from ..cli import main"),
        ("spectral.even", "def f():\n    from fluorspar.image import dataset"),
        ("spectral.even", "from fluorspar import render"),
        ("spectral.even", "import fluorspar"),
        ("staged.passes", "from fluorspar import paths"),
        ("paths.tracing.tracer", "import fluorspar.paths.sweeping.kernel"),
        ("paths.sweeping.sweep", "import mitsuba as mi"),
        ("staged.passes", "import drjit"),
    ],
)
def test_a_wrong_import_is_found(module: str, source: str) -> None:
    assert faults(source, f"fluorspar.{module}")


def test_no_modules_import_in_a_circle() -> None:
    """Imports within functions and those for type checkers count too."""

    def needed(path: Path) -> set[str]:
        names = imports_of(path.read_text(encoding="utf-8"), name_of(path)) & NAMES
        return {name for name in names if not f"{name_of(path)}.".startswith(f"{name}.")}

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
