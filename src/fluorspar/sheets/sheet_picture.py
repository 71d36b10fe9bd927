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
_BETWEEN = " · "


def sheet_picture(found: xr.Dataset) -> NDArray[np.uint8]:
    """Draw a sheet, the settings of its last dimensions side by side.

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
        label = _BETWEEN.join(_said(dim, setting) for dim, setting in settings_of(found, index).items())
        shown = Appearance(of["rgb"].values, float(of["exposure"]), 0.0)
        tiles.append(Tile(label, label, note, shown.bytes))
    return draw_tiles(tiles, _title(found), _columns(found["exposure"].shape))


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


def _said(dim: str, setting: str | float) -> str:
    """A setting in words that tell what it is.

    Examples
    --------
    >>> _said("wall concentration", 0.5), _said("lamp", "x 2"), _said("lamp", "D65")
    ('wall × 0.5', 'lamp × 2', 'D65')
    """
    if isinstance(setting, float):
        return f"{dim.removesuffix(' concentration')} × {setting:g}"
    return f"{dim} × {setting[2:]}" if setting.startswith("x ") else setting


def _columns(shape: tuple[int, ...]) -> int:
    """How many pictures stand side by side: whole dimensions but for the first, or equal parts of one.

    Examples
    --------
    >>> _columns((3, 2, 2)), _columns((2, 3)), _columns((5, 1)), _columns((2, 10))
    (4, 3, 5, 5)
    """
    *others, last = [size for size in shape if size > 1] or [1]
    columns = -(-last // -(-last // _COLUMNS))
    for size in reversed(others[1:]):
        if columns < last or columns * size > _COLUMNS:
            break
        columns, last = columns * size, columns * size
    return columns


def _title(found: xr.Dataset) -> str:
    attrs = found.attrs
    facts = [" × ".join(map(str, found["exposure"].dims))]
    facts += [str(attrs.get("scene", "")), f"ΔE, Y: {found['point'].values[0]}"]
    if attrs["exposure"] != "each":
        facts.append(f"white is {rounded(1 / float(found['exposure'].values.flat[0]))} cd/m²")
    if attrs.get("partial"):
        facts.append("unfinished")
    return _BETWEEN.join(filter(None, facts))
