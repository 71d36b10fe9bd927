"""Everything one server holds: what is looked at, files that were uploaded, and images that were made."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.xyz import white_xyz
from fluorspar.errors import FluorsparError, FluorsparWarning, message
from fluorspar.files.memory import available_memory
from fluorspar.spectral.illuminants import illuminant
from fluorspar.view.image_cache import ImageCache
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.pictures import exposed
from fluorspar.view.questions import View, WhiteLight
from fluorspar.view.sources import Source

__all__ = ["UnknownSource", "Workspace"]

Array = NDArray[np.float64]

_MOST_BYTES = 2 * 2**30
_SHARE = 4  # of the memory that is free


class UnknownSource(FluorsparError):
    """There is no source of that id."""


class Workspace:
    """Sources by their ids, and what was made of them.

    Parameters
    ----------
    sources : sequence of Source
        Their ids are their numbers.
    folders : sequence of Path
        Of materials of the user's own.
    """

    def __init__(self, sources: Sequence[Source], folders: Sequence[Path] = ()) -> None:
        self.sources = {str(number): source for number, source in enumerate(sources)}
        self.folders = tuple(folders)
        self.making = threading.Lock()  # one image at a time has all cores
        self._cache = ImageCache(min(_MOST_BYTES, available_memory() // _SHARE))

    def source(self, name: str) -> Source:
        """The source of an id.

        Raises
        ------
        UnknownSource
            If there is none; the message lists those there are.
        """
        if name not in self.sources:
            known = ", ".join(self.sources)
            raise UnknownSource(message("there is no such source", got=repr(name), expected=known))
        return self.sources[name]

    def image(self, view: View) -> KeptImage:
        """The image of a view, made now unless it was asked for before."""
        source = self.source(view.source)
        coarse = view.coarse and source.kind != "image"
        key = (view.source, view.relight.key, str(coarse))
        with self.making:
            kept = self._cache.get(key)
            if kept is not None and kept.generation == source.generation:
                return kept
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", FluorsparWarning)
                made = source.image(view.relight, coarse, kept)
            made.add_notes(
                str(each.message) for each in caught if issubclass(each.category, FluorsparWarning)
            )
            return self._cache.put(key, made)

    def white(self, view: View) -> Array | None:
        """XYZ of the white that a view is adapted to, of any scale, ndarray of shape (3,); None if to none."""
        if view.white is None:
            return None
        if isinstance(view.white, tuple):
            return np.array(view.white)
        grid = self.image(view).image.wavelengths
        if isinstance(view.white, WhiteLight):
            light = self.source(view.source).light(view.relight, view.white.light)
        else:
            light = illuminant(view.white)
        return white_xyz(light.on(grid, outside="hold"), grid)

    def white_of_lab(self, view: View) -> Array:
        """The white of CIELAB where no region is the white: that of the picture, D65 unless it is adapted."""
        white = self.white(view)
        kept = self.image(view)
        if white is None:
            grid = kept.image.wavelengths
            white = white_xyz(illuminant("D65").on(grid, outside="hold"), grid)
            exposure = exposed(kept, view, None)[1]
        else:
            exposure = exposed(kept, view, white)[1]
        return white / white[1] / exposure

    def about(self) -> list[dict[str, Any]]:
        """Every source with its id."""
        return [
            {"id": name, "name": source.name, "kind": source.kind} | source.about() | source.progress()
            for name, source in self.sources.items()
        ]

    def progress(self) -> list[dict[str, Any]]:
        """How far the tracing of every source is."""
        return [{"id": name} | source.progress() for name, source in self.sources.items()]
