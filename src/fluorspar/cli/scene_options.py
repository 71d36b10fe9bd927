"""Options of the commands that trace a scene: what it is, how it is loaded, and how it is traced."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from fluorspar.cli.given import pairs
from fluorspar.errors import OptionError, message
from fluorspar.scene.objects.mesh_file import FORMATS as MESHES

if TYPE_CHECKING:
    from fluorspar.scene.scene import Scene

__all__ = [
    "MaterialOption",
    "MatteOption",
    "MaxDepthOption",
    "MeshOption",
    "RrDepthOption",
    "SceneArgument",
    "SceneDefineOption",
    "SeedOption",
    "SensorOption",
    "SizeOption",
    "SppOption",
    "VariantOption",
    "ViewpointOption",
    "WavelengthsOption",
    "mesh_parameter",
    "scene_to_trace",
]

_LOG = logging.getLogger(__name__)

SceneArgument: TypeAlias = Annotated[
    str,
    typer.Argument(
        help="A Mitsuba 3 scene file (.xml) or the name of a built-in scene, see 'fluorspar scenes'."
    ),
]

SppOption: TypeAlias = Annotated[int | None, typer.Option(help="Samples per pixel. [default: the scene's]")]

SeedOption: TypeAlias = Annotated[
    int, typer.Option(help="Seed of the random numbers. Same seed, same image, bit for bit.")
]

SizeOption: TypeAlias = Annotated[
    str | None, typer.Option(metavar="WxH", help="Size in pixels. [default: the scene's]")
]

WavelengthsOption: TypeAlias = Annotated[
    str, typer.Option(metavar="START:STOP:STEP", help="Wavelength grid in nm.")
]

MaterialOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ID=NAME",
        help="Give a surface another material, by the id of its shape or BSDF: NAME is one of 'fluorspar materials "
        "list', a file, or a mixture such as A:0.3,B:0.7. May be repeated.",
    ),
]

SceneDefineOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option("-D", metavar="KEY=VALUE", help="Value for $KEY in the scene file. May be repeated."),
]

MaxDepthOption: TypeAlias = Annotated[
    int | None,
    typer.Option(
        help="Longest light path, as in Mitsuba: 1 is lamps seen directly, 2 adds direct light, -1 is unlimited. "
        "[default: the scene's]"
    ),
]

RrDepthOption: TypeAlias = Annotated[
    int | None, typer.Option(help="Depth from which Russian roulette may end a path. [default: the scene's]")
]

MatteOption: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--matte",
        help="Replace textures, gloss and environment maps by diffuse averages: for scenes that are refused "
        "without it, such as glossy ones with --method staged.",
    ),
]

SensorOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="N|ID",
        help="Which camera of the scene (sensor), by number, from 0, or by id. [default: the first]",
    ),
]

ViewpointOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="'origin=X,Y,Z target=X,Y,Z up=X,Y,Z fov=DEGREES'",
        help="Move the camera. Positions are in units of the scene. What is left out stays: viewing direction, upward "
        "direction, field of view.",
    ),
]

VariantOption: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="auto|llvm|cuda",
        help="llvm: the processor; cuda: an NVIDIA GPU; auto: the GPU if it works, else the processor.",
    ),
]

MeshOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help=f"Of the scene cornell-mesh: the mesh to put into it, y up ({', '.join(MESHES)}).",
    ),
]


def scene_to_trace(
    scene: str,
    *,
    material: Sequence[str] | None,
    library: Sequence[Path] | None,
    define: Sequence[str] | None,
    matte: bool,
    sensor: str | None,
    mesh: Path | None,
) -> Scene:
    """Load the scene that a command is to trace, with the options that are about it.

    Raises
    ------
    OptionError
        If one of them is not readable.
    SceneError, MaterialError, SpectrumError
        If the scene cannot be used.
    """
    from fluorspar.scene.loading import load_scene

    defined = pairs(define or [], "-D")
    loaded = load_scene(
        scene,
        materials=pairs(material or [], "--material"),
        matte=matte,
        parameters=defined | mesh_parameter(scene, mesh, defined),
        library=library or [],
        sensor=sensor,
    )
    _LOG.info("loaded %s: %d surfaces, %d lights", scene, len(loaded.surfaces), len(loaded.lights))
    return loaded


def mesh_parameter(scene: str, mesh: Path | None, defined: Mapping[str, str]) -> dict[str, str]:
    """The parameter that `--mesh` gives to the scene `cornell-mesh`.

    Raises
    ------
    OptionError
        If it is given for another scene, or `-D mesh=` as well.
    """
    if mesh is None:
        return {}
    if "mesh" in defined:
        fault, got = "the mesh is given twice", f"--mesh {mesh} and -D mesh={defined['mesh']}"
        raise OptionError(message(fault, where="--mesh", got=got, fix="leave one of them out"))
    if scene != "cornell-mesh":
        raise OptionError(
            message(
                "--mesh puts a mesh into the built-in scene cornell-mesh",
                where="--mesh",
                got=f"scene '{scene}'",
                expected="cornell-mesh",
                fix="render cornell-mesh; for a $mesh in a scene file of yours, use -D mesh=FILE",
            )
        )
    return {"mesh": str(mesh)}
