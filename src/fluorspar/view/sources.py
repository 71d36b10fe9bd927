"""What is looked at: an image, light paths, or a scene that is being traced."""

from __future__ import annotations

from typing import Any, Protocol

from fluorspar.errors import OptionError, message
from fluorspar.image.components import TOTAL, definition
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import unit_of_image
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.questions import Relight

__all__ = ["ImageSource", "Source", "described"]


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

    def image(self, relight: Relight, coarse: bool, before: KeptImage | None) -> KeptImage:
        """The image under other lights, with other materials; `before` is an older one of the same."""

    def light(self, relight: Relight, name: str) -> Spectrum:
        """The spectrum of a light as it is in a view."""

    def about(self) -> dict[str, Any]:
        """What is to be said of it, but for its id."""

    def progress(self) -> dict[str, Any]:
        """How far its tracing is."""


class ImageSource:
    """An image, as it is."""

    kind = "image"
    generation = 0

    def __init__(self, name: str, image: SpectralImage) -> None:
        self.name, self._image = name, image

    def image(self, relight: Relight, coarse: bool, before: KeptImage | None) -> KeptImage:
        """The image; its lamps are what they are."""
        if not relight.is_nothing:
            fix = "view a scene, or the light paths that 'fluorspar trace' keeps of it"
            raise OptionError(message("an image cannot be relit", where=self.name, fix=fix))
        return before or KeptImage(self._image)

    def light(self, relight: Relight, name: str) -> Spectrum:
        """An image knows none."""
        raise OptionError(message("an image knows no lights", where=self.name, got=repr(name)))

    def about(self) -> dict[str, Any]:
        """Facts of the image."""
        return described(self._image) | {"lights": [], "surfaces": []}

    def progress(self) -> dict[str, Any]:
        """Nothing goes on."""
        return {"generation": 0, "progress": None, "error": None}


def described(image: SpectralImage) -> dict[str, Any]:
    """Facts of an image.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar import Wavelengths
    >>> described(SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths()))["size"]
    (6, 4)
    """
    return {
        "size": image.size,
        "wavelengths": image.wavelengths.values,
        "unit": unit_of_image(image),
        "components": [
            {
                "name": name,
                "number": None if name == TOTAL else definition(name).number,
                "label": name.replace("_", " "),
            }
            for name in image.components
        ],
        "standard_error": "standard_error" in image.dataset,
        "partial": bool(image.attrs.get("partial")),
        "attrs": image.attrs,
    }
