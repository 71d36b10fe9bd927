"""Write a spectral image to a NetCDF file while it is being rendered, in bounded memory."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.files.beside import Temporary
from fluorspar.files.patient_file import PatientFile
from fluorspar.files.run_journal import Left, RunJournal
from fluorspar.files.writing import check_target, write_error
from fluorspar.image.components import COMPONENTS
from fluorspar.image.formats.image_writer import ImageWriter
from fluorspar.image.formats.netcdf_layout import create, places, write_attrs
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["NetcdfWriter"]


class NetcdfWriter(ImageWriter):
    """Write a spectral image to a NetCDF file while it is being rendered.

    The file has a temporary name until it is closed. Leaving the `with` block through an exception removes it
    and leaves an older file of the name as it was; to keep what was finished, call `close(partial=True)`
    before.

    Parameters
    ----------
    path : str or path-like
        The file to be written or replaced.
    wavelengths : Wavelengths
        The N wavelengths.
    height, width : int
        Size of the image in pixels.
    attrs : mapping, optional
        Attributes of the data set.
    component_errors : bool
        Whether the standard errors of the components will be given too.
    components : sequence of str
        The C components.
    label : mapping, optional
        What is written, in words and digests. A writer that is killed, or whose disk is full, after more than a few
        seconds then leaves what is finished, with a journal, to be continued.
    left : Left, optional
        What to go on with, see `left_of`.

    Raises
    ------
    ImageError
        If the file cannot be written, what was left is of another version of HDF5, or the disk has not enough space.
        This is found out before anything is rendered.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar.image.formats.netcdf import read_netcdf
    >>> path = os.path.join(tempfile.mkdtemp(), "room.nc")
    >>> with NetcdfWriter(path, Wavelengths(), height=2, width=3, attrs={"spp": 16}) as writer:
    ...     for first_pixel in (0, 2, 4):
    ...         writer.write_pixels(first_pixel, np.ones((2, 7, 69)), np.zeros((2, 69)))
    >>> read_netcdf(path).radiance.shape
    (7, 2, 3, 69)
    """

    kind = "file"

    def __init__(
        self,
        path: str | os.PathLike[str],
        wavelengths: Wavelengths,
        height: int,
        width: int,
        attrs: Mapping[str, Any] | None = None,
        component_errors: bool = False,
        *,
        components: Sequence[str] = COMPONENTS,
        label: Mapping[str, str] | None = None,
        left: Left | None = None,
    ) -> None:
        super().__init__(wavelengths, height, width, attrs, component_errors, len(components))
        pixel_bytes = 4 * len(wavelengths) * sum(self._layers.values())
        there = 0 if left is None else sum(count for _, count in left.runs)
        self.path = check_target(path, (height * width - there) * pixel_bytes)
        self._data = -1
        self._journal: RunJournal | None = None
        try:
            self._temporary = Temporary(self.path, None if left is None else left.path)
            try:
                self._begin(components, label, left)
            except BaseException:
                if left is None:
                    self._temporary.drop()
                else:
                    self._temporary.leave()
                raise
        except OSError as err:
            raise write_error(self.path, err) from err

    @property
    def _is_open(self) -> bool:
        return self._data >= 0

    def _write(self, first_pixel: int, count: int, given: Mapping[str, NDArray[np.floating]]) -> None:
        for name in self._layers:
            for layer, pixels in enumerate(given[name].swapaxes(0, 1)):
                self._put(name, layer, first_pixel, pixels)
        self._known[first_pixel : first_pixel + count] = True
        if self._journal is not None:
            self._journal.add(first_pixel, count)

    def _complete(self) -> None:
        self._fill_gaps()
        if self._journal is not None:
            self._journal.close()  # all is on the disk if it took long
        os.close(self._data)
        self._data = -1
        write_attrs(self._temporary.path, self.attrs)
        self._temporary.keep(durable=self._can_go_on)

    def discard(self) -> None:
        """Give the file up; an older file of the name stays as it was.

        What is in the journal is left, to be continued; without one nothing is.
        """
        if self._data >= 0:
            if self._journal is not None:
                with suppress(OSError):  # the disk may be full
                    self._journal.close()
            os.close(self._data)
            self._data = -1
        if self._can_go_on:
            self._temporary.leave()
        else:
            self._temporary.drop()

    @property
    def _can_go_on(self) -> bool:
        return self._journal is not None and self._journal.is_begun

    def _begin(self, components: Sequence[str], label: Mapping[str, str] | None, left: Left | None) -> None:
        """Lay out the file, or go on with what was left of it."""
        path = self._temporary.path
        if left is None:
            rows, self._places = self._lay_out(path, components)
        else:
            beside = Temporary(self.path)
            try:
                rows, self._places = self._lay_out(beside.path, components)
                self._renew(beside.path, rows, left)
            finally:
                beside.drop()
        self._block = rows * self.width  # pixels that follow one another in the file
        self._data = os.open(path, os.O_RDWR)
        if label is not None:
            header = {"label": dict(label), "places": self._places_as_lists()}
            self._journal = RunJournal(
                self._temporary.journal, header, self._data, 0 if left is None else left.end
            )

    def _lay_out(self, path: Path, components: Sequence[str]) -> tuple[int, dict[str, NDArray[np.int64]]]:
        """Create the file without pixels; return where they belong, see `places`."""
        with PatientFile(path) as stream:
            size = self.height, self.width
            create(
                stream, self.wavelengths, components, *size, list(self._layers), self.attrs, in_place=True
            ).close()
            stream.check()
            return places(stream, list(self._layers))

    def _places_as_lists(self) -> dict[str, Any]:
        return {name: where.tolist() for name, where in self._places.items()}

    def _renew(self, fresh: Path, rows: int, left: Left) -> None:
        """Take all but the pixels from a file without pixels: the writer may have been killed while closing."""
        if left.header.get("places") != self._places_as_lists():
            raise ImageError(
                message(
                    "the unfinished image cannot be continued",
                    where=left.path,
                    got="a file of another version of HDF5",
                    fix="render it anew, without --resume",
                )
            )
        size = 4 * rows * self.width * len(self.wavelengths)
        with fresh.open("rb") as source, left.path.open("r+b") as file:
            end = source.seek(0, os.SEEK_END)
            begins = np.sort(np.concatenate([where.ravel() for where in self._places.values()])).tolist()
            for begin, stop in zip([0, *(at + size for at in begins)], [*begins, end], strict=True):
                source.seek(begin)
                file.seek(begin)
                file.write(source.read(stop - begin))
            file.truncate(end)
        for first, count in left.runs:
            self._known[first : first + count] = True

    def _put(self, name: str, layer: int, first_pixel: int, pixels: NDArray[np.floating]) -> None:
        """Write pixels of a layer to where they belong, past HDF5, of which a crash then leaves nothing half done."""
        pixels = np.ascontiguousarray(pixels, dtype=np.float32)
        for place, run in self._pieces(name, layer, first_pixel, pixels):
            data: Any = run.view(np.uint8).reshape(-1)
            left = memoryview(data)
            while left:
                written = os.pwrite(self._data, left, place)
                left, place = left[written:], place + written

    def read_pixels(self, variable: str, first_pixel: int, count: int) -> NDArray[np.float32]:
        """Read pixels that have been written.

        Returns
        -------
        ndarray of shape (C or 1, count, N)
        """
        found = np.empty((self._layers[variable], count, len(self.wavelengths)), np.float32)
        with self._step():
            for layer, pixels in enumerate(found):
                for place, run in self._pieces(variable, layer, first_pixel, pixels):
                    run[...] = np.frombuffer(os.pread(self._data, run.nbytes, place), np.float32).reshape(
                        run.shape
                    )
        return found

    def _pieces(
        self, name: str, layer: int, first_pixel: int, pixels: NDArray[np.float32]
    ) -> Iterator[tuple[int, NDArray[np.float32]]]:
        """Cut pixels of a layer into what lies together in the file, each with its place there."""
        done = 0
        while done < len(pixels):
            number, start = divmod(first_pixel + done, self._block)
            run = pixels[done : done + self._block - start]
            yield int(self._places[name][layer, number]) + start * pixels[0].nbytes, run
            done += len(run)

    def _fill_gaps(self) -> None:
        edges = np.flatnonzero(np.diff(self._known, prepend=True, append=True))
        for first, stop in edges.reshape(-1, 2).tolist():
            for start in range(first, stop, self._block):
                shape = min(self._block, stop - start), len(self.wavelengths)
                missing = np.full(shape, np.nan, np.float32)
                for name, layers in self._layers.items():
                    for layer in range(layers):
                        self._put(name, layer, start, missing)
