"""Fluorspar: spectral images of scenes with fluorescent objects, on a renderer that knows nothing of fluorescence.

The public names are imported when they are first used. Importing Fluorspar sets no Mitsuba variant, reads no
data file and prints nothing. It does point Dr.Jit to a working LLVM, through the environment variable
`DRJIT_LIBLLVM_PATH` unless that is set: Dr.Jit loads LLVM when it is imported, so import Fluorspar before Mitsuba.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version as _version
from typing import TYPE_CHECKING, Any

from fluorspar.scene.renderer import configure_llvm as _configure_llvm

if TYPE_CHECKING:
    from fluorspar.image.components import COMPONENTS
    from fluorspar.image.spectral_image import SpectralImage
    from fluorspar.rendering import render
    from fluorspar.scene.plugin import register_plugins
    from fluorspar.scene.scene import Scene, load_scene
    from fluorspar.spectral.donaldson import DonaldsonMatrix
    from fluorspar.spectral.illuminants import illuminant
    from fluorspar.spectral.lamp_colour import colour_under_condition, colour_under_lamp
    from fluorspar.spectral.library import material, materials
    from fluorspar.spectral.material import Fluorophore, Material
    from fluorspar.spectral.spectrum import Spectrum
    from fluorspar.spectral.wavelengths import Wavelengths

_configure_llvm()

__version__ = _version("fluorspar")

_HOME = {
    "COMPONENTS": "image.components",
    "DonaldsonMatrix": "spectral.donaldson",
    "Fluorophore": "spectral.material",
    "Material": "spectral.material",
    "Scene": "scene.scene",
    "SpectralImage": "image.spectral_image",
    "Spectrum": "spectral.spectrum",
    "Wavelengths": "spectral.wavelengths",
    "colour_under_condition": "spectral.lamp_colour",
    "colour_under_lamp": "spectral.lamp_colour",
    "illuminant": "spectral.illuminants",
    "load_scene": "scene.scene",
    "material": "spectral.library",
    "materials": "spectral.library",
    "register_plugins": "scene.plugin",
    "render": "rendering",
}

__all__ = [
    "COMPONENTS",
    "DonaldsonMatrix",
    "Fluorophore",
    "Material",
    "Scene",
    "SpectralImage",
    "Spectrum",
    "Wavelengths",
    "colour_under_condition",
    "colour_under_lamp",
    "illuminant",
    "load_scene",
    "material",
    "materials",
    "register_plugins",
    "render",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'fluorspar' has no attribute '{name}'")
    value = getattr(import_module(f"fluorspar.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
