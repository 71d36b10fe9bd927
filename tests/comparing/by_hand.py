"""Images and tables small enough to be computed by hand."""

from __future__ import annotations

import numpy as np

from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.spectral.bands import Bands
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["GRID", "image_of", "table_of"]

GRID = Wavelengths(400, 700, 50)


def image_of(total, grid=GRID, error=None, **attrs):
    """An image whose total is in component 1; one error stands for all."""
    radiance = np.zeros((7, *np.shape(total)), np.float32)
    radiance[1] = total
    errors = None if error is None else np.broadcast_to(error, np.shape(total))
    return SpectralImage.from_arrays(radiance, grid, errors, attrs)


def table_of(radiance, grid=GRID, fwhm=0.0, names=None, error=None, **stated):
    """A table of points named a, b, c, ...; one error stands for all."""
    radiance = np.asarray(radiance, float)
    names = tuple(names or "abcdefghijklmnopqrstuvwxyz"[: len(radiance)])
    errors = None if error is None else np.broadcast_to(error, radiance.shape).copy()
    return PointSpectra(names, Bands(grid, fwhm), radiance, errors, title="table", **stated)
