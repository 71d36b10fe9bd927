"""A spectroradiometer for spectral images: the mean spectrum under an aperture, at points of the scene."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, FluorsparWarning, ImageError, message
from fluorspar.files.names import text_of
from fluorspar.image.known_error import is_all_light, known_error
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import bands_of, is_denoised, unit_of_image
from fluorspar.measuring.aperture import Aperture, coverage, radius_in_pixels
from fluorspar.measuring.image_scene import scene_of
from fluorspar.measuring.mean_spectrum import mean_spectrum
from fluorspar.measuring.options import text_option, width_option
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point, pixels_of, points_of
from fluorspar.measuring.visible import doubts, visible_pixels
from fluorspar.scene.scene import Scene
from fluorspar.spectral.bands import beyond_the_data

__all__ = ["measure"]

Array = NDArray[np.float64]


def measure(
    image: SpectralImage | str | os.PathLike[str],
    points: Sequence[Point] | str | os.PathLike[str],
    *,
    scene: Scene | str | Path | None = None,
    aperture: Aperture | str | None = None,
    bandwidth: float = 0.0,
    component: str | None = None,
    title: str = "",
) -> PointSpectra:
    """Measure the spectra of points in an image.

    Parameters
    ----------
    image : SpectralImage, str or path-like
        A spectral image, or its file (`.nc`, `.exr`, `.hdr`, `.zarr`).
    points : sequence of Point, str or path-like
        P pixels, or positions on surfaces of the scene; or a points file, as `read_points` takes it.
    scene : Scene, str or Path, optional
        The scene of the image: needed for positions and for an aperture in degrees. By default the built-in
        scene of that name, if the image has one.
    aperture : Aperture or str, optional
        Such as `"0.125deg"` or `"3px"`. By default 1/8 degree, if there is a scene, else one pixel. Pixels count
        as far as it covers them.
    bandwidth : float
        FWHM of the instrument's triangular bands in nm; 0: none. The notes say where they reach beyond the data.
    component : str, optional
        A component or a sum of some (`total`, `single_bounce`, `reflected`, `luminescent`, or several joined by "+").
    title : str
        What to call the image.

    Returns
    -------
    PointSpectra
        `radiance` of shape (P, N) on the N wavelengths of the image, W m-2 sr-1 nm-1 or the unit that the image
        states. `standard_error` is that of the mean under the aperture, if the image has standard errors of what is
        measured: pixels are independent, the bands of a pixel fully correlated; `freedom` says of how many
        samples they are. Of a sum of components it is an upper limit, or missing; the notes say so. Of a denoised
        image it is the estimated error, which pixels share. Known whites are kept if all light is measured (the total,
        or `single_bounce`): illuminance needs it.

    Raises
    ------
    OptionError
        If a point lies outside the image, is hidden, or is not on a surface; if the scene is needed and not
        known; if there is no such component; if the points, the aperture or the bandwidth are not usable.
    SceneError
        If the scene cannot be loaded.
    ImageError
        If the image cannot be read, or a pixel that is measured was not rendered.

    Warns
    -----
    ApproximationWarning
        If the aperture reaches beyond the image, or is smaller than a pixel.
    FluorsparWarning
        If the places of the points are doubtful: all within one pixel, as in other units than those of the scene, or
        two at the same place.

    Examples
    --------
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> spectra = measure(image, [Point("1", (2, 3))], aperture="1px")
    >>> float(spectra.at("1")[0])
    7.0
    """
    with ExitStack() as opened:
        if not isinstance(image, SpectralImage):
            if not isinstance(image, str | os.PathLike):
                raise ImageError(
                    message(
                        "this is not a spectral image",
                        got=type(image).__name__,
                        expected="a SpectralImage, or the path of one (.nc, .exr, .hdr, .zarr)",
                    )
                )
            title = title or text_of(image)
            image = opened.enter_context(SpectralImage.open(image))
        points, aperture = points_of(points), Aperture.of(aperture)
        component, bandwidth = (
            text_option("component", component),
            width_option("bandwidth", bandwidth) or 0.0,
        )
        needs_camera = any(not point.is_pixel for point in points)
        seen = None
        if scene is not None or needs_camera or aperture is None or aperture.unit == "deg":
            seen = scene_of(image.attrs, scene, required=needs_camera or aperture is not None)
        aperture = aperture or (Aperture() if seen is not None else Aperture(1.0, "px"))
        pixels, camera_matrix = _seen(image, points, seen, aperture)
        radiance, error, freedom = _means(image, points, pixels, aperture, camera_matrix, component)
        width = _width(pixels, aperture, camera_matrix)
        if width:
            warnings.warn(f"the aperture is {aperture}{width}", ApproximationWarning, stacklevel=2)
        notes = [
            f"mean under an aperture of {aperture}{width}" + ("" if component is None else f", {component}")
        ]
        if is_denoised(image):
            notes.append("the image is denoised: errors are estimated, and pixels share them")
        if of_error := known_error(image, component).note:
            notes.append(of_error)
        lit = is_all_light(image, component)
        spectra = PointSpectra(
            tuple(point.name for point in points),
            bands_of(image),
            radiance,
            error,
            unit_of_image(image),
            whites={point.name: point.white for point in points if point.white is not None and lit},
            title=title or str(image.attrs.get("scene", "an image")),
            notes=tuple(notes),
            correlated=True,
            freedom=freedom,
            denoised=str(image.attrs.get("denoised", "")),
        ).through(bandwidth)
    if bandwidth and (assumption := beyond_the_data(spectra.grid, spectra.grid, bandwidth)):
        spectra = replace(spectra, notes=(*spectra.notes, assumption))
    return spectra


def _seen(
    image: SpectralImage, points: tuple[Point, ...], scene: Scene | None, aperture: Aperture
) -> tuple[Array, Array | None]:
    """Where the points are in the image, ndarray of shape (P, 2), and the camera's matrix where it is needed."""
    pixels, matrix = pixels_of(points, image.size), None
    in_scene = [p for p, point in enumerate(points) if not point.is_pixel]
    if scene is not None and (in_scene or aperture.unit == "deg"):
        from fluorspar.scene.camera import camera_of

        width, height = image.size
        scene = scene.with_settings(width=width, height=height)
        matrix = camera_of(scene).matrix
        if in_scene:
            pixels[in_scene] = visible_pixels(scene, [points[p] for p in in_scene])
    for doubt in doubts(points, pixels, scene):
        warnings.warn(doubt, FluorsparWarning, stacklevel=3)
    return pixels, matrix


def _width(pixels: Array, aperture: Aperture, camera_matrix: Array | None) -> str:
    """The width of an aperture where it is less than a pixel, in words; empty: it is more."""
    width = 2 * max(radius_in_pixels(pixel, aperture, camera_matrix) for pixel in pixels)
    return f", {width:.2g} pixels wide: the pixels it touches are measured whole" if width < 0.99 else ""


def _means(
    image: SpectralImage,
    points: tuple[Point, ...],
    pixels: Array,
    aperture: Aperture,
    camera_matrix: Array | None,
    component: str | None,
) -> tuple[Array, Array | None, Array | None]:
    """Mean radiance under the aperture (P, N), its standard error (P, N) and the error's degrees of freedom (P,)."""
    means = []
    for point, pixel in zip(points, pixels, strict=True):
        rows, columns, weights = coverage(pixel, aperture, image.size, camera_matrix)
        part = SpectralImage(image.dataset.isel(y=rows, x=columns))
        means.append(mean_spectrum(part, weights, component, f"point {point.name}"))
        radius = radius_in_pixels(pixel, aperture, camera_matrix)
        if (pixel < radius - 0.01).any() or (pixel + radius > np.array(image.size) + 0.01).any():
            text = f"the aperture at point {point.name} reaches beyond the image: only the part inside is measured"
            warnings.warn(text, ApproximationWarning, stacklevel=3)
    radiance, errors, freedom = zip(*means, strict=True)
    known = [error for error in errors if error is not None]
    return np.stack(radiance), np.stack(known) if known else None, np.array(freedom) if known else None
