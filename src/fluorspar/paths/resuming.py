"""What is there of an image that was not finished, to go on with."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fluorspar.errors import FluorsparError, FluorsparWarning, OptionError, message
from fluorspar.files.beside import check_alone, remove_unfinished, unfinished
from fluorspar.files.journal import read_journal
from fluorspar.files.run_journal import Left, Run, read_left
from fluorspar.fingerprint import differences
from fluorspar.image.combining import pixels_of
from fluorspar.image.components import COMPONENTS
from fluorspar.image.opening import attrs_in
from fluorspar.image.pixels import Target, put
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob

__all__ = [
    "Earlier",
    "check_begun",
    "check_image",
    "check_passes",
    "check_same",
    "earlier_image",
    "earlier_left",
    "label_onto",
    "look_for",
    "passes_of",
    "pixels_left",
    "say_unfinished",
    "take_over",
    "unfinished_image",
]

_SHOWN = 3  # differences that a message names


@dataclass(frozen=True)
class Earlier:
    """What there is of a file that an interrupted run was writing.

    Attributes
    ----------
    left : Path or None
        What a killed run has left under a temporary name.
    is_there : bool
        Whether the file itself, whole or partial, is of the same fingerprint.
    """

    left: Path | None
    is_there: bool


def look_for(
    label: Mapping[str, str],
    output: str | os.PathLike[str],
    label_there: Callable[[], Mapping[str, str] | None],
) -> Earlier:
    """Look for what can be continued.

    Parameters
    ----------
    label : mapping
        Fingerprint of what is to be made.
    output : path-like
    label_there : callable
        Reads that of the file, if it is there.

    Raises
    ------
    OptionError
        If there is nothing to go on with, but something of another fingerprint; nothing is lost.
    FluorsparError
        If the file cannot be read, or another process is writing it.
    """
    target = _target(output)
    check_alone(target)
    left = _left(label, target)
    if target.exists():
        try:
            there = label_there()
        except FluorsparError:
            if left is None:
                raise
            there = None
        if there == label or left is None:
            check_same(label, there, output)
            return Earlier(left, True)
    elif left is None and (others := unfinished(target)):
        check_same(label, _label_of(others[0][1]), output)
    return Earlier(left, False)


def earlier_left(label: Mapping[str, str], output: str | os.PathLike[str]) -> Left | None:
    """What a killed writer has left of an image with this fingerprint."""
    path = _left(label, _target(output))
    return None if path is None else read_left(path)


def earlier_image(
    job: RenderJob, label: Mapping[str, str], output: str | os.PathLike[str]
) -> SpectralImage | None:
    """The image of a job that is there, whole or partial.

    Raises
    ------
    OptionError
        If what is there is of another render.
    ImageError
        If it cannot be read, or another process is writing it.
    """

    def label_there() -> Mapping[str, str] | None:
        with SpectralImage.open(output) as image:
            found: Mapping[str, str] | None = image.attrs.get("fingerprint")
            return found

    found = look_for(label, output, label_there)
    if not found.is_there:
        return None
    image = SpectralImage.open(output)
    check_image(image, job, output)
    if not image.attrs.get("partial") and found.left is not None:
        remove_unfinished(found.left)
    return image


def check_begun(output: str | os.PathLike[str]) -> None:
    """Refuse to add to an image of which there is only what its writer has left, who was killed or still writes.

    Raises
    ------
    OptionError
        If it can be gone on with.
    ImageError
        If another process is writing it.
    """
    target = _target(output)
    if target.exists():
        return
    check_alone(target)
    if left := unfinished(target):
        raise OptionError(
            message(
                "samples are added to an unfinished image",
                where=output,
                got=f"no such file yet, but {left[0][0].name}, left by an interrupted run",
                fix="finish it first: --resume instead, with the options that it was begun with",
            )
        )


def check_image(image: SpectralImage, job: RenderJob, output: str | os.PathLike[str]) -> None:
    """Refuse an image that was changed since it was rendered.

    Raises
    ------
    OptionError
        With what it is now.
    """
    settings = job.scene.settings
    changed = [
        what
        for what, same in (
            ("other components", tuple(image.components) == COMPONENTS),
            ("another grid", image.wavelengths == job.grid),
            ("another size", image.size == (settings.width, settings.height)),
            ("denoised", "denoised" not in image.attrs),
        )
        if not same
    ]
    if changed:
        fix = "name the file that was rendered, or another one"
        fault = "the image was changed since it was rendered"
        raise OptionError(message(fault, where=output, got=", ".join(changed), fix=fix))


def check_same(
    label: Mapping[str, str],
    before: Mapping[str, str] | None,
    output: str | os.PathLike[str],
    *,
    but: tuple[str, ...] = (),
    fix: str = "give the same scene and options, or begin anew without --resume",
) -> None:
    """Refuse to go on with another render.

    Raises
    ------
    OptionError
        With what differs.
    """
    found = ["no record of what it was made from"] if before is None else differences(label, before, but=but)
    if found:
        more = f"; and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
        raise OptionError(
            message(
                "the file to continue is of another render",
                where=output,
                got="; ".join(found[:_SHOWN]) + more,
                fix=fix,
            )
        )


def unfinished_image(job: RenderJob, label: Mapping[str, str], output: str | os.PathLike[str]) -> str:
    """What there is of an image that was not finished, and can be continued, in words; "" if nothing."""
    settings = job.scene.settings
    most = pixels_left(label, output)
    if attrs_in(output).keys() & {"partial", "until"}:  # to open an image takes half a second
        with suppress(FluorsparError), warnings.catch_warnings():
            warnings.simplefilter("ignore", FluorsparWarning)  # of what is about to be replaced
            with SpectralImage.open(output) as image:
                attrs = image.attrs
                if attrs.get("fingerprint") == label:
                    if attrs.get("partial"):
                        there = image.dataset["radiance"][0, :, :, 0].values
                        most = max(most, int(np.isfinite(there).sum()))
                    elif attrs.get("until", {}).get("stopped") == "interrupted":
                        return f"{sum(passes_of(image))} samples per pixel"
    return f"{most} of {settings.width * settings.height} pixels" if most else ""


def pixels_left(label: Mapping[str, str], output: str | os.PathLike[str]) -> int:
    """How many pixels the longest journal of this fingerprint has, of an image or of light paths."""
    path = _left(label, _target(output))
    records = [] if path is None else read_journal(path.with_suffix(".journal"), with_data=False)
    return sum(
        said.get("pixels", 0) + sum(count for _, count in said.get("runs", ())) for said, _, _ in records
    )


def say_unfinished(found: str, output: str | os.PathLike[str]) -> None:
    """Say what there is to go on with, which is about to be made anew."""
    if found:
        text = (
            f"an unfinished {Path(output).name} is there, {found}: --resume (resume=True) would go on with it; it is "
            "replaced when this one is finished"
        )
        warnings.warn(text, FluorsparWarning, stacklevel=5)


def take_over(target: Target, image: SpectralImage, runs: list[Run]) -> None:
    """Put the finished runs of a partial image into a target."""
    for first, count in runs:
        if target.has(first, count):
            continue
        pixels = pixels_of(image, first, count)
        if not np.isnan(pixels.radiance[0, :, 0]).any():
            put(target, first, pixels)


def check_passes(image: SpectralImage, job: RenderJob, output: str | os.PathLike[str]) -> None:
    """Refuse an image that is not the one pass of a job.

    Raises
    ------
    OptionError
        With the samples it has.
    """
    passes, spp = passes_of(image), job.scene.settings.spp
    if passes != [spp]:
        raise OptionError(
            message(
                "the file to continue has other samples",
                where=output,
                got=f"{sum(passes)} samples per pixel in {len(passes)} passes",
                expected=spp,
                fix="give --until or --more-samples, or begin anew without --resume",
            )
        )


def label_onto(
    label: Mapping[str, str] | None, image: SpectralImage, output: str | os.PathLike[str]
) -> dict[str, str] | None:
    """Fingerprint of a pass that is combined with the passes of an image, while it comes."""
    if label is None:
        return None
    base = f"{passes_of(image)}, written {os.stat(output).st_mtime_ns}"
    return {**label, "onto": base}


def passes_of(image: SpectralImage) -> list[int]:
    """Samples per pixel of each pass that an image is the mean of."""
    attrs = image.attrs
    passes = attrs.get("passes") or attrs.get("until", {}).get("passes") or [attrs["spp"]]
    return [int(size) for size in passes]


def _target(output: str | os.PathLike[str]) -> Path:
    return Path(os.path.realpath(output))


def _left(label: Mapping[str, str], target: Path) -> Path | None:
    """The longest of what killed runs of this fingerprint have left."""
    return next((path for path, journal in unfinished(target) if _label_of(journal) == label), None)


def _label_of(journal: Path) -> dict[str, str] | None:
    header, *_ = next(read_journal(journal, with_data=False), ({},))
    label: dict[str, str] | None = header.get("label")
    return label
