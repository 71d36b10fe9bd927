"""`fluorspar batch`: all renders of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.options import ThreadsOption
from fluorspar.cli.workers import SchedulerOption, WorkersOption, client_for
from fluorspar.files.names import text_of

__all__ = ["batch"]

_NAMED = 5  # files of one fault

_EXAMPLES = """After an interruption, or a change of the table, the same command renders what is missing.

Example: lamps.toml is

\b
  output = "lamps/{light}-{concentration:.2f}.nc"

\b
  [render]
  scene = "cornell-box"
  size = "128x128"
  spp = 64

\b
  [product]
  light.light = ["D65", "A", "FL11"]
  concentration.left-wall = { start = 0, stop = 1, number = 5 }

  fluorspar batch lamps.toml

Every value of [product] is combined with every other, and with each table [[rows]] if there are any. Keys are options
of 'fluorspar render' (scene, size, spp, seed, wavelengths, max_depth, matte, sensor, until, denoise, ...), and D.KEY,
light.ID, material.ID, concentration.ID. In a CSV file they are the columns, and each line is a render. File names are
relative to the folder of the study."""


def batch(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="A table of renders: .toml or .csv.")],
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="PATTERN",
            help="Pattern of the files to write, such as '{scene}-{light}-{seed}.nc', relative to the "
            "folder of the study. May be repeated. [default: that of the study, else STUDY-{number}.nc]",
        ),
    ] = None,
    threads: ThreadsOption = None,
    scheduler: SchedulerOption = None,
    workers: WorkersOption = None,
) -> None:
    """Render a table of scenes, lights and materials. Images that are done are skipped."""
    from fluorspar.studies.batch import run_study
    from fluorspar.studies.study import read_study

    read = read_study(study, output)
    with (
        client_for(scheduler, workers, threads) as client,
        console.progress_bar(f"{len(read.rows)} renders") as progress,
    ):
        results = run_study(read, client=client, threads=threads, progress=progress)
    failed = [result for result in results if result.status == "failed"]
    by_fault: dict[str, list[Path]] = {}
    for result in failed:
        by_fault.setdefault(result.fault, []).append(read.rows[result.number - 1].outputs[0])
    for fault, files in by_fault.items():
        named = ", ".join(text_of(file.name) for file in files[:_NAMED])
        more = f" and {len(files) - _NAMED} more" if len(files) > _NAMED else ""
        console.error(f"not rendered: {named}{more}\n  {fault}")
    before = sum(result.before for result in results)
    done = sum(result.status == "done" for result in results) - before
    unfinished = sum(result.status == "open" for result in results)
    counts = [f"{done} rendered", f"{before} done before", f"{len(failed)} failed", f"{unfinished} open"]
    console.out.print(
        f"{len(results)} renders: {', '.join(count for count in counts if count[:2] != '0 ')}",
        markup=False,
        highlight=False,
    )
    console.out.print(f"wrote {text_of(str(read.index))}.csv and .nc", markup=False, highlight=False)
    if unfinished:
        raise typer.Exit(130)  # `main` says 143 after SIGTERM
    if failed:
        raise typer.Exit(1)


batch.__doc__ = f"{batch.__doc__}\n\n{_EXAMPLES}"
