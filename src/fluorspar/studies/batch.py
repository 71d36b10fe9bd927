"""`batch`: all renders of a study, those that are done left out, one bad row no harm to the others."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fluorspar.errors import ClusterError, FluorsparError, FluorsparWarning, OptionError, message
from fluorspar.extras import check_extra
from fluorspar.files.writing import check_not_input
from fluorspar.progress import Progress, shown
from fluorspar.scene.builtin import BUILTIN
from fluorspar.studies.do_group import Result, do_group, fault_of
from fluorspar.studies.files import located
from fluorspar.studies.groups import Group, groups_of
from fluorspar.studies.index import check_index, index_files, index_of, write_index
from fluorspar.studies.marks import made_by
from fluorspar.studies.study import Row, Study, read_study
from fluorspar.studies.turns import turn
from fluorspar.version import __version__

if TYPE_CHECKING:
    import xarray as xr

    from fluorspar.cluster.fit_workers import Unfit

__all__ = ["batch", "run_study"]

_EVERY = 10.0  # s between indices
_PARTS = 1000  # of a render, for progress


def batch(
    study: str | os.PathLike[str] | Mapping[str, Any],
    *,
    output: str | Sequence[str] | None = None,
    client: Any = None,
    threads: int | None = None,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    """Render all rows of a study; see "Many images" in the documentation.

    Parameters
    ----------
    study : path or mapping
        A TOML or CSV file, or a dict of the tables of the former, see `fluorspar.studies.study.read_study`.
    output : str or sequence of str, optional
        Patterns of the names of the files, instead of the study's.
    client : distributed.Client, optional
        Workers of Dask, which see the same files: each traces and relights whole groups. Default: this process.
    threads : int, optional
        Default: all cores this process, or a worker, may use.
    progress : callable or bool, optional
        True draws a bar, in notebooks too; or called with thousandths of renders done and in all.

    Returns
    -------
    Dataset
        The index: a dimension `render`, whose coordinates are the settings of the rows, and variables `output`,
        `status` ("done", "failed", "open"), `seconds`, `study_row`, `fault`. Of a study from a file it is also written
        beside it, `STUDY-index.csv` and `.nc`. If the user interrupts (Ctrl-C), what is finished is kept, and the same
        call goes on with the rest.

    Raises
    ------
    OptionError
        If the study is not readable, or two rows have the same output. Nothing is rendered then. Other faults make a
        row "failed": it is tried twice, and again by the next call.
    FluorsparError
        If a client is given, and Dask is not installed.
    ClusterError
        If the scheduler of the client is lost, or no worker has the versions of the client. What is done is kept, and
        in the index; the same call goes on with the rest.

    Notes
    -----
    Rows that differ only in lights, materials, concentrations, grid, Stokes rule, excitation or errors share light
    paths: their images are those that `render` would make, in distribution; bit for bit only if nothing was changed.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.mkdtemp()
    >>> index = batch(
    ...     {
    ...         "output": folder + "/{light}-{concentration:.1f}.nc",
    ...         "render": {"scene": "cornell-box", "size": "8x8", "spp": 4},
    ...         "product": {"light.light": ["D65", "A"], "concentration.left-wall": [0, 0.5, 1]},
    ...     }
    ... )
    >>> index["status"].values.tolist() == ["done"] * 6, sorted(os.listdir(folder))[0]
    (True, 'A-0.0.nc')
    """
    read = read_study(study, output)
    results = run_study(read, client=client, threads=threads, progress=shown(progress))
    return index_of(read, results)


def run_study(
    study: Study,
    *,
    client: Any = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> list[Result]:
    """Render the rows of a study that are not done, and write its index; see `batch`.

    Returns
    -------
    list of Result
        One of each row, in order.
    """
    if client is not None:
        check_extra("cluster")
    _prepare(study)
    found = _done_before(study)
    pending = [row for row in study.rows if row.number not in found]
    bar = _Bar(progress, len(pending))
    written = time.monotonic()
    try:
        for again in (False, True):
            rows = [row for row in pending if not again or found[row.number].status == "failed"]
            with closing(_results(study, rows, client, threads, bar, again)) as done:
                for results in done:
                    for result in results:
                        found[result.number] = result
                        for category, text in result.warnings:
                            warnings.warn(text, category, stacklevel=3)
                    if time.monotonic() - written > _EVERY:
                        with suppress(FluorsparError):  # told at the end
                            _write(study, found)
                        written = time.monotonic()
                    if any(result.status == "open" for result in results):
                        raise KeyboardInterrupt
    except KeyboardInterrupt:
        count = sum(result.status == "done" for result in found.values())
        if count < len(study.rows):
            of = f"{count} of {len(study.rows)} renders are done"
            text = f"interrupted: {of}; the same command goes on with the others"
            warnings.warn(text, FluorsparWarning, stacklevel=3)
    except ClusterError:
        try:
            _write(study, found)
        except FluorsparError as err:
            warnings.warn(f"the index is not up to date: {err}", FluorsparWarning, stacklevel=3)
        raise
    _write(study, found)
    return _all(study, found)


def _prepare(study: Study) -> None:
    """Refuse to overwrite what is read; make the folders of the files; remove what a killed run has left."""
    check_index(study)
    indices = [os.path.realpath(path) for path in index_files(study)]
    real: dict[str, Path] = {}
    for path in (path for row in study.rows for path in row.outputs):
        if real.setdefault(os.path.realpath(path), path) != path:
            got = f"{real[os.path.realpath(path)]} and {path}"
            fix = "name one file for each image; symbolic links are followed"
            raise OptionError(message("two images have the same file", got=got, fix=fix))
    for row in study.rows:
        for path in row.outputs:
            if os.path.realpath(path) in indices:
                fix = "name the image otherwise"
                raise OptionError(message("an image has the name of the index", where=path, fix=fix))
        scene = located(row.settings, row.folder)["scene"]
        for path in row.outputs:
            if scene not in BUILTIN:
                check_not_input(path, str(scene))
            with suppress(OSError):  # told when it is written
                path.parent.mkdir(parents=True, exist_ok=True)
    for group in groups_of(study.rows, study.rows):
        with turn(study.file, group.rows, wait=False) as is_ours:
            for file in group.paths_files() if is_ours else []:
                with suppress(OSError):
                    file.unlink(missing_ok=True)


def _done_before(study: Study) -> dict[int, Result]:
    """Rows whose files are there, whole, and made by the same row."""
    found: dict[int, Result] = {}
    others: set[str] = set()
    for row in study.rows:
        if made := made_by(row):
            mark, versions = made
            found[row.number] = Result(row.number, "done", mark=mark, before=True)
            others |= versions - {"", __version__}
    if others:
        text = (
            f"some images were made by Fluorspar {', '.join(sorted(others))} and count as done; delete them to have "
            f"them made by {__version__}"
        )
        warnings.warn(text, FluorsparWarning, stacklevel=5)
    return found


def _results(
    study: Study, rows: Sequence[Row], client: Any, threads: int | None, bar: _Bar, again: bool
) -> Generator[list[Result]]:
    """Do one group after another, here or on workers; at the end those that other processes are at meanwhile."""
    groups = groups_of(study.rows, rows)
    if client is not None:
        yield from _on_workers(groups, client, threads, bar, again)
        return
    for last in (False, True):
        left = []
        for group in groups:
            with turn(study.file, group.rows, wait=last) as is_ours:
                results = do_group(group, threads, None if again else bar.tell) if is_ours else []
            if not is_ours:
                left.append(group)
                continue
            yield results
            if not again:
                bar.advance(len(results))
        groups = left
        if left and not last:
            count = sum(len(group.rows) for group in left)
            text = f"{count} renders are being made by another process, which is waited for"
            warnings.warn(text, FluorsparWarning, stacklevel=4)


def _on_workers(
    groups: Sequence[Group], client: Any, threads: int | None, bar: _Bar, again: bool
) -> Generator[list[Result]]:
    """Do groups on workers, in any order; raises ClusterError if the scheduler is lost, or no worker fits."""
    from distributed import as_completed

    from fluorspar.cluster.connect import check_connection, connection
    from fluorspar.cluster.fit_workers import FitWorkers, Unfit
    from fluorspar.cluster.versions import versions_here

    workers, begun = FitWorkers(client), {}

    def begin(group: Group) -> Any:
        where = {} if workers.only is None else {"workers": workers.only, "allow_other_workers": True}
        with connection(client):
            future = client.submit(_task, group, threads, versions_here(), pure=False, **where)
        begun[future] = group
        return future

    try:
        done = as_completed([begin(group) for group in groups])
        for future in done:
            group = begun[future]
            try:
                results = future.result()
            except Exception as err:  # a worker that died, above all
                check_connection(client)
                results = [Result(row.number, "failed", fault=fault_of(err)) for row in group.rows]
            del begun[future]
            if isinstance(results, Unfit):
                workers.look(patient=True)
                workers.refuse(results)
                done.add(begin(group))
                continue
            yield results
            if not again:
                bar.advance(len(group.rows))
    finally:
        if client.status == "running":
            client.cancel(list(begun))


def _task(group: Group, threads: int | None, versions: Mapping[str, str]) -> list[Result] | Unfit:
    """Do a group on a worker, with the threads it has; stop between chunks if nobody waits for it any more."""
    from distributed import get_worker
    from distributed.worker import thread_state

    from fluorspar.cluster.fit_workers import Unfit
    from fluorspar.cluster.task import in_turn
    from fluorspar.cluster.versions import check_versions, versions_here

    worker, key = get_worker(), thread_state.key
    try:
        check_versions(versions, versions_here(), worker.address)
    except ClusterError as err:
        return Unfit(worker.address, str(err))

    def tell(finished: int, share: float) -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state == "cancelled":
            raise KeyboardInterrupt

    return in_turn(do_group, group, threads or worker.state.nthreads, tell)


class _Bar:
    """Progress over renders, which never goes back."""

    def __init__(self, progress: Progress | None, renders: int) -> None:
        self._progress, self._renders = progress, renders
        self._before, self._most = 0, 0

    def tell(self, finished: int, share: float) -> None:
        self._most = max(self._most, int(_PARTS * (self._before + finished + share)))
        if self._progress:
            self._progress(self._most, _PARTS * self._renders)

    def advance(self, renders: int) -> None:
        self._before += renders
        self.tell(0, 0)


def _write(study: Study, found: Mapping[int, Result]) -> None:
    write_index(study, index_of(study, _all(study, found)))


def _all(study: Study, found: Mapping[int, Result]) -> list[Result]:
    return [found.get(row.number, Result(row.number, "open")) for row in study.rows]
