"""Two images, pixel by pixel, block of rows by block of rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import CIE_1931, srgb_from_xyz, xyz_from_radiance
from fluorspar.comparing.comparison import Comparison, ImageComparison
from fluorspar.comparing.difference import ratio
from fluorspar.comparing.noise import explained_by_noise
from fluorspar.comparing.sides import ImageSide
from fluorspar.comparing.whites import lab_of
from fluorspar.errors import ImageError, message
from fluorspar.image.dataset import row_blocks
from fluorspar.measuring.freedom import error_freedom

__all__ = ["compare_images", "mean_of_images"]

Array = NDArray[np.float64]


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
    a: ImageSide,
    b: ImageSide,
    inside: NDArray[np.bool_],
    done: Comparison,
    exposure: float,
    *,
    scale_error: float = 0.0,
    to_display: Array | None = None,
    same_seed: int | None = None,
) -> ImageComparison:
    """Compare two images.

    Parameters
    ----------
    a, b : ImageSide
        Of one size, on common bands.
    inside : ndarray of shape (T,)
        The bands of RMSE.
    done : Comparison
        With the grid, the scale, the divisors and the white.
    exposure : float
        Of the pictures, m2/cd, in the scale of A.
    scale_error : float
        Relative standard error of the scale.
    to_display : ndarray of shape (3, 3), optional
        What XYZ (CIE 1931) is multiplied with from the right for the pictures.
    same_seed : int, optional
        As in `explained_by_noise`.

    Returns
    -------
    ImageComparison
    """
    width, height = a.image.size
    maps = {name: np.full((height, width), np.nan, np.float32) for name in ("rmse", "de00")}
    squares, variances, means, mean_errors, levels, level_squares = (
        np.full((height, width), np.nan) for _ in range(6)
    )
    pictures = [np.zeros((height, width, 3), np.uint8) for _ in range(2)]
    signed = np.zeros((height, width, 3), np.float32)
    bands = len(done.grid)
    absolute, difference_sum, sum_a, sum_b = (np.zeros(bands) for _ in range(4))
    # in units of the mean of A: squares of very small or large numbers leave the range of float32
    to_unit = np.float32(1 / done.mean_a), np.float32(1 / done.mean_b)
    known_of = [name for name, side in (("A", a), ("B", b)) if side.has_errors]
    count = 0
    for rows in row_blocks(a.image.dataset):
        first, second = a.radiance(rows) * to_unit[0], b.radiance(rows) * to_unit[1]
        difference = second - first
        known = np.asarray(np.isfinite(difference).all(axis=-1))
        maps["rmse"][rows] = _root_mean_square(difference[..., inside])
        labs = []
        shown = []
        for values in (first, second):
            xyz = xyz_from_radiance(values, done.grid) * done.mean_a
            seen = xyz
            if done.observer != CIE_1931:
                seen = xyz_from_radiance(values, done.grid, done.observer) * done.mean_a
            labs.append(lab_of(seen, done.white))
            pictured = xyz if to_display is None else xyz @ to_display
            rgb, _ = srgb_from_xyz(np.where(known[..., np.newaxis], pictured, 0.0), exposure)
            shown.append(rgb)
        maps["de00"][rows] = ciede2000(*labs)
        for picture, rgb in zip(pictures, shown, strict=True):
            picture[rows] = (rgb * 255 + 0.5).astype(np.uint8)
        signed[rows] = shown[1] - shown[0]
        pixels = difference[known]
        count += len(pixels)
        absolute += np.abs(pixels).sum(axis=0, dtype=np.float64)
        difference_sum += pixels.sum(axis=0, dtype=np.float64)
        sum_a += first[known].sum(axis=0, dtype=np.float64)
        sum_b += second[known].sum(axis=0, dtype=np.float64)
        if known_of:
            variance = np.zeros_like(difference)
            for side, factor in zip((a, b), to_unit, strict=True):
                if side.has_errors:
                    variance += np.square(side.errors(rows) * factor)
            squares[rows] = np.einsum("yxn,yxn->yx", difference, difference, dtype=np.float64)
            variances[rows] = variance.sum(axis=-1, dtype=np.float64)
            levels[rows] = second.mean(axis=-1, dtype=np.float64)
            level_squares[rows] = np.einsum("yxn,yxn->yx", second, second, dtype=np.float64)
            means[rows] = difference.mean(axis=-1, dtype=np.float64)
            mean_errors[rows] = np.sqrt(variance).mean(axis=-1, dtype=np.float64)
    if count == 0:
        raise _nothing_common()
    noise = None
    if known_of:
        noise = explained_by_noise(
            squares,
            variances,
            means,
            mean_errors,
            " and ".join(known_of),
            scale_error=scale_error,
            levels=levels,
            level_squares=level_squares,
            same_seed=same_seed,
            freedom=min(error_freedom(side.image) for side in (a, b) if side.has_errors),
        )
    return ImageComparison(
        maps["rmse"],
        maps["de00"],
        pictures[0],
        pictures[1],
        signed,
        exposure,
        sum_a / count * done.mean_a,
        sum_b / count * done.mean_a,
        ratio(absolute, sum_a),
        ratio(difference_sum, sum_a),
        float(ratio(difference_sum.sum(), sum_a.sum())),
        noise,
    )


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
