"""Images that are computed of others: at once, or rows by rows when they are used if they are large."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.dataset import VARIABLES, WAVELENGTH_ATTRS, make_dataset, plain_attrs, variable_attrs
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["computed"]

Array = NDArray[np.float32]

_LARGEST_KEPT = 2**30  # bytes of an image that is computed at once and kept in memory


def computed(
    variables: Mapping[str, Callable[[slice], Array]],
    size: tuple[int, int],
    wavelengths: Wavelengths,
    attrs: Mapping[str, Any],
    components: Sequence[str],
) -> xr.Dataset:
    """Make an image of functions that compute rows of it.

    Parameters
    ----------
    variables : mapping of str to callable
        Some of `VARIABLES`: each function takes a slice of rows y and returns them, with all components, float32. What
        they read must stay readable: an image of more than 1 GiB is not kept in memory, but computed whenever it is
        used. Rows asked for again right after that, for another component, are still there.
    size : (int, int)
        Width and height.
    wavelengths : Wavelengths
    attrs : mapping
    components : sequence of str

    Returns
    -------
    Dataset

    Examples
    --------
    >>> ramp = np.arange(4, dtype=np.float32).reshape(1, 4, 1, 1) + [0, 100]
    >>> grid = Wavelengths(500, 501, 1)
    >>> computed({"radiance": lambda rows: 10 * ramp[:, rows]}, (1, 4), grid, {}, ["total"]).radiance.values.shape
    (1, 4, 1, 2)
    """
    import xarray as xr

    sizes = {"component": len(components), "y": size[1], "x": size[0], "wavelength": len(wavelengths)}
    shapes = {name: tuple(sizes[dim] for dim in VARIABLES[name][1]) for name in variables}
    if sum(4 * int(np.prod(shape)) for shape in shapes.values()) <= _LARGEST_KEPT:
        arrays: dict[str, Any] = {name: rows(slice(0, size[1])) for name, rows in variables.items()}
        return make_dataset(wavelengths=wavelengths, attrs=attrs, components=components, **arrays)
    attrs = plain_attrs(attrs)
    coords = {
        "component": list(components),
        "wavelength": ("wavelength", wavelengths.values, WAVELENGTH_ATTRS),
    }
    lazy = {
        name: (VARIABLES[name][1], _lazy(shapes[name], rows), variable_attrs(name, attrs))
        for name, rows in variables.items()
    }
    return xr.Dataset(lazy, coords, attrs)


def _lazy(shape: tuple[int, ...], rows: Callable[[slice], Array]) -> Any:
    """An array as xarray has those of its files, of the last three dims y, x, wavelength."""
    from xarray.backends import BackendArray
    from xarray.core import indexing

    last: list[tuple[range, Array]] = []  # what was computed last

    def read(key: tuple[Any, ...]) -> Array:
        *of, y, x, band = key
        asked = range(shape[-3])[y : y + 1] if isinstance(y, int) else range(shape[-3])[y]
        known = [values for at, values in last if at == asked]
        if not known:
            runs = [asked] if asked.step == 1 else [range(row, row + 1) for row in asked]
            parts = [rows(slice(run.start, run.stop)) for run in runs]
            known = [parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-3)]
            last[:] = [(asked, known[0])]
        return np.asarray(known[0][(*of, 0 if isinstance(y, int) else slice(None), x, band)])

    class Rows(BackendArray):
        def __init__(self) -> None:
            self.shape, self.dtype = shape, np.dtype(np.float32)

        def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
            return indexing.explicit_indexing_adapter(key, shape, indexing.IndexingSupport.BASIC, read)

    return indexing.LazilyIndexedArray(Rows())
