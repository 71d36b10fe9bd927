"""Matching the scales of two sides, and how uncertain that is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.xyz import luminance, observer_weights
from fluorspar.comparing.compare_images import mean_of_images
from fluorspar.comparing.sides import ImageSide, PointSide
from fluorspar.comparing.terms import Scale
from fluorspar.errors import OptionError, message
from fluorspar.image.dataset import row_blocks
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["match_scales"]

Array = NDArray[np.float64]
Images = tuple[ImageSide, ImageSide]
Points = tuple[PointSide, PointSide]


def match_scales(
    points: Points | None,
    images: Images | None,
    grid: Wavelengths,
    in_range: NDArray[np.bool_],
    match: str,
) -> tuple[Scale, list[str]]:
    """Match the scales of two sides.

    Parameters
    ----------
    points : (PointSide, PointSide) or None
    images : (ImageSide, ImageSide) or None
        One of both is needed.
    grid : Wavelengths
        The T common bands.
    in_range : ndarray of shape (T,)
        Which of them RMSE is taken over.
    match : str
        As in `compare`; luminance is that of CIE 1931.

    Returns
    -------
    scale : Scale
        All factors are 1 if both sides are black.
    sentences : list of str
        What was done, and how uncertain it is.

    Raises
    ------
    OptionError
        If a point is not known, or what is to be matched is 0.

    Examples
    --------
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.measuring.point_spectra import PointSpectra
    >>> bands, ones = Bands(Wavelengths(400, 700, 100)), np.ones((1, 4))
    >>> tables = (PointSpectra(("1",), bands, k * ones, 0.03 * k * ones, correlated=True) for k in (2.0, 4.0))
    >>> sides = tuple(PointSide(table, bands, None) for table in tables)
    >>> match_scales(sides, None, bands.grid, np.ones(4, bool), "1")[0]
    Scale(factor=0.5, mean_a=2.0, mean_b=4.0, error=0.042...)
    """
    at_a_point = match not in ("none", "luminance")
    if at_a_point and points is None:
        fault, fix = (
            "the scales are to be matched at a point, but no points are given",
            "give points (--points)",
        )
        raise OptionError(message(fault, got=match, fix=fix))
    what = "points" if images is None else "pixels"
    if images is not None:
        spectra = mean_of_images(*images)
    elif points is not None:
        spectra = points[0].spectra.radiance.mean(axis=0), points[1].spectra.radiance.mean(axis=0)
    if not any(spectrum.any() for spectrum in spectra):
        return Scale(1.0, 1.0, 1.0), ["Scale: both sides are black, so there is nothing to match."]
    if points is not None and at_a_point:
        mean_a, mean_b = (float(side.spectra.at(match)[in_range].mean()) for side in points)
        _check_lit(mean_a, mean_b, f"the mean of point {match} over the bands of RMSE")
        how = f"Scale: each side is divided by its own mean over these bands at point {match} (Eq. 14)"
    else:
        mean_a = mean_b = float(spectra[0][in_range].mean())
        _check_lit(mean_a, 1.0, f"the mean of the {what} over the bands of RMSE")
        how = "Scale: compared as they are"
        if match == "luminance":
            luminance_a, luminance_b = (float(luminance(spectrum, grid)) for spectrum in spectra)
            _check_lit(luminance_a, luminance_b, f"the average luminance of the {what}")
            mean_b = mean_a * luminance_b / luminance_a
            how = f"Scale: B is matched to A by the average luminance (CIE 1931) of the {what}"
        how += f"; for RMSE both are divided by the mean of A over the {what} and these bands"
    scale = Scale(mean_a / mean_b, mean_a, mean_b, _error(points, images, grid, in_range, match))
    divisors = f"{mean_a:.6g}"
    if scale.factor != 1:
        divisors += f" and {mean_b:.6g}, so B counts {scale.factor:.6g} times"
    sentences = [f"{how}: {divisors}."]
    if scale.error:
        where = f"point {match}" if at_a_point else "the average luminance"
        sentences.append(f"The noise of {where} makes that factor uncertain by {100 * scale.error:.2g} %.")
    return scale, sentences


def _check_lit(of_a: float, of_b: float, what: str) -> None:
    """Find the side that cannot be normalised."""
    for name, value in (("A", of_a), ("B", of_b)):
        if not value > 0:
            raise OptionError(
                message(
                    f"{name} is black: it cannot be normalised"
                    if value == 0
                    else f"{name} cannot be normalised",
                    where=what,
                    got=f"{value:g}",
                    expected="a positive number",
                    fix="exchange A and B, or match the scales at another point",
                )
            )


def _error(
    points: Points | None, images: Images | None, grid: Wavelengths, in_range: NDArray[np.bool_], match: str
) -> float:
    """Relative standard error of the factor that matches the scales; "none" has no error."""
    if match == "none":
        return 0.0
    of_luminance = observer_weights(grid)[:, 1]
    if match == "luminance" and images is not None:
        of_a, of_b = (_error_of_luminance(side, of_luminance) for side in images)
        return float(np.hypot(of_a, of_b))
    shares = of_luminance if match == "luminance" else in_range / in_range.sum()
    squares = 0.0
    for side in points or ():
        error = side.error_of_sum(shares)
        if error is not None:
            rows = slice(None) if match == "luminance" else [side.spectra.index(match)]
            amount = float(np.sum(side.spectra.radiance[rows] @ shares))
            squares += float(np.sum(error[rows] ** 2)) / amount**2 if amount > 0 else 0.0
    return float(np.sqrt(squares))


def _error_of_luminance(side: ImageSide, weights: Array) -> float:
    """Relative standard error of the average luminance: pixels are independent, their bands correlated."""
    if not side.has_errors:
        return 0.0
    squares = amount = 0.0
    for rows in row_blocks(side.image.dataset):
        values = side.radiance(rows).astype(np.float64) @ weights
        errors = side.errors(rows).astype(np.float64) @ weights
        known = np.isfinite(values) & np.isfinite(errors)
        amount += float(values[known].sum())
        squares += float(np.square(errors[known]).sum())
    return float(np.sqrt(squares) / amount) if amount > 0 else 0.0
