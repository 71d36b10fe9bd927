"""What is there of an image that was not finished, to go on with."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fluorspar.errors import FluorsparWarning, OptionError, message
from fluorspar.files.run_journal import Left, Run, left_of
from fluorspar.files.writing import check_alone, remove_leftovers, unfinished
from fluorspar.fingerprint import differences
from fluorspar.image.combining import pixels_of
from fluorspar.image.dataset import values_of
from fluorspar.image.pixels import Target
from fluorspar.image.spectral_image import SpectralImage

__all__ = ["check_same", "earlier_image", "earlier_left", "passes_of", "say_unfinished", "take_over"]

_SHOWN = 3  # differences that a message names


def earlier_left(label: Mapping[str, str], output: str | os.PathLike[str]) -> Left | None:
    """What a killed writer has left of the file of a render with this fingerprint: of several the largest."""
    same = [left for left in left_of(_target(output)) if left.header.get("label") == label]
    return max(same, key=_pixels, default=None)


def earlier_image(label: Mapping[str, str], output: str | os.PathLike[str]) -> SpectralImage | None:
    """The image that is there under the name of the file, whole or partial.

    Raises
    ------
    OptionError
        If it is of another fingerprint, or all that was left by killed writers is; nothing is lost.
    ImageError
        If it cannot be read, or another process is writing it.
    """
    target = _target(output)
    check_alone(target)
    lefts = left_of(target)
    if target.exists():
        image = SpectralImage.open(target)
        check_same(label, image.attrs.get("fingerprint"), output)
        if not image.attrs.get("partial"):
            remove_leftovers(target)
        return image
    if lefts and all(left.header.get("label") != label for left in lefts):
        check_same(label, lefts[0].header.get("label"), output)
    return None


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
                "the file that is there is of another render",
                where=output,
                got="; ".join(found[:_SHOWN]) + more,
                fix=fix,
            )
        )


def say_unfinished(output: str | os.PathLike[str]) -> None:
    """Say that there is something to go on with, which is about to be made anew."""
    if unfinished(_target(output)):
        text = (
            f"an unfinished render of {Path(output).name} is there, which --resume would go on with; it is removed "
            "when this one is whole"
        )
        warnings.warn(text, FluorsparWarning, stacklevel=5)


def take_over(target: Target, image: SpectralImage, runs: list[Run]) -> None:
    """Put the finished runs of a partial image into a target."""
    # one component and one wavelength tell
    missing = np.isnan(values_of(image.dataset, "radiance", slice(None), image.components[0])[..., 0]).ravel()
    for first, count in runs:
        if not target.has(first, count) and not missing[first : first + count].any():
            pixels = pixels_of(image, first, count)
            room, at = target.room(first, count)
            own = room[at : at + count]
            own.radiance[...] = pixels.radiance
            own.standard_error[...] = pixels.standard_error
            if own.component_standard_error is not None:
                own.component_standard_error[...] = pixels.component_standard_error
            target.keep(first, count)


def passes_of(image: SpectralImage) -> list[int]:
    """Samples per pixel of each pass that an image is the mean of."""
    attrs = image.attrs
    passes = attrs.get("passes") or attrs.get("until", {}).get("passes") or [attrs["spp"]]
    return [int(size) for size in passes]


def _target(output: str | os.PathLike[str]) -> Path:
    return Path(os.path.realpath(output))


def _pixels(left: Left) -> int:
    return sum(count for _, count in left.runs)
