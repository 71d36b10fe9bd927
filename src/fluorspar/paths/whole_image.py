"""An image of light paths, or none: for those who make many, and have no use for a part of one."""

from __future__ import annotations

import warnings
from typing import Any

from fluorspar.image.spectral_image import SpectralImage
from fluorspar.paths.light_paths import LightPaths
from fluorspar.progress import Progress

__all__ = ["whole_image"]


def whole_image(paths: LightPaths, progress: Progress | None = None, **options: Any) -> SpectralImage:
    """Sweep paths into an image, as `LightPaths.image` does with these options, of all the pixels that were traced.

    Raises
    ------
    KeyboardInterrupt
        If the user interrupts, where `LightPaths.image` keeps what is finished.

    Examples
    --------
    >>> import fluorspar
    >>> paths = fluorspar.trace("cornell-box", size=(8, 8), spp=1)
    >>> whole_image(paths, lights={"light": "A"}).size
    (8, 8)
    """
    finished = 0

    def report(done: int, whole: int) -> None:
        nonlocal finished
        finished = done
        if progress:
            progress(done, whole)

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "interrupted: ")
        image = paths.image(progress=report, **options)
    if finished < paths.pixels:
        raise KeyboardInterrupt
    return image
