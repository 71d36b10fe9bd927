"""Matching the scales of two sides, and choosing the white and the exposure they are looked at with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message
from fluorspar.image.appearance import auto_exposure
from fluorspar.image.dataset import add_up
from fluorspar.measure.compare_images import mean_of_images
from fluorspar.measure.point_spectra import PointSpectra
from fluorspar.measure.sides import ImageSide
from fluorspar.spectral.colour import CIE_1931, luminance, white_xyz, xyz_from_radiance
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Pair", "exposure_of", "matched_scale", "scale_error_of", "white_of"]

Array = NDArray[np.float64]

_ROWS = 16
_EXPOSED = 2**18  # pixels that are enough for an exposure


@dataclass(frozen=True)
class Pair:
    """Spectra of the same points on the common bands; None if there are no points."""

    a: PointSpectra | None
    b: PointSpectra | None


def matched_scale(
    pair: Pair,
    images: tuple[ImageSide, ImageSide] | None,
    grid: Wavelengths,
    inside: NDArray[np.bool_],
    match: str,
    observer: str = CIE_1931,
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
    match, observer : str
        As in `compare`.

    Returns
    -------
    scale, mean_a, mean_b : float
        What B is multiplied with, and what A and B are divided by for RMSE.
    sentence : str
        What was done.

    Raises
    ------
    OptionError
        If a point is not known, or what is to be matched is 0.

    Examples
    --------
    >>> from fluorspar.measure.bands import Bands
    >>> grid = Wavelengths(400, 700, 100)
    >>> a, b = (PointSpectra(("1",), Bands(grid), np.full((1, 4), value)) for value in (2.0, 4.0))
    >>> matched_scale(Pair(a, b), None, grid, np.ones(4, bool), "1", CIE_1931)[:3]
    (0.5, 2.0, 4.0)
    """
    if match not in ("none", "luminance"):
        if pair.a is None or pair.b is None:
            raise OptionError(
                message(
                    "the scales cannot be matched at a point without points",
                    got=match,
                    fix="give a points file (--points)",
                )
            )
        mean_a, mean_b = (float(table.at(match)[inside].mean()) for table in (pair.a, pair.b))
        said = f"Scale: each side is divided by its own mean over these bands at point {match} (Eq. 14)"
    else:
        if images is not None:
            spectra = mean_of_images(*images)
            over = "pixels"
        elif pair.a is not None and pair.b is not None:
            spectra = pair.a.radiance.mean(axis=0), pair.b.radiance.mean(axis=0)
            over = "points"
        mean_a = mean_b = float(spectra[0][inside].mean())
        if match == "luminance":
            luminances = [float(luminance(spectrum, grid, observer)) for spectrum in spectra]
            if not min(luminances) > 0:
                raise OptionError(
                    message("the scales cannot be matched", got=f"average luminances {luminances}")
                )
            mean_b = mean_a * luminances[1] / luminances[0]
            said = f"Scale: B is matched to A by the average luminance of the {over}"
        else:
            said = "Scale: compared as they are"
        said += f"; for RMSE both are divided by the mean of A over the {over} and these bands"
    if not (mean_a > 0 and mean_b > 0):
        raise OptionError(
            message(
                "spectra cannot be normalised",
                got=f"means {mean_a:g} and {mean_b:g}",
                expected="positive numbers",
            )
        )
    scale = mean_a / mean_b
    return scale, mean_a, mean_b, f"{said}: {mean_a:.6g} and {mean_b:.6g}, so B counts {scale:.6g} times."


def scale_error_of(pair: Pair, inside: NDArray[np.bool_], match: str) -> float:
    """Return the relative standard error of the factor that matches the scales at a point.

    Parameters
    ----------
    pair : Pair
    inside : ndarray of shape (T,)
        The bands of RMSE; their errors count as fully correlated.
    match : str
        As in `compare`; only a point has an error.

    Examples
    --------
    >>> from fluorspar.measure.bands import Bands
    >>> ones = np.ones((1, 4))
    >>> noisy = PointSpectra(("1",), Bands(Wavelengths(400, 700, 100)), ones, 0.03 * ones)
    >>> scale_error_of(Pair(noisy, noisy), np.ones(4, bool), "1").__round__(4)
    0.0424
    """
    if match in ("none", "luminance"):
        return 0.0
    squares = 0.0
    for table in (pair.a, pair.b):
        if table is not None and table.standard_error is not None:
            error = table.standard_error[table.index(match)][inside].mean()
            squares += float(error / table.at(match)[inside].mean()) ** 2
    return float(np.sqrt(squares))


def exposure_of(side: ImageSide) -> float:
    """Return the exposure of the pictures: that of A without visible lamps, as `SpectralImage.srgb` has it.

    Parameters
    ----------
    side : ImageSide

    Returns
    -------
    float
        Factor on luminance, m2/cd.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.measure.bands import Bands
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> exposure_of(ImageSide(image, Bands(image.wavelengths), None)) > 0
    True
    """
    dataset = side.image.dataset
    width, height = side.image.size
    lit = [name for name in side.chosen if name != "source"] or list(side.chosen)
    every = -(-width * height // _EXPOSED)  # of a large image, evenly spaced blocks of rows
    xyz = [
        xyz_from_radiance(add_up(dataset, lit, slice(first, first + _ROWS)), side.image.wavelengths).reshape(
            -1, 3
        )
        for first in range(0, height, _ROWS * every)
    ]
    return auto_exposure(np.concatenate(xyz))


def white_of(
    table: PointSpectra | None,
    white: str | None,
    match: str,
    grid: Wavelengths,
    observer: str,
    pictured: float | None,
) -> tuple[Array, str]:
    """Choose the white of CIELAB.

    Parameters
    ----------
    table : PointSpectra or None
        The points of A.
    white, match, observer : str
        As in `compare`.
    grid : Wavelengths
    pictured : float or None
        Luminance of white in the pictures, cd/m2, for images without points.

    Returns
    -------
    xyz : ndarray of shape (3,)
        In the scale of A.
    sentence : str
        Which white it is.

    Raises
    ------
    SpectrumError
        If there is neither a point nor an illuminant of that name.

    Examples
    --------
    >>> white_of(None, "E", "none", Wavelengths(360, 830, 5), CIE_1931, 100.0)[0].round(2)
    array([100.01, 100.  , 100.03])
    """
    point = white if white is not None and table is not None and white in table.names else None
    if white is None and match not in ("none", "luminance"):
        point = match
    if point is not None and table is not None:
        xyz = xyz_from_radiance(table.at(point), grid, observer)
        return xyz, f"White of CIELAB, for both sides: point {point} of A, {xyz[1]:.6g} cd/m2."
    name = white or "D65"
    relative = white_xyz(illuminant(name).on(grid, outside="hold"), grid, observer)
    if table is not None:
        level, source = float(table.luminance(observer).max()), "the greatest luminance of the points of A"
    elif pictured is not None:
        level, source = pictured, "the luminance of white in the pictures"
    xyz = relative * (level / relative[1])
    return xyz, f"White of CIELAB, for both sides: {name} at {source}, {level:.6g} cd/m2."
