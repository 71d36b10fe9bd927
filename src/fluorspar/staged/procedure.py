"""Render with the staged method: the steps of the paper, on a renderer that is a black box."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, FluorsparWarning
from fluorspar.image.components import COMPONENTS, SINGLE_BOUNCE
from fluorspar.image.pixels import FinishedPixels, Pixels
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import RenderJob
from fluorspar.progress import Progress
from fluorspar.scene.settings import UNLIMITED
from fluorspar.staged.equations import indirect_reflection, total
from fluorspar.staged.imaging import seeds_of, views_of
from fluorspar.staged.intermediate import file_names
from fluorspar.staged.mutual import FluorescentObject, fluorescent_objects, mutual_illumination
from fluorspar.staged.passes import Passes
from fluorspar.staged.renderers.mitsuba.renderer import MitsubaRenderer
from fluorspar.staged.renderers.protocol import Renderer
from fluorspar.staged.timings import FIRST

__all__ = ["render_staged"]

_DEPTHS = {FIRST: 2, "components 1 and 3": UNLIMITED, "source": 1}


def render_staged(
    job: RenderJob, *, progress: Progress | None = None, renderer: Renderer | None = None
) -> SpectralImage:
    """Render components 0 to 5 (and 6 with `bounces` of 2 or more) by the paper's procedure.

    Parameters
    ----------
    job : RenderJob
        What to render; its options are `StagedOptions`. Samples are rounded up to what the repeats and square small
        pixels need; the attribute `spp` says how many were taken.
    progress : callable, optional
        Called with the renders done and the renders in all, which grow while emitters are subdivided.
    renderer : Renderer, optional
        See `fluorspar.staged.renderers.protocol`; default: Mitsuba in its variant llvm.

    Returns
    -------
    SpectralImage
        `standard_error` is that of the mean of the repeats and missing for a single one; it does not hold the
        error that a finite number of emitters makes. Attributes `single_bounce` (1, or 0 with component 6),
        `timings` (each pass relative to component 1), `emitters` (by object, their number),
        `excluded_emitter_geometry` (the objects that were left out of their own emitter render); `partial` is 1 if
        the user interrupted after some of the repeats.

    Raises
    ------
    OptionError, MaterialError, SceneError
        If an option is out of range, or a material or a fluorescent surface cannot be used.

    Warns
    -----
    ApproximationWarning
        If the depth is limited to something between 3 and infinity: component 5 then holds longer paths too,
        because depth counts anew from the emitters.
    SceneNotice
        If there are fewer samples than repeats: there are then fewer repeats.

    Notes
    -----
    Components 1 and 3: `max_depth` 2, unlimited depth with the same seed, and their difference, each without
    the directly seen lamp. E = y / S (Eq. 11) per material and sample, so pixels that show several materials
    need no care. Components 2 and 4: Eqs. 7 and 9. Component 5: each fluorescent surface becomes an array of
    area lights (Eq. 10). The sum is Eq. 13.

    Examples
    --------
    >>> from fluorspar import Wavelengths, load_scene
    >>> from fluorspar.staged.options import StagedOptions
    >>> scene = load_scene("cornell-box").with_settings(width=8, height=8, spp=4)
    >>> options = StagedOptions(emitters=2, patch_samples=64, repeats=1)
    >>> job = RenderJob(scene, Wavelengths(400, 700, 50), method="staged", options=options)
    >>> image = render_staged(job)
    >>> image.components[-1], image.attrs["emitters"]
    ('luminescent_reflection', {'right-wall': 4, 'left-wall': 4})
    """
    renderer = renderer or MitsubaRenderer()
    depth = job.scene.settings.max_depth
    if depth > 2:
        warnings.warn(
            f"max_depth {depth}: the staged method counts depth anew from each emitter of component 5, "
            "which therefore holds longer paths too",
            ApproximationWarning,
            stacklevel=2,
        )
    with renderer.session(job.threads):
        return _all(Passes(job, renderer, progress))


def _all(p: Passes) -> SpectralImage:
    """All repeats, and their mean."""
    p.expect(len(_DEPTHS) * len(p.every) * p.sampling.passes * p.repeats)
    objects = fluorescent_objects(p) if p.bounces else []
    names = COMPONENTS if p.bounces > 1 else SINGLE_BOUNCE
    grid = p.job.grid
    mean = np.zeros(0, dtype=np.float32)
    totals: list[NDArray[np.float32]] = []
    for repeat in range(p.repeats):
        try:
            components = _repeat(p, repeat, objects)[: len(names), ..., -len(grid) :]
        except KeyboardInterrupt:
            if not totals:
                raise
            warnings.warn(
                f"interrupted: {len(totals)} of {p.repeats} repeats are finished",
                FluorsparWarning,
                stacklevel=3,
            )
            break
        p.kept.finish_repeat()
        mean = mean + components if totals else components
        totals.append(total(list(components)).astype(np.float32))
    done = len(totals)
    mean /= done
    with np.errstate(over="ignore", invalid="ignore"):  # then the image is refused
        error = np.std(totals, axis=0, ddof=1) / math.sqrt(done) if done > 1 else None
    layers = mean.reshape(len(names), -1, len(grid))
    missing = np.full(layers.shape[1:], np.nan, np.float32)
    finished = FinishedPixels(grid, p.job.scene.settings.width)
    finished.add(0, Pixels(layers, missing if error is None else error.reshape(missing.shape), None))
    finished.finish()
    attrs: dict[str, Any] = {
        **p.job.attrs,
        "spp": p.sampling.samples * done,
        "max_depth": p.depth,
        "repeats": done,
        "single_bounce": int(len(names) == len(SINGLE_BOUNCE)),
        "emitters": {item.name: len(item.array) for item in objects},
        "excluded_emitter_geometry": [item.name for item in objects if item.excluded] or None,
        "timings": p.watch.relative(),
    }
    if done < p.repeats:
        attrs["partial"] = 1
    p.kept.write(attrs)
    return SpectralImage.from_arrays(mean, grid, error, attrs, components=names)


def _repeat(p: Passes, repeat: int, objects: Sequence[FluorescentObject]) -> NDArray[np.float32]:
    """Components 0 to 6 from one set of seeds, ndarray of shape (7, Y, X, N)."""
    seeds = seeds_of(p.seed, repeat, count=p.sampling.passes)
    views = views_of(p.base, p.sampling, seeds, p.fluorescent)
    # the extra seeds are for the emitters: their light must not be estimated with the camera's paths
    spare = seeds_of(p.seed, repeat, 1, count=2)
    depths = {
        name: depth if p.depth == UNLIMITED or 0 < depth <= p.depth else p.depth
        for name, depth in _DEPTHS.items()
    }
    p.compile(p.base, p.lights, depths)
    *images, source = p.pictures(p.base, p.albedo, p.lights, views, p.every, depths, p.watch.timing)
    direct, everything = (image.without(source) for image in images)

    with p.watch.timing("components 2 and 4"):
        light_i = {
            row: indirect_reflection(everything.light[row], direct.light[row]) for row in p.fluorescent
        }
        y2 = p.luminesced(direct.light, views)
        y4 = p.luminesced(light_i, views)
    files = file_names([made.name for made in p.scene.materials])
    for row in p.fluorescent:
        p.kept.image(f"E_D {files[row]}", direct.light[row])
        p.kept.image(f"E_I {files[row]}", light_i[row])
    y5, y6 = mutual_illumination(p, repeat, objects, views, spare)
    y3 = indirect_reflection(everything.image, direct.image)
    return np.stack([source.image, direct.image, y2, y3, y4, y5, y6], dtype=np.float32, casting="same_kind")
