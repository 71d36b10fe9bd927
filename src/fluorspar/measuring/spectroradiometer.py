"""A spectroradiometer for spectral images: the mean spectrum under an aperture, at points of the scene."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ApproximationWarning, ImageError, OptionError, message
from fluorspar.image.components import select
from fluorspar.image.dataset import add_up, values_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import OF_TOTAL, bands_of, error_layer, unit_of_image
from fluorspar.image.units import is_unit_of_radiance
from fluorspar.measuring.aperture import Aperture, coverage, radius_in_pixels
from fluorspar.measuring.freedom import combined_freedom, error_freedom
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point, pixels_of
from fluorspar.scene.scene import Scene
from fluorspar.spectral.bands import beyond_the_data

__all__ = ["RANGE", "measure", "normalised", "scene_of"]

Array = NDArray[np.float64]

_ON_SURFACE = 2e-3  # of the distance to the camera
RANGE = (400.0, 700.0)
"""Wavelengths in nm over which the paper takes means and RMSE (Eq. 14)."""


def measure(
    image: SpectralImage,
    points: tuple[Point, ...],
    *,
    scene: Scene | None = None,
    aperture: Aperture | None = None,
    bandwidth: float = 0.0,
    component: str | None = None,
    title: str = "",
) -> PointSpectra:
    """Measure the spectra of points in an image.

    Parameters
    ----------
    image : SpectralImage
    points : tuple of Point
        Pixels, or positions on surfaces of the scene.
    scene : Scene, optional
        The scene of the image: needed for positions and for an aperture in degrees. By default the built-in
        scene of that name, if the image has one.
    aperture : Aperture, optional
        By default 1/8 degree, if there is a scene, else one pixel. Pixels count as far as it covers them.
    bandwidth : float
        FWHM of the instrument's triangular bands in nm; 0: none. The notes say where they reach beyond the data.
    component : str, optional
        A component or a sum of some (`total`, `single_bounce`, `reflected`, `luminescent`).
    title : str
        What to call the image.

    Returns
    -------
    PointSpectra
        With the standard error of the mean under the aperture, if the image has standard errors for what is
        measured: pixels are independent, the bands of a pixel fully correlated; `freedom` says of how many samples
        they are. Known whites are kept if all light
        is measured (the total, or `single_bounce`): illuminance needs it.

    Raises
    ------
    OptionError
        If a point lies outside the image, is hidden, or is not on a surface; if the scene is needed and not
        known; if there is no such component.
    ImageError
        If a pixel that is measured was not rendered.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> spectra = measure(image, (Point("1", (2, 3)),), aperture=Aperture(1, "px"))
    >>> float(spectra.at("1")[0])
    7.0
    """
    needs_camera = any(not point.is_pixel for point in points)
    if scene is None and (needs_camera or aperture is None or aperture.unit == "deg"):
        scene = scene_of(image, required=needs_camera or aperture is not None)
    aperture = aperture or (Aperture() if scene is not None else Aperture(1.0, "px"))
    matrix, projected = None, None
    if scene is not None and (needs_camera or aperture.unit == "deg"):
        from fluorspar.scene.camera import camera_of

        width, height = image.size
        scene = scene.with_settings(width=width, height=height)
        matrix = camera_of(scene).matrix
        if needs_camera:
            projected = _visible_pixels(scene, points)
    pixels = pixels_of(points, image.size, projected)
    chosen = select(component, image.components)
    layer = error_layer(image, component)
    radiance = np.empty((len(points), len(image.wavelengths)))
    error = np.empty_like(radiance) if layer is not None else None
    freedom = np.empty(len(points)) if layer is not None else None
    for p, (point, pixel) in enumerate(zip(points, pixels, strict=True)):
        rows, columns, weights = coverage(pixel, aperture, image.size, matrix)
        part = image.dataset.isel(y=rows, x=columns)
        radiance[p] = np.einsum("yx,yxn->n", weights, add_up(part, chosen), dtype=np.float64)
        if error is not None and freedom is not None and layer is not None:
            errors = values_of(part, layer[0], component=layer[1]).astype(np.float64)
            error[p] = np.sqrt(np.einsum("yx,yxn->n", weights**2, errors**2))
            shares = np.square(weights * errors.mean(axis=-1))
            freedom[p] = combined_freedom(shares.sum(), np.sum(shares**2) / error_freedom(image))
        if not np.isfinite(radiance[p]).all():
            raise ImageError(
                message("a pixel that is to be measured was not rendered", where=f"point {point.name}")
            )
        radius = radius_in_pixels(pixel, aperture, matrix)
        if (pixel < radius - 0.01).any() or (pixel + radius > np.array(image.size) + 0.01).any():
            text = f"the aperture at point {point.name} reaches beyond the image: only the part inside is measured"
            warnings.warn(text, ApproximationWarning, stacklevel=2)
    all_light = chosen == select(None, image.components) or component == "single_bounce"
    whites = {point.name: point.white for point in points if point.white is not None and all_light}
    notes = [f"mean under an aperture of {aperture}" + ("" if component is None else f", {component}")]
    if layer == ("standard_error", None) and chosen != select(None, image.components):
        notes.append(OF_TOTAL)
    bands = bands_of(image)
    names = tuple(point.name for point in points)
    spectra = PointSpectra(
        names,
        bands,
        radiance,
        error,
        unit_of_image(image),
        whites=whites,
        title=title or _title(image),
        notes=tuple(notes),
        correlated=True,
        freedom=freedom,
    ).through(bandwidth)
    if bandwidth and (said := beyond_the_data(bands.grid, bands.grid, bandwidth)):
        spectra = replace(spectra, notes=(*spectra.notes, said))
    return spectra


def _visible_pixels(scene: Scene, points: tuple[Point, ...]) -> Array:
    """Pixels of the points that are positions; NaN for the others."""
    from fluorspar.paths.tracing.visibility import first_hits
    from fluorspar.scene.camera import camera_of

    found = np.full((len(points), 2), np.nan)
    rows = [row for row, point in enumerate(points) if not point.is_pixel]
    positions = np.array([points[row].position for row in rows])
    camera = camera_of(scene)
    found[rows] = camera.project(positions)
    eye = -np.linalg.solve(camera.matrix[:, :3], camera.matrix[:, 3])
    hits = first_hits(scene, positions)
    for row, position, hit in zip(rows, positions, hits, strict=True):
        there, seen = np.linalg.norm(position - eye), np.linalg.norm(hit - eye)
        if np.isnan(found[row]).any() or abs(seen - there) <= _ON_SURFACE * there:
            continue  # behind the camera: said when it is looked up in the image
        what = "a point is hidden from the camera" if seen < there else "a point is not on a surface"
        sees = "nothing" if np.isnan(seen) else "a surface at " + ", ".join(f"{c:.4g}" for c in hit)
        raise OptionError(
            message(
                what,
                where=f"point {points[row].name} at {', '.join(f'{c:g}' for c in position)}",
                got=f"the camera sees {sees}",
                expected="a point of a surface that the camera sees",
            )
        )
    return found


def scene_of(image: SpectralImage, *, required: bool = False) -> Scene | None:
    """Load the scene an image was rendered from, if it is built-in, with the parameters it was rendered with.

    Parameters
    ----------
    image : SpectralImage
    required : bool
        Raise if it cannot be told.

    Raises
    ------
    OptionError
        If it is required and the image names no built-in scene, or the mesh it was rendered with is gone.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> scene_of(SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())) is None
    True
    """
    from fluorspar.scene.builtin import BUILTIN
    from fluorspar.scene.loading import load_scene

    name = str(image.attrs.get("scene", ""))
    if name in BUILTIN:
        said = image.attrs.get("parameters")
        parameters = said if isinstance(said, dict) else {}
        mesh = parameters.get("mesh")
        if mesh is not None and not Path(mesh).is_file():
            raise OptionError(
                message(
                    "the mesh that the image was rendered with is gone",
                    where=f"scene {name}",
                    got=mesh,
                    fix=f"put it back, or say where it is: --scene {name} -D mesh=FILE",
                )
            )
        return load_scene(name, parameters=parameters)
    if required:
        raise OptionError(
            message(
                "the scene is needed for positions in it, and for an aperture in degrees",
                got=f"an image of {name!r}" if name else "an image that names no scene",
                fix="name the scene (--scene, and -D KEY=VALUE as it was rendered), or give pixels and an aperture in "
                "pixels (--aperture 3px)",
            )
        )
    return None


def normalised(spectra: PointSpectra, by: str) -> PointSpectra:
    """Normalise spectra as a whole: their ratios stay.

    Parameters
    ----------
    spectra : PointSpectra
    by : str
        "none"; "luminance": the mean luminance of the points becomes 1; or the name of a point, the white
        reference: its mean over the bands of 400-700 nm becomes 1, as in Eq. 14 of the paper.

    Returns
    -------
    PointSpectra

    Raises
    ------
    OptionError
        If there is no such point, or what is to become 1 is 0.

    Examples
    --------
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.full((2, 31), [[2.0], [4.0]]))
    >>> normalised(spectra, "2").radiance[:, 0]
    array([0.5, 1. ])
    """
    if by == "none":
        return spectra
    if by == "luminance":
        divisor = float(spectra.luminance().mean())
        absolute = is_unit_of_radiance(spectra.unit)
        unit = f"{spectra.unit} per cd m-2" if absolute else "1"
        what = f"the mean luminance of the points, {divisor:.6g}" + (" cd/m2" if absolute else "")
    else:
        low, high = RANGE
        inside = (spectra.grid.values >= low) & (spectra.grid.values <= high)
        divisor = float(spectra.at(by)[inside].mean()) if inside.any() else 0.0
        unit, what = "1", f"the mean of point {by} over the bands of 400-700 nm, {divisor:.6g}"
    if not divisor > 0:
        raise OptionError(
            message("the spectra cannot be normalised", where=spectra.title or None, got=f"{what}")
        )
    return spectra.scaled(1 / divisor, unit, f"divided by {what}")


def _title(image: SpectralImage) -> str:
    return str(image.attrs.get("scene", "an image"))
