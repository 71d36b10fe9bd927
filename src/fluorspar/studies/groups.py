"""Rows of a study that differ in spectra only: they share light paths, traced once."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from fluorspar.studies.keys import Value
from fluorspar.studies.study import Row

__all__ = ["Group", "groups_of"]

_RELIT = ("light", "concentration")  # what only light paths can be given
_SPECTRAL = (
    *_RELIT,
    "material",
    "same_luminance",
    "wavelengths",
    "stokes",
    "excitation",
    "component_errors",
    "denoise",
)


@dataclass(frozen=True)
class Group:
    """Renders that need one scene and, if `traced`, one set of light paths. It pickles.

    Attributes
    ----------
    rows : tuple of Row
        To be rendered now.
    common : mapping of str to str, int, float or bool
        Settings that all rows of the study have that are of this kind: what is loaded and traced. So an image is the
        same bit for bit whether the others are done already or not.
    traced : bool
        Whether light paths are traced and kept; else the scene is rendered.
    """

    rows: tuple[Row, ...]
    common: Mapping[str, Value]
    traced: bool

    def paths_files(self) -> list[Path]:
        """Where large light paths are kept for a while: beside the output of a row, and named after it, that of the
        first one now; so no other study that writes into the folder has the same.
        """
        outputs = [row.outputs[0] for row in self.rows]
        names = [hashlib.sha256(os.fsencode(output.name)).hexdigest()[:16] for output in outputs]
        return [output.parent / f".{name}.paths" for output, name in zip(outputs, names, strict=True)]

    @classmethod
    def alone(cls, row: Row) -> Group:
        """The group of one row, which is loaded with its own materials."""
        is_relit = any(_kind(key) in _RELIT for key in row.settings)
        return cls((row,), row.settings, is_relit and _keeps_paths(row))


def groups_of(rows: Iterable[Row], pending: Iterable[Row]) -> list[Group]:
    """Group the pending rows of a study.

    Examples
    --------
    >>> from fluorspar.studies.study import read_study
    >>> lamps = {"render": {"scene": "furnace"}, "product": {"light.walls": ["A", "D65"], "seed": [1, 2, 3]}}
    >>> rows = read_study(lamps).rows
    >>> [[row.number for row in group.rows] for group in groups_of(rows, rows)]
    [[1, 4], [2, 5], [3, 6]]
    """
    wanted = {row.number for row in pending}
    alike: dict[str, list[Row]] = {}
    for row in rows:
        alike.setdefault(_key(row), []).append(row)
    groups = []
    for members in alike.values():
        left = tuple(row for row in members if row.number in wanted)
        if left and len(members) == 1:
            groups.append(Group.alone(left[0]))
        elif left:
            shared = members[0].settings.items()
            common = {k: v for k, v in shared if all(row.settings.get(k) == v for row in members)}
            groups.append(Group(_in_order(left), common, True))
    return groups


def _key(row: Row) -> str:
    """What rows must have in common to share light paths."""
    if not _keeps_paths(row):
        return str(row.number)
    return json.dumps({k: v for k, v in row.settings.items() if _kind(k) not in _SPECTRAL}, sort_keys=True)


def _keeps_paths(row: Row) -> bool:
    """Whether a row can be made of light paths that are kept: not in passes, nor by the staged method."""
    return row.settings.get("method", "paths") == "paths" and "until" not in row.settings


def _in_order(rows: tuple[Row, ...]) -> tuple[Row, ...]:
    """Those that differ in lights only follow one another, because unpacked paths serve all of them."""

    def surfaces(row: Row) -> str:
        settings = row.settings.items()
        return str(sorted((k, v) for k, v in settings if _kind(k) in ("material", "concentration")))

    first: dict[str, int] = {}
    for row in rows:
        first.setdefault(surfaces(row), row.number)
    return tuple(sorted(rows, key=lambda row: (first[surfaces(row)], row.number)))


def _kind(key: str) -> str:
    return key.partition(".")[0]
