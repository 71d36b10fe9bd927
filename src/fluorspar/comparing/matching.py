"""Matching the scales of two sides, and how uncertain that is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.xyz import luminance, observer_weights
from fluorspar.comparing.images import mean_of_images
from fluorspar.comparing.pair import Pair
from fluorspar.comparing.sides import ImageSide
from fluorspar.errors import OptionError, message
from fluorspar.image.dataset import row_blocks
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["matched_scale", "scale_error_of"]

Array = NDArray[np.float64]
Images = tuple[ImageSide, ImageSide]


def matched_scale(
    pair: Pair,
    images: Images | None,
    grid: Wavelengths,
    inside: NDArray[np.bool_],
    match: str,
) -> tuple[float, float, float, str]:
    """Match the scales of two sides.

    Parameters
    ----------
    pair : Pair
    images : (ImageSide, ImageSide) or None
    grid : Wavelengths
        The T common bands.
    inside : ndarray of shape (T,)
        Which of them RMSE is taken over.
    match : str
        As in `compare`; luminance is that of CIE 1931.

    Returns
    -------
    scale, mean_a, mean_b : float
        What B is multiplied with, and what A and B are divided by for RMSE; all 1 if both sides are black.
    sentence : str
        What was done.

    Raises
    ------
    OptionError
        If a point is not known, or what is to be matched is 0.

    Examples
    --------
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.measuring.point_spectra import PointSpectra
    >>> grid = Wavelengths(400, 700, 100)
    >>> a, b = (PointSpectra(("1",), Bands(grid), np.full((1, 4), value)) for value in (2.0, 4.0))
    >>> matched_scale(Pair(a, b), None, grid, np.ones(4, bool), "1")[:3]
    (0.5, 2.0, 4.0)
    """
    if match not in ("none", "luminance") and (pair.a is None or pair.b is None):
        raise OptionError(
            message(
                "the scales cannot be matched at a point without points",
                got=match,
                fix="give a points file (--points)",
            )
        )
    if images is not None:
        spectra, over = mean_of_images(*images), "pixels"
    elif pair.a is not None and pair.b is not None:
        spectra, over = (pair.a.radiance.mean(axis=0), pair.b.radiance.mean(axis=0)), "points"
    if not any(spectrum.any() for spectrum in spectra):
        return 1.0, 1.0, 1.0, "Scale: both sides are black, so there is nothing to match."
    if match not in ("none", "luminance"):
        assert pair.a is not None
        assert pair.b is not None
        mean_a, mean_b = (float(table.at(match)[inside].mean()) for table in (pair.a, pair.b))
        _check_lit(mean_a, mean_b, f"the mean of point {match} over the bands of RMSE")
        said = f"Scale: each side is divided by its own mean over these bands at point {match} (Eq. 14)"
    else:
        mean_a = mean_b = float(spectra[0][inside].mean())
        _check_lit(mean_a, 1.0, f"the mean of the {over} over the bands of RMSE")
        said = "Scale: compared as they are"
        if match == "luminance":
            luminance_a, luminance_b = (float(luminance(spectrum, grid)) for spectrum in spectra)
            _check_lit(luminance_a, luminance_b, f"the average luminance of the {over}")
            mean_b = mean_a * luminance_b / luminance_a
            said = f"Scale: B is matched to A by the average luminance (CIE 1931) of the {over}"
        said += f"; for RMSE both are divided by the mean of A over the {over} and these bands"
    scale = mean_a / mean_b
    return scale, mean_a, mean_b, f"{said}: {mean_a:.6g} and {mean_b:.6g}, so B counts {scale:.6g} times."


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


def scale_error_of(
    pair: Pair, images: Images | None, grid: Wavelengths, inside: NDArray[np.bool_], match: str
) -> float:
    """Return the relative standard error of the factor that matches the scales.

    Parameters
    ----------
    pair : Pair
    images : (ImageSide, ImageSide) or None
    grid : Wavelengths
        The T common bands.
    inside : ndarray of shape (T,)
        The bands of RMSE.
    match : str
        As in `compare`; "none" has no error.

    Examples
    --------
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.measuring.point_spectra import PointSpectra
    >>> grid, ones = Wavelengths(400, 700, 100), np.ones((1, 4))
    >>> noisy = PointSpectra(("1",), Bands(grid), ones, 0.03 * ones, correlated=True)
    >>> scale_error_of(Pair(noisy, noisy), None, grid, np.ones(4, bool), "1").__round__(4)
    0.0424
    """
    if match == "none":
        return 0.0
    of_luminance = observer_weights(grid)[:, 1]
    shares = of_luminance if match == "luminance" else inside / inside.sum()
    if match == "luminance" and images is not None:
        of_a, of_b = (_of_image(side, of_luminance) for side in images)
        return float(np.hypot(of_a, of_b))
    squares = 0.0
    for side, table in enumerate((pair.a, pair.b)):
        error = pair.error_of_sum(side, shares)
        if table is not None and error is not None:
            rows = slice(None) if match == "luminance" else [table.index(match)]
            amount = float(np.sum(table.radiance[rows] @ shares))
            squares += float(np.sum(error[rows] ** 2)) / amount**2 if amount > 0 else 0.0
    return float(np.sqrt(squares))


def _of_image(side: ImageSide, weights: Array) -> float:
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
