"""How a spectral image lies in a Zarr store: format 3, laid out as xarray expects it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fluorspar.image.dataset import (
    DIMS,
    VARIABLES,
    WAVELENGTH_ATTRS,
    decoded_attrs,
    plain_attrs,
    variable_attrs,
)
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    from collections.abc import Iterator

    import zarr

__all__ = ["chunk_shape", "create", "describe", "is_store", "opened", "put", "unfinished_store"]

_CHUNK_BYTES = 2 * 2**20
_CHUNK_ROWS = 16  # few, since renders come row by row, and whole chunks are written


def is_store(folder: Path) -> bool:
    """Whether a folder is a Zarr store that holds nothing but a spectral image, or is empty."""
    inside = list(folder.iterdir())
    is_group = any((folder / name).is_file() for name in ("zarr.json", ".zgroup"))
    arrays = {path.name for path in inside if path.is_dir()}
    return not inside or (is_group and arrays <= {*VARIABLES, *DIMS})


def chunk_shape(height: int, width: int, bands: int) -> tuple[int, int]:
    """Rows and columns of a chunk of one component with all wavelengths: about 2 MB, hardly any padding at the side.

    Examples
    --------
    >>> chunk_shape(height=2048, width=2048, bands=69)
    (16, 410)
    """
    rows = min(_CHUNK_ROWS, height)
    columns = max(_CHUNK_BYTES // (4 * rows * bands), 1)
    return rows, -(-width // -(-width // columns))


def create(
    folder: Path,
    wavelengths: Wavelengths,
    components: Sequence[str],
    height: int,
    width: int,
    variables: Sequence[str],
    attrs: Mapping[str, Any],
) -> zarr.Group:
    """Lay out a store without pixels: what is never written reads as NaN and takes no space.

    Parameters
    ----------
    folder : Path
        Empty.
    wavelengths : Wavelengths
    components : sequence of str
    height, width : int
    variables : sequence of str
        Some of `VARIABLES`.
    attrs : mapping
        Attributes of the image.

    Returns
    -------
    zarr.Group
    """
    import zarr
    from zarr.codecs import BloscCodec

    group = zarr.create_group(folder, zarr_format=3)
    names = group.create_array(
        "component", shape=(len(components),), dtype=str, compressors=None, dimension_names=("component",)
    )
    names[...] = np.array(components, object)
    group.create_array(
        "wavelength",
        data=wavelengths.values,
        compressors=None,
        dimension_names=("wavelength",),
        attributes=WAVELENGTH_ATTRS,
    )
    sizes = dict(zip(DIMS, (len(components), height, width, len(wavelengths)), strict=True))
    rows, columns = chunk_shape(height, width, len(wavelengths))
    # one component a chunk, so that a component can be read without the others
    extents = {**sizes, "component": 1, "y": rows, "x": columns}
    for name in variables:
        dims = VARIABLES[name][1]
        group.create_array(
            name,
            shape=tuple(sizes[dim] for dim in dims),
            chunks=tuple(extents[dim] for dim in dims),
            dtype="float32",
            fill_value=np.nan,
            compressors=BloscCodec(cname="zstd", clevel=1, shuffle="shuffle", typesize=4),
            dimension_names=dims,
            attributes=variable_attrs(name, attrs),
        )
    describe(group, attrs)
    return group


def describe(group: zarr.Group, attrs: Mapping[str, Any]) -> None:
    """Replace the attributes of an image, and gather those of all arrays in one place, where readers look first."""
    import zarr

    group.attrs.put(plain_attrs(attrs))
    with _format_3():
        zarr.consolidate_metadata(group.store, zarr_format=3)


def opened(folder: Path) -> zarr.Group:
    """Open a store to change it."""
    import zarr

    return zarr.open_group(folder, mode="r+", zarr_format=3)


def unfinished_store(
    folder: Path, label: Mapping[str, str], shapes: Mapping[str, tuple[int, ...]]
) -> zarr.Group | None:
    """Open a store of `create` that was not finished, to be gone on with; None if it is another one, or none is there.

    Parameters
    ----------
    folder : Path
    label : mapping
        Attribute `fingerprint` that it must have.
    shapes : mapping of str to tuple of int
        Those of its variables.
    """
    try:
        group = opened(folder)
    except (OSError, ValueError):  # there is none, or of another format
        return None
    attrs = decoded_attrs(dict(group.attrs))
    height, width, bands = shapes["radiance"][1:]
    chunks = (1, *chunk_shape(height, width, bands), bands)
    is_it = (
        attrs.get("partial") == 1
        and attrs.get("fingerprint") == label
        and {name: array.shape for name, array in group.arrays() if name in VARIABLES} == shapes
        and all(group[name].chunks == chunks[-group[name].ndim :] for name in shapes)
    )
    return group if is_it else None


def put(array: zarr.Array[Any], component: int | None, row: int, values: np.ndarray[Any, Any]) -> None:
    """Write whole rows of chunks, one chunk at a time: after an error nothing is still being written.

    Parameters
    ----------
    array : zarr.Array
    component : int or None
        None: of an array without components.
    row : int
        The first row, that of a chunk.
    values : ndarray of shape (rows, X, N)
    """
    of = () if component is None else (component,)
    down, across = array.chunks[-3:-1]
    for y in range(0, len(values), down):
        for x in range(0, values.shape[1], across):
            part = values[y : y + down, x : x + across]
            array[(*of, slice(row + y, row + y + part.shape[0]), slice(x, x + part.shape[1]))] = part


@contextmanager
def _format_3() -> Iterator[None]:
    """Zarr warns that gathered metadata are not yet part of its standard; who does not know them, ignores them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
