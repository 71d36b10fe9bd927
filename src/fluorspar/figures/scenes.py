"""Figures of spectra, of the materials and lights of a scene, and of an image."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fluorspar.figures.style import blank, put_title, styled
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.scene.scene import Scene
from fluorspar.spectral.spectrum import Spectrum

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["image_figure", "scene_figure", "spectrum_figure"]

_SEEN = (360.0, 780.0)  # nm, where a constant is drawn


def spectrum_figure(spectrum: Spectrum) -> Figure:
    """Draw a spectrum over its own wavelengths.

    Examples
    --------
    >>> from fluorspar.spectral.illuminants import illuminant
    >>> spectrum_figure(illuminant("A")).axes[0].get_title(loc="left")
    'illuminant A'
    """
    return styled(_spectrum, spectrum)


def scene_figure(scene: Scene) -> Figure:
    """Draw the reflectances of the materials of a scene, and the spectra of its lights, each over its greatest value.

    Examples
    --------
    >>> from fluorspar.scene.loading import load_scene
    >>> [panel.get_ylabel() for panel in scene_figure(load_scene("cornell-box")).axes]
    ['reflectance S', 'relative']
    """
    return styled(_scene, scene)


def image_figure(image: SpectralImage) -> Figure:
    """Draw the total of an image as a display shows it, without interpolation.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths(), attrs={"scene": "a room"})
    >>> image_figure(image).axes[0].get_title(loc="left")
    'a room'
    """
    return styled(_image, image)


def _spectrum(spectrum: Spectrum) -> Figure:
    figure = blank(3.6, 2.4)
    panel = figure.subplots()
    _curves(panel, [spectrum], [""])
    put_title(panel, spectrum.title)
    return figure


def _scene(scene: Scene) -> Figure:
    figure = blank(7.2, 2.6)
    surfaces, lights = figure.subplots(1, 2)
    _curves(surfaces, [m.reflectance for m in scene.materials], [m.name for m in scene.materials])
    relative = [light.spectrum.scaled(1 / (light.spectrum.values.max() or 1.0)) for light in scene.lights]
    _curves(lights, relative, [light.name for light in scene.lights])
    surfaces.set_ylabel("reflectance S")
    lights.set_ylabel("relative")
    put_title(surfaces, f"{scene.name}: materials")
    put_title(lights, "lights")
    return figure


def _image(image: SpectralImage) -> Figure:
    width, height = image.size
    figure = blank(4.8, min(4.8 * height / width, 7.2) + 0.2)
    panel = figure.subplots()
    panel.imshow(image.srgb().fillna(0.2), interpolation="nearest")
    panel.set_axis_off()
    put_title(panel, str(image.attrs.get("scene", "an image")))
    return figure


def _curves(panel: Axes, spectra: Sequence[Spectrum], names: Sequence[str]) -> None:
    for spectrum, name in zip(spectra, names, strict=True):
        at = _SEEN if spectrum.is_constant else spectrum.wavelengths
        panel.plot(at, spectrum.values, label=name)
    panel.set_xlabel("wavelength, nm")
    panel.set_ylim(bottom=0 if all(spectrum.values.min() >= 0 for spectrum in spectra) else None)
    panel.margins(x=0)
    panel.grid(linewidth=0.3)
    if any(names):
        for text in panel.legend(frameon=False).get_texts():
            text.set_parse_math(False)
