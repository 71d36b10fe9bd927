"""The public names, listed here only: `__init__.py` reads this file, and so do type checkers and editors."""

from .bispectral.donaldson import DonaldsonMatrix as DonaldsonMatrix
from .bispectral.lamp_colour import colour_under_condition as colour_under_condition
from .bispectral.lamp_colour import colour_under_lamp as colour_under_lamp
from .bispectral.library import material as material
from .bispectral.library import materials as materials
from .bispectral.material import Fluorophore as Fluorophore
from .bispectral.material import Material as Material
from .blender.importing.import_blender import import_blender as import_blender
from .comparing.compare import compare as compare
from .figures.plot import plot as plot
from .image.components import COMPONENTS as COMPONENTS
from .image.opening import open as open
from .image.spectral_image import SpectralImage as SpectralImage
from .job import RenderJob as RenderJob
from .measuring.aperture import Aperture as Aperture
from .measuring.measure import measure as measure
from .measuring.point_spectra import PointSpectra as PointSpectra
from .measuring.points import Point as Point
from .paths.light_paths import LightPaths as LightPaths
from .paths.light_paths import load_paths as load_paths
from .rendering import render as render
from .rendering import render_job as render_job
from .rendering import trace as trace
from .scene.loading import load_scene as load_scene
from .scene.plugin import register_plugins as register_plugins
from .scene.scene import Scene as Scene
from .sheets.sheet import sheet as sheet
from .spectral.illuminants import illuminant as illuminant
from .spectral.illuminants import illuminants as illuminants
from .spectral.spectrum import Spectrum as Spectrum
from .spectral.wavelengths import Wavelengths as Wavelengths
from .studies.batch import batch as batch
from .studies.open_study import open_study as open_study

__all__: list[str]
__version__: str
