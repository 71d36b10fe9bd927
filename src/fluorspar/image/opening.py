"""Opening an image file."""

from __future__ import annotations

import os

from fluorspar.image.spectral_image import SpectralImage

__all__ = ["open"]


def open(path: str | os.PathLike[str]) -> SpectralImage:
    """Open an image file, as `SpectralImage.open` does: NetCDF, Zarr, spectral EXR or ENVI.

    Parameters
    ----------
    path : str or path-like

    Raises
    ------
    ImageError
        If the file is missing, truncated, of another kind, or not a spectral image.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> path = os.path.join(tempfile.mkdtemp(), "room.nc")
    >>> SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths()).save(path)
    >>> open(path).size
    (6, 4)
    """
    return SpectralImage.open(path)
