"""Write a spectral image to a Zarr store while it is being rendered, in bounded memory."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, message
from fluorspar.extras import check_extra
from fluorspar.files import run_journal
from fluorspar.files.beside import Temporary
from fluorspar.files.writing import check_folder, write_error
from fluorspar.image.components import COMPONENTS
from fluorspar.image.dataset import VARIABLES
from fluorspar.image.formats.image_writer import ImageWriter
from fluorspar.image.formats.zarr_layout import (
    chunk_shape,
    create,
    describe,
    is_store,
    opened,
    put,
    unfinished_store,
)
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["ZarrWriter"]

_BUFFER_BYTES = 192 * 2**20  # rows of chunks held until they are whole


class _Block:
    """A row of chunks of all variables that is being filled pixel by pixel."""

    def __init__(self, shapes: Mapping[str, tuple[int, ...]], pixels: int) -> None:
        self.arrays = {name: np.empty(shape, np.float32) for name, shape in shapes.items()}
        self.known = np.zeros(pixels, bool)


class ZarrWriter(ImageWriter):
    """Write a spectral image to a Zarr store while it is being rendered; it can be read meanwhile.

    If there is no store of that name yet, the new one has it from the start; what is not finished is NaN, and the
    attribute `partial` is 1 until it is closed. An older store of the name is as it was until then. Leaving the
    `with` block through an exception removes the new one, but see `discard`; to keep what was finished in any case,
    call `close(partial=True)` before.

    Parameters
    ----------
    path : str or path-like
        The store to be written or replaced, a folder.
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
        What is written, in words and digests: attribute `fingerprint` from the start, so that it can be continued.
    resume : bool
        Go on with the unfinished store that is there, in its place, if it has this label.

    Raises
    ------
    FluorsparError
        If the package `zarr` is missing.
    ImageError
        If the store cannot be written. This is found out before anything is rendered.

    Examples
    --------
    >>> import tempfile
    >>> from fluorspar.image.formats.zarr import read_zarr
    >>> path = os.path.join(tempfile.mkdtemp(), "room.zarr")
    >>> with ZarrWriter(path, Wavelengths(), height=2, width=3, attrs={"spp": 16}) as writer:
    ...     for first_pixel in (0, 2, 4):
    ...         writer.write_pixels(first_pixel, np.ones((2, 7, 69)), np.zeros((2, 69)))
    >>> read_zarr(path).radiance.shape
    (7, 2, 3, 69)
    """

    kind = "store"

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
        resume: bool = False,
    ) -> None:
        check_extra("cluster")
        super().__init__(wavelengths, height, width, attrs, component_errors, len(components))
        self._rows, _ = chunk_shape(height, width, len(wavelengths))
        block_bytes = 4 * len(wavelengths) * sum(self._layers.values()) * self._rows * width
        self._held = max(_BUFFER_BYTES // block_bytes, 2)
        self._blocks: dict[int, _Block] = {}  # in the order of their last use
        self._spilled: dict[int, NDArray[np.bool_]] = {}
        self._spare: list[_Block] = []
        self.path = check_folder(path, is_store, "Zarr store of a spectral image")
        self._open, self._labelled, self._began = True, label is not None, time.monotonic()
        shapes = {
            name: (*((count,) if "component" in VARIABLES[name][1] else ()), height, width, len(wavelengths))
            for name, count in self._layers.items()
        }
        left = unfinished_store(self.path, label, shapes) if resume and label is not None else None
        self._goes_on = left is not None
        try:
            self._temporary = Temporary(self.path, None if left is None else self.path, folder=True)
        except OSError as err:
            raise write_error(self.path, err) from err
        with self._step():
            if left is not None:
                self._group = left
                self._take_over()
                return
            create(
                self._temporary.path,
                wavelengths,
                components,
                height,
                width,
                list(self._layers),
                {**self.attrs, "fingerprint": label and dict(label), "partial": 1},
            )
            self._temporary.take_place()
            self._group = opened(self._temporary.path)

    @property
    def _is_open(self) -> bool:
        return self._open

    def read_pixels(self, variable: str, first_pixel: int, count: int) -> NDArray[np.float32]:
        """Read pixels that have been written.

        Returns
        -------
        ndarray of shape (C or 1, count, N)
        """
        parts = []
        with self._step():
            for number, start, stop in self._pieces(first_pixel, count):
                block = self._blocks.get(number)
                values = self._stored(variable, number) if block is None else block.arrays[variable]
                parts.append(values[:, start:stop])
        return np.concatenate(parts, axis=1)

    def _write(self, first_pixel: int, count: int, given: Mapping[str, NDArray[np.floating]]) -> None:
        done = 0
        for number, start, stop in self._pieces(first_pixel, count):
            block = self._block(number)
            for name in self._layers:
                pixels = given[name][done : done + stop - start]
                block.arrays[name][:, start:stop] = pixels.swapaxes(0, 1)
            block.known[start:stop] = True
            done += stop - start
            if block.known[: self._pixels_in(number)].all():
                self._flush(number)
        self._known[first_pixel : first_pixel + count] = True

    def _complete(self) -> None:
        for number in list(self._blocks):
            self._flush(number)
        describe(self._group, self.attrs)
        self._temporary.keep()
        self._open = False

    def discard(self) -> None:
        """Give the store up: leave what is finished, to be continued, or nothing.

        It is left if it went on with an unfinished one, or if it is labelled, took more than a few seconds, and there
        was no older store of the name, which stays as it was.
        """
        if self._open and self._can_go_on:
            with suppress(OSError, RuntimeError):  # the disk may be full
                for number in list(self._blocks):
                    self._flush(number)
            self._temporary.leave()
        self._open = False
        self._temporary.drop()
        self._blocks.clear()

    @property
    def _can_go_on(self) -> bool:
        in_place = self._temporary.path == self.path
        is_long = time.monotonic() - self._began > run_journal.SYNC_EVERY
        return self._goes_on or (self._labelled and in_place and is_long)

    def _take_over(self) -> None:
        """Find out which pixels of an unfinished store are there."""
        for torn in self.path.rglob("*.partial"):  # of a chunk that was being written
            torn.unlink()
        first = self._group["radiance"]
        for number in range(-(-self.height // self._rows)):
            rows = slice(number * self._rows, (number + 1) * self._rows)
            try:
                known = ~np.isnan(first[0, rows, :, 0].ravel())
            except (OSError, RuntimeError, ValueError) as err:
                fix = "render it anew, without --resume"
                raise ImageError(
                    message("the unfinished image is damaged", where=self.path, got=err, fix=fix)
                ) from err
            self._known[number * self._rows * self.width :][: len(known)] = known
            if known.any() and not known.all():
                self._spilled[number] = known

    def _pieces(self, first_pixel: int, count: int) -> Iterator[tuple[int, int, int]]:
        """Cut a run of pixels at the ends of blocks: the number of each block, and first and last pixel in it."""
        done, whole = 0, self._rows * self.width
        while done < count:
            number, start = divmod(first_pixel + done, whole)
            stop = min(start + count - done, whole)
            yield number, start, stop
            done += stop - start

    def _pixels_in(self, number: int) -> int:
        return min(self._rows, self.height - number * self._rows) * self.width

    def _block(self, number: int) -> _Block:
        """Fetch a block and move it to the end of the line; the first in line goes if there are too many."""
        block = self._blocks.pop(number, None)
        if block is None:
            while len(self._blocks) >= self._held:
                self._flush(next(iter(self._blocks)))
            pixels = self._rows * self.width
            shapes = {name: (count, pixels, len(self.wavelengths)) for name, count in self._layers.items()}
            block = self._spare.pop() if self._spare else _Block(shapes, pixels)
            block.known[:] = False
            if number in self._spilled:
                self._reload(number, block)
        self._blocks[number] = block
        return block

    def _flush(self, number: int) -> None:
        """Write a block to the store; one with gaps is remembered, to be completed later."""
        block = self._blocks.pop(number)
        pixels = self._pixels_in(number)
        gaps = ~block.known[:pixels]
        if gaps.any():
            self._spilled[number] = block.known.copy()
        # the first component of all comes last: where it is, all is
        for name, array in reversed(block.arrays.items()):
            if gaps.any():
                array[:, :pixels][:, gaps] = np.nan
            for layer, values in reversed(list(enumerate(array))):
                component = layer if "component" in VARIABLES[name][1] else None
                rows = values[:pixels].reshape(-1, self.width, len(self.wavelengths))
                put(self._group[name], component, number * self._rows, rows)
        self._spare = [block]

    def _reload(self, number: int, block: _Block) -> None:
        known, pixels = self._spilled.pop(number), self._pixels_in(number)
        block.known[:pixels] = known[:pixels]
        for name, array in block.arrays.items():
            array[:, :pixels] = self._stored(name, number)

    def _stored(self, name: str, number: int) -> NDArray[np.float32]:
        """Read a block from the store, ndarray of shape (C or 1, pixels, N)."""
        rows = slice(number * self._rows, min((number + 1) * self._rows, self.height))
        values: NDArray[np.float32] = self._group[name][..., rows, :, :]
        return values.reshape(self._layers[name], self._pixels_in(number), -1)
