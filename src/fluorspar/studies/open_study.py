"""`open_study`: all images of a study as one data set, read when they are used."""

from __future__ import annotations

import os
import warnings
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fluorspar.errors import FluorsparWarning, ImageError, OptionError, message
from fluorspar.extras import check_extra
from fluorspar.studies.index import DIM
from fluorspar.studies.keys import INDEX

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["open_study"]

# By which xarray opens files, and how.
_ENGINES: dict[str, tuple[str, dict[str, Any]]] = {
    ".nc": ("h5netcdf", {}),
    ".zarr": ("zarr", {"consolidated": False}),
}


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
        `concentration.wall`, and `output`, the file: the first of a row that is NetCDF or Zarr. Close it when done.

    Raises
    ------
    ImageError
        If there is no index, or no image in NetCDF or Zarr is done.
    OptionError
        If the images differ in size or wavelengths.
    FluorsparError
        If Dask or zarr is not installed.

    Warns
    -----
    FluorsparWarning
        Of rows that are done but have no such image, which are left out.

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
    stem = given.stem if given.stem.endswith(INDEX) else f"{given.stem}{INDEX}"
    file = given.with_name(f"{stem}.nc")
    if not file.is_file():
        raise ImageError(
            message("there is no index", where=file, fix=f"render the study: fluorspar batch {given}")
        )
    index = xr.load_dataset(file, engine="h5netcdf")
    index = index.isel({DIM: index["status"].values == "done"})
    names = [name for name in index if str(name).partition("_")[0] == "output"]
    found: dict[int, str] = {}
    for place in range(index.sizes[DIM]):
        outputs = [str(index[name].values[place]) for name in names]
        for output in outputs:
            if Path(output).suffix.lower() in _ENGINES and (file.parent / output).exists():
                found.setdefault(place, output)
    if not found:
        fault = (
            "no image of the study is in NetCDF or Zarr"
            if index.sizes[DIM]
            else "no image of the study is done"
        )
        raise ImageError(message(fault, where=file))
    if left := [str(number) for place, number in enumerate(index[DIM].values) if place not in found]:
        text = f"left out, because no NetCDF or Zarr image of theirs is there: rows {', '.join(left)} of the study"
        warnings.warn(text, FluorsparWarning, stacklevel=2)
    index = index.isel({DIM: list(found)})
    with ExitStack() as opened:
        images = [opened.enter_context(_opened(file.parent / output)) for output in found.values()]
        try:
            joined = xr.concat(
                images,
                DIM,
                data_vars="all",
                coords="minimal",
                compat="override",
                join="exact",
                combine_attrs="drop_conflicts",
            )
        except ValueError as err:
            fix = (
                "open those of one size and grid: select rows of the index, and give their files to "
                "xarray.open_mfdataset"
            )
            raise OptionError(
                message("the images of the study differ in size or wavelengths", where=file, got=err, fix=fix)
            ) from err
        joined = joined.assign_coords({**index.coords, "output": (DIM, list(found.values()))})
        joined.set_close(opened.pop_all().close)
    return joined


def _opened(file: Path) -> xr.Dataset:
    import xarray as xr

    engine, options = _ENGINES[file.suffix.lower()]
    return xr.open_dataset(file, engine=engine, chunks={}, **options)
