"""PNG pictures of a spectral image: the total, its components, and a labelled sheet of all of them."""

from __future__ import annotations

import io
import os
import struct
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.errors import ImageError, message
from fluorspar.files.writing import replacing
from fluorspar.image.components import TOTAL, definition, select
from fluorspar.image.dataset import decoded_attrs, grid_of, names_of
from fluorspar.image.display.appearance import appearance, auto_exposure, show, xyz_of
from fluorspar.image.display.tiles import Tile, draw_tiles
from fluorspar.image.units import is_radiance

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "contact_sheet",
    "png_bytes",
    "rounded",
    "thumbnail",
    "write_pictures",
    "write_png",
]

_COLUMNS = 4
_NOTED = ("study_row", "version")  # attributes of an image of a study that are noted in its picture


def write_png(
    dataset: xr.Dataset,
    path: str | os.PathLike[str],
    component: str | Iterable[str] | None = None,
    exposure: float | None = None,
    *,
    white: str | ArrayLike | None = None,
) -> float:
    """Write a picture of an image or of some of its components.

    Parameters
    ----------
    dataset : Dataset
        Of a `SpectralImage`.
    path : str or path-like
        The file to be written or replaced.
    component : str or iterable of str, optional
        As in `SpectralImage.srgb`.
    exposure : float, optional
        As in `SpectralImage.srgb`.
    white : str or array_like of shape (3,), optional
        As in `SpectralImage.srgb`.

    Returns
    -------
    float
        The exposure, m2/cd.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar import SpectralImage
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> path = Path(tempfile.mkdtemp()) / "reflected.png"
    >>> write_png(image.dataset, path, "reflected", exposure=0.001)
    0.001
    """
    with replacing(path) as temporary:
        shown = appearance(dataset, select(component, names_of(dataset)), exposure, white=white)
        as_it_is = component is None and exposure is None and white is None
        noted = _NOTED if as_it_is and _NOTED[0] in dataset.attrs else ()
        texts = {name: str(dataset.attrs.get(name)) for name in noted}
        temporary.write_bytes(png_bytes(shown.bytes, texts=texts))
    return shown.exposure


def png_bytes(rgb: NDArray[np.uint8], effort: int = -1, *, texts: Mapping[str, str] | None = None) -> bytes:
    """Encode sRGB, an ndarray of shape (Y, X, 3), as PNG with the sRGB profile.

    The effort is that of packing, from 0 to 9, or -1 for the usual one; `texts` are noted in the file.

    Examples
    --------
    >>> png_bytes(np.zeros((4, 6, 3), np.uint8))[1:4]
    b'PNG'
    """
    from PIL import Image, PngImagePlugin

    stream, info = io.BytesIO(), PngImagePlugin.PngInfo()
    for name, text in (texts or {}).items():
        info.add_text(name, text)
    Image.fromarray(rgb).save(stream, "PNG", icc_profile=_srgb_profile(), compress_level=effort, pnginfo=info)
    return stream.getvalue()


@cache
def _srgb_profile() -> bytes:
    """The sRGB profile of Little CMS, with a fixed date, so that equal pictures are equal files."""
    from PIL import ImageCms

    profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    profile[24:36] = struct.pack(">6H", 2000, 1, 1, 0, 0, 0)
    profile[84:100] = bytes(16)  # the checksum of the profile: 0 is "not computed"
    return bytes(profile)


def thumbnail(dataset: xr.Dataset, longest: int = 512) -> NDArray[np.uint8]:
    """A small picture of the total, ndarray of shape (y, x, 3).

    Examples
    --------
    >>> from fluorspar import SpectralImage
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> thumbnail(SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths()).dataset).shape
    (4, 6, 3)
    """
    from PIL import Image

    # so that the spectra of a large image are not all read
    every = -(-max(dataset.sizes["x"], dataset.sizes["y"]) // (2 * longest))
    dataset = dataset.isel(x=slice(None, None, every), y=slice(None, None, every))
    picture = Image.fromarray(appearance(dataset, names_of(dataset)).bytes)
    picture.thumbnail((longest, longest))
    return np.asarray(picture)


def write_pictures(
    dataset: xr.Dataset, directory: str | os.PathLike[str], exposure: float | str | None = None
) -> list[Path]:
    """Write `total.png`, a PNG for every component, and the labelled sheet `components.png`.

    Each picture has the exposure that the sheet states for it.

    Parameters
    ----------
    dataset : Dataset
        Of a `SpectralImage`.
    directory : str or path-like
        Created if it does not exist.
    exposure : float or str, optional
        One for all pictures, m2/cd; or `"same"`, that of the total. Default: each component has its own.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ImageError
        If the directory cannot be made or a file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar import SpectralImage
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> len(write_pictures(image.dataset, tempfile.mkdtemp()))
    9
    """
    directory = Path(directory)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as err:
        raise ImageError(
            message("the directory for the pictures cannot be made", where=directory, got=err)
        ) from err
    tiles = _tiles(dataset, exposure)
    pictures = {tile.name: tile.picture for tile in tiles} | {"components": _sheet(dataset, tiles)}
    paths = [directory / f"{name}.png" for name in pictures]
    for path, picture in zip(paths, pictures.values(), strict=True):
        with replacing(path) as temporary:
            temporary.write_bytes(png_bytes(picture))
    return paths


def contact_sheet(dataset: xr.Dataset, exposure: float | str | None = None) -> NDArray[np.uint8]:
    """Show the total and every component on one labelled sheet.

    Components differ by orders of magnitude, so by default each is shown with an exposure of its own, which its label
    states: a power of two times that of the total.

    Parameters
    ----------
    dataset : Dataset
        Of a `SpectralImage`.
    exposure : float or str, optional
        As in `write_pictures`.

    Returns
    -------
    ndarray of shape (y, x, 3)
        uint8.

    Examples
    --------
    >>> from fluorspar import SpectralImage
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> contact_sheet(image.dataset).ndim
    3
    """
    return _sheet(dataset, _tiles(dataset, exposure))


def _tiles(dataset: xr.Dataset, exposure: float | str | None = None) -> list[Tile]:
    """The pictures of the sheet with their labels, the total first."""
    xyz = {name: xyz_of(dataset, [name]) for name in names_of(dataset)}
    lit = sum((values for name, values in xyz.items() if name != "source"), np.zeros((1, 1, 3)))
    reference = auto_exposure(lit) if exposure is None or isinstance(exposure, str) else exposure
    total = lit + xyz.get("source", 0.0)
    whole = np.nansum(total[..., 1])
    unit = " cd/m²" if is_radiance(dataset.attrs) else ", relative"
    tiles = [Tile("total", "Total", f"white is {rounded(1 / reference)}{unit}", show(total, reference).bytes)]
    for name, values in xyz.items():
        if name == TOTAL:
            continue  # an image that is not split
        share = np.nansum(values[..., 1]) / whole if whole else 0.0
        own = exposure is None and share > 0
        factor = float(2.0 ** np.floor(np.log2(auto_exposure(values) / reference))) if own else 1.0
        times = f"× {factor:g}" if factor >= 1 else f"× 1/{1 / factor:g}"
        note = f"exposure {times},  {rounded(100 * share)} % of the luminance" if share > 0 else "no light"
        label = f"{definition(name).number}  {name.replace('_', ' ')}"
        tiles.append(Tile(name, label, note, show(values, factor * reference).bytes))
    return tiles


def rounded(value: float) -> str:
    """Three digits without an exponent, if that is short.

    Examples
    --------
    >>> rounded(0.12345), rounded(1234.5)
    ('0.123', '1230')
    """
    return f"{float(f'{value:.3g}'):g}"


def _sheet(dataset: xr.Dataset, tiles: list[Tile]) -> NDArray[np.uint8]:
    return draw_tiles(tiles, _title(dataset), _COLUMNS)


def _title(dataset: xr.Dataset) -> str:
    attrs: dict[str, Any] = decoded_attrs(dataset.attrs)
    width, height = dataset.sizes["x"], dataset.sizes["y"]
    facts = [str(attrs.get("scene", "")), f"{width} × {height}", f"{grid_of(dataset)}"]
    if "spp" in attrs:
        facts.append(f"{attrs['spp']} samples per pixel")
    if attrs.get("partial"):
        facts.append("unfinished")
    return "   ·   ".join(filter(None, facts))
