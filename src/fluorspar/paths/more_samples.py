"""Add samples to a finished image: a pass of further random numbers, combined with it."""

from __future__ import annotations

import os
import time
from dataclasses import replace

from fluorspar.errors import OptionError, message
from fluorspar.fingerprint import fingerprint
from fluorspar.image.combining import AddedPixels
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import runs_of
from fluorspar.paths.render import Fill, fill_here, new_target
from fluorspar.paths.resuming import (
    check_begun,
    check_image,
    check_same,
    label_onto,
    passes_of,
    say_unfinished,
    unfinished_image,
)
from fluorspar.progress import Progress

__all__ = ["render_more"]

_FREE = ("samples", "seed", "pass", "errors of components")


def render_more(
    job: RenderJob,
    output: str | os.PathLike[str],
    *,
    resume: bool = False,
    progress: Progress | None = None,
    fill: Fill = fill_here,
) -> SpectralImage:
    """Render a pass of the samples of a job, and combine it with the image that is there.

    Parameters
    ----------
    job : RenderJob
        The scene and options of the image. Its seed and whether components have errors are the image's.
    output : path-like
        The `.nc` file of the image, which is replaced when the new one is whole.
    resume : bool
        Go on with the chunks of the pass that are there.
    progress : callable, optional
        Called with the pixels done and the pixels in all.
    fill : callable
        Where it is rendered.

    Returns
    -------
    SpectralImage
        Its `spp` is that of all passes, attribute `passes` says that of each.

    Raises
    ------
    OptionError
        If the image is not finished, even if only unfinished files beside it are there; or of another scene or other
        options.
    ImageError
        If there is no image, or it cannot be written.
    """
    began = time.perf_counter()
    check_begun(output)
    image = SpectralImage.open(output)
    attrs = image.attrs
    wrong = [name for name in ("partial", "denoised") if attrs.get(name)]
    if wrong:
        fix = "finish it first: --resume" if wrong == ["partial"] else "add samples to the noisy one"
        raise OptionError(message(f"samples are added to a {wrong[0]} image", where=output, fix=fix))
    fix = "give the scene and the options of the image"
    check_same(fingerprint(job) or {}, attrs.get("fingerprint"), output, but=_FREE, fix=fix)
    check_image(image, job, output)
    passes = passes_of(image)
    errors = "component_standard_error" in image.dataset
    job = replace(job, seed=int(attrs["seed"]), stream=len(passes), component_errors=errors)
    samples = job.scene.settings.spp
    label = label_onto(fingerprint(job), image, output)
    if not resume and label is not None:
        say_unfinished(unfinished_image(job, label, output), output)
    inner = new_target(job, output, label, resume=resume)
    with AddedPixels(inner, samples, image, sum(passes)) as target:
        left = [run for run in runs_of(job) if not target.has(*run)]
        fill(target, job, left, progress=progress)
        passes.append(samples)
        timings = dict(attrs.get("timings", {}))
        timings["render"] = round(timings.get("render", 0.0) + time.perf_counter() - began, 3)
        for name in ("until", "study_row"):  # they were of the passes before
            attrs.pop(name, None)
        told = {"spp": sum(passes), "passes": passes, "timings": timings}
        return target.image({**attrs, **told}, partial=False)
