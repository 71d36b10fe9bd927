"""What is looked at: an image, light paths, or a scene that is being traced."""

from __future__ import annotations

from typing import Any, Protocol

from fluorspar.errors import OptionError, message
from fluorspar.image.components import TOTAL, definition
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import unit_of_image
from fluorspar.job import RenderJob
from fluorspar.progress import Progress
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.questions import Region, Relight
from fluorspar.view.turns import Turns

__all__ = ["ImageSource", "Source", "component_facts"]


_LARGE = 2048  # pixels of a side that are shown at once
_OVERVIEW = 1024


class Source(Protocol):
    """Something of which there is an image.

    Attributes
    ----------
    name : str
        What to call it.
    kind : str
        "image", "paths" or "scene".
    """

    name: str
    kind: str

    @property
    def generation(self) -> int:
        """Grows whenever pictures are worth asking for again."""

    @property
    def job(self) -> RenderJob:
        """What was traced; OptionError if nothing was."""

    def image(self, relight: Relight, coarse: bool, progress: Progress | None = None) -> KeptImage:
        """The image under other lights, with other materials."""

    def about(self) -> dict[str, Any]:
        """What is to be said of it, but for its id."""

    def progress(self) -> dict[str, Any]:
        """How far its tracing is."""

    def start(self, turns: Turns) -> None:
        """Begin what goes on in the background."""

    def stop(self) -> None:
        """End it."""


class ImageSource:
    """An image, as it is."""

    kind = "image"
    generation = 0

    def __init__(self, name: str, image: SpectralImage) -> None:
        self.name, self._image = name, image

    @property
    def job(self) -> RenderJob:
        """An image knows no lights and no surfaces."""
        fix = "view a scene, or the light paths that 'fluorspar trace' keeps of it"
        raise OptionError(message("an image cannot be relit", where=self.name, fix=fix))

    def image(self, relight: Relight, coarse: bool, progress: Progress | None = None) -> KeptImage:
        """The image; what is to be changed is refused."""
        if not relight.is_nothing:
            _ = self.job
        width, height = self._image.size
        if max(width, height) <= _LARGE:
            return KeptImage(self._image, made=False)
        return self._shown((0, 0, width - 1, height - 1), _OVERVIEW)

    def window(self, region: Region) -> KeptImage:
        """A part of a large image, all of its pixels if they are not too many for a screen.

        Raises
        ------
        OptionError
            If it is not within the image.
        """
        (x0, y0, x1, y1), (width, height) = region, self._image.size
        if not (0 <= x0 <= x1 < width and 0 <= y0 <= y1 < height):
            expected = f"x0 <= x1 < {width}, y0 <= y1 < {height}"
            raise OptionError(message("the window is outside the image", got=region, expected=expected))
        return self._shown(region, _LARGE)

    def _shown(self, region: Region, longest: int) -> KeptImage:
        """Every pixel of a region, or every second, third, ... of its rows and columns."""
        x0, y0, x1, y1 = region
        every = -(-max(x1 + 1 - x0, y1 + 1 - y0) // longest)
        part = self._image.dataset.isel(x=slice(x0, x1 + 1, every), y=slice(y0, y1 + 1, every))
        kept = KeptImage(SpectralImage(part), made=False, whole=self._image)
        if every > 1:
            kept.notes = (
                f"The image is large: of every {every} rows and columns one is shown, and counts for exposure, "
                "shares and differences. Zoom in to see all; spectra and files are of all pixels.",
            )
        return kept

    def about(self) -> dict[str, Any]:
        """Facts of the image."""
        image = self._image
        return {
            "size": image.size,
            "wavelengths": image.wavelengths.values,
            "unit": unit_of_image(image),
            "components": component_facts(image.components),
            "standard_error": "standard_error" in image.dataset,
            "partial": bool(image.attrs.get("partial")),
            "attrs": image.attrs,
            "lights": [],
            "surfaces": [],
        }

    def progress(self) -> dict[str, Any]:
        """Nothing goes on."""
        return {"generation": 0, "progress": None, "error": None}

    def start(self, turns: Turns) -> None:
        """Nothing begins."""

    def stop(self) -> None:
        """Nothing ends."""


def component_facts(names: tuple[str, ...]) -> list[dict[str, Any]]:
    """Name, number and label of components; the number is None of an image that is not split.

    Examples
    --------
    >>> component_facts(("total",))
    [{'name': 'total', 'number': None, 'label': 'total'}]
    """
    return [
        {
            "name": name,
            "number": None if name == TOTAL else definition(name).number,
            "label": name.replace("_", " "),
        }
        for name in names
    ]
