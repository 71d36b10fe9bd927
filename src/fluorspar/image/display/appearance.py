"""What a spectral image looks like: XYZ, exposure and sRGB, computed block of rows by block of rows."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.colour.adaptation import adapt_to_d65
from fluorspar.colour.xyz import CIE_1931, srgb_from_xyz, white_xyz, xyz_from_radiance
from fluorspar.errors import OptionError, message
from fluorspar.image.dataset import add_up, grid_of, row_blocks
from fluorspar.image.units import is_radiance
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Appearance", "appearance", "auto_exposure", "linear_srgb", "show", "xyz_of"]

_LOG = logging.getLogger(__name__)
_WHITE_PERCENTILE = 99.0
_AT_ONCE = 2**21  # numbers


@dataclass(frozen=True)
class Appearance:
    """An image as a display shows it.

    Parameters
    ----------
    rgb : ndarray of shape (Y, X, 3)
        sRGB with its transfer curve, float32 from 0 to 1; NaN where nothing was rendered.
    exposure : float
        Factor on luminance: `1 / exposure` cd/m2 is shown as white.
    out_of_gamut : float
        Share of the pixels, from 0 to 1, that sRGB cannot show as they are: they are shown less saturated, or
        white.
    """

    rgb: NDArray[np.float32]
    exposure: float
    out_of_gamut: float

    @property
    def bytes(self) -> NDArray[np.uint8]:
        """The picture in 8 bits, ndarray of shape (Y, X, 3); dark grey where nothing was rendered."""
        return np.concatenate(
            [np.asarray(np.nan_to_num(part, nan=0.2) * 255 + 0.5, np.uint8) for part in _parts(self.rgb)]
        )


def xyz_of(dataset: xr.Dataset, components: Sequence[str], observer: str = CIE_1931) -> NDArray[np.float64]:
    """Tristimulus values of a sum of components.

    Parameters
    ----------
    dataset : Dataset
        A spectral image, in memory or in a file.
    components : sequence of str
        The components to be added.
    observer : str
        See `fluorspar.colour.observers.observer_named`.

    Returns
    -------
    ndarray of shape (Y, X, 3)
        XYZ, Y in cd/m2 for CIE 1931, summed over the wavelengths of the image.

    Examples
    --------
    >>> from fluorspar.image.dataset import make_dataset
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> dataset = make_dataset(np.ones((7, 4, 3, 69)), Wavelengths())
    >>> xyz_of(dataset, ["source"]).shape
    (4, 3, 3)
    """
    grid = grid_of(dataset)
    blocks = row_blocks(dataset)  # refuses what is too large
    xyz = np.empty((dataset.sizes["y"], dataset.sizes["x"], 3))
    for rows in blocks:
        xyz[rows] = xyz_from_radiance(add_up(dataset, components, rows), grid, observer)
    return xyz


def auto_exposure(xyz: NDArray[np.floating]) -> float:
    """Choose an exposure that shows colours and clips little.

    The brightest of the linear R, G, B of a pixel is to be 1 at the 99th percentile of all pixels that are
    not black. A luminance of 1 at that percentile would turn the saturated colours of luminescence white.

    Parameters
    ----------
    xyz : ndarray of shape (..., 3)
        Y in cd/m2, best without lamps that are seen directly, which may well be clipped. NaN is left out.

    Returns
    -------
    float
        Factor on luminance in m2/cd; 1 if all is black.

    Examples
    --------
    >>> round(1 / auto_exposure(np.full((4, 4, 3), 200.0) * [0.9505, 1.0, 1.089]))  # white of 200 cd/m2
    200
    """
    lit = xyz[np.isfinite(xyz).all(axis=-1) & (xyz[..., 1] > 0)]
    if not lit.size:
        return 1.0
    dim = 1e-3 / float(lit[:, 1].max())  # dark enough that nothing is brighter than white
    brightest = [linear_srgb(srgb_from_xyz(part, dim)[0]).max(axis=-1) for part in _parts(lit)]
    white = float(np.percentile(np.concatenate(brightest), _WHITE_PERCENTILE))
    return dim / white


def _parts(values: NDArray[np.floating]) -> Iterator[NDArray[np.floating]]:
    """Parts of an array, for what takes several times its memory."""
    count = max(_AT_ONCE * len(values) // max(values.size, 1), 1)
    for first in range(0, len(values), count):
        yield values[first : first + count]


def linear_srgb(rgb: NDArray[np.floating]) -> NDArray[np.floating]:
    """Undo the transfer curve of sRGB (IEC 61966-2-1), for values from 0 to 1 of any shape.

    Examples
    --------
    >>> linear_srgb(np.array([0.0, 0.5, 1.0])).round(3)
    array([0.   , 0.214, 1.   ])
    """
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def show(xyz: NDArray[np.floating], exposure: float) -> Appearance:
    """Show tristimulus values in sRGB.

    Parameters
    ----------
    xyz : ndarray of shape (Y, X, 3)
        Y in cd/m2; NaN where nothing was rendered.
    exposure : float
        Factor on luminance in m2/cd.

    Returns
    -------
    Appearance

    Raises
    ------
    OptionError
        If the exposure is not a positive number.

    Examples
    --------
    >>> show(np.full((1, 1, 3), 200.0) * [0.9505, 1.0, 1.089], exposure=1 / 200).bytes
    array([[[255, 255, 255]]], dtype=uint8)
    """
    rgb, changed = np.empty(xyz.shape, np.float32), 0.0
    done = 0
    for part in _parts(xyz):
        missing = ~np.isfinite(part).all(axis=-1)
        encoded, out_of_gamut = srgb_from_xyz(np.where(missing[..., np.newaxis], 0.0, part), exposure)
        encoded[missing] = np.nan
        rgb[done : done + len(part)] = encoded
        done, changed = done + len(part), changed + out_of_gamut * len(part)
    return Appearance(rgb, float(exposure), changed / max(done, 1))


def appearance(
    dataset: xr.Dataset,
    components: Sequence[str],
    exposure: float | None = None,
    *,
    white: str | ArrayLike | None = None,
) -> Appearance:
    """Show a sum of components in sRGB.

    Parameters
    ----------
    dataset : Dataset
        A spectral image, in memory or in a file.
    components : sequence of str
        The components to be added.
    exposure : float, optional
        Factor on luminance in m2/cd. By default that of `auto_exposure`, for everything but `source`; give
        the same number for pictures that are to be compared.
    white : str or array_like of shape (3,), optional
        The white that becomes that of the display: an illuminant, or XYZ of any scale (linear Bradford
        transform). Default: no adaptation.

    Returns
    -------
    Appearance

    Raises
    ------
    OptionError
        If the exposure is not a positive number, or the white is not three of them.
    SpectrumError
        If there is no such illuminant.

    Examples
    --------
    >>> from fluorspar.image.dataset import make_dataset
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> dataset = make_dataset(np.ones((7, 4, 3, 69)), Wavelengths())
    >>> shown = appearance(dataset, ["direct_reflection"], exposure=1e-5)
    >>> shown.rgb.shape, shown.exposure
    ((4, 3, 3), 1e-05)
    """
    lit = [name for name in components if name != "source"] or components
    xyz = _adapted(dataset, lit, white)
    if exposure is None:
        exposure = auto_exposure(xyz)
    if len(lit) < len(components):
        xyz += _adapted(dataset, ["source"], white)
    shown = show(xyz, exposure)
    _LOG.info(
        "exposure %.4g (white is %.4g%s); sRGB cannot show %.2g %% of the pixels as they are",
        shown.exposure,
        1 / shown.exposure,
        " cd/m2" if is_radiance(dataset.attrs) else "",
        100 * shown.out_of_gamut,
    )
    return shown


def _adapted(
    dataset: xr.Dataset, components: Sequence[str], white: str | ArrayLike | None
) -> NDArray[np.float64]:
    xyz = xyz_of(dataset, components)
    return xyz if white is None else adapt_to_d65(xyz, _white(white, grid_of(dataset)))


def _white(white: str | ArrayLike, grid: Wavelengths) -> NDArray[np.float64]:
    if isinstance(white, str):
        return white_xyz(illuminant(white).on(grid, outside="hold"), grid)
    xyz = np.asarray(white, dtype=np.float64)
    if xyz.shape != (3,) or not (np.isfinite(xyz).all() and (xyz > 0).all()):
        expected = "an illuminant, or three positive numbers X, Y, Z"
        raise OptionError(message("a white is impossible", got=white, expected=expected))
    return xyz
