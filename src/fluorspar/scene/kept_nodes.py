"""Mitsuba's nodes of a scene, which cannot be pickled: kept in the process, and parsed again in another."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fluorspar.errors import SceneError, SceneNotice, message
from fluorspar.scene.nodes import kind, resolved, resolving
from fluorspar.scene.recipe import Recipe
from fluorspar.scene.variants import SPECTRUM_VARIANT, use_variant

__all__ = ["Fingerprint", "KeptNodes", "fingerprint", "reads_file"]


@dataclass(frozen=True)
class Fingerprint:
    """What a scene was when it was loaded.

    Attributes
    ----------
    files : tuple of (str, str)
        Name and SHA-256 of the scene file, what it includes, its meshes, textures and environment maps: all else is
        read when a scene is loaded.
    nodes : str
        SHA-256 of the plugins and ids of the nodes, in their order: surfaces and lights refer to nodes by number.
    """

    files: tuple[tuple[str, str], ...]
    nodes: str


def fingerprint(state: Any) -> Fingerprint:
    """Take the fingerprint of a parsed scene; its folder must be that of Mitsuba's file resolver."""
    read_again = [str(resolved(node.props["filename"])) for node in state.nodes if reads_file(node)]
    names = [*map(str, state.files), *read_again]
    plugins = "\n".join(f"{node.props.plugin_name()} {node.props.id()}" for node in state.nodes)
    return Fingerprint(
        tuple((name, _digest(Path(name))) for name in names),
        hashlib.sha256(plugins.encode()).hexdigest(),
    )


def reads_file(node: Any) -> bool:
    """Whether Mitsuba reads a file when it builds a node: a mesh or a picture."""
    return kind(node) in ("Shape", "Texture", "Emitter") and "filename" in node.props


def _digest(path: Path) -> str:
    if not path.is_file():
        return "missing"
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class KeptNodes:
    """The nodes of a recipe, parsed once in each process.

    Parameters
    ----------
    recipe : Recipe
    state : mitsuba.parser.ParserState
        What `recipe.parse` has just returned.

    Attributes
    ----------
    fingerprint : Fingerprint
        Of the scene when it was loaded.
    folders : tuple of str
        Where Mitsuba looks for the files of the scene: those that the scene names (`<path>`), its own, and others.
    """

    def __init__(self, recipe: Recipe, state: Any) -> None:
        import mitsuba as mi

        self._recipe = recipe
        self.fingerprint = fingerprint(state)
        self._state = state
        self._made: tuple[Any, Any] | None = None
        self.folders = tuple(map(str, mi.file_resolver()))

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_state": None, "_made": None}

    def made(self, key: Any, make: Callable[[], Any]) -> Any:
        """Return what `make` makes of the nodes; the last is kept, and not made again for an equal key."""
        if self._made is None or self._made[0] != key:
            self._made = None  # it goes before the next one comes
            self._made = key, make()
        return self._made[1]

    def state(self) -> Any:
        """Return the `mitsuba.parser.ParserState`, which must not be changed.

        Raises
        ------
        SceneError
            If the files of the scene have changed, or are gone, since it was loaded.
        """
        if self._state is None:
            self._state = self._parse_again()
        return self._state

    def _parse_again(self) -> Any:
        with use_variant(SPECTRUM_VARIANT), resolving(self._recipe.base), warnings.catch_warnings():
            warnings.simplefilter("ignore", SceneNotice)  # of a mesh: said when the scene was loaded
            try:
                state = self._recipe.parse()
            except SceneError as err:
                raise SceneError(f"{err}\n  in:       a scene loaded before, which is read again") from err
            now, before = fingerprint(state), self.fingerprint
        pairs = zip(before.files, now.files, strict=False)  # a file more or less is a change of another
        changed = [name for (name, digest), (_, other) in pairs if digest != other]
        if changed or now.nodes != before.nodes:
            raise SceneError(
                message(
                    "the scene has changed since it was loaded",
                    where=self._recipe.name,
                    got=f"{changed[0]} has changed or is gone" if changed else "other nodes",
                    expected="the same files, and the same version of Mitsuba",
                    fix="load the scene again",
                )
            )
        return state
