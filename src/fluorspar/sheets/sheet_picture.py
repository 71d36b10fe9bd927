"""The picture of a sheet: every combination, labelled."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.files.writing import replacing
from fluorspar.image.display.appearance import Appearance
from fluorspar.image.display.picture import png_bytes, rounded
from fluorspar.image.display.tiles import Tile, draw_tiles

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["settings_of", "sheet_picture", "write_sheet_picture"]

_COLUMNS = 8  # at the most
_BETWEEN = "   ·   "


def sheet_picture(found: xr.Dataset) -> NDArray[np.uint8]:
    """Draw a sheet, the settings of its last dimension side by side.

    Parameters
    ----------
    found : Dataset
        Of `fluorspar.sheet`.

    Returns
    -------
    ndarray of shape (y, x, 3)
        uint8.

    Examples
    --------
    >>> import fluorspar
    >>> paths = fluorspar.trace("cornell-box", size=(8, 8), spp=1)
    >>> sheet_picture(fluorspar.sheet(paths, lights={"light": ["D65", "A"]})).ndim
    3
    """
    dims = found["exposure"].dims
    each = found.attrs["exposure"] == "each"
    tiles = []
    for index in np.ndindex(found["exposure"].shape):
        of = found.isel(dict(zip(dims, index, strict=True)))
        note = f"ΔE {float(of['delta_e'][0]):.1f},  Y {rounded(float(of['XYZ'][0, 1]))} cd/m²"
        if each:
            note += f",  white is {rounded(1 / float(of['exposure']))} cd/m²"
        settings = settings_of(found, index)
        label = _BETWEEN.join(
            f"{value:g}" if isinstance(value, float) else value for value in settings.values()
        )
        shown = Appearance(of["rgb"].values, float(of["exposure"]), 0.0)
        tiles.append(Tile(label, label, note, shown.bytes))
    varied = [found.sizes[dim] for dim in dims if found.sizes[dim] > 1]
    rows = -(-(varied or [1])[-1] // _COLUMNS)
    return draw_tiles(tiles, _title(found), -(-(varied or [1])[-1] // rows))


def write_sheet_picture(found: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write the picture of a sheet as PNG.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(png_bytes(sheet_picture(found)))


def settings_of(found: xr.Dataset, index: tuple[int, ...]) -> dict[str, Any]:
    """The settings of one combination in words, concentrations as numbers, by dimension."""
    return {
        str(dim): found[dim].values[number].item()
        if found[dim].dtype.kind == "f"
        else str(found[dim].values[number])
        for dim, number in zip(found["exposure"].dims, index, strict=True)
    }


def _title(found: xr.Dataset) -> str:
    attrs = found.attrs
    facts = [" × ".join(str(found[dim].attrs["long_name"]) for dim in found["exposure"].dims)]
    facts += [str(attrs.get("scene", "")), f"ΔE, Y: {found['point'].values[0]}"]
    if attrs["exposure"] != "each":
        facts.append(f"white is {rounded(1 / float(found['exposure'].values.flat[0]))} cd/m²")
    if attrs.get("partial"):
        facts.append("unfinished")
    return _BETWEEN.join(filter(None, facts))
