"""The one-pass method from scene to image: pixels are collected in memory or streamed to a file."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Mapping
from contextlib import closing
from typing import Any

import numpy as np

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.errors import FluorsparWarning, OptionError, message
from fluorspar.image.components import COMPONENTS
from fluorspar.image.formats.netcdf import NetcdfWriter
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.paths.chunks import estimate
from fluorspar.progress import Progress
from fluorspar.scene.scene import Scene
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["render_paths"]


def render_paths(
    scene: Scene,
    grid: Wavelengths,
    *,
    seed: int,
    attrs: Mapping[str, Any],
    stokes: Stokes = "half",
    component_errors: bool = False,
    variant: str = "llvm",
    threads: int | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> SpectralImage:
    """Render all components by the one-pass method.

    Parameters
    ----------
    scene, grid, seed, stokes, component_errors, variant, threads
        See `estimate`.
    attrs
        Attributes of the image.
    output
        A `.nc` file to stream the image to.
    progress
        Called with the pixels done and the pixels in all, after each chunk.

    Returns
    -------
    SpectralImage
        Partial, with the rest NaN, if the user interrupted.
    """
    settings = scene.settings
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
            if done == 0:
                raise  # nothing to keep, and an older file stays as it was
            text = f"interrupted: {done} of {pixels} pixels are finished, the others are NaN"
            warnings.warn(text, FluorsparWarning, stacklevel=3)
        timings = {"render": round(time.perf_counter() - began, 3)}
        return sink.image({**attrs, "timings": timings}, partial=done < pixels)


class _Memory:
    """Collects pixels in arrays."""

    def __init__(self, grid: Wavelengths, height: int, width: int, component_errors: bool) -> None:
        self.grid, self.height, self.width = grid, height, width
        self.pixels = height * width
        # Not filled with NaN beforehand: writing the pages twice would show.
        try:
            self.radiance = np.empty((len(COMPONENTS), self.pixels, len(grid)), dtype=np.float32)
            self.standard_error = np.empty((self.pixels, len(grid)), dtype=np.float32)
            self.component_errors = np.empty_like(self.radiance) if component_errors else None
        except MemoryError as err:
            size = f"{width} x {height} pixels, {len(COMPONENTS)} components, {len(grid)} wavelengths"
            fix = "stream it to a NetCDF file (-o NAME.nc, output='NAME.nc'), or make it smaller"
            raise OptionError(message("the image does not fit into memory", got=size, fix=fix)) from err
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
        end = first + len(radiance)
        self.radiance[:, first:end] = radiance.swapaxes(0, 1)
        self.standard_error[first:end] = error
        if self.component_errors is not None and errors is not None:
            self.component_errors[:, first:end] = errors.swapaxes(0, 1)
        self.done = end  # last: an interrupt before leaves the pixels unfinished

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
