"""Which components of two images are compared, and where these do not hold the same light."""

from __future__ import annotations

import numpy as np

from fluorspar.comparing.sources import Side
from fluorspar.image.components import COMPONENTS, LUMINESCENT, TOTAL, named_in, select
from fluorspar.image.dataset import values_of
from fluorspar.image.known_error import known_error
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.stated import METHODS

__all__ = ["common_components"]

_REEXCITATION = COMPONENTS[6]
_SAME = 1e-6  # nm
_ROWS = 16  # that are enough to see whether anything luminesces


def common_components(
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
        What is compared, what its standard errors are, and where the light of two images is not the same or cannot be
        told.

    Examples
    --------
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> ones = np.ones((7, 1, 1, 69))
    >>> a = SpectralImage.from_arrays(ones, Wavelengths())
    >>> b = SpectralImage.from_arrays(ones[:6], Wavelengths(), components=COMPONENTS[:6])
    >>> common_components((a, b), None)[0]
    ('single_bounce', None)
    """
    compared: list[str | None] = [component, component]
    notes = []
    for index, side in enumerate(sides):
        if component is not None and _is_whole(side) and _light(side, None) == select(component):
            compared[index] = None  # it was added up before
    if component is None:
        held = [
            None if light is None else _REEXCITATION in light for light in (_light(s, None) for s in sides)
        ]
        if sorted(held, key=str) == [False, True] and not _is_whole(sides[held.index(True)]):
            with_it = held.index(True)
            compared[with_it] = "single_bounce"
            notes.append(
                f"Components: both sides without light that luminesced twice (single_bounce), since {'BA'[with_it]} "
                "does not hold it."
            )
    for name, side, what in zip("AB", sides, compared, strict=True):
        if isinstance(side, SpectralImage) and (of_error := known_error(side, what).note):
            notes.append(f"{name}: {of_error}.")
    return (compared[0], compared[1]), notes + _unlike(sides, compared) + _missing_excitation(sides, compared)


def _unlike(sides: tuple[Side, Side], compared: list[str | None]) -> list[str]:
    """Say where two images do not hold the same light, or where it cannot be told."""
    if not all(isinstance(side, SpectralImage) for side in sides):
        return []
    lights = [_light(side, what) for side, what in zip(sides, compared, strict=True)]
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


def _missing_excitation(sides: tuple[Side, Side], compared: list[str | None]) -> list[str]:
    """Say that luminescence differs between renders in which different wavelengths excite."""
    starts, full = [], []
    for side, what in zip(sides, compared, strict=True):
        if not isinstance(side, SpectralImage) or _is_whole(side) or "converted" in side.attrs:
            return []  # the grid of the render is not known
        if side.attrs.get("method") not in METHODS or not _luminesces(side, what):
            return []
        held = side.wavelengths.start
        starts.append(float(str(side.attrs.get("excitation", held)).partition(":")[0]))
        full.append(
            starts[-1] < held - _SAME
        )  # it was begun earlier than asked for: as early as anything excites
    late = int(starts[1] > starts[0])
    if abs(starts[0] - starts[1]) < _SAME or full[late]:
        return []
    return [
        f"Luminescence: {'AB'[late]} was rendered from {starts[late]:g} nm on, so what {starts[1 - late]:g}-"
        f"{starts[late]:g} nm excites is in {'BA'[late]} only, which is part of the difference."
    ]


def _luminesces(image: SpectralImage, component: str | None) -> bool:
    """Whether some of its light, in evenly spaced rows, luminesced."""
    names = set(select(component, image.components)) & {*LUMINESCENT, _REEXCITATION}
    rows = slice(None, None, -(-image.size[1] // _ROWS))
    return any(np.nan_to_num(values_of(image.dataset, "radiance", rows, name)).any() for name in names)


def _is_whole(side: Side) -> bool:
    """Whether it is an image that is not split."""
    return isinstance(side, SpectralImage) and side.components == (TOTAL,)


def _light(side: Side, component: str | None) -> tuple[str, ...] | None:
    """Components of what is compared; None if it cannot be told: a table, or an image that does not say."""
    if not isinstance(side, SpectralImage):
        return None
    return named_in(side.attrs) if _is_whole(side) else select(component, side.components)
