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

__all__ = ["bytes_of_image", "stream_target", "streamed_to"]

_LOG = logging.getLogger(__name__)


def stream_target(outputs: Sequence[Path]) -> Path | None:
    """Choose the file that the image is streamed to while it is rendered, if one is NetCDF or Zarr."""
    return next((path for path in outputs if path.suffix.lower() in (".nc", ".zarr")), None)


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
    target: Path | None, size: tuple[int, int], bands: int, *, component_errors: bool = False
) -> Iterator[Path | None]:
    """Choose where an image goes that cannot always be streamed to one of its files.

    Parameters
    ----------
    target : Path or None
        The file that it can be streamed to.
    size : (int, int)
        Width and height.
    bands : int
    component_errors : bool

    Yields
    ------
    Path or None
        That file; or without one a temporary file, which is there within the body, if the image is large and there is
        room for it; else None: it is kept in memory.

    Examples
    --------
    >>> with streamed_to(None, (16, 16), 69) as path:
    ...     print(path)
    None
    """
    needed = bytes_of_image(size, bands, component_errors)
    if target is not None or not is_large(needed) or shutil.disk_usage(temporary_folder()).free < needed:
        yield target
        return
    with TemporaryDirectory(dir=temporary_folder()) as folder:
        _LOG.info("the image, %s, is kept in %s meanwhile", decimal(needed), folder)
        yield Path(folder, "image.nc")
