"""One function: scene, method and options in, spectral image out."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fluorspar.bispectral.donaldson import Stokes
from fluorspar.bispectral.material import Material
from fluorspar.errors import OptionError, message
from fluorspar.image.dataset import plain_attrs
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import METHODS
from fluorspar.progress import Progress
from fluorspar.scene.loading import load_scene
from fluorspar.scene.scene import Scene
from fluorspar.scene.settings import whole
from fluorspar.scene.variants import TRACE_VARIANTS
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.version import __version__

if TYPE_CHECKING:
    from fluorspar.staged.options import StagedOptions
    from fluorspar.staged.renderers.protocol import Renderer

__all__ = ["METHODS", "render"]

LARGEST_SEED = 2**63 - 1  # what the attributes of a NetCDF file can hold


def render(
    scene: Scene | str | Path | dict[str, Any],
    *,
    spp: int | None = None,
    seed: int = 0,
    wavelengths: Wavelengths | str | ArrayLike | None = None,
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
    staged: StagedOptions | None = None,
    renderer: Renderer | None = None,
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
        Grid in nm: a `Wavelengths`, `"START:STOP:STEP"`, or an evenly spaced array; default 360:700:5.
    method
        `"paths"`: all components, bands and bounces from one pass. `"staged"`: the paper's procedure on stock
        integrators, components 0 to 5.
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
        Called with the work done and the work in all (pixels, or renders of the staged method).
    staged
        Options of the staged method.
    renderer
        Another renderer than Mitsuba for the staged method, see `fluorspar.staged.renderers.protocol`.

    Returns
    -------
    SpectralImage
        `radiance(component, y, x, wavelength)`, W m-2 sr-1 nm-1, and its `standard_error`. If the user
        interrupts (Ctrl-C), what is finished is kept, the rest is NaN, and attribute `partial` is 1; of the staged
        method, whole repeats are kept.

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
    if stokes not in ("half", "strict"):
        raise OptionError(
            message("there is no such Stokes rule", got=repr(stokes), expected="'half' or 'strict'")
        )
    if method == "staged" and (component_errors or variant != "llvm"):
        got = "component_errors" if component_errors else f"variant={variant!r}"
        raise OptionError(
            message("the staged method has no such option", got=got, expected="method='paths' with it")
        )
    if (staged is not None or renderer is not None) and method != "staged":
        what = "options of the staged method" if staged is not None else "a renderer for the staged method"
        verb = "are" if staged is not None else "is"
        raise OptionError(
            message(f"{what} {verb} given", got=f"method={method!r}", expected="method='staged'")
        )
    seed = whole("seed", seed)
    if threads is not None and whole("threads", threads) < 1:
        raise OptionError(message("the number of threads is out of range", got=threads, expected="1 or more"))
    if not 0 <= seed <= LARGEST_SEED:
        fault = "the seed is negative" if seed < 0 else "the seed is too large"
        raise OptionError(message(fault, got=seed, expected=f"0 to {LARGEST_SEED}"))
    if output is not None and Path(output).suffix.lower() != ".nc":
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
    width, height = _pair(size)
    scene = scene.with_settings(spp=spp, width=width, height=height, max_depth=max_depth, rr_depth=rr_depth)
    if method == "paths":  # the staged method has a sampler of its own
        scene = scene.with_whole_samples()
    grid = _grid(wavelengths)
    attrs: dict[str, Any] = {
        "version": __version__,
        "method": method,
        "spp": scene.settings.spp,
        "seed": seed,
        "max_depth": scene.settings.max_depth,
        "rr_depth": scene.settings.rr_depth,
        "stokes": stokes,
        "scene": scene.name,
        "parameters": dict(scene.parameters) or None,
        "materials": {made.name: made.credit for made in scene.materials},
    }
    if method == "staged":
        from fluorspar.staged.procedure import render_staged

        image = render_staged(
            scene,
            grid,
            seed=seed,
            options=staged,
            stokes=stokes,
            threads=threads,
            progress=progress,
            renderer=renderer,
        )
        image.dataset.attrs = plain_attrs(attrs | image.attrs)
        if output is None:
            return image
        image.save(output)
        return SpectralImage.open(output)

    from fluorspar.paths.render import render_paths

    return render_paths(
        scene,
        grid,
        seed=seed,
        attrs=attrs,
        stokes=stokes,
        component_errors=component_errors,
        variant=variant,
        threads=threads,
        output=output,
        progress=progress,
    )


def _grid(wavelengths: Wavelengths | str | ArrayLike | None) -> Wavelengths:
    """Read a wavelength grid in any of its forms."""
    if wavelengths is None:
        return Wavelengths()
    if isinstance(wavelengths, Wavelengths):
        return wavelengths
    if isinstance(wavelengths, str):
        return Wavelengths.parse(wavelengths)
    return Wavelengths.from_values(np.asarray(wavelengths, dtype=np.float64))


def _pair(size: tuple[int, int] | None) -> tuple[int | None, int | None]:
    """Read a size in pixels."""
    if size is None:
        return None, None
    try:
        width, height = size
    except (TypeError, ValueError) as err:
        raise OptionError(
            message("the size is not readable", got=size, expected="(width, height) in pixels")
        ) from err
    return width, height
