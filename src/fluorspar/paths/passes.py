"""Render passes, each of all pixels, until the image is good enough."""

from __future__ import annotations

import logging
import math
import os
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from fluorspar.errors import FluorsparWarning
from fluorspar.fingerprint import fingerprint
from fluorspar.image.combining import AddedPixels, pixels_of
from fluorspar.image.opening import replace_attrs
from fluorspar.image.pixels import Target
from fluorspar.image.relative_error import RelativeErrors
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import runs_of, variant_of
from fluorspar.paths.render import Fill, fill_here, keep_finished, new_target
from fluorspar.paths.resuming import (
    earlier_image,
    label_onto,
    passes_of,
    say_unfinished,
    take_over,
    unfinished_image,
)
from fluorspar.progress import Progress
from fluorspar.scene.settings import MOST_SAMPLES
from fluorspar.scene.variants import use_variant
from fluorspar.until import Until, next_samples

__all__ = ["render_passes"]

_LOG = logging.getLogger(__name__)

_RUN = 8192  # pixels read at a time

_MISSED = {
    "time": "the time is up",
    "samples": f"a render has at most {MOST_SAMPLES:,}",
    "interrupted": "interrupted; only finished passes are kept",
}


def render_passes(
    job: RenderJob,
    until: Until,
    *,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    fill: Fill = fill_here,
    clock: Callable[[], float] = time.perf_counter,
) -> SpectralImage:
    """Render pass after pass, each with its own random numbers, and combine them, until the target is reached.

    Parameters
    ----------
    job : RenderJob
        The first pass is the image of this job, bit for bit.
    until : Until
        The target, and the longest time: no pass is begun that would end after it.
    output : path-like, optional
        A `.nc` file to stream the image to. After each pass it holds the image of all passes so far; in a pass the
        disk holds it twice.
    resume : bool
        Go on with the passes, and the chunks of a pass, that are there.
    progress : callable, optional
        Called with the samples done and an estimate of the samples in all.
    fill : callable
        Where they are rendered.
    clock : callable, optional
        Gives seconds.

    Returns
    -------
    SpectralImage
        Attribute `spp`: samples per pixel of all passes. Attribute `until`: the `target`; `of`, what the error is of;
        the `mean` and the 95th percentile `p95` of its relative standard error that were reached (None: not known);
        the samples per pixel of each of the `passes`; and why the render `stopped`: "reached", "dark" (no pixel shows
        light), "time", "samples" (there are no more) or "interrupted". A pass that is interrupted is not kept, unless
        it is the first one, of which the pixels that are finished are.

    Warns
    -----
    FluorsparWarning
        If the target was not reached, or is not going to be.
    """
    passes = _Passes(job, until, output, resume, progress, fill, clock)
    size = job.scene.settings.spp
    try:
        if resume:
            size = passes.go_on(size)
        elif output is not None and passes.label is not None:
            say_unfinished(unfinished_image(job, passes.label, output), output)
        with use_variant(variant_of(job)):  # to change it between passes would take longer than a small one
            while size:
                size = passes.render(size)
    except KeyboardInterrupt:
        if passes.image is None:
            raise
        if output is not None:
            passes.image = SpectralImage.open(output)  # the pass may have been written when the signal came
    image = passes.image
    assert image is not None
    told = image.attrs["until"]
    if progress and told["stopped"] != "interrupted":
        progress(passes.done * passes.pixels, passes.done * passes.pixels)
    if why := _MISSED.get(told["stopped"]):
        _warn(f"{until} was not reached ({_in_words(told)}): {why}")
    return image


@dataclass
class _Passes:
    """The passes that are finished, and the image that they make."""

    job: RenderJob
    until: Until
    output: str | os.PathLike[str] | None
    resume: bool
    progress: Progress | None
    fill: Fill
    clock: Callable[[], float]
    image: SpectralImage | None = None
    sizes: list[int] = field(default_factory=list)
    expected: float = 0.0  # samples per pixel in all
    outlook: str = ""
    partial: SpectralImage | None = None  # the first pass, interrupted

    def __post_init__(self) -> None:
        self.pixels = self.job.scene.settings.width * self.job.scene.settings.height
        self.began = self.clock()
        self.label = fingerprint(self.job)

    @property
    def done(self) -> int:
        """Samples per pixel of the passes that are finished."""
        return sum(self.sizes)

    def go_on(self, size: int) -> int:
        """Take the passes that are there of the file; return the samples of the next one, `size` if there are none."""
        if self.output is None or self.label is None:
            return size
        image = earlier_image(self.job, self.label, self.output)
        if image is None:
            return size
        if image.attrs.get("partial"):
            self.partial = image
            return size
        self.image, self.sizes = image, passes_of(image)
        errors = RelativeErrors(self.job.grid, self.pixels)
        for first in range(0, self.pixels, _RUN):
            count = min(_RUN, self.pixels - first)
            errors.add(first, pixels_of(image, first, count))
        took = float(image.attrs.get("timings", {}).get("render", 0.0))
        more, stopped = self._next(errors, took / self.done)
        if not more:
            attrs = {**image.attrs, "until": self._told(errors, stopped)}
            image.close()
            replace_attrs(self.output, attrs)
            self.image = SpectralImage.open(self.output)
        return more

    def render(self, size: int) -> int:
        """Render one more pass of so many samples per pixel; return those of the next, 0 if this was the last one."""
        pass_began = self.clock()
        job = replace(self.job, scene=self.job.scene.with_settings(spp=size), stream=len(self.sizes))
        errors = RelativeErrors(job.grid, self.pixels)
        label = fingerprint(job)
        if self.image is not None and self.output is not None:
            label = label_onto(label, self.image, self.output)
        target: Target = new_target(job, self.output, label, resume=self.resume)
        if self.image is not None:
            target = AddedPixels(target, size, self.image, self.done)
        with target:
            if self.partial is not None:
                take_over(target, self.partial, runs_of(job))
                self.partial.close()
                self.partial = None
            left = []
            for run in runs_of(job):
                if target.has(*run):
                    errors.add(run[0], target.stored(*run))
                else:
                    left.append(run)
            try:
                self.fill(target, job, left, errors=errors, progress=self._progress(size))
            except KeyboardInterrupt:
                if self.image is not None:
                    raise
                keep_finished(target, self.pixels)
            self.sizes.append(size)
            partial = target.kept < self.pixels
            more, stopped = self._next(errors, (self.clock() - pass_began) / size)
            if partial:
                more, stopped = 0, "interrupted"
            told = self._told(errors, stopped)
            timings = {"render": round(self.clock() - self.began, 3)}
            attrs = {**self.job.attrs, "spp": self.done, "until": told, "timings": timings}
            attrs["fingerprint"] = self.label
            self.image = target.image(attrs, partial=partial)
        _LOG.info("pass %d: %s%s", len(self.sizes), _in_words(told), self.outlook if more else "")
        return more

    def _told(self, errors: RelativeErrors, stopped: str) -> dict[str, Any]:
        """What the image says about the passes."""
        return {
            "target": str(self.until),
            "of": errors.of,
            "mean": _known(errors.mean),
            "p95": _known(errors.p95),
            "passes": self.sizes,
            "stopped": stopped,
        }

    def _next(self, errors: RelativeErrors, seconds: float) -> tuple[int, str]:
        """Samples of the next pass and why it is the last one; 0 if there is none, and why.

        Parameters
        ----------
        errors : RelativeErrors
            Of all passes so far.
        seconds : float
            That one sample per pixel took in the last pass.
        """
        reached = {"error": errors.mean, "p95": errors.p95}[self.until.measure]
        if reached <= self.until.target:
            return 0, "reached" if errors.lit.size else "dark"
        # the error falls with the root of the number of samples
        wanted = self.done * (reached / self.until.target) ** 2
        left = self.until.seconds - (self.clock() - self.began)
        affordable = left / max(seconds, 1e-9)
        self.expected = min(wanted, MOST_SAMPLES, self.done + max(affordable, 0.0))
        size = next_samples(self.sizes[0], self.done, wanted, affordable)
        if size == 0:
            return 0, "time" if affordable < self.sizes[0] else "samples"
        if math.isfinite(wanted):
            time_left = (self.expected - self.done) * seconds
            self.outlook = f"; {self.until} takes about {wanted:,.0f}, {time_left:,.0f} s to go"
            if len(self.sizes) == 1 and wanted > MOST_SAMPLES:
                _warn(f"{self.until} takes about {wanted:,.0f} samples per pixel, and {_MISSED['samples']}")
        return size, "interrupted"  # what the file says if the next pass does not come to its end

    def _progress(self, size: int) -> Progress | None:
        """Report the pixels of a pass as samples of all passes; only at the very end all are done."""
        report, before = self.progress, self.done * self.pixels
        if report is None:
            return None
        whole = int(max(self.done + size, self.expected)) * self.pixels + 1
        return lambda pixels, _: report(before + pixels * size, whole)


def _known(error: float) -> float | None:
    return float(f"{error:.4g}") if math.isfinite(error) else None


def _in_words(told: dict[str, Any]) -> str:
    samples = f"{sum(told['passes']):,} samples per pixel"
    if told["mean"] is None:
        return f"{samples}, standard error of {told['of']} not known"
    return (
        f"{samples}, relative standard error of {told['of']} {100 * told['mean']:.3g} % on average, "
        f"{100 * told['p95']:.3g} % at the 95th percentile"
    )


def _warn(text: str) -> None:
    warnings.warn(text, FluorsparWarning, stacklevel=4)
