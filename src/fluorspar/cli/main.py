"""The command `fluorspar`: gathers the subcommands and turns errors into messages and exit codes."""

from __future__ import annotations

import logging
import sys
import traceback
import warnings
from typing import Annotated, TextIO

import typer

from fluorspar.cli import console
from fluorspar.cli.compare import compare
from fluorspar.cli.convert import convert
from fluorspar.cli.doctor import doctor
from fluorspar.cli.info import info
from fluorspar.cli.materials import materials
from fluorspar.cli.measure import measure
from fluorspar.cli.render import render
from fluorspar.cli.scenes import scenes
from fluorspar.errors import FluorsparError, FluorsparWarning
from fluorspar.version import __version__

__all__ = ["app", "main"]

USER_ERROR = 2
OWN_FAULT = 70  # EX_SOFTWARE of sysexits.h: not 1, which says that a limit of `compare` is exceeded
INTERRUPTED = 130

app = typer.Typer(
    name="fluorspar",
    help="Spectral images of scenes with fluorescent objects.\n\n"
    "Example:  fluorspar render cornell-box -o box.nc -o box.png\n\n"
    "Exit codes: 0 done; 1 a limit of 'compare --fail-above' is exceeded; 2 something to be mended by you; "
    "70 a fault of Fluorspar itself; 130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.command()(render)
app.command()(compare)
app.command()(convert)
app.command()(measure)
app.command()(info)
app.command()(scenes)
app.add_typer(materials, name="materials")
app.command()(doctor)


def _print_version(wanted: bool) -> None:
    if wanted:
        console.out.print(f"fluorspar {__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and stop.", is_eager=True, callback=_print_version),
    ] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Say more about what is done.")] = False,
) -> None:
    logging.basicConfig(level=logging.INFO if verbose else logging.WARNING, format="%(message)s")


def main() -> None:
    """Run the command line.

    Errors that a user can mend end with a message and exit code 2, others with a traceback and 70.
    """
    warnings.simplefilter("always", FluorsparWarning)
    warnings.showwarning = _Shown()
    try:
        app()
    except FluorsparError as err:
        console.error(str(err))
        sys.exit(USER_ERROR)
    except KeyboardInterrupt:
        console.error("interrupted")
        sys.exit(INTERRUPTED)
    except Exception:
        traceback.print_exc()
        console.error("a fault of Fluorspar itself; please report it with the lines above")
        sys.exit(OWN_FAULT)


class _Shown:
    """Shows each warning once: a material that two steps look at is not two faults."""

    def __init__(self) -> None:
        self.before: set[str] = set()

    def __call__(
        self,
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        text = str(message)
        if not issubclass(category, FluorsparWarning):
            logging.getLogger("fluorspar").info("%s: %s", category.__name__, text)
        elif text not in self.before:
            self.before.add(text)
            console.warning(text)
