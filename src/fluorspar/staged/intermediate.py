"""Intermediate images of the staged method, kept to be looked at."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.files.patient_file import PatientFile
from fluorspar.files.writing import replacing
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.emitters.patches import EmitterArray

__all__ = ["Intermediate", "file_names"]

Pixels = NDArray[np.float32]


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
    >>> kept = Intermediate(folder, Wavelengths())
    >>> kept.image("E_D red wall", np.ones((4, 4, 69)))
    >>> kept.finish_repeat()
    >>> kept.write({"scene": "cornell-box"})
    >>> sorted(path.name for path in folder.iterdir())
    ['E_D-red-wall.nc', 'E_D-red-wall.png']
    """

    def __init__(
        self, folder: str | Path | None, grid: Wavelengths, computed: Wavelengths | None = None
    ) -> None:
        self.folder, self.grid, self.computed = folder, grid, computed or grid
        self._taken: dict[str, Pixels] = {}
        self._sums: dict[str, tuple[int, Pixels, Pixels]] = {}
        if folder is not None:
            try:
                Path(folder).mkdir(parents=True, exist_ok=True)
            except OSError as err:
                raise ImageError(
                    message("the folder for intermediate images cannot be made", where=folder, got=err)
                ) from err

    def image(self, name: str, values: NDArray[np.floating]) -> None:
        """Take an image of a repeat, ndarray of shape (Y, X, N)."""
        if self.folder is not None:
            self._taken[name] = np.asarray(values[..., -len(self.grid) :], np.float32)

    def finish_repeat(self) -> None:
        """Count what was taken of a repeat; what is taken of one that is interrupted does not count."""
        for name, values in self._taken.items():
            count, mean, squares = self._sums.get(name, (0, np.zeros_like(values), np.zeros_like(values)))
            off = values - mean
            mean += off / (count + 1)
            squares += off * (values - mean)
            self._sums[name] = count + 1, mean, squares
        self._taken.clear()

    def write(self, attrs: Mapping[str, Any]) -> None:
        """Write the means of all repeats with their standard errors, as NetCDF and as pictures.

        Parameters
        ----------
        attrs : mapping
            What the whole image says of itself.
        """
        for name, (repeats, mean, squares) in self._sums.items():
            component = "luminescent_reflection" if name.startswith("emitters") else "direct_reflection"
            error = np.sqrt(squares / (repeats * (repeats - 1))) if repeats > 1 else None
            said = {**attrs, "intermediate": name, "repeats": repeats}
            kept = SpectralImage.from_arrays(mean[np.newaxis], self.grid, error, said, components=[component])
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
        shown = array.emitting
        dataset = xr.Dataset(
            {
                "illumination": (("patch", "wavelength"), light, unit | {"long_name": "E on the patch"}),
                "emission": (("patch", "wavelength"), emitted, unit | {"long_name": "L_F of the patch"}),
                "area": ("patch", array.areas),
                "centre": (("patch", "axis"), centre / array.areas[:, np.newaxis]),
                "corner": (("vertex", "axis"), shown.vertices, {"long_name": "corners of what emits"}),
                "face": (("triangle", "of_three"), shown.faces, {"long_name": "its triangles, by corners"}),
                "patch_of_face": ("triangle", array.patch_of_face),
            },
            {"wavelength": ("wavelength", self.computed.values, {"units": "nm"}), "axis": ["x", "y", "z"]},
            {"object": name.partition(" ")[2], "back": int(array.back)},
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
