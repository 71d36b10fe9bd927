"""From denoised channels back to spectra, of components that add up to a total."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from numpy.typing import NDArray

from fluorspar.paths.sweeping.kept_code import FAST, keep_code

if TYPE_CHECKING:
    from fluorspar.denoising.pictures import Picture

__all__ = ["finish"]

Array = NDArray[np.float32]

_MOST = np.float32(2)  # factor on what no channel holds
_TINY = np.finfo(np.float32).tiny


def finish(
    radiance: Array, places: list[int], pictures: list[Picture], whole: Picture, first: int, rows: slice
) -> None:
    """Denoise the spectra of some rows, in place.

    What no channel holds of a spectrum becomes lighter or darker as they do. Then the components are changed to add up
    to the total: the less certain one is, the more it changes.

    Parameters
    ----------
    radiance : ndarray of shape (components, rows, X, N)
        The noisy spectra.
    places : list of int
        Which components are denoised, n of them. Others stay as they are.
    pictures : list of Picture
        Theirs, denoised; with their `uncertainty` if there are several.
    whole : Picture
        The denoised total.
    first : int
        Row of the image that `radiance` begins with.
    rows : slice
        Rows of the image.

    Notes
    -----
    These are the least changes for the errors stated, the sum being known: each component takes of the difference what
    its variance is of all variances. None becomes negative, nor does a total that was not.

    Examples
    --------
    >>> from fluorspar.denoising.pictures import Picture
    >>> ones = np.ones((1, 1), np.float32)
    >>> radiance = np.array([1, 3], np.float32).reshape(2, 1, 1, 1)
    >>> parts = [Picture(each.copy(), ones, ones) for each in radiance]
    >>> for part, error in zip(parts, (0.1, 0.2)):
    ...     part.uncertainty = np.full((1, 1), error**2, np.float32)
    >>> finish(radiance, [0, 1], parts, Picture(np.full((1, 1, 1), 3, np.float32), ones, ones), 0, slice(0, 1))
    >>> radiance[:, 0, 0, 0].round(3).tolist()
    [0.9729999899864197, 2.0269999504089355]
    """
    several = len(places) > 1
    _finish(
        radiance,
        np.array(places),
        np.stack([picture.channels[rows] for picture in pictures]),
        np.ascontiguousarray(pictures[0].ranges.T),
        np.stack([picture.spectra for picture in pictures]),
        np.stack([picture.uncertainty[rows] for picture in pictures])
        if several
        else whole.channels[:0, ..., :0],
        np.ascontiguousarray(whole.channels[rows]),
        np.ascontiguousarray(whole.ranges.T),
        whole.spectra,
        rows.start - first,
    )


@numba.njit(inline="always")
def _denoise(values: Any, clean: Any, ranges: Any, spectra: Any, noisy: Any, out: Any) -> None:
    before, after = np.float32(0), np.float32(0)
    for c in range(len(noisy)):
        sum_ = np.float32(0)
        for j in range(len(values)):
            sum_ += values[j] * ranges[c, j]
        if np.isnan(sum_):  # without the bands that are not known
            sum_, known = np.float32(0), np.float32(0)
            for j in range(len(values)):
                if not np.isnan(values[j]):
                    sum_ += values[j] * ranges[c, j]
                    known += ranges[c, j]
            sum_ = sum_ / known if known > 0 else np.float32(0)
        noisy[c] = sum_
        before += noisy[c]
        after += clean[c]
    factor = min(after / before, _MOST) if before > 0 else np.float32(1)
    for j in range(len(values)):
        out[j] = values[j] * factor
    for c in range(len(noisy)):
        change = clean[c] - factor * noisy[c]
        for j in range(len(values)):
            out[j] += change * spectra[c, j]


@numba.njit(nogil=True, fastmath=FAST)
def _finish(
    radiance: Any,
    places: Any,
    channels: Any,
    ranges: Any,
    spectra: Any,
    uncertainty: Any,
    whole_channels: Any,
    whole_ranges: Any,
    whole_spectra: Any,
    offset: int,
) -> None:
    rows, width, _ = whole_channels.shape
    count, bands = len(places), radiance.shape[3]
    noisy = np.empty(ranges.shape[0], np.float32)
    whole_noisy = np.empty(whole_ranges.shape[0], np.float32)
    light, total = np.empty(bands, np.float32), np.empty(bands, np.float32)
    parts = np.empty((count, bands), np.float32)
    level, variances, change = (
        np.empty(bands, np.float32),
        np.empty(bands, np.float32),
        np.empty(bands, np.float32),
    )
    for y in range(rows):
        for x in range(width):
            light[:] = 0
            for i in range(count):
                values = radiance[places[i], offset + y, x]
                for j in range(bands):
                    light[j] += values[j]
            _denoise(light, whole_channels[y, x], whole_ranges, whole_spectra, whole_noisy, total)
            for j in range(bands):
                if total[j] < 0 and light[j] >= 0:
                    total[j] = 0
            if count == 1:
                for j in range(bands):
                    radiance[places[0], offset + y, x, j] = total[j]
                continue
            level[:] = 0
            for i in range(count):
                part = parts[i]
                _denoise(
                    radiance[places[i], offset + y, x], channels[i, y, x], ranges, spectra[i], noisy, part
                )
                for j in range(bands):
                    part[j] = np.float32(0) if part[j] < 0 else part[j]
                    level[j] += part[j]
            # The variance of a part p is u p^2, so of a difference d of the total it takes p u p / sum(p u p).
            variances[:] = 0
            for i in range(count):
                for j in range(bands):
                    variances[j] += parts[i, j] / max(level[j], _TINY) * parts[i, j] * uncertainty[i, y, x]
            for j in range(bands):
                change[j] = (total[j] - level[j]) / variances[j] if variances[j] > 0 else np.float32(0)
                change[j] /= max(level[j], _TINY)
            light[:] = 0
            for i in range(count):
                for j in range(bands):
                    factor = np.float32(1) + parts[i, j] * uncertainty[i, y, x] * change[j]
                    parts[i, j] *= max(factor, np.float32(0))
                    light[j] += parts[i, j]
            for j in range(bands):
                if light[j] <= 0:
                    parts[0, j] = light[j] = 1
                total[j] /= light[j]
            for i in range(count):
                for j in range(bands):
                    radiance[places[i], offset + y, x, j] = parts[i, j] * total[j]


keep_code(_finish, "the spectra of denoised images")
