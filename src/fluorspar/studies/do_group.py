"""Make the images of one group of rows, here or in another process: whatever happens to one, the others are made."""

from __future__ import annotations

import os
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fluorspar.errors import FluorsparError, FluorsparWarning, OptionError, message
from fluorspar.files.memory import is_large
from fluorspar.fingerprint import fingerprint
from fluorspar.image.formats.netcdf_layout import write_attrs
from fluorspar.image.opening import replace_attrs
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.streaming import streamed_to
from fluorspar.job import RenderJob, read_grid
from fluorspar.paths.light_paths import LightPaths
from fluorspar.paths.resuming import unfinished_image
from fluorspar.paths.trace import trace_job
from fluorspar.paths.whole_image import whole_image
from fluorspar.progress import Progress
from fluorspar.rendering import render_job
from fluorspar.scene.loading import load_scene
from fluorspar.scene.relit import relit
from fluorspar.scene.scene import Scene
from fluorspar.scene.settings_text import light_of, size_of
from fluorspar.studies.files import located, mark_of
from fluorspar.studies.groups import Group
from fluorspar.studies.keys import Value, ids_of
from fluorspar.studies.marks import MARK, made_by
from fluorspar.studies.study import Row
from fluorspar.until import Until

__all__ = ["Result", "do_group", "fault_of"]

_OF_JOB = (
    "seed",
    "wavelengths",
    "method",
    "max_depth",
    "rr_depth",
    "stokes",
    "excitation",
    "component_errors",
    "variant",
    "spp",
    "camera",
)
_OF_IMAGE = ("wavelengths", "stokes", "excitation", "component_errors")
_SAMPLE = 60  # bytes of light paths, at the most of what was seen


@dataclass(frozen=True)
class Result:
    """What became of a row.

    Attributes
    ----------
    number : int
        Of the row.
    status : str
        "done", "failed" or "open": nobody has tried, or the user interrupted.
    seconds : float
        It took, without the tracing that it shares; nan if unknown.
    mark : str
        Of the row when it was done.
    fault : str
        Why it failed.
    warnings : tuple of (type, str)
        What was warned of.
    before : bool
        Whether it was done by an earlier run, or by another one meanwhile.
    """

    number: int
    status: str
    seconds: float = float("nan")
    mark: str = ""
    fault: str = ""
    warnings: tuple[tuple[type[Warning], str], ...] = ()
    before: bool = False


def do_group(
    group: Group, threads: int | None = None, tell: Callable[[int, float], object] | None = None
) -> list[Result]:
    """Make and write the images of a group, but for those that others have made meanwhile.

    Parameters
    ----------
    group : Group
    threads : int, optional
        Default: all cores this process may use.
    tell : callable, optional
        Called with the number of rows that are finished, and the share of the next one that is.

    Returns
    -------
    list of Result
        One of each row, also if the user interrupts.
    """
    results: list[Result] = []

    def report(done: int, whole: int) -> None:
        if tell:
            tell(len(results), done / whole)

    status, fault = "open", ""
    try:
        marks = {row.number: mark_of(row) for row in group.rows}  # of the files that are about to be read
        made = [result for row in group.rows if (result := _made_meanwhile(row))]
        if len(made) == len(group.rows):
            return made
        with _caught() as told, _source(group, threads, report) as source:
            for row in group.rows:
                results.append(_attempt(row, marks[row.number], source, group.common, told, threads, report))
                report(0, 1)
    except KeyboardInterrupt:
        pass
    except Exception as err:  # of the scene or its light paths, whatever it is
        status, fault = "failed", fault_of(err)
    return results + [Result(row.number, status, fault=fault) for row in group.rows[len(results) :]]


def fault_of(err: BaseException) -> str:
    """An error in words; a fault of ours with where it is."""
    if isinstance(err, FluorsparError):
        return str(err)
    if isinstance(err, MemoryError):
        return message("there is not enough memory", got=str(err) or None)
    if isinstance(err, OSError) and err.strerror:
        return message("the operating system refuses", where=err.filename, got=err.strerror)
    return "".join(traceback.format_exception(err)).strip()


@contextmanager
def _caught() -> Iterator[list[warnings.WarningMessage]]:
    """Collect what is warned of: other processes have nobody to tell."""
    with warnings.catch_warnings(record=True) as told:
        warnings.filterwarnings("always", category=FluorsparWarning)
        warnings.filterwarnings("ignore", "interrupted: ")  # the row counts as open
        yield told


@contextmanager
def _source(group: Group, threads: int | None, report: Progress) -> Iterator[Scene | LightPaths]:
    """The scene of a group or, if its images are made of them, its light paths: in memory, or in a file for a while."""
    settings = located(group.common, group.rows[0].folder)
    scene = load_scene(
        str(settings["scene"]),
        materials=ids_of(settings, "material"),  # type: ignore[arg-type]
        matte=bool(settings.get("matte", False)),
        parameters={key: _xml(value) for key, value in ids_of(settings, "D").items()},
        library=_library(settings),
        sensor=settings.get("sensor"),  # type: ignore[arg-type]
    )
    job = _job(scene, settings, threads)
    if not group.traced:
        yield job.scene
        return
    asked = job.scene.settings
    file = None
    if is_large(asked.width * asked.height * asked.spp * _SAMPLE):
        file = next(
            (
                file
                for file in group.paths_files()
                if os.path.isdir(file.parent) and os.access(file.parent, os.W_OK)
            ),
            None,
        )
    try:
        paths = trace_job(job, report, file)
        if paths.pixels < asked.width * asked.height:
            raise KeyboardInterrupt
        yield replace(paths, job=job)  # a file has not the geometry, which denoising needs
    finally:
        if file is not None:
            file.unlink(missing_ok=True)


def _made_meanwhile(row: Row) -> Result | None:
    made = made_by(row)
    return made and Result(row.number, "done", mark=made[0], before=True)


def _lights(settings: Mapping[str, Value]) -> dict[str, Any]:
    return {key: light_of(str(value)) for key, value in ids_of(settings, "light").items()}


def _job(scene: Scene, settings: Mapping[str, Value], threads: int | None, **others: Any) -> RenderJob:
    return RenderJob.of(
        scene,
        size=size_of(settings.get("size")),  # type: ignore[arg-type]
        until=Until.parse(settings.get("until"), settings.get("max_time")),  # type: ignore[arg-type]
        threads=threads,
        **others,
        **{name: settings[name] for name in _OF_JOB if name in settings},  # type: ignore[arg-type]
    )


def _attempt(
    row: Row,
    mark: str,
    source: Scene | LightPaths,
    common: Mapping[str, Value],
    told: list[warnings.WarningMessage],
    threads: int | None,
    report: Progress,
) -> Result:
    """Make and write the image of a row, if it is not done."""
    if made := _made_meanwhile(row):
        return made
    began = time.perf_counter()
    settings = located(row.settings, row.folder)
    given = {k: v for k, v in ids_of(settings, "material").items() if f"material.{k}" not in common}
    if isinstance(source, LightPaths) and given and not _exchangeable(source.job.scene, given, settings):
        (result,) = do_group(Group.alone(row), threads)
        if result.status == "open":
            raise KeyboardInterrupt
        return result
    try:
        with _stream(row, source) as stream:
            if isinstance(source, LightPaths):
                image = whole_image(
                    source,
                    report,
                    output=stream,
                    library=_library(settings),
                    lights=_lights(settings),
                    materials=given,
                    concentration=ids_of(settings, "concentration"),
                    same_luminance=bool(settings.get("same_luminance", False)),
                    **{name: settings.get(name) for name in _OF_IMAGE},
                )
            else:
                _check_rendered(row)
                lit = {
                    "lights": _lights(settings),
                    "same_luminance": bool(settings.get("same_luminance", False)),
                }
                job = _job(source, settings, threads, **lit)
                image = render_job(job, output=stream, resume=_is_begun(job, stream), progress=report)
                if image.attrs.get("partial") or image.attrs.get("until", {}).get("stopped") == "interrupted":
                    raise KeyboardInterrupt
            if settings.get("denoise"):
                image = image.denoised(scene=_seen(source, given, settings), threads=threads)
            _write(image, row, mark, stream)
        result = Result(row.number, "done", time.perf_counter() - began, mark)
    except Exception as err:  # whatever it is, other rows may succeed
        result = Result(row.number, "failed", time.perf_counter() - began, fault=fault_of(err))
    result = replace(result, warnings=tuple((each.category, str(each.message)) for each in told))
    told.clear()
    return result


def _is_begun(job: RenderJob, stream: Path | None) -> bool:
    """Whether there is an image of the job that was interrupted, to go on with."""
    if stream is None:
        return False
    label = fingerprint(job)
    return label is not None and bool(unfinished_image(job, label, stream))


def _xml(value: Value) -> str:
    """A value as a scene file has it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _library(settings: Mapping[str, Value]) -> tuple[str, ...]:
    return (str(settings["library"]),) if "library" in settings else ()


def _exchangeable(scene: Scene, materials: Mapping[str, Value], settings: Mapping[str, Value]) -> bool:
    """Whether light paths can be given these materials; else the scene is loaded with them."""
    try:
        relit(scene, materials=materials, library=_library(settings))  # type: ignore[arg-type]
    except OptionError:
        return False
    except FluorsparError:
        pass  # told when the image is made
    return True


def _seen(source: Scene | LightPaths, materials: Mapping[str, Value], settings: Mapping[str, Value]) -> Scene:
    """The scene that an image shows, for its denoising."""
    if isinstance(source, Scene):
        return source
    return relit(
        source.job.scene,
        materials=materials,  # type: ignore[arg-type]
        concentration=ids_of(settings, "concentration"),  # type: ignore[arg-type]
        library=_library(settings),
    )


def _check_rendered(row: Row) -> None:
    """Refuse what only light paths can be given, of a row that none are traced for."""
    for key in row.settings:
        if key.partition(".")[0] == "concentration":
            got = "until" if "until" in row.settings else "method = staged"
            fix = "leave one of the two out, or change the scene file"
            raise OptionError(
                message(f"'{key}' changes kept light paths, and none are kept here", got=got, fix=fix)
            )


def _stream(row: Row, source: Scene | LightPaths) -> AbstractContextManager[Path | None]:
    """The file that a large image is streamed to while it is made: one of the row, or one that is there meanwhile."""
    settings = (source if isinstance(source, Scene) else source.job.scene).settings
    return streamed_to(
        row.outputs,
        (settings.width, settings.height),
        len(read_grid(row.settings.get("wavelengths"))),
        component_errors=bool(row.settings.get("component_errors")),
        denoise=bool(row.settings.get("denoise")),
        only_large=True,
        temporary=row.settings.get("method", "paths") == "paths",
    )


def _write(image: SpectralImage, row: Row, mark: str, stream: Path | None) -> None:
    """Write the files of a row, with its mark."""
    image.dataset.attrs[MARK] = mark
    for path in row.outputs:
        if path != stream:
            image.save(path)
    if stream in row.outputs:
        attrs = image.attrs
        image.close()
        if stream.suffix.lower() == ".nc":
            write_attrs(stream, {MARK: mark})
        else:
            replace_attrs(stream, {**attrs, MARK: mark})
