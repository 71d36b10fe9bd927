"""What is looked at, as a file to be taken away."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from shutil import rmtree

from fluorspar.image.formats.registry import write_image
from fluorspar.view.kept_image import KeptImage

__all__ = ["KINDS", "file_name", "written"]

KINDS = {
    "nc": "application/x-netcdf",
    "exr": "image/x-exr",
    "png": "image/png",
    "csv": "text/csv; charset=utf-8",
}
"""What each format is called in an answer."""

_OTHER = re.compile(r"[^A-Za-z0-9._+-]+")


def file_name(wanted: str, source: str, suffix: str) -> str:
    """A name that is one on every system, with the suffix.

    Examples
    --------
    >>> file_name("", "/home/me/cornell box.nc", "png"), file_name("../x\\n.nc", "", "nc")
    ('cornell_box.png', 'x.nc')
    """
    name = Path((wanted or source).replace("\\", "/")).name
    stem = _OTHER.sub("_", name.rpartition(".")[0] if "." in name else name).strip("._")
    return f"{stem[:100] or 'image'}.{suffix}"


def written(kept: KeptImage, suffix: str) -> Path:
    """Write an image, all of its components as they are, to a file in a new folder, which is to be removed.

    Raises
    ------
    ImageError
        If it cannot be written.
    """
    folder = Path(tempfile.mkdtemp(prefix="fluorspar-"))
    file = folder / f"image.{suffix}"
    try:
        write_image(kept.whole.dataset, file)
    except BaseException:
        rmtree(folder, ignore_errors=True)
        raise
    return file
