"""Where Blender is, and how it is started: the program itself, or a Python that has the module `bpy`."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

from fluorspar.errors import RendererError, message

__all__ = ["OLDEST", "check_version", "start_command"]

OLDEST = (3, 4)
_SECONDS = 60  # for the answer to --version; a first start from a slow disk takes long
_GET = (
    "install it (Debian: apt install blender; others: https://www.blender.org/download, or 'pip install bpy' in a "
    "virtual environment of its own) and say where it is: --blender PATH of the program or of that Python, or the "
    "environment variable BLENDER"
)


def start_command(blender: str | os.PathLike[str] | None, script: Path) -> list[str]:
    """Say how a script is run inside Blender, without window, user settings and sound.

    Parameters
    ----------
    blender : str or path, optional
        Blender, or a Python that has `bpy`; default: the environment variable `BLENDER`, else `blender` of the search
        path.
    script : Path
        It finds its arguments after `--`.

    Raises
    ------
    RendererError
        If there is no Blender, it does not start, or it is too old.
    """
    wanted = os.fspath(blender) if blender is not None else os.environ.get("BLENDER") or "blender"
    found = shutil.which(os.path.expanduser(wanted))
    if found is None:
        fault = "Blender is not there" if wanted != "blender" else "Blender is not installed"
        raise RendererError(message(fault, got=f"no program '{wanted}'", fix=_GET))
    try:
        said = subprocess.run(
            [found, "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_SECONDS,
            check=False,
        ).stdout.decode(errors="replace")
    except (OSError, subprocess.TimeoutExpired) as err:
        raise RendererError(message("Blender does not start", where=found, got=err, fix=_GET)) from err
    if re.match(r"Python \d", said):
        return [found, str(script), "--"]
    version = re.search(r"Blender (\d+)\.(\d+)", said)
    if version is None:
        got = said.strip().splitlines()[0] if said.strip() else "no answer to --version"
        expected = "Blender, or a Python that has bpy"
        raise RendererError(
            message("this program is not Blender", where=found, got=got, expected=expected, fix=_GET)
        )
    check_version((int(version[1]), int(version[2])), found)
    options = ["--background", "--factory-startup", "-noaudio", "--python-exit-code", "1"]
    return [found, *options, "--python", str(script), "--"]


def check_version(version: tuple[int, ...], where: str) -> None:
    """Refuse a Blender that is too old.

    Raises
    ------
    RendererError
    """
    if version < OLDEST:
        expected = ".".join(map(str, OLDEST)) + " or newer"
        got = ".".join(map(str, version))
        raise RendererError(
            message("this Blender is too old", where=where, got=got, expected=expected, fix=_GET)
        )
