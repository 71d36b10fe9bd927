"""Compare two images, two tables of measured spectra, or an image with a table."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar.colour.adaptation import adapt_to_d65
from fluorspar.colour.observers import observer_named
from fluorspar.colour.xyz import CIE_1931
from fluorspar.comparing.common_components import common_components
from fluorspar.comparing.common_points import common_points
from fluorspar.comparing.compare_images import compare_images
from fluorspar.comparing.compare_points import compare_points
from fluorspar.comparing.comparison import Comparison, Detail
from fluorspar.comparing.scale import match_scales
from fluorspar.comparing.sides import Weights, image_sides, point_sides
from fluorspar.comparing.sources import (
    Side,
    Source,
    bands_of_side,
    check_units,
    open_side,
    title_of,
    unit_of_side,
)
from fluorspar.comparing.terms import Terms
from fluorspar.comparing.whites import exposure_of, has_colour, white_of
from fluorspar.errors import SpectrumError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.units import is_unit_of_radiance
from fluorspar.job import read_grid
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.image_scene import given_scene
from fluorspar.measuring.normalised import RANGE
from fluorspar.measuring.options import reference_option, text_option, width_option
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point, points_of
from fluorspar.scene.scene import Scene
from fluorspar.spectral.bands import Bands, assumed_bands, common_bands, conversion
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["compare"]


def compare(
    a: Source,
    b: Source,
    *,
    points: Sequence[Point] | str | os.PathLike[str] | None = None,
    match: str = "none",
    white: str | None = None,
    observer: str | int = CIE_1931,
    wavelengths: Wavelengths | str | ArrayLike | None = None,
    bandwidth_a: float | None = None,
    bandwidth_b: float | None = None,
    aperture: Aperture | str | None = None,
    scene: Scene | str | Path | None = None,
    component: str | None = None,
    adapt: bool = False,
) -> Comparison:
    """Compare B with A.

    Parameters
    ----------
    a, b : SpectralImage, PointSpectra, str or path-like
        Images (`.nc`, `.exr`, `.hdr`, `.zarr`) or tables of measured spectra (`.csv`). A is the reference: errors are
        relative to it.
    points : sequence of Point, str or path-like, optional
        Points at which images are measured, or a points file; needed to compare an image with a table, which is
        matched by the names.
    match : str
        How the scale of B is matched to that of A: "none"; "luminance": the average luminances become equal;
        or the name of a point, at which the means over the bands of 400-700 nm become equal (Eq. 14).
    white : str, optional
        White of CIELAB: the name of a point of A, or an illuminant, whose luminance is then the greatest of
        the points (of images without points: that of the white of the pictures). Default: the point of
        `match`; else D65.
    observer : str or int
        2 or 10 (degrees), or a name, see `fluorspar.colour.observers.observer_named`.
        It counts for CIELAB; luminances and pictures are those of CIE 1931.
    wavelengths : Wavelengths, str or array_like of shape (T,), optional
        The grid to compare on, such as `"400:700:10"` (nm), or evenly spaced wavelengths; default: the coarser of
        the two, as far as both have data.
    bandwidth_a, bandwidth_b : float, optional
        FWHM in nm of the bands of each side, 0 for samples; default: samples for images of Fluorspar, and else
        what the file says.
    aperture : Aperture or str, optional
        As in `measure`, the same for both sides.
    scene : Scene, str or Path, optional
        As in `measure`, the same for both sides; it needs points.
    component : str, optional
        As in `measure`, the same for both sides. By default, if only one of two images holds light that
        luminesced twice, both are compared without it (`single_bounce`).
    adapt : bool
        Show pictures adapted from the white of CIELAB to the white of the display, D65, by the linear
        Bradford transform.

    Returns
    -------
    Comparison
        Its `points` of P points, `images` of Y x X pixels, or both, on T common bands: RMSE, CIEDE2000, errors
        of bands, and what share of the difference is noise. `text()`, `to_json()` and `save_json(path)` write
        the numbers.

    Raises
    ------
    ImageError
        If an image cannot be read, or if two images differ in size and there are no points.
    SpectrumError
        If a table cannot be read, they have no wavelengths in common, or there is no such white.
    OptionError
        If an option is impossible, points are missing, or the units differ and scales are not matched.

    Warns
    -----
    ApproximationWarning
        If images are measured with an aperture that is smaller than a pixel.

    Notes
    -----
    With a point as `match`, RMSE is that of Eq. 14 of Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi
    10.1109/TVCG.2026.3668980: `sqrt(mean over points and bands of (a / m_a - b / m_b)^2)` over the common bands of
    400-700 nm, where m_a and m_b are the means over these bands at that point, each of its own side. The RMSE of
    each point or pixel has the root within the mean over points; its mean is the "mean RMSE". Without such a
    point, m_a is the mean over all points, or pixels, of A, and m_b that of A in the scale of B.

    Standard errors: the bands of a rendered pixel count as fully correlated and pixels as independent; the bands
    of a table of measurements count as independent, unless its file says `# errors: correlated`.

    Examples
    --------
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> compare(image, image).value("rmse")
    0.0
    """
    with ExitStack() as opened:
        match, white = reference_option("match", match), text_option("white", white)
        component = text_option("component", component)
        widths = width_option("bandwidth_a", bandwidth_a), width_option("bandwidth_b", bandwidth_b)
        grid, observer = None if wavelengths is None else read_grid(wavelengths), observer_named(observer)
        sides = _opened(a, opened), _opened(b, opened)
        titles = title_of(sides[0], a), title_of(sides[1], b)
        bands, weights, of_bands = _common(sides, widths, grid)
        components, of_components = common_components(sides, component)
        of_units = check_units(*sides, match)
        tables, of_points = common_points(
            sides,
            None if points is None else points_of(points),
            scene=given_scene(scene),
            aperture=Aperture.of(aperture),
            components=components,
            titles=titles,
        )
        pixels, of_size = image_sides(sides, weights, components, with_points=tables is not None)
        table_sides = point_sides(tables, bands, weights)
        in_range, rmse_bands, of_range = _rmse_bands(bands.grid)
        scale, of_scale = match_scales(table_sides, pixels, bands.grid, in_range, match)
        absolute = is_unit_of_radiance(unit_of_side(sides[0]))
        exposure = exposure_of(pixels[0]) if pixels else None
        find_white = partial(
            white_of,
            table_sides[0].spectra if table_sides else None,
            white,
            match,
            bands.grid,
            pictured=None if exposure is None else 1 / exposure,
            absolute=absolute,
        )
        white_xyz, of_white = find_white(observer=observer)
        to_display = adapt_to_d65(np.eye(3), find_white(observer=CIE_1931)[0]) if adapt else None
        at_a_point = match not in ("none", "luminance")
        terms = Terms(bands.grid, in_range, scale, white_xyz, observer, _same_seed(sides))
        return Comparison(
            *titles,
            grid=bands.grid,
            rmse_bands=rmse_bands,
            scale=scale.factor,
            mean_a=scale.mean_a,
            mean_b=scale.mean_b,
            white=white_xyz,
            observer=observer,
            notes=_each_once(
                *of_units,
                *of_bands,
                *of_components,
                *of_points,
                *_of_tables(tables),
                *of_size,
                of_range,
                *of_scale,
                of_white,
                *_of_colour(bands.grid, observer, white_xyz),
                *_of_pictures(exposure, absolute, adapt),
            ),
            points=compare_points(*table_sides, terms, at_a_point=at_a_point) if table_sides else None,
            images=compare_images(*pixels, terms, exposure, to_display) if pixels and exposure else None,
            match=match,
            absolute=absolute,
        )


def _opened(source: Source, until: ExitStack) -> Side:
    """A side that is closed again if it was opened here."""
    side = open_side(source)
    if isinstance(side, SpectralImage) and side is not source:
        until.callback(side.close)
    return side


def _common(
    sides: tuple[Side, Side], widths: tuple[float | None, float | None], wavelengths: Wavelengths | None
) -> tuple[Bands, tuple[Weights, Weights], list[str]]:
    """The common bands, what brings each side to them, and what was done."""
    given = [
        bands_of_side(side) if width is None else Bands(bands_of_side(side).grid, width)
        for side, width in zip(sides, widths, strict=True)
    ]
    own = [assumed_bands(given[0], given[1]), assumed_bands(given[1], given[0])]
    common = common_bands(own[0], own[1], wavelengths)
    to_a, done_to_a = conversion(own[0], common, "A")
    to_b, done_to_b = conversion(own[1], common, "B")
    assumed = [
        f"{side}: the band shape is not known; {'this triangle is' if known.fwhm else 'samples are'} assumed."
        for side, stated, known in zip("AB", given, own, strict=True)
        if stated.fwhm is None
    ]
    return common, (to_a, to_b), [done_to_a, done_to_b, *assumed]


def _rmse_bands(grid: Wavelengths) -> tuple[NDArray[np.bool_], tuple[float, float], Detail]:
    """Which bands RMSE is taken over, the first and the last of them, and how to say it."""
    in_range = (grid.values >= RANGE[0] - 1e-6) & (grid.values <= RANGE[1] + 1e-6)
    if not in_range.any():
        fault = "the common bands have no wavelength of 400-700 nm, over which RMSE is taken"
        raise SpectrumError(message(fault, got=str(grid)))
    bands = (float(grid.values[in_range][0]), float(grid.values[in_range][-1]))
    reached = "" if bands == RANGE else ", which is all that both have of 400-700 nm"
    of_range = f"RMSE is taken over {in_range.sum()} bands, {bands[0]:g}-{bands[1]:g} nm{reached}."
    return in_range, bands, Detail(of_range)


def _each_once(*notes: str) -> tuple[str, ...]:
    """What is said of an image and of its points is said once."""
    return tuple(dict.fromkeys(notes))


def _of_tables(tables: tuple[PointSpectra, PointSpectra] | None) -> list[str]:
    notes = []
    for name, table in zip("AB", tables or (), strict=False):
        notes += [f"{name}: {note}." for note in table.notes]
        if table.standard_error is not None:
            how = "fully correlated" if table.correlated else "independent"
            notes.append(f"{name}: standard errors of the bands of a point count as {how}.")
    return notes


def _of_colour(grid: Wavelengths, observer: str, white: NDArray[np.float64]) -> list[str]:
    seen = grid.values[(grid.values >= 360 - 1e-6) & (grid.values <= 830 + 1e-6)]
    notes: list[str] = [
        Detail(
            f"XYZ: sums over {seen[0]:g}-{seen[-1]:g} nm in steps of {grid.step:g} nm, {observer}; "
            "colour differences: CIEDE2000 with unit weights."
        )
    ]
    if not has_colour(white):
        missing = " and ".join(axis for axis, value in zip("XYZ", white, strict=True) if not value > 0)
        notes.append(f"CIEDE2000 cannot be computed: in these bands the white has no {missing}.")
    return notes


def _of_pictures(exposure: float | None, absolute: bool, adapt: bool) -> list[str]:
    if exposure is None:
        return []
    level = f"{1 / exposure:.4g} cd/m2" if absolute else "the same radiance"
    adapted = "that of CIELAB is adapted to it (linear Bradford)" if adapt else "no adaptation"
    return [Detail(f"Pictures: sRGB (CIE 1931), both with {level} as white; the white is D65, {adapted}.")]


def _same_seed(sides: tuple[Side, Side]) -> int | None:
    """The seed of two renders by one method, if it is the same: their noise is then correlated."""
    a, b = sides
    if not (isinstance(a, SpectralImage) and isinstance(b, SpectralImage)):
        return None
    seed = a.attrs.get("seed")
    same = seed == b.attrs.get("seed") and a.attrs.get("method") == b.attrs.get("method")
    return seed if same and isinstance(seed, int) else None
