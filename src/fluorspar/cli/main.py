"""The command `fluorspar`: gathers the subcommands and turns errors into messages and exit codes."""

from __future__ import annotations

import errno
import logging
import os
import sys
import traceback
import warnings
from typing import Annotated

import typer

from fluorspar.cli import console
from fluorspar.cli.batch import batch
from fluorspar.cli.compare import compare
from fluorspar.cli.convert import convert
from fluorspar.cli.denoise import denoise
from fluorspar.cli.doctor import doctor
from fluorspar.cli.import_scene import import_scene
from fluorspar.cli.info import info
from fluorspar.cli.materials import materials
from fluorspar.cli.measure import measure
from fluorspar.cli.relight import relight
from fluorspar.cli.render import render
from fluorspar.cli.scenes import scenes
from fluorspar.cli.sheet import sheet
from fluorspar.cli.shown_warnings import ShownWarnings
from fluorspar.cli.signals import Signals
from fluorspar.cli.trace import trace
from fluorspar.cli.view import view
from fluorspar.errors import FluorsparError, FluorsparWarning, message
from fluorspar.version import __version__

__all__ = ["app", "main"]

USER_ERROR = 2
OWN_FAULT = 70  # EX_SOFTWARE of sysexits.h: not 1, which says that a limit of `compare` is exceeded, or `batch` failed
INTERRUPTED = 130  # by Ctrl-C; typer's code for it, and that of `render` for an image that is partial

# What the operating system refuses for reasons outside this program
_REFUSED = {
    getattr(errno, name)
    for name in (
        "ENOSPC",
        "EDQUOT",
        "EFBIG",
        "EROFS",
        "EACCES",
        "EPERM",
        "EMFILE",
        "ENFILE",
        "EIO",
        "ENAMETOOLONG",
    )
    if hasattr(errno, name)
}

app = typer.Typer(
    name="fluorspar",
    help="Spectral images of scenes with fluorescent objects.\n\n"
    "Example:  fluorspar render cornell-box -o box.nc -o box.png\n\n"
    "Example:  fluorspar view cornell-box\n\n"
    "Exit codes: 0 done; 1 a limit of 'compare --fail-above' is exceeded, or a render of 'batch' failed; "
    "2 an error in the input, or of the system, which the message explains; "
    "70 a fault of Fluorspar itself; 130 interrupted by Ctrl-C; 143 by SIGTERM.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.command()(render)
app.command(short_help="Trace the light paths of a scene into a file.")(trace)
app.command(short_help="Compute an image of light paths, with other lights and materials.")(relight)
app.command(short_help="Show combinations of lights and materials side by side.")(sheet)
app.command(short_help="Render a table of scenes, lights and materials.")(batch)
app.command(short_help="Compare the spectra of two images or tables.")(compare)
app.command(short_help="Convert a spectral image, or make a picture of it.")(convert)
app.command(short_help="Take the noise out of a spectral image.")(denoise)
app.command(short_help="Measure the spectra of points of an image.")(measure)
app.command(short_help="Look at images, light paths and scenes in the browser.")(view)
app.command(name="import", short_help="Turn a file of Blender into a scene.")(import_scene)
app.command()(info)
app.command()(scenes)
app.add_typer(materials, name="materials", short_help="The library, measured matrices, fits, dyes, colours.")
app.command(short_help="Check this machine: versions, LLVM, GPU.")(doctor)


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
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose",
            "-v",
            help="Print the stages with their times, and all warnings, even if they are alike.",
        ),
    ] = False,
) -> None:
    logging.getLogger("fluorspar").setLevel(logging.INFO if verbose else logging.WARNING)
    warnings.showwarning = ShownWarnings(everything=verbose)


def main() -> None:
    """Run the command line.

    Errors that a user can mend end with a message and exit code 2, others with a traceback and 70.
    """
    warnings.simplefilter("always", FluorsparWarning)
    logging.basicConfig(handlers=[_Notes()], level=logging.WARNING)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # names of files may be any bytes
    with Signals() as signals:
        code = _run(signals)
    console.out.finish()
    if code == 0 and console.out.fault is not None:
        console.error(message("standard output cannot be written", got=console.out.fault))
        code = USER_ERROR
    sys.exit(code)


class _Notes(logging.Handler):
    """Prints what is logged, once; of what only `-v` prints, when it was, in seconds since the start."""

    def __init__(self) -> None:
        super().__init__()
        self.before: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        if record.getMessage() in self.before:
            return
        self.before.add(record.getMessage())
        at = f"{record.relativeCreated / 1000:.1f} s: " if record.levelno < logging.WARNING else ""
        console.note(at + record.getMessage())


def _run(signals: Signals) -> int:
    """Run the command that was asked for; return the exit code."""
    try:
        _check_folder()
        code = int(app(standalone_mode=False) or 0)
        if isinstance(warnings.showwarning, ShownWarnings):
            warnings.showwarning.finish()
        if code != INTERRUPTED:
            return code
    except (KeyboardInterrupt, typer.Abort):
        pass
    except Exception as err:
        text = "".join(traceback.format_exception(err))
        if not (signals.number and "KeyboardInterrupt" in text):  # C++ code passes it on as something else
            return _explain(err, text)
    console.error("interrupted")
    return signals.exit_code


def _explain(err: Exception, text: str) -> int:
    """Print an error; return the exit code."""
    if isinstance(err, FluorsparError):
        console.error(str(err))
    elif isinstance(err, _UsageError):
        _explain_usage(err)
    elif isinstance(err, MemoryError):
        fix = "fewer pixels, samples or wavelengths, or a smaller file"
        console.error(message("there is not enough memory", got=str(err) or None, fix=fix))
    elif isinstance(err, OSError) and err.errno in _REFUSED:
        fix = "mend that, or choose another folder (TMPDIR for temporary files)"
        console.error(message("the operating system refuses", where=err.filename, got=err.strerror, fix=fix))
    else:
        console.note(text.rstrip())
        console.error("a fault of Fluorspar itself; please report it with the lines above")
        return OWN_FAULT
    return USER_ERROR


_UsageError = typer.BadParameter.__mro__[
    1
]  # what the parser of the command line raises: typer exports no name of it


def _explain_usage(err: Exception) -> None:
    text, context = err.format_message(), getattr(err, "ctx", None)  # type: ignore[attr-defined]
    if type(err).__name__ == "NoArgsIsHelpError":
        console.note(text)
        return
    fix = f"see '{context.command_path} --help'" if context is not None else ""
    console.error(message(text[:1].lower() + text[1:].rstrip("."), fix=fix))


def _check_folder() -> None:
    try:
        os.getcwd()
    except FileNotFoundError as err:
        fix = "change to a folder that exists"
        raise FluorsparError(message("the working folder does not exist any more", fix=fix)) from err
