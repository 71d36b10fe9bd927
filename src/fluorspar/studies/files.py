"""Files that the settings of a row name, as a study file sees them: relative to its own folder."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from fluorspar.bispectral.files.registry import SUFFIXES
from fluorspar.bispectral.library import ENVIRONMENT
from fluorspar.files.names import file_and_column
from fluorspar.scene.builtin import BUILTIN, builtin_path
from fluorspar.studies.keys import INDEX

if TYPE_CHECKING:
    from fluorspar.studies.keys import Value
    from fluorspar.studies.study import Row

__all__ = ["located", "mark_of"]

_QUOTED = re.compile(r"""="([^"<>]*)"|='([^'<>]*)'""".replace("=", r"=\s*"))
_ATTRIBUTE = re.compile(r"""(\w+)\s*=\s*["']([^"']*)["']""")
_NAME_FILES = ("scene", "library", "D", "light", "material")


def located(settings: Mapping[str, Value], folder: Path) -> dict[str, Value]:
    """Write the names of files that are in the folder of the study as paths from anywhere.

    Examples
    --------
    >>> located({"scene": "cornell-box", "spp": 4}, Path("/studies"))
    {'scene': 'cornell-box', 'spp': 4}
    """
    return {
        key: ",".join(_located(part, folder, key == "library") for part in value.split(","))
        if isinstance(value, str) and key.partition(".")[0] in _NAME_FILES and value not in BUILTIN
        else value
        for key, value in settings.items()
    }


def mark_of(row: Row) -> str:
    """A mark that changes with what a row asks for: SHA-256 of its settings, its scene file and the files they name.

    Files that the scene file names in turn count: meshes, textures, spectra, what it includes; and so do all files of
    the folders with materials of the user.

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
    folders = [file.parent for file in files]
    for file in files:
        with suppress(OSError):  # told when it is read
            mark.update(_digest(file, file.stat().st_mtime_ns))
            if file.suffix.lower() == ".xml":
                files += [named for named in _named_in(file, folders, parameters) if named not in files]
    return mark.hexdigest()


def _files_of(row: Row) -> Iterator[Path]:
    folders = [Path(folder) for folder in os.environ.get(ENVIRONMENT, "").split(os.pathsep) if folder]
    for key, value in located(row.settings, row.folder).items():
        if key == "scene" and value in BUILTIN:
            yield builtin_path(str(value))
        elif key == "library":
            folders.append(Path(str(value)))
        elif isinstance(value, str) and key.partition(".")[0] in _NAME_FILES:
            yield from _files_in(value, [Path()])
    for folder in folders:
        if os.path.isdir(folder):
            # A library may be the folder of the study, where each run changes the index and the images.
            yield from sorted(
                file
                for file in folder.glob("*")
                if file.suffix.lower() in SUFFIXES and not file.stem.endswith(INDEX) and file.is_file()
            )


def _files_in(text: str, folders: Sequence[Path]) -> Iterator[Path]:
    """Files that a text names: as it is, with a column, or the parts of a mixture, each with a weight."""
    parts = [text, *text.split(",")] if "," in text else [text]
    for part in parts:
        for name in (part, part.rpartition(":")[0], part.rpartition("x")[0]):
            for folder in folders if name.strip() else ():
                with suppress(OSError, ValueError):  # of what is no name
                    file = folder / file_and_column(name.strip())[0]
                    if file.is_file():
                        yield file


def _named_in(file: Path, folders: Sequence[Path], parameters: Mapping[str, str]) -> Iterator[Path]:
    """Files that a scene file names, relative to its folder, that of the scene, or one of a `<path>`."""
    text = file.read_text(errors="replace")
    defaults = {
        name: value
        for tag in re.findall(r"<default\b[^>]*>", text)
        for name, value in [tuple(dict(_ATTRIBUTE.findall(tag)).get(of, "") for of in ("name", "value"))]
    }
    values = [
        Template(value).safe_substitute({**defaults, **parameters})
        for value in (first or second for first, second in _QUOTED.findall(text))
    ]
    around = [*dict.fromkeys([*folders, file.parent])]
    around += [
        folder / value for folder in around for value in values if value and os.path.isdir(folder / value)
    ]
    for value in values:
        yield from _files_in(value, around)


def _located(name: str, folder: Path, folders: bool) -> str:
    """One name, or a part of a mixture: a name with a weight; perhaps a folder, which a lamp or material is not."""
    there = os.path.exists if folders else os.path.isfile
    for text in (name, name.rpartition(":")[0], name.rpartition("x")[0]):
        if text.strip() and there(folder / text.strip()):
            return str(folder / name.strip())
    return name


@cache
def _digest(file: Path, modified: int) -> bytes:
    """SHA-256 of a file; read again once it was modified."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").digest()
