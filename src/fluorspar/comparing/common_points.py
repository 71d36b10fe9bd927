"""The points that both sides of a comparison have, measured with one aperture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fluorspar.comparing.sources import Side
from fluorspar.errors import OptionError, message
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.image_scene import scene_of
from fluorspar.measuring.measure import measure
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point
from fluorspar.scene.scene import Scene

__all__ = ["common_points"]


def common_points(
    sides: tuple[Side, Side],
    points: tuple[Point, ...] | None,
    *,
    scene: Scene | None = None,
    aperture: Aperture | None = None,
    components: tuple[str | None, str | None] = (None, None),
    titles: tuple[str, str] = ("A", "B"),
) -> tuple[tuple[PointSpectra, PointSpectra] | None, list[str]]:
    """Measure images at the points, and keep the points that both sides have.

    Parameters
    ----------
    sides : (SpectralImage or PointSpectra, SpectralImage or PointSpectra)
    points : tuple of Point, optional
        Needed to compare an image with a table.
    scene, aperture
        As in `measure`. What is left open is chosen once: an image that names no built-in scene is taken to be
        of the other's; two that name different ones have each its own.
    components : (str or None, str or None)
        What of each image.
    titles : (str, str)

    Returns
    -------
    tables : (PointSpectra, PointSpectra) or None
        In the order of A; None if two images are compared without points.
    sentences : list of str
        Which points are left out.

    Raises
    ------
    OptionError
        If points are missing, or none is common; if there is an aperture or a scene but no image that is measured.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> a, b = (PointSpectra(tuple(n), Bands(Wavelengths()), np.ones((2, 69))) for n in ("pq", "qr"))
    >>> tables, sentences = common_points((a, b), None)
    >>> tables[0].names, sentences[0]
    (('q',), 'A: not compared, since B does not have them: points p.')
    """
    images = [side for side in sides if isinstance(side, SpectralImage)]
    measured = [side for side in sides if isinstance(side, PointSpectra)]
    if aperture is not None and (points is None or not images):
        got = f"{aperture}, and no points" if points is None else f"{aperture}, and two tables"
        fix = "give points (--points)" if images else "leave the aperture out (--aperture)"
        raise OptionError(
            message("an aperture is given, but no image is measured at points", got=got, fix=fix)
        )
    if scene is not None and (points is None or not images):
        fix = "give points (--points)" if images else "leave the scene out (--scene)"
        got = f"{scene.name}, and " + ("no points" if images else "two tables")
        raise OptionError(message("a scene is given, but no image is measured at points", got=got, fix=fix))
    if not measured and points is None:
        return None, []
    if points is None and images:
        raise OptionError(
            message(
                "an image is compared with a table at points, whose places in the image are not given",
                expected=f"the places of {', '.join(measured[0].names)}",
                fix="give points (--points)",
            )
        )
    # places may be more than what was measured, and the other way round
    known = tuple(point for point in points or () if all(point.name in table.names for table in measured))
    if images and not known:
        raise OptionError(
            message(
                "the points are not those of the table",
                got=", ".join(point.name for point in points or ()),
                expected=f"some of {', '.join(measured[0].names)}" if measured else "at least one point",
            )
        )
    if images:
        _check_sizes(images, known)
    scenes, aperture = _cameras(images, known, scene, aperture)
    tables = [
        side
        if isinstance(side, PointSpectra)
        else measure(side, known, scene=scenes.pop(0), aperture=aperture, component=component, title=title)
        for side, component, title in zip(sides, components, titles, strict=True)
    ]
    of_both = tuple(name for name in tables[0].names if name in tables[1].names)
    if not of_both:
        raise OptionError(
            message(
                "the tables have no point in common",
                got=", ".join(tables[0].names),
                expected=", ".join(tables[1].names),
            )
        )
    sentences = []
    for name, table, other in (("A", tables[0], "B"), ("B", tables[1], "A")):
        if left_out := [point for point in table.names if point not in of_both]:
            why = "since they are not in the points file" if images else f"since {other} does not have them"
            sentences.append(f"{name}: not compared, {why}: points {', '.join(left_out)}.")
    return (_only(tables[0], of_both), _only(tables[1], of_both)), sentences


def _check_sizes(images: Sequence[SpectralImage], points: Sequence[Point]) -> None:
    """Find pixels that would be looked up in two images of different size."""
    pixels = [point.name for point in points if point.is_pixel]
    if pixels and len({image.size for image in images}) > 1:
        raise OptionError(
            message(
                "pixels are not the same places in images that differ in size",
                where=f"points {', '.join(pixels)}",
                got=" and ".join(f"{w} x {h}" for w, h in (image.size for image in images)),
                fix="give positions in the scene (point, x, y, z)",
            )
        )


def _cameras(
    images: Sequence[SpectralImage],
    points: Sequence[Point],
    scene: Scene | None,
    aperture: Aperture | None,
) -> tuple[list[Scene | None], Aperture | None]:
    """The scene of each image and the aperture of all of them."""
    scenes: list[Scene | None] = [scene] * len(images)
    if not images:
        return scenes, aperture
    if scene is None and (
        aperture is None or aperture.unit == "deg" or not all(point.is_pixel for point in points)
    ):
        scenes = [scene_of(image.attrs) for image in images]
        first = next((known for known in scenes if known is not None), None)
        scenes = [first if known is None else known for known in scenes]
    if aperture is None:
        aperture = Aperture() if scenes[0] is not None else Aperture(1.0, "px")
    return scenes, aperture


def _only(spectra: PointSpectra, names: tuple[str, ...]) -> PointSpectra:
    rows = [spectra.index(name) for name in names]
    error = None if spectra.standard_error is None else spectra.standard_error[rows]
    freedom = None if spectra.freedom is None else spectra.freedom[rows]
    return replace(
        spectra, names=names, radiance=spectra.radiance[rows], standard_error=error, freedom=freedom
    )
