"""One function: scene, method and options in, spectral image out."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

import fluorspar
from fluorspar.errors import FluorsparWarning, OptionError, message
from fluorspar.image.components import COMPONENTS
from fluorspar.image.netcdf import NetcdfWriter
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.scene.renderer import TRACE_VARIANTS
from fluorspar.scene.scene import Scene, load_scene
from fluorspar.spectral.donaldson import Stokes
from fluorspar.spectral.material import Material
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["METHODS", "Progress", "render"]

METHODS = ("paths",)
Progress = Callable[[int, int], None]


def render(
    scene: Scene | str | Path | dict[str, Any],
    *,
    spp: int | None = None,
    seed: int = 0,
    wavelengths: Wavelengths | str | None = None,
    method: str = "paths",
    size: tuple[int, int] | None = None,
    max_depth: int | None = None,
    rr_depth: int | None = None,
    materials: Mapping[str, str | Path | Material] | None = None,
    stokes: Stokes = "half",
    component_errors: bool = False,
    variant: str = "llvm",
    threads: int | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> SpectralImage:
    """Render a scene into a spectral image, split into components.

    Parameters
    ----------
    scene
        A scene of `load_scene`, or what `load_scene` takes.
    spp
        Samples per pixel; default: the scene's.
    seed
        Same seed, same image, bit for bit, whatever the number of threads.
    wavelengths
        Grid in nm, a `Wavelengths` or `"START:STOP:STEP"`; default 360:700:5.
    method
        `"paths"`: all components, bands and bounces from one pass.
    size
        Width and height in pixels; default: the scene's.
    max_depth, rr_depth
        As in Mitsuba (2 is direct light only, -1 unlimited); default: the scene's.
    materials
        Materials from outside, by shape or BSDF id, for a scene that is not loaded yet.
    stokes
        `"half"`: excitation at the emission wavelength itself counts half (trapezoid rule); `"strict"`: not at
        all (Eq. 1 of the paper to the letter).
    component_errors
        Estimate the standard error of each component too, not only of the total.
    variant
        `"llvm"`, or `"cuda"` for an NVIDIA GPU.
    threads
        Default: all cores this process may use.
    output
        A `.nc` file to stream the image to while it is rendered, so that it need not fit into memory; the
        image returned then reads from it.
    progress
        Called with the pixels done and the pixels in all, after each chunk.

    Returns
    -------
    SpectralImage
        `radiance(component, y, x, wavelength)`, W m-2 sr-1 nm-1, and its `standard_error`. If the user
        interrupts (Ctrl-C), what is finished is kept, the rest is NaN, and attribute `partial` is 1.

    Raises
    ------
    SceneError, MaterialError, SpectrumError
        If the scene cannot be used, see `load_scene`.
    OptionError
        If an option is out of range.
    RendererError
        If Mitsuba's variant does not start.

    Notes
    -----
    Method: section "One pass" of the documentation; components: Eqs. 3-13 of Tominaga, Guarnera, Ohtera,
    IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980. The caller's Mitsuba variant is set again afterwards.

    Examples
    --------
    >>> image = render("cornell-box", size=(16, 16), spp=4, wavelengths="400:700:20")
    >>> image.dataset.radiance.shape
    (7, 16, 16, 16)
    """
    from fluorspar.paths.estimate import estimate

    if method not in METHODS:
        raise OptionError(
            message("there is no such method", got=repr(method), expected=f"one of {', '.join(METHODS)}")
        )
    if variant not in TRACE_VARIANTS:
        raise OptionError(
            message(
                "there is no such variant", got=repr(variant), expected=f"one of {', '.join(TRACE_VARIANTS)}"
            )
        )
    if seed < 0:
        raise OptionError(message("the seed is negative", got=seed, expected="0 or more"))
    if output is not None and Path(output).suffix != ".nc":
        raise OptionError(
            message(
                "an image can be streamed to NetCDF only",
                got=Path(output).name,
                expected="a name that ends in .nc",
            )
        )
    if not isinstance(scene, Scene):
        scene = load_scene(scene, materials=materials)
    elif materials:
        raise OptionError(
            message("materials come too late for a loaded scene", fix="give them to load_scene")
        )
    width, height = size or (None, None)
    scene = scene.with_settings(spp=spp, width=width, height=height, max_depth=max_depth, rr_depth=rr_depth)
    scene = scene.with_whole_samples()
    settings = scene.settings
    grid = Wavelengths.parse(wavelengths) if isinstance(wavelengths, str) else wavelengths or Wavelengths()
    attrs: dict[str, Any] = {
        "version": fluorspar.__version__,
        "method": method,
        "spp": settings.spp,
        "seed": seed,
        "max_depth": settings.max_depth,
        "rr_depth": settings.rr_depth,
        "stokes": stokes,
        "scene": scene.name,
        "materials": {made.name: made.credit for made in scene.materials},
    }
    sink: _File | _Memory
    if output is None:
        sink = _Memory(grid, settings.height, settings.width, component_errors)
    else:
        sink = _File(output, grid, settings.height, settings.width, component_errors=component_errors)
    began = time.perf_counter()
    pixels, done = settings.width * settings.height, 0
    chunks = estimate(
        scene,
        grid,
        seed=seed,
        stokes=stokes,
        component_errors=component_errors,
        backend=variant,
        threads=threads,
    )
    with sink:
        try:
            with closing(chunks):
                for first_pixel, swept in chunks:
                    sink.write_pixels(first_pixel, *swept[: 3 if component_errors else 2])
                    done = first_pixel + len(swept.radiance)
                    if progress:
                        progress(done, pixels)
        except KeyboardInterrupt:
            text = f"interrupted: {done} of {pixels} pixels are finished, the others are NaN"
            warnings.warn(text, FluorsparWarning, stacklevel=2)
        attrs["timings"] = {"render": round(time.perf_counter() - began, 3)}
        return sink.image(attrs, partial=done < pixels)


class _Memory:
    """Collects pixels in arrays."""

    def __init__(self, grid: Wavelengths, height: int, width: int, component_errors: bool) -> None:
        self.grid, self.height, self.width = grid, height, width
        self.pixels = height * width
        # Not filled with NaN beforehand: writing the pages twice would show.
        self.radiance = np.empty((len(COMPONENTS), self.pixels, len(grid)), dtype=np.float32)
        self.standard_error = np.empty((self.pixels, len(grid)), dtype=np.float32)
        self.component_errors = np.empty_like(self.radiance) if component_errors else None
        self.done = 0

    def __enter__(self) -> _Memory:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def write_pixels(
        self,
        first: int,
        radiance: np.ndarray[Any, Any],
        error: np.ndarray[Any, Any],
        errors: np.ndarray[Any, Any] | None = None,
    ) -> None:
        self.done = first + len(radiance)
        self.radiance[:, first : self.done] = radiance.swapaxes(0, 1)
        self.standard_error[first : self.done] = error
        if self.component_errors is not None and errors is not None:
            self.component_errors[:, first : self.done] = errors.swapaxes(0, 1)

    def image(self, attrs: dict[str, Any], *, partial: bool) -> SpectralImage:
        layers = [self.radiance, self.standard_error[np.newaxis]]
        if self.component_errors is not None:
            layers.append(self.component_errors)
        for values in layers:
            values[:, self.done :] = np.nan
        shape = (self.height, self.width, len(self.grid))
        return SpectralImage.from_arrays(
            self.radiance.reshape(-1, *shape),
            self.grid,
            self.standard_error.reshape(shape),
            attrs | ({"partial": 1} if partial else {}),
            component_standard_error=None
            if self.component_errors is None
            else self.component_errors.reshape(-1, *shape),
        )


class _File(NetcdfWriter):
    """Streams pixels to a NetCDF file."""

    def image(self, attrs: dict[str, Any], *, partial: bool) -> SpectralImage:
        self.close(partial=partial, attrs=attrs)
        return SpectralImage.open(self.path)
