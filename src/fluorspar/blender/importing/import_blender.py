"""Turn a file of Blender into a scene for Fluorspar."""

from __future__ import annotations

import json
import os
from pathlib import Path

from fluorspar.blender.importing.listing import Listing
from fluorspar.blender.importing.scene_file import write_scene
from fluorspar.blender.process import BlenderProcess
from fluorspar.errors import SceneError, message
from fluorspar.files.beside import Temporary
from fluorspar.files.names import text_of
from fluorspar.files.writing import check_folder

__all__ = ["import_blender"]

_INSIDE = Path(__file__).with_name("inside_blender")
_MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")  # plain, or compressed by Zstandard or gzip
_LISTED = "import.txt"


def import_blender(
    source: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    blender: str | os.PathLike[str] | None = None,
) -> Path:
    """Write a scene that Fluorspar and Mitsuba render, from a file of Blender.

    Parameters
    ----------
    source : str or path-like
        A `.blend` file. What a render of its active scene at its current frame shows is taken.
    folder : str or path-like
        To be written: `scene.xml` with `meshes` and `textures`, and `import.txt`, which lists what has no counterpart.
        One of an earlier import is replaced.
    blender : str or path-like, optional
        Blender 3.4 or newer, or a Python that has `bpy`; default: the environment variable `BLENDER`, else the
        `blender` of the search path.

    Returns
    -------
    Path
        The scene file.

    Raises
    ------
    SceneError
        If the file is none of Blender's, cannot be opened, or has no camera of a known kind.
    MaterialError
        If a material of the library is asked for that there is not.
    RendererError
        If there is no Blender, it is too old, or it ends or hangs.
    ImageError
        If the folder cannot be written, or holds something else.

    Warns
    -----
    ApproximationWarning
        For each thing that has no counterpart.

    Examples
    --------
    >>> import_blender("no-such-room.blend", "room")
    Traceback (most recent call last):
    ...
    fluorspar.errors.SceneError: the file of Blender does not exist
      where:    no-such-room.blend
    """
    source = _checked(Path(source))
    target = check_folder(folder, _is_import, "folder of an import")
    temporary = Temporary(target, folder=True)
    try:
        listing = _imported(source, temporary.path, blender)
        text = [f"Imported from {text_of(source.name)}. What has no counterpart:", ""]
        text += listing.sentences or ["(nothing)"]
        (temporary.path / _LISTED).write_text("\n".join(text) + "\n", encoding="utf-8")
        temporary.keep()
    finally:
        temporary.drop()
    listing.warn()
    return Path(folder) / "scene.xml"


def _imported(source: Path, folder: Path, blender: str | os.PathLike[str] | None) -> Listing:
    with BlenderProcess(_INSIDE, blender) as process:
        out = process.name(".json")
        answer = process.ask(
            "describe",
            file=os.path.abspath(source),
            arrays=str(process.folder),
            textures=os.path.abspath(folder / "textures"),
            out=out,
        )
        if answer.get("refused") == "no camera":
            fix = "add a camera to the scene in Blender, and make it the active one"
            raise SceneError(message("the scene has no camera", where=source, fix=fix))
        if "refused" in answer:
            version = ".".join(map(str, process.version))
            fix = f"a file of a newer Blender than {version} needs that one (--blender)"
            raise SceneError(
                message("Blender cannot open the file", where=source, got=answer["refused"].strip(), fix=fix)
            )
        said = json.loads(Path(out).read_text(encoding="utf-8"))
        return write_scene(said, process.folder, folder)


def _checked(source: Path) -> Path:
    try:
        with open(source, "rb") as file:
            start = file.read(8)
    except FileNotFoundError as err:
        raise SceneError(message("the file of Blender does not exist", where=source)) from err
    except OSError as err:
        raise SceneError(
            message("the file of Blender cannot be read", where=source, got=err.strerror)
        ) from err
    if not start.startswith(_MAGIC):
        expected = "a .blend file, plain or compressed"
        raise SceneError(
            message(
                "this is not a file of Blender",
                where=source,
                got=f"a file that begins with {start!r}",
                expected=expected,
            )
        )
    return source


def _is_import(folder: Path) -> bool:
    """Whether a folder is empty, or one of an earlier import."""
    names = {path.name for path in folder.iterdir()}
    return not names or ({_LISTED, "scene.xml"} <= names <= {_LISTED, "scene.xml", "meshes", "textures"})
