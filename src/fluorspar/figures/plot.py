"""One function that draws whatever Fluorspar has a figure for."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from fluorspar.bispectral.lamp_colour import LampColour
from fluorspar.bispectral.material import Material
from fluorspar.comparing.comparison import Comparison
from fluorspar.errors import OptionError, message
from fluorspar.figures.materials import lamp_figure, material_figure
from fluorspar.figures.scenes import image_figure, scene_figure, spectrum_figure
from fluorspar.figures.spectra import comparison_figure, spectra_figure
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.scene.scene import Scene
from fluorspar.spectral.spectrum import Spectrum

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot"]

Drawable: TypeAlias = Spectrum | Material | LampColour | Scene | SpectralImage | PointSpectra | Comparison


def plot(thing: Drawable) -> Figure:
    """Draw a figure: of a spectrum, a material, a scene (its materials and lights), an image or measured spectra.

    Parameters
    ----------
    thing : Spectrum, Material, LampColour, Scene, SpectralImage, PointSpectra or Comparison

    Returns
    -------
    matplotlib.figure.Figure
        `figure.savefig("a.pdf")` writes it; notebooks show it after `%matplotlib inline`.

    Raises
    ------
    OptionError
        If there is no figure of such a thing.

    Examples
    --------
    >>> import fluorspar
    >>> len(plot(fluorspar.material("poster-red")).axes)
    5
    >>> plot(fluorspar.illuminant("D65")).axes[0].get_xlabel()
    'wavelength, nm'
    """
    match thing:
        case Spectrum():
            return spectrum_figure(thing)
        case Material():
            return material_figure(thing)
        case LampColour():
            return lamp_figure(thing, "a material")
        case Scene():
            return scene_figure(thing)
        case SpectralImage():
            return image_figure(thing)
        case PointSpectra():
            return spectra_figure(thing)
        case Comparison():
            return comparison_figure(thing)
    expected = "a Spectrum, Material, LampColour, Scene, SpectralImage, PointSpectra or Comparison"
    raise OptionError(message("there is no figure of this", got=type(thing).__name__, expected=expected))
