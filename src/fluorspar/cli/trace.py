"""`fluorspar trace`: the light paths of a scene, kept in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.changes import LightOption, SameLuminanceOption, files_named, light_of, settings
from fluorspar.cli.options import ExcitationOption, LibraryOption, ResumeOption, ThreadsOption
from fluorspar.cli.scene_options import (
    MaterialOption,
    MatteOption,
    MaxDepthOption,
    MeshOption,
    RrDepthOption,
    SceneArgument,
    SceneDefineOption,
    SeedOption,
    SensorOption,
    SizeOption,
    SppOption,
    VariantOption,
    ViewpointOption,
    WavelengthsOption,
    scene_to_trace,
)
from fluorspar.cli.workers import SchedulerOption, WorkersOption, client_for
from fluorspar.scene.settings_text import size_of

__all__ = ["trace"]

_EXAMPLES = """Examples:

  fluorspar trace cornell-box --size 256x256 --spp 64 -o box.paths

  fluorspar relight box.paths --light light=FL11 -o box.png

  fluorspar trace room.xml --spp 256 -o room.paths --resume"""


def trace(
    scene: SceneArgument,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="File to write, NAME.paths.")
    ],
    spp: SppOption = None,
    seed: SeedOption = 0,
    size: SizeOption = None,
    wavelengths: WavelengthsOption = "360:700:5",
    excitation: ExcitationOption = "full",
    material: MaterialOption = None,
    library: LibraryOption = None,
    define: SceneDefineOption = None,
    max_depth: MaxDepthOption = None,
    rr_depth: RrDepthOption = None,
    matte: MatteOption = False,
    sensor: SensorOption = None,
    camera: ViewpointOption = None,
    light: LightOption = None,
    same_luminance: SameLuminanceOption = False,
    resume: ResumeOption = False,
    variant: VariantOption = "auto",
    threads: ThreadsOption = None,
    scheduler: SchedulerOption = None,
    workers: WorkersOption = None,
    mesh: MeshOption = None,
) -> None:
    """Trace the light paths of a scene into a file, for 'relight', 'sheet' and 'view'."""
    from fluorspar.cli.outputs import say_written
    from fluorspar.cli.targets import check_files
    from fluorspar.paths.paths_file import SUFFIX
    from fluorspar.rendering import trace as trace_scene

    lights = settings(light, "--light", light_of)
    check_files([output], (SUFFIX,), (scene, mesh, *files_named(lights, {}, [])))
    loaded = scene_to_trace(
        scene, material=material, library=library, define=define, matte=matte, sensor=sensor, mesh=mesh
    )
    with (
        client_for(scheduler, workers, threads) as client,
        console.progress_bar(f"tracing {scene}") as progress,
    ):
        paths = trace_scene(
            loaded,
            spp=spp,
            seed=seed,
            size=size_of(size),
            wavelengths=wavelengths,
            excitation=excitation,
            camera=camera,
            lights=lights,
            same_luminance=same_luminance,
            max_depth=max_depth,
            rr_depth=rr_depth,
            variant=variant,
            threads=threads,
            output=output,
            resume=resume,
            progress=progress,
            client=client,
        )
    console.out.print(str(paths), markup=False, highlight=False)
    say_written(output)
    traced = paths.job.scene.settings
    if paths.pixels < traced.width * traced.height:
        raise typer.Exit(130)  # `main` says 143 after SIGTERM


trace.__doc__ = f"{trace.__doc__}\n\n{_EXAMPLES}"
