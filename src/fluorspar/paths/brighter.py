"""Materials that are much brighter than those among which light paths were traced."""

from __future__ import annotations

import warnings

from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparWarning
from fluorspar.job import RenderJob
from fluorspar.paths.log import SURVIVAL
from fluorspar.scene.relit import exchangeable

__all__ = ["warn_of_brighter"]


def warn_of_brighter(traced: RenderJob, job: RenderJob) -> None:
    """Warn where long paths are too rare for a new material: their weights grow from vertex to vertex."""
    settings = job.scene.settings
    if 0 <= settings.max_depth <= settings.rr_depth:
        return
    before = exchangeable(traced.scene)
    for name, new in exchangeable(job.scene).items():
        old = before.get(name)
        if not (isinstance(old, Material) and isinstance(new, Material)) or new is old:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # said when the image is computed
            least, most = (
                min(1.0, float(material.on(grid).energy_yield().max()))
                for material, grid in ((old, traced.computed_grid), (new, job.computed_grid))
            )
        if most**2 > max(least, SURVIVAL[0]):
            text = (
                f"'{name}' is much brighter now ({new.name}: {most:.2f} at the most, {old.name}: {least:.2f}): light "
                f"of more than {settings.rr_depth} bounces is noisy, and its standard error uncertain; for less noise "
                "trace with a larger rr_depth"
            )
            warnings.warn(text, FluorsparWarning, stacklevel=3)
            return
