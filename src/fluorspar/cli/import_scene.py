"""`fluorspar import`: a scene of Blender as one that Fluorspar renders."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.blender_option import BlenderOption
from fluorspar.files.names import text_of

__all__ = ["import_scene"]


def import_scene(
    source: Annotated[Path, typer.Argument(metavar="SCENE.blend", help="A file of Blender.")],
    folder: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder to write: scene.xml, meshes, textures, and import.txt.",
        ),
    ],
    blender: BlenderOption = None,
) -> None:
    """Turn a file of Blender into a scene for Fluorspar and Mitsuba.

    Blender runs in the background. What cannot be translated is listed in import.txt, and as warnings. A material
    named 'fluorspar:poster-red', or with a custom property 'fluorspar' of 'poster-red', fluoresces.

    Example:  fluorspar import room.blend -o room

    Then:  fluorspar render room/scene.xml -o room.nc
    """
    from fluorspar.blender.importing.import_blender import import_blender

    scene = import_blender(source, folder, blender=blender)
    console.out.print(f"wrote {text_of(scene)}", markup=False, highlight=False)
