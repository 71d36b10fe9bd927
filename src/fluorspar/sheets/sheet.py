"""Contact sheets: images of all combinations of lights and materials from light paths that are traced once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.colour.difference import ciede2000
from fluorspar.colour.xyz import CIE_1931, xyz_from_radiance
from fluorspar.comparing.whites import lab_of, white_of
from fluorspar.denoising.denoise import Surfaces, surfaces_of
from fluorspar.denoising.denoise import denoise as denoise_image
from fluorspar.errors import OptionError, message
from fluorspar.extras import check_extra
from fluorspar.files.memory import check_memory
from fluorspar.image.components import GROUPS, select
from fluorspar.image.display.appearance import auto_exposure, show, xyz_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.job import read_grid
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.image_scene import scene_of
from fluorspar.measuring.measure import measure
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point, points_of
from fluorspar.measuring.visible import visible_pixels
from fluorspar.paths.light_paths import LightPaths, load_paths
from fluorspar.paths.paths_file import PathsInFile
from fluorspar.paths.whole_image import whole_image
from fluorspar.progress import Progress, shown
from fluorspar.rendering import trace
from fluorspar.scene.builtin import BUILTIN
from fluorspar.scene.relit import LightSetting, MaterialSetting, relit
from fluorspar.scene.scene import Scene
from fluorspar.sheets.combinations import Axis, axes_of, count_combinations, in_order
from fluorspar.spectral.wavelengths import Wavelengths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOST", "sheet"]

Array = NDArray[np.float64]

MOST = 64
"""Combinations beyond which somebody has to say that so many are meant."""
WHOLE = "whole picture"
"""Name of the one point of a sheet without points."""

_GLOWING = ("luminescent", "reexcitation")


def sheet(
    paths: LightPaths | Scene | str | Path | dict[str, Any],
    *,
    lights: Mapping[str, Sequence[LightSetting]] | None = None,
    materials: Mapping[str, Sequence[MaterialSetting]] | None = None,
    concentration: Mapping[str, Sequence[float]] | None = None,
    same_luminance: bool = False,
    library: Sequence[str | Path] = (),
    points: Sequence[Point] | str | Path | None = None,
    scene: Scene | str | Path | None = None,
    aperture: Aperture | str | None = None,
    white: str | None = None,
    exposure: str | float = "same",
    wavelengths: Wavelengths | str | ArrayLike | None = None,
    threads: int | None = None,
    denoise: bool = False,
    most: int = MOST,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    """Show all combinations of lights, materials and concentrations, and measure them.

    Parameters
    ----------
    paths : LightPaths, Scene, str, path or dict
        Light paths or their file; or a scene, which is then traced with its own settings.
    lights, materials, concentration : mapping of str to list, optional
        Settings by id, each as in `LightPaths.image`. Every one is combined with every other.
    same_luminance, library, threads
        See `LightPaths.image`.
    points, scene, aperture : optional
        What to measure, see `fluorspar.measure`; default: the whole picture. The scene is needed for positions, and
        for an aperture in degrees, if the paths come from a file.
    white : str, optional
        White of CIELAB for all combinations, see `fluorspar.compare`: a point of the first combination, or an
        illuminant at the greatest luminance of its points or, without points, at that of white in its picture.
        Default D65.
    exposure : str or float
        `"same"`: one for all pictures, at which the brightest is well exposed; `"each"`: each its own; or a factor on
        luminance, m2/cd.
    wavelengths : Wavelengths, str or array_like of shape (N,), optional
        Grid in nm, see `fluorspar.render`; default: as traced.
    denoise : bool
        Take the noise out of each image, see `SpectralImage.denoised`; with paths from a file give the scene too.
    most : int
        How many combinations to compute at the most.
    progress : callable or bool, optional
        True draws a bar, in notebooks too; or called with the pixels done and the pixels in all.

    Returns
    -------
    Dataset
        A dimension for each id, in the order lights, materials, concentration; its coordinate holds the settings in
        words, concentrations as numbers. Where another dimension has the name of the id, it is followed by
        `light`, `material` or `concentration`. Variables, with these dimensions and

        * `rgb` (y, x, channel): sRGB with its transfer curve, float32 from 0 to 1; NaN where nothing was traced;
        * `exposure`: of each picture, m2/cd;
        * `XYZ` (point, tristimulus): CIE 1931, Y in cd/m2;
        * `Lab` (point, coordinate): CIELAB;
        * `delta_e` (point): CIEDE2000 from the first combination;
        * `luminescent_share` (point): share of the luminance, from 0 to 1, that has luminesced; NaN where it is dark.

        Without points, `point` is the whole picture: XYZ is the mean of its pixels, without lamps seen directly.
        Attributes say the grid, the white, and where was measured.

    Raises
    ------
    OptionError
        If there is nothing to combine, there are more combinations than `most`, an id is unknown, a material cannot
        be exchanged, or a point cannot be measured.
    MaterialError, SpectrumError
        If a material or light is unknown or impossible. All of them are looked at before the first is computed.
    PathsError, SceneError
        If the paths or the scene cannot be used.
    ImageError
        If the pictures do not fit into memory.

    Warns
    -----
    ApproximationWarning
        If points are measured with an aperture that is smaller than a pixel.

    Examples
    --------
    >>> import fluorspar
    >>> paths = fluorspar.trace("cornell-box", size=(16, 16), spp=4)
    >>> found = sheet(paths, lights={"light": ["D65", "A"]}, concentration={"left-wall": [0, 0.5, 1]})
    >>> dict(found.rgb.sizes)
    {'light': 2, 'left-wall': 3, 'y': 16, 'x': 16, 'channel': 3}
    >>> found.delta_e.dims, found.delta_e.values[0, 0]
    (('light', 'left-wall', 'point'), array([0.]))
    """
    axes = axes_of(lights, materials, concentration)
    _check_count(count_combinations(axes), most)
    if exposure not in ("same", "each") and (isinstance(exposure, str) or not 0 < exposure < np.inf):
        expected = "same, each, or a positive number"
        raise OptionError(message("there is no such exposure", got=repr(exposure), expected=expected))
    if denoise:
        check_extra("denoise")
    kept = _paths_of(paths)
    grid = kept.job.grid if wavelengths is None else read_grid(wavelengths)
    of_light = {"same_luminance": same_luminance, "library": library}
    for axis in axes:
        for setting in axis.settings:
            relit(kept.job.scene, **{axis.kind: {axis.key: setting}}, **of_light)  # type: ignore[arg-type]
    meter = None if points is None else _Meter.of(points, kept, scene, aperture)
    images = _images(kept, axes, shown(progress), wavelengths=grid, threads=threads, **of_light)
    if denoise:
        images = _clean(images, axes, _shown(kept, scene), threads, library)
    return _dataset(axes, kept, _reduced(images, axes, kept, meter), meter, grid, white, exposure)


@dataclass(frozen=True)
class _Reduced:
    """What is left of the images: pictures as XYZ (..., y, x, 3), their exposures, and XYZ (..., P, 3) with the share
    (..., P) that has luminesced; and the first image's points, attributes and notes."""

    pictures: NDArray[np.float32]
    exposures: Array
    xyz: Array
    glowing: Array
    table: PointSpectra | None
    attrs: dict[str, Any]


@dataclass(frozen=True)
class _Meter:
    """Measures points; positions are looked up once."""

    points: tuple[Point, ...]
    scene: Scene | None
    aperture: Aperture | None

    @classmethod
    def of(
        cls,
        points: Sequence[Point] | str | Path,
        paths: LightPaths,
        scene: Scene | str | Path | None,
        aperture: Aperture | str | None,
    ) -> _Meter:
        given, aperture = points_of(points), Aperture.of(aperture)
        settings = paths.job.scene.settings
        in_scene = [point for point in given if not point.is_pixel]
        needed = bool(in_scene) or (aperture is not None and aperture.unit == "deg")
        seen_by = _shown(paths, scene, required=needed)
        if in_scene and seen_by is not None:
            seen_by = seen_by.with_settings(width=settings.width, height=settings.height)
            at = dict(zip([p.name for p in in_scene], visible_pixels(seen_by, in_scene) - 0.5, strict=True))
            given = tuple(
                point if point.is_pixel else replace(point, position=tuple(at[point.name].tolist()))
                for point in given
            )
        return cls(given, seen_by, aperture)

    def read(self, image: SpectralImage, component: str | None = None) -> PointSpectra:
        return measure(image, self.points, scene=self.scene, aperture=self.aperture, component=component)


def _check_count(count: int, most: int) -> None:
    if count > most:
        raise OptionError(
            message(
                f"these are {count} combinations",
                expected=f"at most {most}, unless so many are meant",
                fix=f"give fewer settings, or say that they are meant: --yes (most={count})",
            )
        )


def _paths_of(given: LightPaths | Scene | str | Path | dict[str, Any]) -> LightPaths:
    if isinstance(given, LightPaths):
        return given
    is_scene = (
        isinstance(given, Scene | dict) or str(given) in BUILTIN or Path(given).suffix.lower() == ".xml"
    )
    return trace(given) if is_scene else load_paths(given)  # type: ignore[arg-type]


def _images(
    paths: LightPaths, axes: Sequence[Axis], progress: Progress | None, **options: Any
) -> Iterator[tuple[tuple[int, ...], SpectralImage]]:
    """Make one image after another."""
    count = count_combinations(axes)
    for number, (index, changes) in enumerate(in_order(axes)):

        def report(done: int, whole: int, number: int = number) -> None:
            if progress:
                progress(number * whole + done, count * whole)

        yield index, whole_image(paths, report, **changes, **options)


def _shown(paths: LightPaths, scene: Scene | str | Path | None, *, required: bool = False) -> Scene | None:
    """The scene of light paths with its geometry, which those from a file do not hold."""
    own = None if isinstance(paths.chunks, PathsInFile) else paths.job.scene
    return scene_of(paths.job.attrs, scene or own, required=required)


def _clean(
    images: Iterator[tuple[tuple[int, ...], SpectralImage]],
    axes: Sequence[Axis],
    shown: Scene | None,
    threads: int | None,
    library: Sequence[str | Path],
) -> Iterator[tuple[tuple[int, ...], SpectralImage]]:
    """Denoise one image after another; each set of materials is looked at once."""
    looked_at: dict[tuple[int, ...], Surfaces | None] = {}
    of_surfaces = [axis.kind != "lights" for axis in axes]
    for (index, image), (_, changes) in zip(images, in_order(axes), strict=True):
        key = tuple(number for number, matters in zip(index, of_surfaces, strict=True) if matters)
        if key not in looked_at:
            surfaces = {name: setting for name, setting in changes.items() if name != "lights"}
            looked_at[key] = (
                surfaces_of(relit(shown, library=library, **surfaces), image)  # type: ignore[arg-type]
                if shown is not None
                else None
            )
        yield index, denoise_image(image, surfaces=looked_at[key], threads=threads)


def _reduced(
    images: Iterator[tuple[tuple[int, ...], SpectralImage]],
    axes: Sequence[Axis],
    paths: LightPaths,
    meter: _Meter | None,
) -> _Reduced:
    """Reduce each image to what is shown and measured of it."""
    shape = tuple(len(axis.settings) for axis in axes)
    settings = paths.job.scene.settings
    whole = (*shape, settings.height, settings.width, 3)
    check_memory(4 * int(np.prod(whole)), "the sheet", f"{' x '.join(map(str, whole[:-1]))} pixels")
    pictures, exposures = np.empty(whole, np.float32), np.empty(shape)
    count = 1 if meter is None else len(meter.points)
    xyz, glowing = np.empty((*shape, count, 3)), np.empty((*shape, count))
    table, attrs = None, {}
    for index, image in images:
        of = {name: _xyz(image, name) for name in ("reflected", *_GLOWING, "source")}
        glow = of["luminescent"] + of["reexcitation"]
        lit = of["reflected"] + glow
        pictures[index] = lit + of["source"]
        exposures[index] = auto_exposure(lit) if (lit[..., 1] > 0).any() else np.nan
        if meter is None:
            traced = np.isfinite(lit[..., 0])
            xyz[index], luminous = lit[traced].mean(axis=0), glow[traced][:, 1].mean()
        else:
            measured = meter.read(image)
            xyz[index] = xyz_from_radiance(measured.radiance, measured.grid)
            luminous = sum(meter.read(image, name).luminance() for name in _GLOWING)
        with np.errstate(invalid="ignore", divide="ignore"):
            glowing[index] = luminous / xyz[index][..., 1]
        if not any(index):
            attrs = image.attrs
            table = None if meter is None else measured
    return _Reduced(pictures, exposures, xyz, glowing, table, attrs)


def _xyz(image: SpectralImage, group: str) -> Array:
    return xyz_of(image.dataset, select(group if group in GROUPS else [group], image.components))


def _dataset(
    axes: Sequence[Axis],
    paths: LightPaths,
    found: _Reduced,
    meter: _Meter | None,
    grid: Wavelengths,
    white: str | None,
    exposure: str | float,
) -> xr.Dataset:
    """Expose the pictures, in place, and label everything."""
    import xarray as xr

    first = (0,) * len(axes)
    exposures = found.exposures
    own = float(exposures[first])
    if exposure != "each":
        one = exposure if not isinstance(exposure, str) else np.nanmin(np.append(exposures, np.inf))
        exposures = np.full_like(exposures, one if np.isfinite(one) else 1.0)
    exposures = np.where(np.isnan(exposures), 1.0, exposures)
    for index in np.ndindex(exposures.shape):
        found.pictures[index] = show(found.pictures[index], float(exposures[index])).rgb
    pictured = 1 / own if np.isfinite(own) else None
    of_white, _ = white_of(found.table, white, "none", grid, CIE_1931, pictured)
    lab = lab_of(found.xyz, of_white)
    dims = tuple(axis.name for axis in axes)
    names = [WHOLE] if meter is None else [point.name for point in meter.points]
    coords: dict[str, Any] = {
        axis.name: (axis.name, list(axis.labels), {"long_name": axis.title}) for axis in axes
    }
    coords |= {
        "point": names,
        "channel": ["R", "G", "B"],
        "tristimulus": ["X", "Y", "Z"],
        "coordinate": ["L*", "a*", "b*"],
    }
    at = (*dims, "point")
    variables = {
        "rgb": ((*dims, "y", "x", "channel"), found.pictures, _said("1", "sRGB")),
        "exposure": (dims, exposures, _said("m2 cd-1", "1 / luminance of white")),
        "XYZ": ((*at, "tristimulus"), found.xyz, _said("cd m-2", "tristimulus values, CIE 1931")),
        "Lab": ((*at, "coordinate"), lab, _said("1", "CIELAB")),
        "delta_e": (at, ciede2000(lab, lab[first]), _said("1", "CIEDE2000 from the first combination")),
        "luminescent_share": (at, found.glowing, _said("1", "share of the luminance that has luminesced")),
    }
    attrs: dict[str, Any] = {
        name: found.attrs[name]
        for name in ("version", "scene", "spp", "seed", "denoised")
        if name in found.attrs
    }
    attrs |= {
        "wavelengths": str(grid),
        "exposure": exposure,
        "white": f"{white or 'D65'}, {of_white[1]:.6g} cd/m2, for all combinations",
        "measured": "mean of all pixels, without lamps seen directly"
        if found.table is None
        else "; ".join(found.table.notes),
    }
    if paths.pixels < found.pictures.shape[-3] * found.pictures.shape[-2]:
        attrs["partial"] = 1
    return xr.Dataset(variables, coords, attrs)


def _said(units: str, long_name: str) -> dict[str, str]:
    return {"units": units, "long_name": long_name}
