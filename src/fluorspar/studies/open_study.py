"""`open_study`: all images of a study as one data set, read when they are used."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from fluorspar.errors import ImageError, OptionError, message
from fluorspar.extras import check_extra
from fluorspar.studies.index import DIM

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["open_study"]


def open_study(path: str | os.PathLike[str]) -> xr.Dataset:
    """Open the images of a study that are done, one behind the other, with their settings as coordinates.

    Parameters
    ----------
    path : path-like
        The file of the study, or its index.

    Returns
    -------
    Dataset
        `radiance(render, component, y, x, wavelength)` and `standard_error(render, y, x, wavelength)`, as Dask arrays:
        nothing is read before it is needed. Along `render` lie all settings of the rows, such as `light.lamp` and
        `concentration.wall`, and `output`, the file. Close it when done.

    Raises
    ------
    ImageError
        If there is no index, or no image in NetCDF is done.
    OptionError
        If the images differ in size or wavelengths.
    FluorsparError
        If Dask is not installed.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar.studies.batch import batch
    >>> file = Path(tempfile.mkdtemp(), "lamps.toml")
    >>> _ = file.write_text('''
    ...     render = { scene = "cornell-box", size = "8x8", spp = 4 }
    ...     product = { light.light = ["D65", "A"], seed = [1, 2, 3] }
    ... ''')
    >>> _ = batch(file)
    >>> with open_study(file) as images:
    ...     table = images.set_index(render=["light.light", "seed"]).unstack("render")
    ...     dict(table.radiance.mean(["y", "x"]).sizes)
    {'component': 7, 'wavelength': 69, 'light.light': 2, 'seed': 3}
    """
    check_extra("cluster")
    import xarray as xr

    given = Path(path)
    stem = given.stem if given.stem.endswith("-index") else f"{given.stem}-index"
    file = given.with_name(f"{stem}.nc")
    if not file.is_file():
        raise ImageError(
            message("there is no index", where=file, fix=f"render the study: fluorspar batch {given}")
        )
    index = xr.load_dataset(file, engine="h5netcdf")
    index = index.isel({DIM: index["status"].values == "done"})
    names = [name for name in index if str(name).partition("_")[0] == "output"]
    name = next(
        (name for name in names if all(str(f).lower().endswith(".nc") for f in index[name].values)), None
    )
    if name is None or not index.sizes[DIM]:
        raise ImageError(message("no image of the study is done, or none is NetCDF", where=file))
    try:
        images = xr.open_mfdataset(
            [file.parent / each for each in index[name].values],
            engine="h5netcdf",
            combine="nested",
            concat_dim=DIM,
            data_vars="all",
            coords="minimal",
            compat="override",
            join="exact",
            combine_attrs="drop_conflicts",
        )
    except ValueError as err:
        fix = "open those of one size and grid: select rows of the index, and give their files to xarray.open_mfdataset"
        raise OptionError(
            message("the images of the study differ in size or wavelengths", where=file, got=err, fix=fix)
        ) from err
    return images.assign_coords({**index.coords, "output": (DIM, index[name].values)})
