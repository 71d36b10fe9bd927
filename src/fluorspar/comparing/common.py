"""What both sides of a comparison have in common: the light, the unit, and the points, measured with one aperture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fluorspar.errors import OptionError, message
from fluorspar.image.components import COMPONENTS, GROUPS, TOTAL, named_in, select
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import OF_TOTAL, error_layer, unit_of_image
from fluorspar.image.units import NOT_STATED, in_our_spelling
from fluorspar.measuring.aperture import Aperture
from fluorspar.measuring.point_spectra import PointSpectra
from fluorspar.measuring.points import Point
from fluorspar.measuring.spectroradiometer import measure, scene_of
from fluorspar.scene.scene import Scene

__all__ = ["check_units", "common_light", "common_points", "unit_of_side"]

Side = SpectralImage | PointSpectra

_REEXCITATION = COMPONENTS[6]

_NOT_STATED = ("", NOT_STATED, "unknown")


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
        If points are missing, or none is common; if there is an aperture but no image that is measured.

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
        fix = "give a points file (--points)" if images else "leave out --aperture"
        raise OptionError(message("an aperture measures images at points", got=got, fix=fix))
    if not measured and points is None:
        return None, []
    if points is None and images:
        raise OptionError(
            message(
                "an image is compared with a table at points, and their places are missing",
                expected=f"the places of {', '.join(measured[0].names)}",
                fix="give a points file (--points)",
            )
        )
    known = points or ()
    for table in measured:
        # places may be more than what was measured, and the other way round
        known = tuple(point for point in known if point.name in table.names)
    if images and not known:
        raise OptionError(
            message(
                "the points of the points file are not those of the table",
                got=", ".join(point.name for point in points or ()),
                expected=f"some of {', '.join(measured[0].names)}" if measured else "at least one point",
            )
        )
    if images:
        _check_sizes(images, known)
    scenes, aperture = _cameras(images, known, scene, aperture)
    found = [
        side
        if isinstance(side, PointSpectra)
        else measure(side, known, scene=scenes.pop(0), aperture=aperture, component=component, title=title)
        for side, component, title in zip(sides, components, titles, strict=True)
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
    sentences = []
    for name, table, other in (("A", found[0], "B"), ("B", found[1], "A")):
        if left := [point for point in table.names if point not in both]:
            why = "since they are not in the points file" if images else f"since {other} does not have them"
            sentences.append(f"{name}: not compared, {why}: points {', '.join(left)}.")
    return (_only(found[0], both), _only(found[1], both)), sentences


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
        scenes = [scene_of(image) for image in images]
        first = next((found for found in scenes if found is not None), None)
        scenes = [found if found is not None else first for found in scenes]
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


def common_light(
    sides: tuple[Side, Side], component: str | None
) -> tuple[tuple[str | None, str | None], list[str]]:
    """Choose what of each image is compared: light that luminesced twice only if both hold it.

    Parameters
    ----------
    sides : (SpectralImage or PointSpectra, SpectralImage or PointSpectra)
    component : str, optional
        As in `compare`.

    Returns
    -------
    components : (str or None, str or None)
        What of each image; None: all of it.
    sentences : list of str
        What was chosen, and where the light of two images is not the same or cannot be told.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> ones = np.ones((7, 1, 1, 69))
    >>> a = SpectralImage.from_arrays(ones, Wavelengths())
    >>> b = SpectralImage.from_arrays(ones[:6], Wavelengths(), components=COMPONENTS[:6])
    >>> common_light((a, b), None)[0]
    ('single_bounce', None)
    """
    chosen: list[str | None] = [component, component]
    notes = []
    for index, side in enumerate(sides):
        if component is not None and _light(side, None) == _named(component) and _is_whole(side):
            chosen[index] = None  # it was added up before
    if component is None:
        held = [
            None if light is None else _REEXCITATION in light for light in (_light(s, None) for s in sides)
        ]
        if sorted(held, key=str) == [False, True] and not _is_whole(sides[held.index(True)]):
            with_it = held.index(True)
            chosen[with_it] = "single_bounce"
            notes.append(
                f"Components: both sides without light that luminesced twice (single_bounce), since {'BA'[with_it]} "
                "does not hold it."
            )
    for name, side, what in zip("AB", sides, chosen, strict=True):
        if isinstance(side, SpectralImage) and what == "single_bounce":
            layer = error_layer(side, what)
            if layer == ("standard_error", None) and select(what, side.components) != side.components:
                notes.append(f"{name}: {OF_TOTAL}.")
    return (chosen[0], chosen[1]), notes + _unlike(sides, chosen)


def _unlike(sides: tuple[Side, Side], chosen: list[str | None]) -> list[str]:
    """Say where two images do not hold the same light, or where it cannot be told."""
    if not all(isinstance(side, SpectralImage) for side in sides):
        return []
    lights = [_light(side, what) for side, what in zip(sides, chosen, strict=True)]
    if None in lights:
        unknown = lights.index(None)
        if lights[1 - unknown] is None:
            return []
        name, other = "AB"[unknown], "BA"[unknown]
        return [
            f"Components: {name} is not split and does not say what light it holds: taken as that of {other}."
        ]
    only = [
        ", ".join(
            name for name in COMPONENTS if name in (lights[k] or ()) and name not in (lights[1 - k] or ())
        )
        for k in range(2)
    ]
    return [
        f"Components: only {name} holds {names}, which is part of the difference."
        for name, names in zip("AB", only, strict=True)
        if names
    ]


def _is_whole(side: Side) -> bool:
    """Whether it is an image that is not split."""
    return isinstance(side, SpectralImage) and side.components == (TOTAL,)


def _light(side: Side, component: str | None) -> tuple[str, ...] | None:
    """Components of what is compared; None if it cannot be told: a table, or an image that does not say."""
    if not isinstance(side, SpectralImage):
        return None
    return named_in(side.attrs) if _is_whole(side) else select(component, side.components)


def _named(component: str) -> tuple[str, ...]:
    return GROUPS.get(component, (component,))


def unit_of_side(side: SpectralImage | PointSpectra) -> str:
    """The unit of an image or a table, in the spelling of its source; radiance has that of Fluorspar."""
    return in_our_spelling(side.unit) if isinstance(side, PointSpectra) else unit_of_image(side)


def check_units(a: SpectralImage | PointSpectra, b: SpectralImage | PointSpectra, match: str) -> list[str]:
    """Find out whether two sides may be compared as they are.

    Parameters
    ----------
    a, b : SpectralImage or PointSpectra
    match : str
        As in `compare`.

    Returns
    -------
    list of str
        A sentence if the units are not the same.

    Raises
    ------
    OptionError
        If they differ and the scales are not to be matched. A unit that is not stated may be that of the other.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> tables = [PointSpectra(("1",), Bands(Wavelengths()), np.ones((1, 69)), unit=u) for u in ("1", "counts")]
    >>> check_units(*tables, match="luminance")
    ["Units: A has '1', B has 'counts'; only ratios are compared."]
    """
    units = [unit_of_side(side) for side in (a, b)]
    if units[0] == units[1]:
        return []
    told = f"A has {units[0]!r}, B has {units[1]!r}"
    if match != "none":
        return [f"Units: {told}; only ratios are compared."]
    if any(unit.lower() in _NOT_STATED for unit in units):
        return [f"Units: {told}; they are taken as the same (a line '# unit: ...' states that of a table)."]
    raise OptionError(
        message(
            "the two sides have different units",
            got=told,
            expected="the same unit, or scales that are matched",
            fix="match the scales (--match luminance, or --match POINT); if a table states no unit, or not the right "
            "one, put a line '# unit: W m-2 sr-1 nm-1' above its header",
        )
    )
