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
from fluorspar.view.questions import Relight
from fluorspar.view.turns import Turns

__all__ = ["ImageSource", "Source", "component_facts"]


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
        return KeptImage(self._image, made=False)

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
