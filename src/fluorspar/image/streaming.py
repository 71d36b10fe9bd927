"""Where an image goes while it is made: into memory, or into a file if it is large."""

from __future__ import annotations

import logging
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.filesize import decimal

from fluorspar.files.memory import is_large
from fluorspar.files.temporary import temporary_folder
from fluorspar.image.components import COMPONENTS

__all__ = ["bytes_of_image", "streamed_to"]

_LOG = logging.getLogger(__name__)


def bytes_of_image(size: tuple[int, int], bands: int, component_errors: bool = False) -> int:
    """What an image of so many pixels, with all components and their errors, takes in memory.

    Examples
    --------
    >>> bytes_of_image((512, 512), 69)
    578813952
    """
    planes = (1 + len(COMPONENTS)) * (1 + component_errors)
    return 4 * planes * size[0] * size[1] * bands


@contextmanager
def streamed_to(
    outputs: Sequence[Path],
    size: tuple[int, int],
    bands: int,
    *,
    component_errors: bool = False,
    denoise: bool = False,
    only_large: bool = False,
    temporary: bool = True,
) -> Iterator[Path | None]:
    """Choose where an image goes while it is made.

    Parameters
    ----------
    outputs : sequence of Path
        The files that it is for.
    size : (int, int)
        Width and height.
    bands : int
    component_errors : bool
    denoise : bool
        Whether it is not yet what is written.
    only_large : bool
        Stream to one of the files only what is large.
    temporary : bool
        Whether another file may hold it meanwhile. Not so if it is in memory as a whole before it is written, or if a
        file is to be gone on with.

    Yields
    ------
    Path or None
        One of the files; or without one that it can be streamed to a temporary file, which is there within the body, if
        the image is large and there is room for it; else None: it is kept in memory.

    Examples
    --------
    >>> for name in ("room.nc", "room.png"):
    ...     with streamed_to([Path(name)], (16, 16), 69) as path:
    ...         print(path)
    room.nc
    None
    """
    needed = bytes_of_image(size, bands, component_errors)
    target, large = None, is_large(needed)
    if not denoise:
        target = next((path for path in outputs if path.suffix.lower() in (".nc", ".zarr")), None)
    if target is not None and (large or not only_large):
        yield target
    elif not (large and temporary) or shutil.disk_usage(temporary_folder()).free < needed:
        yield None
    else:
        with TemporaryDirectory(dir=temporary_folder()) as folder:
            _LOG.info("the image, %s, is kept in %s meanwhile", decimal(needed), folder)
            yield Path(folder, "image.nc")
