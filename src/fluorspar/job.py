"""`RenderJob`: one render as it was asked for, checked once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.bispectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.bispectral.excitation import excitation_grid
from fluorspar.bispectral.material import Material
from fluorspar.errors import OptionError, SpectrumError, message
from fluorspar.image.stated import METHODS
from fluorspar.scene.camera import seen_from
from fluorspar.scene.loading import load_scene
from fluorspar.scene.relit import LightSetting, lights_in_words, relit
from fluorspar.scene.sample_sets import error_freedom
from fluorspar.scene.scene import Scene
from fluorspar.scene.settings import whole
from fluorspar.scene.variants import TRACE_VARIANTS, fastest_variant
from fluorspar.scene.viewpoint import ViewpointSetting
from fluorspar.spectral.light import light_on
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.until import Until
from fluorspar.version import __version__

__all__ = ["RenderJob", "read_grid"]

MOST_THREADS = 4096
LARGEST_SEED = 2**63 - 1  # what the attributes of a NetCDF file can hold


@dataclass(frozen=True)
class RenderJob:
    """What to render, and how. It pickles: another process that finds the scene's files can render it.

    Parameters
    ----------
    scene : Scene
        With its size, samples and depths.
    grid : Wavelengths
        The N wavelengths of the image.
    seed : int
        Same seed, same image.
    method : str
        `"paths"` or `"staged"`.
    stokes : str
        `"half"` or `"strict"`, see `DonaldsonMatrix`.
    excitation : str
        `"full"`: wavelengths below the grid excite too, see `computed_grid`; `"grid"`: only those of the image.
    component_errors : bool
        Estimate a standard error for each component, not only for the total.
    variant : str
        `"llvm"` or `"cuda"`; or `"auto"`, which becomes the faster of them that starts here, `"llvm"` for the staged
        method.
    threads : int, optional
        Default: all cores this process may use.
    options : StagedOptions, optional
        Options of the method: only the staged one has any.
    changed_lights : mapping
        What its lights were given instead of their spectra in the scene file, in words.
    relit : mapping
        What was changed in the scene since its light paths were traced, in words.
    until : Until, optional
        Render passes until the image is that good, see `fluorspar.paths.passes`.
    stream : int
        Which of the streams of random numbers of the seed: 0, or the number of a later pass.

    Raises
    ------
    OptionError
        If a value is out of range, or an option does not go with the method.

    Examples
    --------
    >>> job = RenderJob(load_scene("cornell-box"), seed=7)
    >>> job.attrs["method"], job.attrs["seed"]
    ('paths', 7)
    """

    scene: Scene
    grid: Wavelengths = field(default_factory=Wavelengths)
    seed: int = 0
    method: str = "paths"
    stokes: Stokes = "half"
    excitation: str = "full"
    component_errors: bool = False
    variant: str = "auto"
    threads: int | None = None
    options: Any = None
    changed_lights: Mapping[str, Any] = field(default_factory=dict)
    relit: Mapping[str, Any] = field(default_factory=dict)
    until: Until | None = None
    stream: int = 0

    def __post_init__(self) -> None:
        _one_of("method", self.method, METHODS)
        _one_of("variant", self.variant, (*TRACE_VARIANTS, "auto"))
        if self.variant == "auto":  # now, because an image is the same bit for bit in one variant only
            object.__setattr__(self, "variant", "llvm" if self.method == "staged" else fastest_variant())
        _one_of("Stokes rule", self.stokes, ("half", "strict"))
        _one_of("excitation", self.excitation, ("full", "grid"))
        _one_of("value of component_errors", self.component_errors, (True, False))
        if self.method == "staged" and (self.component_errors or self.variant != "llvm"):
            got = "component_errors" if self.component_errors else f"variant={self.variant!r}"
            raise OptionError(
                message("the staged method has no such option", got=got, expected="method='paths' with it")
            )
        if self.method == "staged" and self.until is not None:
            fix = "use method 'paths', or render as many samples as it takes (--spp)"
            raise OptionError(
                message(
                    "the staged method cannot render until an error is reached",
                    got=f"until {self.until}",
                    fix=fix,
                )
            )
        if self.method == "staged" and self.scene.lobes is not None:
            raise OptionError(
                message(
                    "the staged method renders only matte surfaces of one spectrum, and lights that do not vary",
                    where=self.scene.name,
                    got=", ".join(self.scene.general) or "others",
                    fix="use method 'paths', or replace them by their averages with --matte (matte=True)",
                )
            )
        if self.options is not None and self.method != "staged":
            raise OptionError(
                message(
                    "options of the staged method are given",
                    got=f"method={self.method!r}",
                    expected="method='staged'",
                )
            )
        object.__setattr__(self, "seed", whole("seed", self.seed))
        if not 0 <= self.seed <= LARGEST_SEED:
            fault = "the seed is negative" if self.seed < 0 else "the seed is too large"
            raise OptionError(message(fault, got=self.seed, expected=f"0 to {LARGEST_SEED}"))
        if self.threads is not None:
            object.__setattr__(self, "threads", whole("threads", self.threads))
            if not 1 <= self.threads <= MOST_THREADS:
                raise OptionError(
                    message(
                        "the number of threads is out of range",
                        got=self.threads,
                        expected=f"1 or more, at most {MOST_THREADS}",
                    )
                )

    @classmethod
    def of(
        cls,
        scene: Scene | str | Path | dict[str, Any],
        *,
        materials: Mapping[str, str | Path | Material] | None = None,
        wavelengths: Wavelengths | str | ArrayLike | None = None,
        size: tuple[int, int] | None = None,
        spp: int | None = None,
        max_depth: int | None = None,
        rr_depth: int | None = None,
        camera: ViewpointSetting | None = None,
        lights: Mapping[str, LightSetting] | None = None,
        same_luminance: bool = False,
        **others: Any,
    ) -> RenderJob:
        """Read scene, grid, size, camera and lights in all the forms that `fluorspar.render` takes; see there."""
        width, height = _pair(size)
        grid = read_grid(wavelengths)
        if not isinstance(scene, Scene):
            scene = load_scene(scene, materials=materials)
        elif materials:
            raise OptionError(
                message(
                    "the scene is already loaded, so materials are not taken here",
                    fix="give them to load_scene",
                )
            )
        scene = scene.with_settings(
            spp=spp, width=width, height=height, max_depth=max_depth, rr_depth=rr_depth
        )
        if camera is not None:
            scene = seen_from(scene, camera)
        scene = relit(scene, lights=lights, same_luminance=same_luminance)
        return cls(scene, grid, changed_lights=lights_in_words(scene, lights, same_luminance), **others)

    @cached_property
    def computed_grid(self) -> Wavelengths:
        """The grid of all computation; its last N wavelengths are those of the image, see `excitation_grid`.

        Examples
        --------
        >>> RenderJob.of("cornell-box", wavelengths="400:700:5").computed_grid
        Wavelengths(start=305.0, stop=700.0, step=5.0)
        """
        lights = [light.spectrum for light in self.scene.lights]
        return excitation_grid(self.grid, self.scene.materials, lights, self.excitation)

    def matrices(self) -> list[DonaldsonMatrix]:
        """Donaldson matrices of the scene's materials on the computed grid, by row of its table."""
        return self.scene.matrices(self.computed_grid, self.stokes)

    def lights(self) -> list[NDArray[np.float64]]:
        """Spectra of the scene's lights on the computed grid, by row of its table."""
        return [light_on(light.spectrum, self.computed_grid) for light in self.scene.lights]

    @property
    def seed_of_stream(self) -> int:
        """The seed itself, or for another stream of random numbers one that is beyond all seeds."""
        return self.seed + self.stream * 2 * (LARGEST_SEED + 1)

    @property
    def attrs(self) -> dict[str, Any]:
        """What the image says about how it was made."""
        settings, computed = self.scene.settings, self.computed_grid
        return {
            "version": __version__,
            "method": self.method,
            "variant": self.variant,
            "spp": settings.spp,
            "error_freedom": error_freedom(settings) if self.method == "paths" else None,
            "seed": self.seed,
            "max_depth": settings.max_depth,
            "rr_depth": settings.rr_depth,
            "stokes": self.stokes,
            "excitation": f"{computed.start:g}:{computed.stop:g}:{computed.step:g}",
            "scene": self.scene.name,
            "parameters": dict(self.scene.parameters) or None,
            "camera": None if settings.viewpoint is None else str(settings.viewpoint),
            "lights": dict(self.changed_lights) or None,
            "materials": self.scene.used,
            "relit": dict(self.relit) or None,
        }


def read_grid(wavelengths: Wavelengths | str | ArrayLike | None) -> Wavelengths:
    """Read a wavelength grid: a `Wavelengths`, `"START:STOP:STEP"`, an array, or None for the default grid.

    Raises
    ------
    SpectrumError
        If it is not a grid.

    Examples
    --------
    >>> read_grid("400:700:10") == read_grid(range(400, 701, 10))
    True
    """
    if wavelengths is None:
        return Wavelengths()
    if isinstance(wavelengths, Wavelengths):
        return wavelengths
    if isinstance(wavelengths, str):
        return Wavelengths.parse(wavelengths)
    try:
        values = np.asarray(wavelengths, dtype=np.float64)
    except (TypeError, ValueError):
        values = np.array(np.nan)
    if values.ndim != 1:
        raise SpectrumError(
            message(
                "the wavelengths are not readable",
                got=repr(wavelengths),
                expected='a Wavelengths, "START:STOP:STEP" in nm such as "360:700:5", or an ascending, evenly spaced '
                "array",
            )
        )
    return Wavelengths.from_values(values)


def _one_of(what: str, value: object, known: tuple[object, ...]) -> None:
    if not any(value == name and isinstance(value, type(name)) for name in known):
        expected = f"one of {', '.join(map(str, known))}"
        raise OptionError(message(f"there is no such {what}", got=repr(value), expected=expected))


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
