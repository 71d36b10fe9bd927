"""Light paths in a file: HDF5 with a record of the scene, and the packed paths of one run of pixels after another.

It is written while the paths are traced, and read back run by run, so that neither needs the memory for all of them.
"""

from __future__ import annotations

import math
import os
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from fluorspar.errors import FluorsparError, PathsError, SceneError, message
from fluorspar.files.beside import Temporary
from fluorspar.files.journal import Journal, read_journal
from fluorspar.files.patient_file import PatientFile
from fluorspar.files.run_journal import SYNC_EVERY
from fluorspar.files.writing import check_target, write_error
from fluorspar.job import RenderJob
from fluorspar.paths.numbering import count_rows
from fluorspar.paths.packed import ARRAYS, PackedChunk
from fluorspar.scene.recipe import Recipe
from fluorspar.scene.records import from_record, to_record
from fluorspar.scene.scene import Scene
from fluorspar.version import __version__

__all__ = ["SUFFIX", "PathsInFile", "PathsWriter", "read_paths"]

SUFFIX = ".paths"

_FORMAT, _VERSION = "fluorspar light paths", 2
_BYTES_A_SAMPLE = 24  # at the least, for the check of free space
_JOB = ("seed", "stokes", "excitation", "component_errors", "variant", "threads", "changed_lights")
_SCENE = ("materials", "lights", "surfaces", "settings", "lobes")
_PLACE = ("first_pixel", "pixels", "spp")
_RECIPE = ("name", "parameters", "matte", "library", "sensor", "folder")


class PathsWriter:
    """Writes light paths to a file, chunk after chunk, in any order.

    The file has a temporary name until `keep`. Leaving the `with` block without removes it, and an older file of the
    name stays as it was.

    Parameters
    ----------
    path : str or path-like
        The file to be written or replaced.
    job : RenderJob
        What is traced.
    label : mapping, optional
        Its fingerprint.
    left : Path, optional
        What to go on with, under its temporary name.
    journaled : bool
        Leave what is finished in a journal, to be continued, if the writer is killed.

    Attributes
    ----------
    written : dict of int to int
        Number of the first pixel of each chunk, and how many pixels it has.

    Raises
    ------
    ImageError
        If the file cannot be written. This is found out before anything is traced, but for a disk that fills up.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        job: RenderJob,
        label: Mapping[str, str] | None = None,
        left: Path | None = None,
        *,
        journaled: bool = False,
    ) -> None:
        import h5py

        settings = job.scene.settings
        self.path = check_target(path, _BYTES_A_SAMPLE * settings.width * settings.height * settings.spp)
        self.written: dict[int, int] = {}
        try:
            self._temporary = Temporary(self.path, left)
            self._stream = PatientFile(self._temporary.path)
        except OSError as err:
            raise write_error(self.path, err) from err
        self._label, self._journaled = label, journaled
        self._journal: Journal | None = None
        self._began = self._synced = time.monotonic()
        self._resumed = left is not None
        self._file = h5py.File(self._stream, "w")
        # Text of fixed length: HDF5 follows the pointers of other text blindly, and dies of wrong ones.
        texts = {"format": np.bytes_(_FORMAT), "fluorspar": np.bytes_(__version__)}
        try:
            self._file.attrs.update({**texts, "format_version": _VERSION})
            self._record(job)
            if self._resumed:
                self._go_on()
        except BaseException as err:
            self.__exit__(type(err), err, None)
            raise

    def __enter__(self) -> PathsWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file:
            self._close()
        if self._journal is not None:
            self._journal.close()
        if kind is not None and self._can_go_on:
            self._temporary.leave()
        self._temporary.drop()

    def write(self, chunk: PackedChunk) -> None:
        """Append a chunk."""
        self._put(chunk)
        if not self._journaled:
            return
        try:
            if self._journal is None:
                self._journal = Journal(self._temporary.journal)
                self._journal.append({"label": self._label})
            self._journal.append(*_as_record(chunk))
            if time.monotonic() - self._synced > SYNC_EVERY:
                self._journal.sync()
                self._synced = time.monotonic()
        except OSError as err:
            raise write_error(self.path, err, kept=self._can_go_on) from err

    @property
    def _can_go_on(self) -> bool:
        if self._resumed:
            return True
        return self._journal is not None and time.monotonic() - self._began > SYNC_EVERY

    def _go_on(self) -> None:
        """Take the chunks of the journal that is there."""
        end = 0
        for number, (said, data, stop) in enumerate(read_journal(self._temporary.journal)):
            if number:
                self._put(_from_record(said, data))
            end = stop
        self._journal = Journal(self._temporary.journal, end)

    def _put(self, chunk: PackedChunk) -> None:
        group = self._file.create_group(f"chunks/{chunk.first_pixel:012d}")
        group.attrs.update({"first_pixel": chunk.first_pixel, "pixels": chunk.pixels, "spp": chunk.spp})
        for name in ARRAYS:
            group[name] = getattr(chunk, name)
        group.attrs["crc32"] = _checksum_of(chunk)
        self.written[chunk.first_pixel] = chunk.pixels
        self._check()

    def keep(self) -> None:
        """Close the file and give it its name."""
        self._file.attrs["pixels"] = sum(self.written.values())
        self._close()
        self._check()
        try:
            self._temporary.keep(durable=self._can_go_on)
        except OSError as err:
            raise write_error(self.path, err) from err

    def _record(self, job: RenderJob) -> None:
        scene = job.scene
        recipe: dict[str, Any] = {name: getattr(scene.recipe, name) for name in _RECIPE}
        source = scene.recipe.source
        recipe["source"] = None if isinstance(source, dict) else str(source)
        recipe["is_file"] = isinstance(source, Path)
        what = {
            "job": {name: getattr(job, name) for name in _JOB},
            "grid": job.grid,
            "scene": {name: getattr(scene, name) for name in _SCENE},
            "recipe": recipe,
            "fingerprint": self._label,
        }
        text, arrays = to_record(what)
        self._file["record"] = np.frombuffer(text.encode(), np.uint8)
        for number, array in enumerate(arrays):
            self._file[f"arrays/{number:06d}"] = array
        self._file.attrs["crc32"] = _checksum(np.frombuffer(text.encode(), np.uint8), *arrays)

    def _close(self) -> None:
        with suppress(OSError, RuntimeError):  # the stream tells what failed
            self._file.close()
        self._stream.close()

    def _check(self) -> None:
        try:
            self._stream.check()
        except OSError as err:
            raise write_error(self.path, err, kept=self._can_go_on) from err


def _as_record(chunk: PackedChunk) -> tuple[dict[str, Any], bytes]:
    arrays = [np.ascontiguousarray(getattr(chunk, name)) for name in ARRAYS]
    said = {name: getattr(chunk, name) for name in _PLACE}
    shapes = [[array.dtype.str, array.shape] for array in arrays]
    return {**said, "arrays": shapes}, b"".join(array.tobytes() for array in arrays)


def _from_record(said: Mapping[str, Any], data: bytes) -> PackedChunk:
    arrays: dict[str, Any] = {}
    at = 0
    for name, (kind, shape) in zip(ARRAYS, said["arrays"], strict=True):
        arrays[name] = np.frombuffer(data, kind, math.prod(shape), at).reshape(shape)
        at += arrays[name].nbytes
    return PackedChunk(**{name: said[name] for name in _PLACE}, **arrays)


class PathsInFile(Sequence[PackedChunk]):
    """The packed chunks of a file, each read when it is asked for.

    The file stays open, so that it may be replaced meanwhile; `nbytes` is its size, `fingerprint` that of the job.
    """

    def __init__(
        self, file: Any, path: Path, rows: int, lights: int, fingerprint: dict[str, str] | None = None
    ) -> None:
        self.path = path
        self.nbytes = path.stat().st_size
        self._file = file
        self._groups = sorted(file.get("chunks", ()))
        self._tables = rows, lights
        self._sound: set[int] = set()
        self.fingerprint: dict[str, str] | None = fingerprint

    def __len__(self) -> int:
        return len(self._groups)

    def __getitem__(self, number: Any) -> Any:
        """Read one chunk; it is checked when it is read first."""
        if isinstance(number, slice):
            return [self[each] for each in range(*number.indices(len(self)))]
        number = range(len(self))[number]
        try:
            group = self._file["chunks"][self._groups[number]]
            sizes: dict[str, Any] = {
                name: int(group.attrs[name]) for name in ("first_pixel", "pixels", "spp")
            }
            arrays: dict[str, Any] = {name: group[name][...] for name in ARRAYS}
            chunk = PackedChunk(**sizes, **arrays)
            fault = ""
            if number not in self._sound:
                wrong = _checksum_of(chunk) != int(group.attrs["crc32"])
                fault = "a checksum is wrong" if wrong else chunk.fault(*self._tables)
        except _DAMAGE as err:
            fault = _first_line(err)
        if fault:
            raise PathsError(
                message(
                    "the light paths in the file are damaged",
                    where=self.path,
                    got=f"{fault}, in part {number + 1} of {len(self)}",
                    fix="trace the scene again",
                )
            )
        self._sound.add(number)
        return chunk

    def __iter__(self) -> Iterator[PackedChunk]:
        return (self[number] for number in range(len(self)))

    @property
    def pixels(self) -> int:
        """How many pixels there are paths of."""
        return sum(int(self._file["chunks"][name].attrs["pixels"]) for name in self._groups)


def read_paths(path: str | os.PathLike[str]) -> tuple[RenderJob, PathsInFile]:
    """Open a file of light paths.

    Raises
    ------
    PathsError
        If the file is missing, is none of light paths, of a later version, or damaged.
    """
    import h5py

    path = Path(os.path.abspath(path))
    try:
        file = h5py.File(path, "r")
        said = {name: _text(file.attrs.get(name, "?")) for name in ("format", "format_version", "fluorspar")}
    except FileNotFoundError as err:
        raise PathsError(message("there is no such file", where=path)) from err
    except _DAMAGE as err:
        fault = "the file cannot be read" if path.is_dir() else "the file is damaged, or holds no light paths"
        raise PathsError(message(fault, where=path, got=_first_line(err), expected=_EXPECTED)) from err
    if said["format"] != _FORMAT:
        raise PathsError(message("the file holds no light paths", where=path, expected=_EXPECTED))
    if said["format_version"] != str(_VERSION):
        raise PathsError(
            message(
                "the light paths are of another version",
                where=path,
                got=f"version {said['format_version']}, written by Fluorspar {said['fluorspar']}",
                expected=f"version {_VERSION}",
                fix="trace the scene again, or use the Fluorspar that wrote them",
            )
        )
    try:
        job, fingerprint = _job(file)
        chunks = PathsInFile(file, path, *count_rows(job.scene), fingerprint)
        _check_runs(chunks, job)
    except (*_DAMAGE, FluorsparError) as err:
        got = f"{type(err).__name__}: {_first_line(err)}"
        fix = "trace the scene again"
        raise PathsError(
            message("the light paths in the file are damaged", where=path, got=got, fix=fix)
        ) from err
    return job, chunks


# What HDF5 and a record raise that are not what they were.
_DAMAGE = (
    OSError,
    RuntimeError,
    KeyError,
    TypeError,
    ValueError,
    IndexError,
    AttributeError,
    OverflowError,
    MemoryError,
)
_EXPECTED = "a file written by 'fluorspar trace' or LightPaths.save"


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def _first_line(err: BaseException) -> str:
    return str(err).partition("\n")[0]


def _job(file: Any) -> tuple[RenderJob, dict[str, str] | None]:
    arrays = [file["arrays"][name][...] for name in sorted(file.get("arrays", ()))]
    record = file["record"][...]
    if _checksum(record, *arrays) != int(file.attrs["crc32"]):
        raise ValueError("a checksum is wrong")
    read = from_record(bytes(record).decode(), arrays)
    given = dict(read["recipe"])
    source, is_file = given.pop("source"), given.pop("is_file")
    given["library"], given["folder"] = tuple(map(Path, given["library"])), Path(given["folder"])
    recipe = Recipe(
        source={} if source is None else Path(source) if is_file else source, materials={}, **given
    )
    scene = Scene(recipe=recipe, _nodes=_NoNodes(recipe.name), **read["scene"])  # type: ignore[arg-type]
    return RenderJob(scene, read["grid"], **read["job"]), read.get("fingerprint")


def _check_runs(chunks: PathsInFile, job: RenderJob) -> None:
    """Refuse runs of pixels that overlap, lie beyond the image or are not all there."""
    settings, at = job.scene.settings, 0
    for name in chunks._groups:
        attrs = chunks._file["chunks"][name].attrs
        if int(attrs["first_pixel"]) < at or int(attrs["spp"]) != settings.spp or int(attrs["pixels"]) <= 0:
            raise ValueError("runs of pixels that do not follow one another")
        at = int(attrs["first_pixel"]) + int(attrs["pixels"])
    if not 0 < at <= settings.width * settings.height:
        raise ValueError(f"paths up to pixel {at} of {settings.width * settings.height}")
    written = int(chunks._file.attrs.get("pixels", at))
    if chunks.pixels != written:
        raise ValueError(f"paths of {chunks.pixels} pixels, where {written} were written")


def _checksum_of(chunk: PackedChunk) -> int:
    place = np.array([chunk.first_pixel, chunk.pixels, chunk.spp])
    return _checksum(place, *(getattr(chunk, name) for name in ARRAYS))


def _checksum(*arrays: Any) -> int:
    checksum = 0
    for array in arrays:
        flat: Any = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
        checksum = zlib.crc32(flat, checksum)
    return checksum


class _NoNodes:
    """In place of the nodes of a scene whose paths come from a file."""

    folders: tuple[str, ...] = ()

    def __init__(self, name: str) -> None:
        self._name = name

    def state(self) -> Any:
        """Raise SceneError."""
        fix = "load the scene itself with load_scene"
        raise SceneError(message("light paths from a file hold no geometry", where=self._name, fix=fix))
