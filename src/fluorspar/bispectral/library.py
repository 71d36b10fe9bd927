"""Find a material by name: in the shipped library, in folders of the user's, or in a file."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from difflib import get_close_matches
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from fluorspar.bispectral.files.registry import SUFFIXES, read_material
from fluorspar.bispectral.material import Material, mix
from fluorspar.errors import MaterialError, message

__all__ = ["ENVIRONMENT", "material", "materials"]

ENVIRONMENT = "FLUORSPAR_MATERIALS"
"""Environment variable with more folders of material files, separated as in PATH."""

_MIXTURE = re.compile(r"^(?P<name>[^,]+?)\s*:\s*(?P<weight>[0-9.eE+-]+)$")


def material(
    name: str | Path, directories: Sequence[str | Path] = (), *, base: Path | None = None
) -> Material:
    """Return a material by name, from a file, or mixed.

    Parameters
    ----------
    name : str or Path
        The name of a library material; or a file: a material `.csv`, a Donaldson `.csv` or a Labsphere
        `.bfc`; or a mixture "A:0.3,B:0.7" of such, in which D is mixed linearly.
    directories : sequence of str or Path
        Folders to look in first, before those in the environment variable `FLUORSPAR_MATERIALS` and before
        the shipped library.
    base : Path, optional
        Folder beside which files are looked for before anything else, also those of a mixture: that of a scene.

    Raises
    ------
    MaterialError
        If there is no such material (the message names similar ones) or its file is malformed.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "grey.csv")
    ...     _ = file.write_text("# fluorspar-material: 1\\nwavelength,reflectance\\n300,0.5\\n780,0.5")
    ...     material("grey", [folder]).reflectance.at(550), material(file).name
    (0.5, 'grey')
    """
    if isinstance(name, Path):
        return read_material(name)
    if base is not None and (base / name).is_file():
        return read_material(base / name)
    known = _files(directories)
    if name in known:
        return read_material(known[name])
    parts = [_MIXTURE.match(part.strip()) for part in name.split(",")]
    if all(parts) and not os.path.isfile(name):  # Path.is_file fails on long names
        ingredients = [(part["name"], part["weight"]) for part in parts if part]
        return mix(
            [(material(part, directories, base=base), _weight(weight, name)) for part, weight in ingredients],
            name,
        )
    if Path(name).suffix.lower() in SUFFIXES or os.sep in name or "/" in name:
        return read_material(Path(name))
    folded = {key.casefold(): key for key in known}
    if name.strip().casefold() in folded:
        return read_material(known[folded[name.strip().casefold()]])
    close = [folded[key] for key in get_close_matches(name.casefold(), folded, n=3)]
    fix = f"did you mean {' or '.join(close)}?" if close else "`fluorspar materials list` shows all"
    expected = f"a file ({', '.join(SUFFIXES)}), a mixture A:0.3,B:0.7, or one of: {', '.join(sorted(known))}"
    raise MaterialError(message("there is no such material", got=repr(name), expected=expected, fix=fix))


def materials(directories: Sequence[str | Path] = ()) -> list[str]:
    """List the names that `material` knows.

    Parameters
    ----------
    directories : sequence of str or Path
        As for `material`.

    Raises
    ------
    MaterialError
        If one of the directories does not exist.

    Examples
    --------
    >>> isinstance(materials(), list)
    True
    """
    return sorted(_files(directories), key=str.casefold)


def _weight(text: str, mixture: str) -> float:
    try:
        return float(text)
    except ValueError as err:
        raise MaterialError(message("a weight is not a number", where=mixture, got=repr(text))) from err


def _files(directories: Sequence[str | Path]) -> dict[str, Path | Traversable]:
    """Material files by name; what is found first wins."""
    from_environment = [Path(part) for part in os.environ.get(ENVIRONMENT, "").split(os.pathsep) if part]
    by_name: dict[str, Path | Traversable] = {}
    folders: list[Path | Traversable] = [*map(Path, directories), *from_environment]
    for folder in [*folders, files("fluorspar") / "data" / "materials"]:
        if not folder.is_dir():
            fix = f"correct the argument or the environment variable {ENVIRONMENT}"
            raise MaterialError(message("a folder of materials does not exist", where=folder, fix=fix))
        for file in sorted(folder.iterdir(), key=lambda entry: entry.name):
            stem, _, suffix = file.name.rpartition(".")
            if f".{suffix.lower()}" in SUFFIXES:
                by_name.setdefault(stem, file)
    return by_name
