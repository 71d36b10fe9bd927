"""What the command line asks and tells of the staged method."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fluorspar.cli import console
from fluorspar.errors import OptionError, message
from fluorspar.image.spectral_image import SpectralImage

if TYPE_CHECKING:
    from fluorspar.staged.options import StagedOptions

__all__ = ["mesh_parameter", "print_timings", "staged_options"]


def staged_options(method: str, **given: Any) -> StagedOptions | None:
    """Collect the options of the staged method that were given; None for another method.

    Raises
    ------
    OptionError
        If one is given for another method, or out of range.
    """
    chosen = {name: value for name, value in given.items() if value is not None}
    if method != "staged":
        if chosen:
            option = "--" + next(iter(chosen)).replace("_", "-").replace("mode", "emitter-mode")
            raise OptionError(
                message(
                    "an option of the staged method is given",
                    where=option,
                    fix="add --method staged, or leave it out",
                )
            )
        return None
    from fluorspar.staged.options import StagedOptions

    return StagedOptions(**chosen)


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


def print_timings(image: SpectralImage) -> None:
    """Print how long each pass took."""
    timings = image.attrs.get("timings", {})
    if "component 1" in timings:
        from fluorspar.staged.timings import timing_table

        console.out.print(timing_table(timings), markup=False, highlight=False)
    else:
        for name, seconds in timings.items():
            console.out.print(f"{name:<22}{seconds:>8.2f} s", markup=False, highlight=False)
