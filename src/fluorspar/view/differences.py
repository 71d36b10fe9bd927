"""Two views compared: how much their colours and spectra differ, as `fluorspar compare` has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from fluorspar.comparing.compare import compare
from fluorspar.errors import ImageError, message
from fluorspar.image.display.picture import png_bytes
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.view.false_colour import coloured
from fluorspar.view.pictures import EFFORT, data_url

__all__ = ["difference_of"]


def difference_of(a: SpectralImage, b: SpectralImage) -> dict[str, Any]:
    """Compare B with A.

    Returns
    -------
    dict
        `png`: the map of CIEDE2000 as a data URL, its `range`, `mean`, `median`, `p95`, `max`; `rmse` of each pixel in
        the mean, `bias`; `noise`: the verdict as text; `notes`: what was done.

    Raises
    ------
    ImageError
        If they differ in size.
    FluorsparError
        If they cannot be compared, see `compare`.
    """
    if a.size != b.size:
        sizes = " and ".join(f"{image.size[0]} x {image.size[1]} pixels" for image in (a, b))
        raise ImageError(message("two images of different sizes cannot be compared", got=sizes))
    comparison = compare(a, b)
    assert comparison.images is not None
    results, de00 = comparison.images.as_dict(), comparison.images.de00
    known = de00[np.isfinite(de00)]
    rgb, limits = coloured(de00, "difference")
    return {
        "png": data_url(png_bytes(rgb, EFFORT)),
        "range": limits,
        "mean": results["de00_mean"],
        "median": float(np.median(known)) if known.size else None,
        "p95": results["de00_95"],
        "max": results["de00_max"],
        "rmse": results["rmse"],
        "bias": results["bias"],
        "noise": results["noise"],
        "text": comparison.text(),
        "notes": comparison.notes,
    }
