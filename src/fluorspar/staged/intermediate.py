"""Intermediate images of the staged method, kept to be looked at."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain, count
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.files.patient_file import PatientFile
from fluorspar.files.writing import replacing
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.emitters.patches import EmitterArray

__all__ = ["Intermediate", "file_names"]


class Intermediate:
    """Writes intermediate images into a folder, or does nothing without one.

    Parameters
    ----------
    folder : Path, optional
        Made if it does not exist.
    grid : Wavelengths
        Wavelengths of the images.
    computed : Wavelengths, optional
        Those of what is given to it, if they begin earlier; also of patches.

    Raises
    ------
    ImageError
        If the folder cannot be made.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> Intermediate(folder, Wavelengths()).image("E_D red wall", np.ones((4, 4, 69)))
    >>> sorted(path.name for path in folder.iterdir())
    ['E_D-red-wall.nc', 'E_D-red-wall.png']
    """

    def __init__(
        self, folder: str | Path | None, grid: Wavelengths, computed: Wavelengths | None = None
    ) -> None:
        self.folder, self.grid, self.computed = folder, grid, computed or grid
        if folder is not None:
            try:
                Path(folder).mkdir(parents=True, exist_ok=True)
            except OSError as err:
                raise ImageError(
                    message("the folder for intermediate images cannot be made", where=folder, got=err)
                ) from err

    def image(self, name: str, values: NDArray[np.floating]) -> None:
        """Write an image, ndarray of shape (Y, X, N), as NetCDF and as a picture."""
        if self.folder is None:
            return
        component = "luminescent_reflection" if name.startswith("emitters") else "direct_reflection"
        kept = SpectralImage.from_arrays(
            values[np.newaxis, ..., -len(self.grid) :],
            self.grid,
            attrs={"intermediate": name},
            components=[component],
        )
        for suffix in (".nc", ".png"):
            kept.save(self._path(name, suffix))

    def patches(
        self, name: str, array: EmitterArray, light: NDArray[np.floating], emitted: NDArray[np.floating]
    ) -> None:
        """Write what the patches of an object receive and emit, ndarrays of shape (K, N)."""
        if self.folder is None:
            return
        import h5netcdf
        import xarray as xr
        from xarray.backends import H5NetCDFStore

        path = self._path(name, ".nc")
        areas = array.mesh.areas
        weighted = array.mesh.centroids * areas[:, np.newaxis]
        centre = np.stack(
            [np.bincount(array.patch, part, minlength=len(array)) for part in weighted.T], axis=1
        )
        unit = {"units": "W m-2 sr-1 nm-1"}
        dataset = xr.Dataset(
            {
                "illumination": (("patch", "wavelength"), light, unit | {"long_name": "E on the patch"}),
                "emission": (("patch", "wavelength"), emitted, unit | {"long_name": "L_F of the patch"}),
                "area": ("patch", array.areas),
                "centre": (("patch", "axis"), centre / array.areas[:, np.newaxis]),
            },
            {"wavelength": ("wavelength", self.computed.values, {"units": "nm"}), "axis": ["x", "y", "z"]},
        )
        with (
            replacing(path) as temporary,
            PatientFile(temporary) as stream,
        ):  # HDF5 cannot lock what is locked here
            with h5netcdf.File(stream, "w") as file:
                dataset.dump_to_store(H5NetCDFStore(file))
            stream.check()

    def _path(self, name: str, suffix: str) -> Path:
        assert self.folder is not None
        return Path(self.folder) / (_plain(name) + suffix)


def file_names(names: Sequence[str]) -> list[str]:
    """Distinct parts of file names for names that may be alike.

    Examples
    --------
    >>> file_names(["red paint", "wall", "red/paint"])
    ['red-paint', 'wall', 'red-paint-2']
    """
    distinct: list[str] = []
    for name in map(_plain, names):
        numbered = (f"{name}-{number}" for number in count(2))
        distinct.append(next(part for part in chain([name], numbered) if part not in distinct))
    return distinct


def _plain(name: str) -> str:
    """The characters of a name that any file name may have."""
    return re.sub(r"[^\w.]+", "-", name).strip("-")
