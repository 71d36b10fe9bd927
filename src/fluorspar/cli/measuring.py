"""Options of `measure` and `compare`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fluorspar.cli.options import pairs
from fluorspar.errors import OptionError, message

if TYPE_CHECKING:
    from fluorspar.measuring.aperture import Aperture
    from fluorspar.scene.scene import Scene

__all__ = ["aperture_of", "check_files", "limits_of", "scene_named"]


def check_files(paths: Sequence[Path], suffixes: tuple[str, ...]) -> None:
    """Find out before any work whether the files can be written.

    Raises
    ------
    OptionError
        If a suffix is none of those known, or a file is named twice.
    ImageError
        If a folder does not exist or may not be written to.

    Examples
    --------
    >>> check_files([Path("report.html")], (".html",))
    """
    from fluorspar.files.writing import check_target

    for path in paths:
        if path.suffix.lower() not in suffixes:
            expected = ", ".join(suffixes)
            raise OptionError(
                message("this kind of file cannot be written", where="--output", got=path, expected=expected)
            )
        check_target(path)
    if len(set(paths)) < len(paths):
        raise OptionError(
            message("a file is to be written twice", where="--output", got=", ".join(map(str, paths)))
        )


def limits_of(texts: Sequence[str]) -> dict[str, float]:
    """Read the limits of `--fail-above`.

    Raises
    ------
    OptionError
        If a number is not known or named twice, or its limit is not a number of 0 or more.

    Examples
    --------
    >>> limits_of(["rmse=0.05"])
    {'rmse': 0.05}
    """
    from fluorspar.comparing.comparison import LIMITS

    option = "--fail-above"
    limits: dict[str, float] = {}
    for name, text in (pair for each in texts for pair in pairs([each], option).items()):
        if name not in LIMITS:
            raise OptionError(
                message("there is no such number", where=option, got=name, expected=", ".join(LIMITS))
            )
        if name in limits:
            raise OptionError(
                message("a number has two limits", where=f"{option} {name}", fix="give it once")
            )
        try:
            limits[name] = float(text)
        except ValueError as err:
            raise OptionError(message("a limit is not a number", where=f"{option} {name}", got=text)) from err
        if not 0 <= limits[name] < math.inf:
            expected = "a finite number of 0 or more: no number of a comparison is negative"
            raise OptionError(
                message("a limit is impossible", where=f"{option} {name}", got=text, expected=expected)
            )
    return limits


def aperture_of(text: str | None) -> Aperture | None:
    """Read an aperture, such as `0.125deg` or `3px`."""
    from fluorspar.measuring.aperture import Aperture

    return None if text is None else Aperture.parse(text)


def scene_named(name: str | None, define: Sequence[str] | None = None) -> Scene | None:
    """Load a scene by its name or file.

    Parameters
    ----------
    name : str or None
    define : sequence of str, optional
        `KEY=VALUE` of the `$KEY` substitutions of its file.

    Raises
    ------
    OptionError
        If there are values and no scene.
    SceneError
        If the scene cannot be used.

    Examples
    --------
    >>> scene_named("cornell-box").name
    'cornell-box'
    """
    if name is None:
        if define:
            raise OptionError(
                message(
                    "values for a scene file are given without the scene",
                    where="-D",
                    got=", ".join(define),
                    fix="name the scene (--scene)",
                )
            )
        return None
    from fluorspar.scene.loading import load_scene

    return load_scene(name, parameters=pairs(define or [], "-D"))
