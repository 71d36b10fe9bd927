"""The public names, listed here only: `__init__.py` reads this file, and so do type checkers and editors."""

from .image.components import COMPONENTS as COMPONENTS
from .image.spectral_image import SpectralImage as SpectralImage
from .rendering import render as render
from .scene.plugin import register_plugins as register_plugins
from .scene.scene import Scene as Scene
from .scene.scene import load_scene as load_scene
from .spectral.donaldson import DonaldsonMatrix as DonaldsonMatrix
from .spectral.illuminants import illuminant as illuminant
from .spectral.lamp_colour import colour_under_condition as colour_under_condition
from .spectral.lamp_colour import colour_under_lamp as colour_under_lamp
from .spectral.library import material as material
from .spectral.library import materials as materials
from .spectral.material import Fluorophore as Fluorophore
from .spectral.material import Material as Material
from .spectral.spectrum import Spectrum as Spectrum
from .spectral.wavelengths import Wavelengths as Wavelengths

__all__: list[str]
__version__: str
