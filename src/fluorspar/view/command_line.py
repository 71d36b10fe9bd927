"""The command line that makes the image of a view, and the files it needs."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path

from fluorspar.scene.scene import Scene
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.view.questions import LightSetting, View
from fluorspar.view.relighting import light_of
from fluorspar.view.sources import Source
from fluorspar.view.supplies import Supplies
from fluorspar.view.uploads import PREFIX

__all__ = ["Command", "command_of"]

_OTHER = re.compile(r"[^A-Za-z0-9._-]+")


@dataclass
class Command:
    """What to type.

    Attributes
    ----------
    lines : list of str
        Commands, one after the other.
    files : dict of str to str
        Files that they read and that are not there yet, with their text.
    notes : list of str
        What they do not reproduce.
    """

    lines: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def command_of(source: Source, view: View, supplies: Supplies) -> Command:
    """Compose the command line of a view.

    Parameters
    ----------
    source : Source
    view : View
    supplies : Supplies

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> from fluorspar.view.sources import ImageSource
    >>> image = ImageSource("box.nc", SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths()))
    >>> command_of(image, View(source="0", white="A"), Supplies()).lines
    ['fluorspar convert box.nc picture.png --white A']
    """
    command = Command()
    if source.kind == "image":
        image = source.name
    elif source.kind == "scene" and view.relight.is_nothing:
        command.lines.append(
            _joined(["fluorspar", "render", source.name, *_traced_with(source), "-o", "image.nc"])
        )
        image = "image.nc"
    else:
        paths = source.name
        if source.kind == "scene":
            paths = "scene.paths"
            command.lines.append(
                _joined(["fluorspar", "trace", source.name, *_traced_with(source), "-o", paths])
            )
        words = ["fluorspar", "relight", paths, *_changes(source.job.scene, view, supplies, command)]
        command.lines.append(_joined([*words, "-o", "image.nc"]))
        image = "image.nc"
    command.lines.append(_joined(["fluorspar", "convert", image, "picture.png", *_white(view)]))
    if view.mode != "colour" or view.gamut:
        command.notes.append("False colours and marks are a way of looking: this picture is in plain colour.")
    if any(weight != 1 for weight in view.weights.values()):
        command.notes.append(
            "Weights of components are a way of looking: the image holds all of them as they are."
        )
    if view.exposure is not None:
        command.notes.append(
            f"For the same exposure: SpectralImage.srgb(exposure={view.exposure:.6g}) in Python."
        )
    return command


def _traced_with(source: Source) -> list[str]:
    """The options of a scene that are not those of its file."""
    job = source.job
    settings, grid = job.scene.settings, job.grid
    words = ["--size", f"{settings.width}x{settings.height}", "--spp", str(settings.spp)]
    words += ["--wavelengths", f"{grid.start:g}:{grid.stop:g}:{grid.step:g}"]
    words += [] if settings.viewpoint is None else ["--camera", str(settings.viewpoint)]
    for name, given in job.changed_lights.items():
        words += ["--light", f"{name}={str(given).replace(' x ', 'x')}"]
    words += [word for folder in job.scene.recipe.library for word in ("--library", str(folder))]
    return words + [word for key, value in job.scene.parameters.items() for word in ("-D", f"{key}={value}")]


def _changes(scene: Scene, view: View, supplies: Supplies, command: Command) -> list[str]:
    """The options of `fluorspar relight`; spectra that have no name become files."""
    relight = view.relight
    words = [
        word
        for name, setting in relight.lights.items()
        for word in ("--light", f"{name}={_light(scene, name, setting, supplies, command)}")
    ]
    for name, value in relight.materials.items():
        if value.startswith(PREFIX):
            value = supplies.uploads.get(value).name
            command.notes.append(f"{value} is the file that was uploaded.")
        words += ["--material", f"{name}={value}"]
    for name, factor in relight.concentration.items():
        words += ["--concentration", f"{name}={factor:.15g}"]
    return words + [word for folder in supplies.folders for word in ("--library", str(folder))]


def _light(scene: Scene, name: str, setting: LightSetting, supplies: Supplies, command: Command) -> str:
    """A name, a factor, or a file with the spectrum as it is."""
    if setting.spectrum is None:
        return f"{setting.factor:.15g}"
    if setting.spectrum.name is not None and setting.factor == 1:
        return setting.spectrum.name
    file = f"{_OTHER.sub('_', name).strip('._') or 'light'}.csv"
    while file in command.files:
        file = f"{Path(file).stem}_.csv"
    command.files[file] = _table(light_of(scene, name, setting, supplies))
    return file


def _table(spectrum: Spectrum) -> str:
    rows = zip(spectrum.wavelengths, spectrum.values, strict=True)
    return "wavelength,value\n" + "".join(f"{at:.10g},{float(value)!r}\n" for at, value in rows)


def _white(view: View) -> list[str]:
    if isinstance(view.white, str):
        return ["--white", view.white]
    return (
        ["--white", ",".join(f"{value:.6g}" for value in view.white)] if isinstance(view.white, tuple) else []
    )


def _joined(words: list[str]) -> str:
    return " ".join(shlex.quote(word) for word in words)
