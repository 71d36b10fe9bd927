"""Spectral images as multi-part OpenEXR files.

The layout is that of A. Fichet, R. Pacanowski, A. Wilkie, "An OpenEXR Layout for Spectral Images", JCGT
10(3), 2021: one channel a wavelength, named `S0.550,000000nm`, or `T.550,000000nm` in an image of reflectance.
Part `total` comes first, with an R, G, B preview; then one part for each component, and `standard_error`. Any
program that knows the layout reads the total.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, SpectrumError, message
from fluorspar.files.memory import check_memory
from fluorspar.files.names import check_source, encodable
from fluorspar.files.writing import check_target, replacing
from fluorspar.image.components import COMPONENTS, TOTAL
from fluorspar.image.dataset import (
    VARIABLES,
    add_up,
    grid_of,
    make_dataset,
    names_of,
    plain_attrs,
    row_blocks,
    values_of,
)
from fluorspar.image.display.appearance import appearance, linear_srgb
from fluorspar.image.formats.exr_units import channel_kind, emissive_units
from fluorspar.image.formats.foreign_exr import foreign_dataset, stated_already
from fluorspar.spectral.uneven import UnevenWavelengths, grid_through
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["channel_name", "read_exr", "write_exr"]

_LAYOUT_VERSION = "1.0"
_ATTRIBUTE = "fluorspar"
_MAGIC = b"\x76\x2f\x31\x01"
_LARGEST_KEPT = 2**30  # bytes of planes that are gathered in memory
_ROWS = 16  # rows transposed at a time: what fits into the cache


def channel_name(wavelength: float, kind: str = "S0") -> str:
    """Name the channel of a wavelength in nm, with a decimal comma since OpenEXR splits names at points.

    Examples
    --------
    >>> channel_name(550), channel_name(302.5, "T")
    ('S0.550,000000nm', 'T.302,500000nm')
    """
    return f"{kind}." + f"{wavelength:.6f}".replace(".", ",") + "nm"


def write_exr(dataset: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a spectral image to a multi-part spectral EXR file, without loss.

    Parameters
    ----------
    dataset : Dataset
        A spectral image. It is held in memory a second time while it is written; for images larger than that,
        use NetCDF.
    path : str or path-like
        The file to be written or replaced.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Notes
    -----
    The preview is linear sRGB at the automatic exposure, whose logarithm to base 2 is the attribute `EV`.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "room.exr"
    >>> write_exr(make_dataset(np.ones((7, 4, 3, 69)), Wavelengths(), attrs={"spp": 16}), path)
    >>> read_exr(path).attrs["spp"]
    16
    """
    import OpenEXR

    path = check_target(path)  # before the work, not after it
    grid = grid_of(dataset)
    described = {
        "attrs": plain_attrs(dataset.attrs),
        **_noted(grid),
        "parts": [TOTAL] * (names_of(dataset) == (TOTAL,)) + [name for name, _, _ in _parts(dataset)],
    }
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "spectralLayoutVersion": _LAYOUT_VERSION,
        **emissive_units(dataset.attrs),
    }
    kind = channel_kind(dataset.attrs)
    preview, exposure = _preview(dataset)
    first = {**header, "EV": float(np.log2(exposure)), _ATTRIBUTE: json.dumps(described, ensure_ascii=False)}
    names = [channel_name(wavelength, kind) for wavelength in grid.values]
    layers = [(TOTAL, "", None), *_parts(dataset)]
    height, width = dataset.sizes["y"], dataset.sizes["x"]
    with replacing(path) as temporary:
        planes = _room((len(layers), len(grid), height, width), path.parent)
        for rows in row_blocks(dataset):
            for layer, (_, variable, component) in zip(planes, layers, strict=True):
                values = (
                    values_of(dataset, variable, rows, component)
                    if variable
                    else add_up(dataset, names_of(dataset), rows)
                )
                for few in _row_blocks(len(values)):
                    place = slice(rows.start + few.start, rows.start + few.stop)
                    layer[:, place] = np.moveaxis(values[few], -1, 0)
        parts = [
            OpenEXR.Part(
                {**header, **(first if name == TOTAL else {})},
                {**dict(zip(names, layer, strict=True)), **(preview if name == TOTAL else {})},
                name,
            )
            for layer, (name, _, _) in zip(planes, layers, strict=True)
        ]
        with encodable(temporary) as file_name, _all_cores(), OpenEXR.File(parts) as file:
            file.write(file_name)


def read_exr(path: str | os.PathLike[str], channel_wavelengths: Sequence[float] | None = None) -> xr.Dataset:
    """Read a spectral EXR file, that of Fluorspar with its components, that of another program as it is.

    Parameters
    ----------
    path : str or path-like
    channel_wavelengths : sequence of float, optional
        Wavelengths in nm of the channels of another program whose names hold none, in the order of the numbers
        in their names.

    Returns
    -------
    Dataset
        In memory. The preview and the total are left out: the total is the sum of the components. A file of
        another program is not split: its one component is `total`.

    Raises
    ------
    ImageError
        If the file is missing, truncated, or has no spectral channel.

    Examples
    --------
    >>> read_exr("no-such-file.exr")
    Traceback (most recent call last):
    ...
    fluorspar.errors.ImageError: the image file does not exist
      where:    no-such-file.exr
    """
    described, all_parts = _read_parts(Path(path))
    if described is None:
        return foreign_dataset(all_parts, Path(path), channel_wavelengths)
    if channel_wavelengths is not None:
        raise stated_already(Path(path), "a file of Fluorspar")
    parts = {part.name(): part for part in all_parts}
    grid = _grid(described)
    kind = channel_kind(described["attrs"])
    channels = [channel_name(wavelength, kind) for wavelength in grid.values]
    known = (*COMPONENTS, TOTAL)
    components = [name for name in known if name in described["parts"]]
    layers: dict[str, list[list[NDArray[np.float32]]]] = {variable: [] for variable in VARIABLES}
    for name in described["parts"]:
        if name not in parts or any(channel not in parts[name].channels for channel in channels):
            raise _damaged(Path(path), f"part {name!r} is incomplete")
        planes = [parts[name].channels[channel].pixels for channel in channels]
        layers["radiance" if name in known else name.partition(".")[0]].append(planes)
    arrays = {variable: _assembled(planes) for variable, planes in layers.items() if planes}
    errors = {
        name: layer if "component" in VARIABLES[name][1] else layer[0]
        for name, layer in arrays.items()
        if name != "radiance"
    }
    return make_dataset(arrays["radiance"], grid, attrs=described["attrs"], components=components, **errors)


def _read_parts(path: Path) -> tuple[dict[str, Any] | None, list[Any]]:
    """What `write_exr` noted, None in a file of another program, and the parts of the file."""
    import OpenEXR

    check_source(path)
    with path.open("rb") as stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise ImageError(message("the image file is not an OpenEXR file", where=path))
    try:
        with encodable(path) as name:
            with OpenEXR.File(name, header_only=True) as file:
                headers = [dict(file.header(index)) for index in range(len(file.parts))]
            described = _described(headers[0], path)
            _check_size(headers, path)
            with _all_cores():
                file = OpenEXR.File(name, separate_channels=True)
    except (RuntimeError, ValueError, OSError, KeyError, IndexError) as err:
        raise _damaged(path, str(err)) from err
    promised = [len(header["channels"]) for header in headers]
    # OpenEXR drops the pixels it cannot read, with nothing but a line on standard output
    if [len(part.channels) for part in file.parts] != promised:
        raise _damaged(path, "some pixels are missing")
    return described, list(file.parts)


def _check_size(headers: list[dict[str, Any]], path: Path) -> None:
    """Refuse an image that does not fit into memory: its planes, and then its spectra."""
    needed = 0
    for header in headers:
        low, high = (np.asarray(corner, np.int64) for corner in header["dataWindow"])
        width, height = (int(size) for size in high - low + 1)
        needed += 8 * width * height * len(header["channels"])
    check_memory(needed, path, f"{width} x {height} pixels, {len(headers)} parts")


def _assembled(layers: list[list[NDArray[np.float32]]]) -> NDArray[np.float32]:
    """Turn planes of one wavelength each into an ndarray of shape (layers, Y, X, N)."""
    array = np.empty((len(layers), *layers[0][0].shape, len(layers[0])), np.float32)
    for layer, planes in zip(array, layers, strict=True):
        for rows in _row_blocks(len(layer)):
            np.stack([plane[rows] for plane in planes], axis=-1, out=layer[rows])
    return array


@contextmanager
def _all_cores() -> Iterator[None]:
    """Let OpenEXR use as many threads as there are cores; it has none of its own accord."""
    import OpenEXR

    before = OpenEXR.global_thread_count()
    OpenEXR.set_global_thread_count(os.cpu_count() or 1)
    try:
        yield
    finally:
        OpenEXR.set_global_thread_count(before)


def _parts(dataset: xr.Dataset) -> Iterator[tuple[str, str, str | None]]:
    """Name, variable and component of every part after the total."""
    for variable, (_, dims) in VARIABLES.items():
        if variable in dataset:
            if "component" not in dims:
                yield variable, variable, None
                continue
            for component in names_of(dataset):
                if component == TOTAL:
                    continue  # the first part holds it
                yield (
                    (component if variable == "radiance" else f"{variable}.{component}"),
                    variable,
                    component,
                )


def _room(shape: tuple[int, ...], folder: Path) -> NDArray[np.float32]:
    """An array for all planes, which OpenEXR wants at once and contiguous; a large one lies in a file without name."""
    size = 4 * math.prod(shape)
    if size <= _LARGEST_KEPT:
        return np.empty(shape, np.float32)
    with tempfile.TemporaryFile(dir=folder) as scratch:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(
                scratch.fileno(), 0, size
            )  # a full disk is to be an error here, no crash later
        else:
            scratch.truncate(size)
        return np.memmap(scratch, np.float32, "r+", shape=shape)


def _row_blocks(height: int) -> Iterator[slice]:
    return (slice(first, min(first + _ROWS, height)) for first in range(0, height, _ROWS))


def _preview(dataset: xr.Dataset) -> tuple[dict[str, NDArray[np.float32]], float]:
    """Linear R, G, B of the total and the exposure they are shown with."""
    shown = appearance(dataset, names_of(dataset))
    linear = linear_srgb(shown.rgb)
    return {
        channel: np.ascontiguousarray(linear[..., index], np.float32) for index, channel in enumerate("RGB")
    }, shown.exposure


def _described(header: dict[str, Any], path: Path) -> dict[str, Any] | None:
    """What `write_exr` noted in the header of the first part; None if there is no such note."""
    if _ATTRIBUTE not in header:
        return None
    try:
        described: dict[str, Any] = json.loads(header[_ATTRIBUTE])
        _grid(described)
        if set(described["parts"]) & {*COMPONENTS, TOTAL} and isinstance(described["attrs"], dict):
            return described
    except (KeyError, TypeError, ValueError, AttributeError, SpectrumError):
        pass
    raise ImageError(
        message(
            "this is not a spectral image of Fluorspar, though it says so",
            where=path,
            expected=f"what Fluorspar writes into the attribute {_ATTRIBUTE!r}",
            fix="remove the attribute to have the file read as that of another program",
        )
    )


def _noted(grid: Wavelengths) -> dict[str, list[float]]:
    if isinstance(grid, UnevenWavelengths):
        return {"uneven_wavelengths": grid.values.tolist()}
    return {"wavelengths": [grid.start, grid.stop, grid.step]}


def _grid(described: dict[str, Any]) -> Wavelengths:
    if "uneven_wavelengths" in described:
        return grid_through(described["uneven_wavelengths"], error=SpectrumError)
    return Wavelengths(*described["wavelengths"])


def _damaged(path: Path, reason: str) -> ImageError:
    return ImageError(
        message(
            "the image file is truncated or damaged", where=path, got=reason, fix="write or copy it again"
        )
    )
