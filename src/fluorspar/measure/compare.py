"""Compare two images, two tables of measured spectra, or an image with a table."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ImageError, OptionError, SpectrumError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measure.aperture import Aperture
from fluorspar.measure.bands import Bands, assumed_bands, common_bands, conversion
from fluorspar.measure.compare_images import compare_images
from fluorspar.measure.comparison import Comparison, PointComparison
from fluorspar.measure.difference import band_bias, band_error, ciede2000, rmse
from fluorspar.measure.matching import Pair, exposure_of, matched_scale, scale_error_of, white_of
from fluorspar.measure.noise import explained_by_noise
from fluorspar.measure.point_spectra import PointSpectra
from fluorspar.measure.points import Point
from fluorspar.measure.sides import ImageSide, open_side
from fluorspar.measure.spectroradiometer import RANGE, measure
from fluorspar.scene.scene import Scene
from fluorspar.spectral.chromatic_adaptation import adapt_to_d65
from fluorspar.spectral.colour import CIE_1931, lab_from_xyz, xyz_from_radiance
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["compare"]

Array = NDArray[np.float64]
Source = SpectralImage | PointSpectra | str | os.PathLike[str]


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
    wavelengths : Wavelengths, optional
        The grid to compare on; default: the coarser of the two, as far as both have data.
    bandwidth_a, bandwidth_b : float, optional
        FWHM in nm of the bands of each side, 0 for samples; default: samples for images, and for tables what
        the file says.
    aperture, scene, component
        As in `measure`.
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
        If two images differ in size.
    SpectrumError
        If they have no wavelengths in common.
    OptionError
        If an option is impossible, or points are missing.

    Notes
    -----
    RMSE of a point is `sqrt(mean over bands of (a / m_a - b / m_b)^2)` over the common bands of 400-700 nm and
    E{RMSE} its mean over points (Eq. 14). With a point as `match`, m_a and m_b are the means over these bands
    at that point, each of its own side. Otherwise m_a is the mean over all points, or pixels, of A, and m_b
    that of A in the scale of B.

    Examples
    --------
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> compare(image, image).value("rmse")
    0.0
    """
    side_a, side_b = open_side(a), open_side(b)
    if isinstance(side_a, SpectralImage) and isinstance(side_b, SpectralImage) and side_a.size != side_b.size:
        raise ImageError(
            message(
                "the images differ in size",
                got=" and ".join(f"{w} x {h}" for w, h in (side_a.size, side_b.size)),
                expected="the same number of pixels",
                fix="render both at one size, or compare them at points (--points) of the scene, as two tables",
            )
        )
    own = [_bands(side, width) for side, width in ((side_a, bandwidth_a), (side_b, bandwidth_b))]
    given = list(own)
    own = [assumed_bands(own[0], own[1]), assumed_bands(own[1], own[0])]
    common = common_bands(own[0], own[1], wavelengths)
    to_a, said_a = conversion(own[0], common, "A")
    to_b, said_b = conversion(own[1], common, "B")
    notes = [said_a, said_b]
    notes += [
        f"{side}: the band shape is not known; {'samples are' if not known.fwhm else 'this triangle is'} assumed."
        for side, stated, known in zip("AB", given, own, strict=True)
        if stated.fwhm is None
    ]
    title_a, title_b = title_a or _title(side_a, a), title_b or _title(side_b, b)

    table_a, table_b = _tables(side_a, side_b, points, scene, aperture, component, (title_a, title_b))
    if table_a is not None and table_b is not None:
        notes += [
            f"{side}: {note}." for side, table in (("A", table_a), ("B", table_b)) for note in table.notes
        ]
    pair = Pair(_through(table_a, to_a, common), _through(table_b, to_b, common))
    images: tuple[ImageSide, ImageSide] | None = None
    if isinstance(side_a, SpectralImage) and isinstance(side_b, SpectralImage):
        images = (ImageSide(side_a, own[0], to_a, component), ImageSide(side_b, own[1], to_b, component))
    inside = (common.grid.values >= RANGE[0] - 1e-6) & (common.grid.values <= RANGE[1] + 1e-6)
    if not inside.any():
        raise SpectrumError(
            message(
                "the common bands have no wavelength of 400-700 nm, over which RMSE is taken",
                got=str(common.grid),
            )
        )
    bands = (float(common.grid.values[inside][0]), float(common.grid.values[inside][-1]))
    reached = "" if bands == RANGE else ", which is all that both have of 400-700 nm"
    notes.append(f"RMSE is taken over {inside.sum()} bands, {bands[0]:g}-{bands[1]:g} nm{reached}.")

    scale, mean_a, mean_b, said = matched_scale(pair, images, common.grid, inside, match, observer)
    notes.append(said)
    scale_error = scale_error_of(pair, inside, match)
    if scale_error:
        notes.append(f"The noise of point {match} makes that factor uncertain by {100 * scale_error:.2g} %.")
    exposure = exposure_of(images[0]) if images else 1.0
    chosen, said = white_of(pair.a, white, match, common.grid, observer, 1 / exposure if images else None)
    notes.append(said)
    first, last = max(common.grid.start, 360.0), min(common.grid.stop, 830.0)
    notes.append(
        f"XYZ: sums over {first:g}-{last:g} nm in steps of {common.grid.step:g} nm, {observer}; "
        "colour differences: CIEDE2000 with unit weights."
    )
    results = Comparison(
        title_a, title_b, common.grid, bands, scale, mean_a, mean_b, chosen, observer, (), None, None
    )
    compared = None
    if pair.a is not None and pair.b is not None:
        compared = _compare_points(pair.a, pair.b, inside, results, scale_error)
    maps = None
    if images:
        adapted = adapt_to_d65(np.eye(3), chosen) if adapt else None
        maps = compare_images(*images, inside, results, exposure, scale_error=scale_error, to_display=adapted)
        how = "that of CIELAB is adapted to it (linear Bradford)" if adapt else "no adaptation"
        notes.append(f"Pictures: sRGB, both with {1 / exposure:.4g} cd/m2 as white; the white is D65, {how}.")
    return replace(results, notes=tuple(notes), points=compared, images=maps)


def _bands(side: SpectralImage | PointSpectra, width: float | None) -> Bands:
    if isinstance(side, SpectralImage):
        return Bands(side.wavelengths, width or 0.0)
    return side.bands if width is None else Bands(side.grid, width)


def _title(side: SpectralImage | PointSpectra, source: Source) -> str:
    if isinstance(source, str | os.PathLike):
        return os.fspath(source)
    return side.title if isinstance(side, PointSpectra) else str(side.attrs.get("scene", "an image"))


def _tables(
    side_a: SpectralImage | PointSpectra,
    side_b: SpectralImage | PointSpectra,
    points: tuple[Point, ...] | None,
    scene: Scene | None,
    aperture: Aperture | None,
    component: str | None,
    titles: tuple[str, str],
) -> tuple[PointSpectra | None, PointSpectra | None]:
    """Spectra of the points that both sides have, in the order of A; (None, None) if there are none."""
    sides = (side_a, side_b)
    if all(isinstance(side, SpectralImage) for side in sides) and points is None:
        return None, None
    tables = [side for side in sides if isinstance(side, PointSpectra)]
    if points is None and len(tables) < 2:
        raise OptionError(
            message(
                "an image is compared with a table at points, and their places are missing",
                expected=f"the places of {', '.join(tables[0].names)}",
                fix="give a points file (--points)",
            )
        )
    known = points or ()
    for table in tables:
        # places may be more than what was measured, and the other way round
        known = tuple(point for point in known if point.name in table.names)
    if len(tables) < 2 and not known:
        raise OptionError(
            message(
                "the points of the points file are not those of the table",
                got=", ".join(point.name for point in points or ()),
                expected=f"some of {', '.join(tables[0].names)}" if tables else "at least one point",
            )
        )
    found = [
        side
        if isinstance(side, PointSpectra)
        else measure(side, known, scene=scene, aperture=aperture, component=component, title=title)
        for side, title in zip(sides, titles, strict=True)
    ]
    both = tuple(name for name in found[0].names if name in found[1].names)
    if not both:
        raise OptionError(
            message(
                "the tables have no point in common",
                got=", ".join(found[0].names),
                expected=", ".join(found[1].names),
            )
        )
    return _only(found[0], both), _only(found[1], both)


def _only(spectra: PointSpectra, names: tuple[str, ...]) -> PointSpectra:
    rows = [spectra.index(name) for name in names]
    error = None if spectra.standard_error is None else spectra.standard_error[rows]
    return replace(spectra, names=names, radiance=spectra.radiance[rows], standard_error=error)


def _through(table: PointSpectra | None, weights: Array | None, common: Bands) -> PointSpectra | None:
    if table is None or weights is None:
        return table
    error = None if table.standard_error is None else table.standard_error @ np.abs(weights).T
    return replace(table, bands=common, radiance=table.radiance @ weights.T, standard_error=error)


def _compare_points(
    a: PointSpectra, b: PointSpectra, inside: NDArray[np.bool_], done: Comparison, scale_error: float
) -> PointComparison:
    matched = b.radiance * done.scale
    difference = matched - a.radiance
    lab_a, lab_b = (
        lab_from_xyz(xyz_from_radiance(values, done.grid, done.observer), done.white)
        for values in (a.radiance, matched)
    )
    errors = [
        (name, error)
        for name, error in (("A", a.standard_error), ("B", b.standard_error))
        if error is not None
    ]
    noise = None
    if errors:
        variance = sum((error * (done.scale if name == "B" else 1.0)) ** 2 for name, error in errors)
        noise = explained_by_noise(
            np.sum(difference**2, axis=1),
            np.sum(variance, axis=1),
            difference.mean(axis=1),
            np.sqrt(variance).mean(axis=1),
            " and ".join(name for name, _ in errors),
            scale_error=scale_error,
            levels=matched.mean(axis=1),
            level_squares=np.sum(matched**2, axis=1),
        )
    return PointComparison(
        a.names,
        a.radiance,
        b.radiance,
        a.standard_error,
        b.standard_error,
        rmse(a.radiance[:, inside], b.radiance[:, inside], done.mean_a, done.mean_b),
        ciede2000(lab_a, lab_b),
        lab_a,
        lab_b,
        band_error(a.radiance, matched),
        band_bias(a.radiance, matched),
        float(difference.mean() / a.radiance.mean()),
        noise,
    )
