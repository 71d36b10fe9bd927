"""Files that the settings of a row name, as a study file sees them: relative to its own folder."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from fluorspar.files.names import file_and_column
from fluorspar.scene.builtin import BUILTIN, builtin_path

if TYPE_CHECKING:
    from fluorspar.studies.keys import Value
    from fluorspar.studies.study import Row

__all__ = ["located", "mark_of"]

_NAME_FILES = ("scene", "library", "D", "light", "material")


def located(settings: Mapping[str, Value], folder: Path) -> dict[str, Value]:
    """Write the names of files that are in the folder of the study as paths from anywhere.

    Examples
    --------
    >>> located({"scene": "cornell-box", "spp": 4}, Path("/studies"))
    {'scene': 'cornell-box', 'spp': 4}
    """
    return {
        key: ",".join(_located(part, folder) for part in value.split(","))
        if isinstance(value, str) and key.partition(".")[0] in _NAME_FILES and value not in BUILTIN
        else value
        for key, value in settings.items()
    }


def mark_of(row: Row) -> str:
    """A mark that changes with what a row asks for: SHA-256 of its settings, its scene file and the files they name.

    Files that the scene file names in turn count: meshes, textures, spectra, what it includes. Not those that are only
    found in a folder of a `<path>`.

    Examples
    --------
    >>> from fluorspar.studies.study import Row
    >>> marks = [mark_of(Row(1, {"scene": "furnace", "spp": spp}, (), Path())) for spp in (4, 4, 8)]
    >>> marks[0] == marks[1], marks[0] == marks[2]
    (True, False)
    """
    mark = hashlib.sha256(row.canonical.encode())
    parameters = {key[2:]: str(value) for key, value in row.settings.items() if key.startswith("D.")}
    files = list(_files_of(row))
    for file in files:
        mark.update(_digest(file, file.stat().st_mtime_ns))
        if file.suffix.lower() == ".xml":
            files += [named for named in _named_in(file, parameters) if named not in files]
    return mark.hexdigest()


def _files_of(row: Row) -> Iterator[Path]:
    for key, value in located(row.settings, row.folder).items():
        if key == "scene" and value in BUILTIN:
            yield builtin_path(str(value))
        elif isinstance(value, str) and key.partition(".")[0] in _NAME_FILES:
            for part in value.split(","):
                for name in (part, part.rpartition(":")[0], part.rpartition("x")[0]):
                    if name and os.path.isfile(file := file_and_column(name)[0]):
                        yield file


def _named_in(file: Path, parameters: Mapping[str, str]) -> list[Path]:
    """Files that a scene file names, relative to its folder."""
    named = []
    for value in re.findall(r'"([^"<>]+)"', file.read_text(errors="replace")):
        name = Template(value).safe_substitute(parameters)
        with suppress(OSError, ValueError):  # of what is no name
            if os.path.isfile(path := file.parent / name):
                named.append(path)
    return named


def _located(name: str, folder: Path) -> str:
    """One name, or a part of a mixture: a name with a weight."""
    for text in (name, name.rpartition(":")[0], name.rpartition("x")[0]):
        if text.strip() and os.path.exists(folder / text.strip()):
            return str(folder / name.strip())
    return name


@cache
def _digest(file: Path, modified: int) -> bytes:
    """SHA-256 of a file; read again once it was modified."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").digest()
