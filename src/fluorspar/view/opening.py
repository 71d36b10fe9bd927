"""What the names given to `fluorspar view` mean."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fluorspar.files.names import text_of
from fluorspar.image.opening import open as open_image
from fluorspar.view.sources import ImageSource, Source

__all__ = ["opened"]


def opened(names: Sequence[str]) -> list[Source]:
    """Open images.

    Raises
    ------
    ImageError
        If a file cannot be read.
    """
    return [ImageSource(text_of(Path(name)), open_image(name)) for name in names]
