"""The two sides of a comparison: a spectral image, or a table of spectra of points."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, OptionError, message
from fluorspar.image.components import select
from fluorspar.image.dataset import add_up, values_of
from fluorspar.image.formats.registry import SUFFIXES
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of, error_layer
from fluorspar.measuring.point_spectra import PointSpectra, read_point_spectra
from fluorspar.spectral.bands import Bands

__all__ = ["TABLES", "ImageSide", "bands_of_side", "open_side"]

TABLES = (".csv", ".txt")

_KEEP_BYTES = 400 * 2**20  # totals up to this size stay in memory between two passes


def open_side(source: SpectralImage | PointSpectra | str | os.PathLike[str]) -> SpectralImage | PointSpectra:
    """Open a file as what its suffix says: an image or a table of spectra.

    Parameters
    ----------
    source : SpectralImage, PointSpectra, str or path-like
        What is open already comes back as it is.

    Raises
    ------
    OptionError
        If the suffix is none of those known.
    ImageError, SpectrumError
        If the file cannot be read.

    Examples
    --------
    >>> open_side("notes.pdf")
    Traceback (most recent call last):
    ...
    fluorspar.errors.OptionError: this kind of file cannot be compared
      where:    notes.pdf
      got:      .pdf
      expected: an image (.nc, .exr, .hdr) or a table of spectra (.csv, .txt)
    """
    if isinstance(source, SpectralImage | PointSpectra):
        return source
    suffix = Path(source).suffix.lower()
    if suffix in SUFFIXES:
        return SpectralImage.open(source)
    if suffix in TABLES:
        return read_point_spectra(source)
    raise OptionError(
        message(
            "this kind of file cannot be compared",
            where=source,
            got=suffix or "no suffix",
            expected=f"an image ({', '.join(SUFFIXES)}) or a table of spectra ({', '.join(TABLES)})",
        )
    )


def bands_of_side(side: SpectralImage | PointSpectra) -> Bands:
    """The bands of an image or a table, as far as they are known."""
    return side.bands if isinstance(side, PointSpectra) else bands_of(side)


@dataclass(eq=False)
class ImageSide:
    """An image as a comparison reads it: rows of the chosen components, on common bands.

    Parameters
    ----------
    image : SpectralImage
    bands : Bands
        Of the image itself.
    weights : ndarray of shape (T, N) or None
        What brings its bands to the common ones; None: nothing.
    component : str, optional
        As in `SpectralImage.xyz`.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> ImageSide(image, Bands(image.wavelengths), None).radiance(slice(0, 2)).shape
    (2, 6, 69)
    """

    image: SpectralImage
    bands: Bands
    weights: NDArray[np.float64] | None
    component: str | None = None
    _kept: dict[tuple[int, int], NDArray[np.float32]] = field(default_factory=dict, repr=False)

    @property
    def chosen(self) -> tuple[str, ...]:
        """The components that are added up."""
        return select(self.component, self.image.components)

    @property
    def has_errors(self) -> bool:
        """Whether the image holds standard errors of what is chosen."""
        return error_layer(self.image, self.component) is not None

    def radiance(self, rows: slice) -> NDArray[np.float32]:
        """Radiance of some rows, ndarray of shape (rows, X, T), float32; not to be written to."""
        key = (rows.start, rows.stop)
        if key not in self._kept:
            values = self._on_common_bands(add_up(self.image.dataset, self.chosen, rows))
            if sum(block.nbytes for block in self._kept.values()) + values.nbytes > _KEEP_BYTES:
                return values
            self._kept[key] = values
        return self._kept[key]

    def errors(self, rows: slice) -> NDArray[np.float32]:
        """Standard errors of some rows, ndarray of shape (rows, X, T); bands count as fully correlated."""
        layer = error_layer(self.image, self.component)
        if layer is None:
            raise ImageError(message("the image holds no standard errors of what is chosen"))
        variable, component = layer
        return self._on_common_bands(values_of(self.image.dataset, variable, rows, component), absolute=True)

    def _on_common_bands(self, values: NDArray[np.float32], absolute: bool = False) -> NDArray[np.float32]:
        if self.weights is None:
            return values
        weights = np.abs(self.weights) if absolute else self.weights
        return np.asarray(values @ weights.T.astype(np.float32))
