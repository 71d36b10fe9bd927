"""The two sides of a comparison as it reads them: rows of images, or spectra of points, on common bands."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fluorspar.comparing.sources import Side
from fluorspar.errors import ImageError, message
from fluorspar.image.components import select
from fluorspar.image.dataset import add_up
from fluorspar.image.known_error import known_error
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.spectral.bands import Bands, error_of_sum, errors_on_bands

__all__ = ["ImageSide", "PointSide", "Weights", "image_sides", "point_sides"]

Array = NDArray[np.float64]
Weights: TypeAlias = Array | None

_KEEP_BYTES = 128 * 2**20  # totals up to this size stay in memory between two passes


@dataclass(eq=False)
class ImageSide:
    """An image as a comparison reads it: rows of the components that are compared, on common bands.

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
    weights: Weights
    component: str | None = None
    _kept: dict[tuple[int, int], NDArray[np.float32]] = field(default_factory=dict, repr=False)

    @property
    def components(self) -> tuple[str, ...]:
        """The components that are added up."""
        return select(self.component, self.image.components)

    @property
    def has_errors(self) -> bool:
        """Whether the image holds standard errors of what is compared."""
        return bool(known_error(self.image, self.component))

    def radiance(self, rows: slice) -> NDArray[np.float32]:
        """Radiance of some rows, ndarray of shape (rows, X, T), float32; not to be written to."""
        key = (rows.start, rows.stop)
        if key not in self._kept:
            values = self._on_common_bands(add_up(self.image.dataset, self.components, rows))
            if sum(block.nbytes for block in self._kept.values()) + values.nbytes > _KEEP_BYTES:
                return values
            self._kept[key] = values
        return self._kept[key]

    def errors(self, rows: slice) -> NDArray[np.float32]:
        """Standard errors of some rows, ndarray of shape (rows, X, T); bands count as fully correlated."""
        known = known_error(self.image, self.component)
        if not known:
            raise ImageError(message("the image holds no standard errors of what is compared"))
        return self._on_common_bands(known.rows(rows), absolute=True)

    def _on_common_bands(self, values: NDArray[np.float32], absolute: bool = False) -> NDArray[np.float32]:
        if self.weights is None:
            return values
        weights = np.abs(self.weights) if absolute else self.weights
        return np.asarray(values @ weights.T.astype(np.float32))


@dataclass(frozen=True, eq=False)
class PointSide:
    """A table of spectra as a comparison reads it: P points on common bands.

    Parameters
    ----------
    measured : PointSpectra
        On its own N bands.
    bands : Bands
        The T common ones.
    weights : ndarray of shape (T, N) or None
        What brings its bands to the common ones; None: nothing.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> table = PointSpectra(("1",), Bands(Wavelengths(400, 700, 100)), np.ones((1, 4)), np.ones((1, 4)))
    >>> PointSide(table, table.bands, None).error_of_sum(np.full(4, 0.25))
    array([0.5])
    """

    measured: PointSpectra
    bands: Bands
    weights: Weights

    @cached_property
    def spectra(self) -> PointSpectra:
        """The table on the common bands."""
        table = self.measured
        if self.weights is None:
            return table
        error = errors_on_bands(table.standard_error, self.weights, table.correlated)
        radiance = table.radiance @ self.weights.T
        return replace(table, bands=self.bands, radiance=radiance, standard_error=error)

    def error_of_sum(self, shares: Array) -> Array | None:
        """The standard error of a weighted sum over the common bands, of each point.

        Parameters
        ----------
        shares : ndarray of shape (T,)
            Weights of the common bands.

        Returns
        -------
        ndarray of shape (P,) or None
            None if no standard errors are known. Bands that overlap share the errors of the samples they are
            made of, which counts.
        """
        table = self.measured
        if table.standard_error is None:
            return None
        on_own = shares
        if self.weights is not None:
            on_own = shares @ (np.abs(self.weights) if table.correlated else self.weights)
        return error_of_sum(table.standard_error, on_own, table.correlated)


def image_sides(
    sides: tuple[Side, Side],
    weights: tuple[Weights, Weights],
    components: tuple[str | None, str | None],
    *,
    with_points: bool = False,
) -> tuple[tuple[ImageSide, ImageSide] | None, list[str]]:
    """The images that can be compared pixel by pixel, None if there are not two of one size, and why not.

    Raises
    ------
    ImageError
        If they differ in size and there are no points at which they could be compared.
    """
    a, b = sides
    if not (isinstance(a, SpectralImage) and isinstance(b, SpectralImage)):
        return None, []
    if a.size != b.size:
        if with_points:
            return None, ["The images differ in size: they are compared at the points only."]
        raise ImageError(
            message(
                "the images differ in size",
                got=" and ".join(f"{w} x {h}" for w, h in (a.size, b.size)),
                expected="the same number of pixels",
                fix="render both at one size, or compare them at positions in the scene: points (--points)",
            )
        )
    images = (
        ImageSide(a, bands_of(a), weights[0], components[0]),
        ImageSide(b, bands_of(b), weights[1], components[1]),
    )
    return images, []


def point_sides(
    tables: tuple[PointSpectra, PointSpectra] | None, bands: Bands, weights: tuple[Weights, Weights]
) -> tuple[PointSide, PointSide] | None:
    """The two tables on the common bands; None if there are none."""
    if tables is None:
        return None
    return PointSide(tables[0], bands, weights[0]), PointSide(tables[1], bands, weights[1])
