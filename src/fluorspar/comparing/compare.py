"""Compare two images, two tables of measured spectra, or an image with a table."""

from __future__ import annotations

import os
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.adaptation import adapt_to_d65
from fluorspar.colour.xyz import CIE_1931
from fluorspar.comparing.common import check_units, common_light, common_points, unit_of_side
from fluorspar.comparing.comparison import Comparison
from fluorspar.comparing.images import compare_images
from fluorspar.comparing.matching import matched_scale, scale_error_of
from fluorspar.comparing.pair import paired
from fluorspar.comparing.points import compare_points
from fluorspar.comparing.sides import ImageSide, bands_of_side, open_side
from fluorspar.comparing.whites import exposure_of, has_colour, white_of
from fluorspar.errors import ImageError, SpectrumError, message
from fluorspar.files.names import text_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of
from fluorspar.image.units import is_unit_of_radiance
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point
from fluorspar.measuring.spectroradiometer import RANGE
from fluorspar.scene.scene import Scene
from fluorspar.spectral.bands import Bands, assumed_bands, common_bands, conversion
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["compare"]

Side = SpectralImage | PointSpectra
Source = Side | str | os.PathLike[str]


def compare(
    a: Source,
    b: Source,
    *,
    points: tuple[Point, ...] | None = None,
    match: str = "none",
    white: str | None = None,
    observer: str = CIE_1931,
    wavelengths: Wavelengths | None = None,
    bandwidth_a: float | None = None,
    bandwidth_b: float | None = None,
    aperture: Aperture | None = None,
    scene: Scene | None = None,
    component: str | None = None,
    adapt: bool = False,
    title_a: str = "",
    title_b: str = "",
) -> Comparison:
    """Compare B with A.

    Parameters
    ----------
    a, b : SpectralImage, PointSpectra, str or path-like
        Images (`.nc`, `.exr`, `.hdr`) or tables of measured spectra (`.csv`). A is the reference: errors are
        relative to it.
    points : tuple of Point, optional
        Points at which images are measured; needed to compare an image with a table, which is matched by the
        names.
    match : str
        How the scale of B is matched to that of A: "none"; "luminance": the average luminances become equal;
        or the name of a point, at which the means over the bands of 400-700 nm become equal (Eq. 14).
    white : str, optional
        White of CIELAB: the name of a point of A, or an illuminant, whose luminance is then the greatest of
        the points (of images without points: that of the white of the pictures). Default: the point of
        `match`; else D65.
    observer : str
        Name of the colour matching functions in colour-science.
        It counts for CIELAB; luminances and pictures are those of CIE 1931.
    wavelengths : Wavelengths, optional
        The grid to compare on; default: the coarser of the two, as far as both have data.
    bandwidth_a, bandwidth_b : float, optional
        FWHM in nm of the bands of each side, 0 for samples; default: samples for images of Fluorspar, and else
        what the file says.
    aperture, scene, component
        As in `measure`, but the same for both sides. By default, if only one of two images holds light that
        luminesced twice, both are compared without it (`single_bounce`).
    adapt : bool
        Show pictures adapted from the white of CIELAB to the white of the display, D65, by the linear
        Bradford transform.
    title_a, title_b : str
        What to call them.

    Returns
    -------
    Comparison

    Raises
    ------
    ImageError
        If two images differ in size and there are no points.
    SpectrumError
        If they have no wavelengths in common.
    OptionError
        If an option is impossible, points are missing, or the units differ and scales are not matched.

    Notes
    -----
    RMSE of a point is `sqrt(mean over bands of (a / m_a - b / m_b)^2)` over the common bands of 400-700 nm and
    E{RMSE} its mean over points (Eq. 14). With a point as `match`, m_a and m_b are the means over these bands
    at that point, each of its own side. Otherwise m_a is the mean over all points, or pixels, of A, and m_b
    that of A in the scale of B.

    Standard errors: the bands of a rendered pixel count as fully correlated and pixels as independent; the bands
    of a table of measurements count as independent, unless its file says `# errors: correlated`.

    Examples
    --------
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> compare(image, image).value("rmse")
    0.0
    """
    with ExitStack() as opened:
        sides = _opened(a, opened), _opened(b, opened)
        titles = title_a or _title(sides[0], a), title_b or _title(sides[1], b)
        common, weights, of_bands = _common(sides, (bandwidth_a, bandwidth_b), wavelengths)
        components, of_components = common_light(sides, component)
        notes = [*check_units(*sides, match), *of_bands, *of_components]
        tables, said = common_points(
            sides, points, scene=scene, aperture=aperture, components=components, titles=titles
        )
        notes += said + _table_notes(tables)
        images = _images(sides, weights, components, tables is not None)
        if images is None and all(isinstance(side, SpectralImage) for side in sides):
            notes.append("The images differ in size: they are compared at the points only.")
        inside, bands, said = _rmse_bands(common.grid)
        notes += said

        pair = paired(tables, weights, common)
        scale, mean_a, mean_b, sentence = matched_scale(pair, images, common.grid, inside, match)
        notes.append(sentence)
        scale_error = scale_error_of(pair, images, common.grid, inside, match)
        if scale_error:
            where = "the average luminance" if match == "luminance" else f"point {match}"
            notes.append(f"The noise of {where} makes that factor uncertain by {100 * scale_error:.2g} %.")
        absolute = is_unit_of_radiance(unit_of_side(sides[0]))
        exposure = exposure_of(images[0]) if images else 1.0
        pictured = 1 / exposure if images else None
        chosen, sentence = white_of(pair.a, white, match, common.grid, observer, pictured, absolute=absolute)
        notes.append(sentence)
        notes += _colour_notes(common.grid, observer, chosen)
        seed = _same_seed(sides)
        results = Comparison(
            *titles,
            grid=common.grid,
            rmse_bands=bands,
            scale=scale,
            mean_a=mean_a,
            mean_b=mean_b,
            white=chosen,
            observer=observer,
            notes=(),
            points=None,
            images=None,
            match=match,
            absolute=absolute,
        )
        compared = compare_points(pair, inside, results, scale_error=scale_error, same_seed=seed)
        maps = None
        if images:
            to_display, sentence = None, "no adaptation"
            if adapt:
                of_pictures, _ = white_of(pair.a, white, match, common.grid, CIE_1931, pictured)
                to_display = adapt_to_d65(np.eye(3), of_pictures)
                sentence = "that of CIELAB is adapted to it (linear Bradford)"
            level = f"{1 / exposure:.4g} cd/m2" if absolute else "the same radiance"
            notes.append(
                f"Pictures: sRGB (CIE 1931), both with {level} as white; the white is D65, {sentence}."
            )
            maps = compare_images(
                *images,
                inside,
                results,
                exposure,
                scale_error=scale_error,
                to_display=to_display,
                same_seed=seed,
            )
        return replace(results, notes=tuple(notes), points=compared, images=maps)


def _opened(source: Source, until: ExitStack) -> Side:
    """A side that is closed again if it was opened here."""
    side = open_side(source)
    if isinstance(side, SpectralImage) and side is not source:
        until.callback(side.close)
    return side


def _title(side: Side, source: Source) -> str:
    if isinstance(source, str | os.PathLike):
        return text_of(source)
    return side.title if isinstance(side, PointSpectra) else str(side.attrs.get("scene", "an image"))


def _table_notes(tables: tuple[PointSpectra, PointSpectra] | None) -> list[str]:
    notes = []
    for name, table in zip("AB", tables or (), strict=False):
        notes += [f"{name}: {note}." for note in table.notes]
        if table.standard_error is not None:
            how = "fully correlated" if table.correlated else "independent"
            notes.append(f"{name}: standard errors of the bands of a point count as {how}.")
    return notes


def _common(
    sides: tuple[Side, Side], widths: tuple[float | None, float | None], wavelengths: Wavelengths | None
) -> tuple[Bands, tuple[NDArray[np.float64] | None, NDArray[np.float64] | None], list[str]]:
    """The common bands, what brings each side to them, and what was done."""
    given = [
        bands_of_side(side) if width is None else Bands(bands_of_side(side).grid, width)
        for side, width in zip(sides, widths, strict=True)
    ]
    own = [assumed_bands(given[0], given[1]), assumed_bands(given[1], given[0])]
    common = common_bands(own[0], own[1], wavelengths)
    to_a, said_a = conversion(own[0], common, "A")
    to_b, said_b = conversion(own[1], common, "B")
    assumed = [
        f"{side}: the band shape is not known; {'this triangle is' if known.fwhm else 'samples are'} assumed."
        for side, stated, known in zip("AB", given, own, strict=True)
        if stated.fwhm is None
    ]
    return common, (to_a, to_b), [said_a, said_b, *assumed]


def _images(
    sides: tuple[Side, Side],
    weights: tuple[NDArray[np.float64] | None, NDArray[np.float64] | None],
    components: tuple[str | None, str | None],
    with_points: bool,
) -> tuple[ImageSide, ImageSide] | None:
    """Two images that can be compared pixel by pixel; None if there are not two."""
    a, b = sides
    if not (isinstance(a, SpectralImage) and isinstance(b, SpectralImage)):
        return None
    if a.size != b.size:
        if with_points:
            return None
        raise ImageError(
            message(
                "the images differ in size",
                got=" and ".join(f"{w} x {h}" for w, h in (a.size, b.size)),
                expected="the same number of pixels",
                fix="render both at one size, or compare them at positions in the scene (--points)",
            )
        )
    return (
        ImageSide(a, bands_of(a), weights[0], components[0]),
        ImageSide(b, bands_of(b), weights[1], components[1]),
    )


def _rmse_bands(grid: Wavelengths) -> tuple[NDArray[np.bool_], tuple[float, float], list[str]]:
    """Which bands RMSE is taken over, the first and the last of them, and how to say it."""
    inside = (grid.values >= RANGE[0] - 1e-6) & (grid.values <= RANGE[1] + 1e-6)
    if not inside.any():
        fault = "the common bands have no wavelength of 400-700 nm, over which RMSE is taken"
        raise SpectrumError(message(fault, got=str(grid)))
    bands = (float(grid.values[inside][0]), float(grid.values[inside][-1]))
    reached = "" if bands == RANGE else ", which is all that both have of 400-700 nm"
    return inside, bands, [f"RMSE is taken over {inside.sum()} bands, {bands[0]:g}-{bands[1]:g} nm{reached}."]


def _colour_notes(grid: Wavelengths, observer: str, white: NDArray[np.float64]) -> list[str]:
    seen = grid.values[(grid.values >= 360 - 1e-6) & (grid.values <= 830 + 1e-6)]
    notes = [
        f"XYZ: sums over {seen[0]:g}-{seen[-1]:g} nm in steps of {grid.step:g} nm, {observer}; "
        "colour differences: CIEDE2000 with unit weights."
    ]
    if not has_colour(white):
        missing = " and ".join(axis for axis, value in zip("XYZ", white, strict=True) if not value > 0)
        notes.append(f"CIEDE2000 cannot be had: in these bands the white has no {missing}.")
    return notes


def _same_seed(sides: tuple[Side, Side]) -> int | None:
    """The seed of two renders by one method, if it is the same: their noise is then correlated."""
    if not all(isinstance(side, SpectralImage) for side in sides):
        return None
    first, second = (
        (side.attrs.get("seed"), side.attrs.get("method")) if isinstance(side, SpectralImage) else None
        for side in sides
    )
    return first[0] if first == second and first is not None and isinstance(first[0], int) else None
