"""The table of a sheet: one row for each combination and point."""

from __future__ import annotations

import csv
import io
import os
from typing import TYPE_CHECKING

import numpy as np

from fluorspar.files.writing import replacing
from fluorspar.sheets.sheet_picture import settings_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["write_sheet_table"]

_NUMBERS = ("X", "Y", "Z", "L*", "a*", "b*", "delta_e", "luminescent_share")


def write_sheet_table(found: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a CSV file: the settings, the point, X, Y, Z, L*, a*, b*, delta_e, luminescent_share; and how as comments.

    Parameters
    ----------
    found : Dataset
        Of `fluorspar.sheet`.
    path : str or path-like
        The file to be written or replaced.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import fluorspar, tempfile
    >>> from pathlib import Path
    >>> paths = fluorspar.trace("cornell-box", size=(8, 8), spp=1)
    >>> file = Path(tempfile.mkdtemp()) / "table.csv"
    >>> write_sheet_table(fluorspar.sheet(paths, lights={"light": ["D65", "A"]}), file)
    >>> next(line for line in file.read_text().splitlines() if line[0] != "#")
    'light,point,X,Y,Z,L*,a*,b*,delta_e,luminescent_share'
    """
    dims = found["exposure"].dims
    stream = io.StringIO()
    for name in ("scene", "spp", "wavelengths", "measured", "white", "partial"):
        if name in found.attrs:
            stream.write(f"# {name}: {found.attrs[name]}\n")
    for dim in dims:
        stream.write(f"# {dim}: {found[dim].attrs['long_name']}\n")
    stream.write("# X, Y, Z: cd/m2, CIE 1931; delta_e: CIEDE2000 from the first combination\n")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*dims, "point", *_NUMBERS])
    for index in np.ndindex(found["exposure"].shape):
        of = found.isel(dict(zip(dims, index, strict=True)))
        settings = settings_of(found, index).values()
        for p, point in enumerate(found["point"].values):
            numbers = [*of["XYZ"].values[p], *of["Lab"].values[p]]
            numbers += [of["delta_e"].values[p], of["luminescent_share"].values[p]]
            writer.writerow([*settings, point, *(f"{number:.6g}" for number in numbers)])
    with replacing(path) as temporary:
        temporary.write_text(stream.getvalue(), encoding="utf-8")
