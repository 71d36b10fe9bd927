"""`fluorspar scenes`: the scenes that come with Fluorspar."""

from __future__ import annotations

from typing import Annotated

import typer

from fluorspar.cli import console

__all__ = ["scenes"]


def scenes(
    paths: Annotated[
        bool,
        typer.Option("--paths", help="Print the paths of the scene files instead, to copy and change them."),
    ] = False,
) -> None:
    """List the built-in scenes.

    Example:  fluorspar scenes
    """
    from fluorspar.scene.builtin import BUILTIN, builtin_path

    for name, description in BUILTIN.items():
        console.out.print(
            f"{name:<16}{builtin_path(name) if paths else description}", markup=False, highlight=False
        )
