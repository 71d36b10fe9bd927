"""The option `--blender`, and the renderer that it belongs to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fluorspar.errors import OptionError, message

if TYPE_CHECKING:
    from fluorspar.staged.renderers.protocol import Renderer

__all__ = ["BlenderOption", "chosen_renderer"]

BlenderOption = Annotated[
    str | None,
    typer.Option(
        metavar="PATH",
        help="Blender 3.4 or newer, or a Python that has bpy. [default: the environment variable BLENDER, "
        "else blender]",
    ),
]


def chosen_renderer(name: str | None, blender: str | None) -> Renderer | str | None:
    """The renderer of `--renderer` and `--blender`.

    Raises
    ------
    OptionError
        If a Blender is given that is not used.
    """
    if blender is None:
        return name
    if name != "cycles":
        raise OptionError(
            message(
                "--blender is given, but Blender is not used",
                got=f"--blender {blender}",
                expected="--renderer cycles with it",
            )
        )
    from fluorspar.staged.renderers.cycles.renderer import CyclesRenderer

    return CyclesRenderer(blender)
