"""Everything one server holds: what is looked at, files that were uploaded, and images that were made."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.adaptation import is_adaptable
from fluorspar.colour.xyz import white_xyz
from fluorspar.errors import FluorsparError, OptionError, message
from fluorspar.files.memory import available_memory
from fluorspar.spectral.illuminants import illuminant
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.view.heard import heard
from fluorspar.view.image_cache import ImageCache
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.lamps import known_illuminant
from fluorspar.view.matrices import matrix_of
from fluorspar.view.pictures import exposure_of
from fluorspar.view.questions import LightSetting, MatrixAsked, View, WhiteLight
from fluorspar.view.relighting import light_of, relit_scene
from fluorspar.view.scene_facts import material_on
from fluorspar.view.sources import ImageSource, Source
from fluorspar.view.supplies import Supplies
from fluorspar.view.turns import Abandoned, Turns

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
    supplies : Supplies, optional
        Lamps and dyes that views may name.
    """

    def __init__(self, sources: Sequence[Source], supplies: Supplies | None = None) -> None:
        self.sources = {str(number): source for number, source in enumerate(sources)}
        self.supplies = supplies or Supplies()
        self._turns = Turns()
        self._closed = threading.Event()
        self._beginning: threading.Thread | None = None
        self._cache = ImageCache(min(_MOST_BYTES, available_memory() // _SHARE))

    def start(self) -> None:
        """Begin what goes on in the background: the library is read, which pages need first, then scenes are traced."""

        def begin() -> None:
            with suppress(FluorsparError):  # which a page is told when it asks
                self.menus()
            for source in self.sources.values():
                source.start(self._turns)

        self._beginning = threading.Thread(target=begin, name="beginning")
        self._beginning.start()

    def close(self) -> None:
        """End it, and whatever is being made."""
        self._closed.set()
        if self._beginning is not None:
            self._beginning.join()
        for source in self.sources.values():
            source.stop()

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

    def image(self, view: View, abandoned: threading.Event | None = None) -> KeptImage:
        """The image of a view, made now unless it was asked for before.

        Raises
        ------
        Abandoned
            If the event comes before it is done, or the end.
        FluorsparError
            If it cannot be made.
        """
        source = self.source(view.source)
        coarse = view.coarse and source.kind != "image"
        window = view.window if isinstance(source, ImageSource) else None
        key = (view.source, view.relight.key, str(coarse), str(window))

        def progress(done: int, whole: int) -> None:
            if self._closed.is_set() or (abandoned is not None and abandoned.is_set()):
                raise Abandoned

        with self._turns.looking(abandoned):
            kept = self._cache.get(key)
            if kept is not None and kept.generation == source.generation:
                return kept
            with heard() as texts:
                if isinstance(source, ImageSource) and window is not None:
                    made = source.window(window)
                else:
                    made = source.image(view.relight, coarse, progress)
            made.notes += tuple(texts)
            return self._cache.put(key, made)

    def white(self, view: View) -> Array | None:
        """XYZ of the white that a view is adapted to, of any scale, ndarray of shape (3,); None if to none."""
        if view.white is None:
            return None
        if isinstance(view.white, tuple):
            white = np.array(view.white)
        else:
            grid = self.image(view).image.wavelengths
            if isinstance(view.white, WhiteLight):
                light = self.light(view.source, view.white.light, view.relight.lights.get(view.white.light))
            else:
                light = illuminant(known_illuminant(view.white))
            white = white_xyz(light.on(grid, outside="hold"), grid)
        if not is_adaptable(white):
            fix = "choose a less saturated light, or no adaptation"
            raise OptionError(message("this white is too saturated to adapt to", got=f"XYZ {white}", fix=fix))
        return white

    def light(self, source: str, name: str, setting: LightSetting | None) -> Spectrum:
        """The spectrum of a light of a source as it is set."""
        return light_of(self.source(source).job.scene, name, setting, self.supplies)

    def matrix(self, asked: MatrixAsked) -> dict[str, Any]:
        """The Donaldson matrix of a surface in a view."""
        job = self.source(asked.source).job
        scene = relit_scene(job.scene, asked.relight, self.supplies)
        return matrix_of(material_on(scene, asked.surface, asked.side), job.computed_grid)

    def white_of_lab(self, view: View) -> Array:
        """The white of CIELAB where no region is the white: that of the picture, D65 unless it is adapted.

        NaN if no wavelength of the image can be seen.
        """
        white, kept = self.white(view), self.image(view)
        exposure = exposure_of(kept, view, white)
        seen = _daylight(kept.image.wavelengths) if white is None else white
        with np.errstate(invalid="ignore"):
            return np.asarray(seen / seen[1] / exposure)

    def menus(self) -> dict[str, Any]:
        """What lamps and dyes there are to choose from."""
        with self._turns.looking(None):
            return self.supplies.menus

    def about(self) -> list[dict[str, Any]]:
        """Every source with its id."""
        with self._turns.looking(None):  # colours of materials are made, once
            return [
                {"id": name, "name": source.name, "kind": source.kind} | source.about() | source.progress()
                for name, source in self.sources.items()
            ]

    def progress(self) -> list[dict[str, Any]]:
        """How far the tracing of every source is."""
        return [{"id": name} | source.progress() for name, source in self.sources.items()]


@lru_cache(maxsize=32)
def _daylight(grid: Wavelengths) -> Array:
    """XYZ of D65; 0 if none of it is in the grid."""
    daylight = illuminant("D65")
    seen = grid.start <= daylight.wavelengths[-1] and grid.stop >= daylight.wavelengths[0]
    return white_xyz(daylight.on(grid, outside="hold"), grid) if seen else np.zeros(3)
