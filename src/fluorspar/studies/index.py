"""The index of a study: what was rendered with which settings, into which file, as CSV and NetCDF."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from fluorspar.errors import OptionError, message
from fluorspar.files.writing import check_target, replacing
from fluorspar.studies.do_group import Result
from fluorspar.studies.marks import MARK
from fluorspar.studies.study import Study

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["check_index", "index_files", "index_of", "write_index"]

DIM = "render"
"""The dimension of an index, and of the images of a study."""

_STUDY = "study"  # attribute: the file that it is the index of

_ABOUT = {
    "output": "file of the image, relative to the index",
    "status": "done, failed, or open: not tried, or interrupted",
    "seconds": "time the image took, without tracing that it shares",
    "study_row": "SHA-256 of the settings, the scene file, and the files that they name",
    "fault": "why it failed",
}


def index_of(study: Study, results: Iterable[Result]) -> xr.Dataset:
    """Make the index of a study.

    Returns
    -------
    Dataset
        With a dimension `render`, whose coordinates are the number of the row and every setting that a row has: numbers
        where all are, else texts; nan or "" where a row has none. A / in the name of a setting is a |, because it
        separates groups in NetCDF. Variables `output` (one for each pattern: `output_2`, ...), `status`, `seconds`,
        `study_row` and `fault`.

    Examples
    --------
    >>> from fluorspar.studies.study import read_study
    >>> study = read_study({"render": {"scene": "furnace"}, "product": {"light.walls": ["A", "D65"]}})
    >>> index = index_of(study, [Result(1, "done"), Result(2, "open")])
    >>> index["light.walls"].values.tolist(), index["status"].values.tolist()
    (['A', 'D65'], ['done', 'open'])
    """
    import xarray as xr

    by_number = {result.number: result for result in results}
    found = [by_number[row.number] for row in study.rows]
    coords: dict[str, Any] = {
        DIM: (DIM, [row.number for row in study.rows], {"long_name": "row of the study"})
    }
    for key in study.keys:
        coords[key.replace("/", "|")] = (DIM, _column([row.settings.get(key) for row in study.rows]))
    base = Path.cwd() if study.index is None else study.index.parent
    variables: dict[str, Any] = {}
    for place, name in enumerate(output_names(study)):
        files = [
            "".join(os.path.relpath(file, base) for file in row.outputs[place : place + 1])
            for row in study.rows
        ]
        variables[name] = (DIM, files, {"long_name": _ABOUT["output"]})
    variables |= {
        "status": (DIM, [result.status for result in found]),
        "seconds": (DIM, [result.seconds for result in found], {"units": "s"}),
        "study_row": (DIM, [result.mark for result in found]),
        "fault": (DIM, [result.fault for result in found]),
    }
    attrs = {} if study.file is None else {_STUDY: study.file.name}
    index = xr.Dataset(variables, coords, attrs)
    for name in variables:
        index[name].attrs.setdefault("long_name", _ABOUT.get(name, ""))
    return index


def output_names(study: Study) -> list[str]:
    """Names of the variables that hold the files: `output`, `output_2`, ..."""
    count = max(len(row.outputs) for row in study.rows)
    return ["output", *(f"output_{place}" for place in range(2, count + 1))]


def write_index(study: Study, index: xr.Dataset) -> None:
    """Write the index as CSV and NetCDF, beside the file of the study.

    Raises
    ------
    ImageError
        If a file cannot be written.
    """
    from xarray.backends import H5NetCDFStore

    if study.index is None:
        return
    table, netcdf = index_files(study)
    with replacing(table) as temporary:
        _table(index).to_csv(temporary, index=True)
    with (
        replacing(netcdf) as temporary,
        TemporaryDirectory() as folder,  # HDF5 opens no file that is locked
    ):
        # `to_netcdf` would ask a lock of the scheduler of Dask, which may be the reason why this is written.
        with closing(H5NetCDFStore.open(os.path.join(folder, "index.nc"), mode="w", lock=False)) as store:
            index.dump_to_store(store)
        temporary.write_bytes(Path(folder, "index.nc").read_bytes())


def check_index(study: Study) -> None:
    """Refuse to replace a file of the name of the index that is none, or the index of another study.

    Raises
    ------
    OptionError
        If there is one.
    ImageError
        If the index cannot be written.
    """
    for path in index_files(study):
        if not check_target(path).exists():
            continue
        other = _study_of(path)
        if other is None:
            fault, fix = "a file that is no index has the name of the index", "rename it, or the study"
            raise OptionError(message(fault, where=path, fix=fix))
        if study.file and other not in ("", study.file.name) and study.file.with_name(other).exists():
            fault, fix = "two studies have the same index", "rename one of the studies, or delete the index"
            got = f"{study.file.name} and {other}"
            raise OptionError(message(fault, where=path, got=got, fix=fix))


def index_files(study: Study) -> list[Path]:
    """The files of the index of a study, CSV and NetCDF; a study without a file has none."""
    index = study.index
    return [] if index is None else [index.with_name(f"{index.name}{suffix}") for suffix in (".csv", ".nc")]


def _study_of(path: Path) -> str | None:
    """The file of the study that a file is the index of, "" if it does not say; None if it is no index."""
    import h5py

    if path.suffix == ".csv":
        with path.open(encoding="utf-8", errors="replace") as file:
            return "" if MARK in file.readline() else None
    with suppress(OSError), h5py.File(path) as index:
        return str(index.attrs.get(_STUDY, "")) if MARK in index else None
    return None


def _table(index: xr.Dataset) -> pd.DataFrame:
    return index.to_dataframe()[[*(name for name in index.coords if name != DIM), *index.data_vars]]


def _column(values: Sequence[Any]) -> list[Any]:
    """Settings of all rows as numbers, or as texts."""
    if all(value is None or _is_number(value) for value in values):
        if any(value is None for value in values) or not all(type(v) is type(values[0]) for v in values):
            return [float("nan") if value is None else float(value) for value in values]
        return [int(value) if isinstance(value, bool) else value for value in values]
    return ["" if value is None else str(value) for value in values]


def _is_number(value: Any) -> bool:
    """Whether NetCDF has it as a number: whole ones have 64 bits."""
    return isinstance(value, float) or (isinstance(value, int) and -(2**63) <= value < 2**63)
