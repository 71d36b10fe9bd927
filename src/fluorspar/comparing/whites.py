"""The white of CIELAB, and the exposure of pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.colour.xyz import lab_from_xyz, luminance, xyz_from_radiance
from fluorspar.comparing.sides import ImageSide
from fluorspar.errors import SpectrumError, message
from fluorspar.files.names import file_and_column
from fluorspar.image.dataset import add_up
from fluorspar.image.display.appearance import auto_exposure
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.spectral.illuminants import illuminant, illuminants
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["exposure_of", "has_colour", "lab_of", "white_of"]

Array = NDArray[np.float64]

_ROWS = 16
_EXPOSED = 2**18  # pixels that are enough for an exposure


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
    >>> from fluorspar.spectral.bands import Bands
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> exposure_of(ImageSide(image, Bands(image.wavelengths), None)) > 0
    True
    """
    dataset = side.image.dataset
    width, height = side.image.size
    lit = [name for name in side.components if name != "source"] or list(side.components)
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
    *,
    absolute: bool = True,
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
        Luminance of white in the pictures (CIE 1931), for images without points.
    absolute : bool
        Whether luminances are in cd/m2.

    Returns
    -------
    xyz : ndarray of shape (3,)
        In the scale of A, of the observer.
    sentence : str
        Which white it is, with its luminance, which is that of CIE 1931 whatever the observer.

    Raises
    ------
    SpectrumError
        If there is neither a point nor an illuminant of that name.

    Examples
    --------
    >>> from fluorspar.colour.xyz import CIE_1931
    >>> white_of(None, "E", "none", Wavelengths(360, 830, 5), CIE_1931, 100.0)[0].round(2)
    array([100.01, 100.  , 100.03])
    """
    point = white if white is not None and table is not None and white in table.names else None
    if white is None and match not in ("none", "luminance"):
        point = match
    if point is not None and table is not None:
        amount = _amount(float(luminance(table.at(point), grid)), absolute)
        xyz = xyz_from_radiance(table.at(point), grid, observer)
        return xyz, f"White of CIELAB, for both sides: point {point} of A{amount}."
    name = white or "D65"
    spectrum = _illuminant(name, table).on(grid, outside="hold")
    relative = xyz_from_radiance(spectrum, grid, observer)
    if table is not None:
        level = float(table.luminance().max())
        source = "the greatest luminance of the points of A"
        xyz = relative * ((float(table.luminance(observer).max()) or 1.0) / relative[1])
    else:
        level, source = pictured or 1.0, "the luminance of white in the pictures"
        xyz = relative * (level / float(luminance(spectrum, grid)))
    return xyz, f"White of CIELAB, for both sides: {name} at {source}{_amount(level, absolute)}."


def _amount(level: float, absolute: bool) -> str:
    return f", {level:.6g} cd/m2" if absolute else ""


def _illuminant(name: str, table: PointSpectra | None) -> Spectrum:
    try:
        return illuminant(name)
    except SpectrumError as err:
        if file_and_column(name)[0].is_file():
            raise
        points = f"a point ({', '.join(table.names)})" if table is not None else "no point, as there are none"
        fix = "" if table is not None else "give points (--points) to take a point as white"
        raise SpectrumError(
            message(
                "there is no such illuminant, and no such point",
                where="the white of CIELAB",
                got=repr(name),
                expected=f"{points}, or an illuminant ({', '.join(illuminants())})",
                fix=fix,
            )
        ) from err


def has_colour(white: Array) -> bool:
    """Whether CIELAB is defined with this white: not if X, Y or Z is 0, as Z is in bands of 680-700 nm.

    Examples
    --------
    >>> has_colour(np.array([95.0, 100.0, 0.0]))
    False
    """
    return bool((white > 0).all())


def lab_of(xyz: ArrayLike, white: Array) -> Array:
    """Return CIELAB as `lab_from_xyz` does; NaN if it cannot be computed with this white.

    Examples
    --------
    >>> lab_of([95.0, 100.0, 0.0], np.array([95.0, 100.0, 0.0]))
    array([nan, nan, nan])
    """
    if has_colour(white):
        return lab_from_xyz(xyz, white)
    return np.full(np.shape(xyz), np.nan)
