"""Two images, pixel by pixel, block of rows by block of rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import CIE_1931, srgb_from_xyz, xyz_from_radiance
from fluorspar.comparing.comparison import ImageComparison
from fluorspar.comparing.difference import ratio
from fluorspar.comparing.noise import Differences, NoiseVerdict, explained_by_noise
from fluorspar.comparing.sides import ImageSide
from fluorspar.comparing.terms import Terms
from fluorspar.comparing.whites import lab_of
from fluorspar.errors import ImageError, message
from fluorspar.image.dataset import row_blocks
from fluorspar.image.stated import is_denoised
from fluorspar.measuring.error_freedom import error_freedom

__all__ = ["compare_images", "mean_of_images"]

Array = NDArray[np.float64]
Pixels = NDArray[np.float32]


def mean_of_images(a: ImageSide, b: ImageSide) -> tuple[Array, Array]:
    """Mean spectra over the pixels that both images have.

    Parameters
    ----------
    a, b : ImageSide
        Of one size, on common bands.

    Returns
    -------
    mean_a, mean_b : ndarray of shape (T,)

    Raises
    ------
    ImageError
        If there is no pixel that both have.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 2)), Wavelengths(500, 600, 100))
    >>> side = ImageSide(image, Bands(image.wavelengths), None)
    >>> mean_of_images(side, side)[0]
    array([7., 7.])
    """
    sums = [np.zeros(1), np.zeros(1)]
    count = 0
    for rows in row_blocks(a.image.dataset):
        blocks = [side.radiance(rows) for side in (a, b)]
        known = np.logical_and.reduce([np.isfinite(block).all(axis=-1) for block in blocks])
        count += int(known.sum())
        for index, block in enumerate(blocks):
            spectra = block.reshape(-1, block.shape[-1]) if known.all() else block[known]
            sums[index] = sums[index] + spectra.sum(axis=0, dtype=np.float64)
    if count == 0:
        raise _nothing_common()
    return sums[0] / count, sums[1] / count


def compare_images(
    a: ImageSide, b: ImageSide, terms: Terms, exposure: float, to_display: Array | None = None
) -> ImageComparison:
    """Compare two images.

    Parameters
    ----------
    a, b : ImageSide
        Of one size, Y x X pixels on the T common bands.
    terms : Terms
    exposure : float
        Of the pictures, m2/cd, in the scale of A.
    to_display : ndarray of shape (3, 3), optional
        What XYZ (CIE 1931) is multiplied with from the right for the pictures.

    Returns
    -------
    ImageComparison

    Raises
    ------
    ImageError
        If there is no pixel that both have.
    """
    width, height = a.image.size
    rmse, de00 = (np.full((height, width), np.nan, np.float32) for _ in range(2))
    pictures = np.zeros((2, height, width, 3), np.uint8)
    rgb_difference = np.zeros((height, width, 3), np.float32)
    of_noise = np.full((6, height, width), np.nan)
    count, sums = 0, np.zeros((4, len(terms.grid)))
    # in units of the mean of A: squares of very small or large numbers leave the range of float32
    units = np.float32(1 / terms.scale.mean_a), np.float32(1 / terms.scale.mean_b)
    for rows in row_blocks(a.image.dataset):
        first, second = (side.radiance(rows) * unit for side, unit in zip((a, b), units, strict=True))
        difference = second - first
        known = np.asarray(np.isfinite(difference).all(axis=-1))
        rmse[rows] = _root_mean_square(difference[..., terms.in_range])
        de00[rows], shown = _colours((first, second), known, terms, exposure, to_display)
        pictures[:, rows] = (shown * 255 + 0.5).astype(np.uint8)
        rgb_difference[rows] = shown[1] - shown[0]
        count += int(known.sum())
        pixels = difference[known]
        for row, values in enumerate((np.abs(pixels), pixels, first[known], second[known])):
            sums[row] += values.sum(axis=0, dtype=np.float64)
        if a.has_errors or b.has_errors:
            errors = [
                side.errors(rows) * unit for side, unit in zip((a, b), units, strict=True) if side.has_errors
            ]
            of_noise[:, rows] = _of_noise(difference, errors, second)
    if count == 0:
        raise _nothing_common()
    absolute, signed, of_a, of_b = sums
    return ImageComparison(
        rmse=rmse,
        de00=de00,
        rgb_a=pictures[0],
        rgb_b=pictures[1],
        rgb_difference=rgb_difference,
        exposure=exposure,
        mean_a=of_a / count * terms.scale.mean_a,
        mean_b=of_b / count * terms.scale.mean_a,
        band_error=ratio(absolute, of_a),
        band_bias=ratio(signed, of_a),
        bias=float(ratio(signed.sum(), of_a.sum())),
        noise=_noise(a, b, of_noise, terms),
    )


def _of_noise(difference: Pixels, errors: Sequence[Pixels], matched: Pixels) -> Array:
    """What `_noise` needs of a block of pixels, ndarray of shape (6, Y, X)."""
    variance = np.zeros_like(difference)
    for error in errors:
        variance += np.square(error)
    return np.stack(
        [
            _sum_of_squares(difference),
            variance.sum(axis=-1, dtype=np.float64),
            difference.mean(axis=-1, dtype=np.float64),
            np.sqrt(variance).mean(axis=-1, dtype=np.float64),  # of bands that are fully correlated
            matched.mean(axis=-1, dtype=np.float64),
            _sum_of_squares(matched),
        ]
    )


def _noise(a: ImageSide, b: ImageSide, of_noise: Array, terms: Terms) -> NoiseVerdict | None:
    """The verdict on noise; None without standard errors."""
    freedoms = {name: error_freedom(side.image) for name, side in (("A", a), ("B", b)) if side.has_errors}
    if not freedoms:
        return None
    squares, variances, means, mean_errors, levels, level_squares = of_noise
    freedom = min(freedoms.values())
    return explained_by_noise(
        Differences(squares, variances, means, mean_errors, levels, level_squares, freedom),
        " and ".join(freedoms),
        scale_error=terms.scale.error,
        same_seed=terms.same_seed,
        denoised=" and ".join(name for name, side in (("A", a), ("B", b)) if is_denoised(side.image)),
    )


def _colours(
    sides: tuple[Pixels, Pixels],
    known: NDArray[np.bool_],
    terms: Terms,
    exposure: float,
    to_display: Array | None,
) -> tuple[Array, Array]:
    """CIEDE2000 (Y, X) of two blocks of pixels, and their displayed R, G, B (2, Y, X, 3)."""
    labs, displayed = [], []
    for values in sides:
        xyz = xyz_from_radiance(values, terms.grid) * terms.scale.mean_a
        seen = xyz
        if terms.observer != CIE_1931:
            seen = xyz_from_radiance(values, terms.grid, terms.observer) * terms.scale.mean_a
        labs.append(lab_of(seen, terms.white))
        pictured = xyz if to_display is None else xyz @ to_display
        rgb, _ = srgb_from_xyz(np.where(known[..., np.newaxis], pictured, 0.0), exposure)
        displayed.append(rgb)
    return ciede2000(*labs), np.stack(displayed)


def _sum_of_squares(values: Pixels) -> Array:
    return np.asarray(np.einsum("yxn,yxn->yx", values, values, dtype=np.float64))


def _nothing_common() -> ImageError:
    return ImageError(
        message(
            "there is no pixel that both images have",
            where="A and B",
            got="NaN in one of them at every pixel",
            expected="pixels that were rendered in both",
            fix="compare renders that were not stopped before they had the same pixels",
        )
    )


def _root_mean_square(values: NDArray[np.float32]) -> NDArray[np.float32]:
    squares = np.einsum("yxn,yxn->yx", values, values)
    return np.asarray(np.sqrt(squares / np.float32(values.shape[-1])))
