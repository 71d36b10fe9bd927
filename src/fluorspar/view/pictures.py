"""The picture of a view: its colours, one band in false colour, or how sure it is."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.adaptation import adapt_to_d65
from fluorspar.colour.xyz import observer_weights, outside_srgb
from fluorspar.errors import OptionError, message
from fluorspar.image.components import TOTAL, definition, select
from fluorspar.image.display.appearance import auto_exposure, show
from fluorspar.image.display.picture import png_bytes
from fluorspar.image.stated import unit_of_image
from fluorspar.image.units import is_radiance
from fluorspar.view.false_colour import coloured, layer_of
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.questions import View
from fluorspar.view.sources import component_facts

__all__ = ["EFFORT", "Picture", "components_of", "exposed", "exposure_of", "picture_of"]

Array = NDArray[np.float64]

EFFORT = 1  # of packing pictures: they travel within one computer
_MARK = (255, 0, 255)  # of colours that sRGB cannot show
_THUMBNAIL = 96


@dataclass(frozen=True)
class Picture:
    """A picture and what there is to say of it.

    Attributes
    ----------
    png : bytes
    facts : dict
        For the header `X-Fluorspar`; `white` is what the eye is adapted to.
    """

    png: bytes
    facts: dict[str, Any]


def picture_of(kept: KeptImage, view: View, white: Array | None) -> Picture:
    """Draw a view.

    Parameters
    ----------
    kept : KeptImage
    view : View
    white : ndarray of shape (3,), optional
        XYZ of the white that is to be shown as white.

    Raises
    ------
    OptionError
        If there is no such component or band, or what is asked for is not known of this image.
    """
    facts: dict[str, Any] = {
        "exposure": None,
        "white": white,
        "white_at": None,
        "out_of_gamut": None,
        "range": None,
        "unit": unit_of_image(kept.image),
        "notes": kept.notes,
    }
    if view.mode != "colour":
        values, unit = layer_of(kept.image, view)
        rgb, limits = coloured(values, view.mode, view.range)
        return Picture(png_bytes(rgb, EFFORT), facts | {"range": limits, "unit": unit})
    if not observer_weights(kept.image.wavelengths).any():
        fix = "show a band in false colour"
        raise OptionError(
            message("no wavelength of this image is visible", got=kept.image.wavelengths, fix=fix)
        )
    xyz, exposure = exposed(kept, view, white)
    shown = show(xyz, exposure)
    rgb = shown.bytes
    if view.gamut:
        rgb[outside_srgb(np.nan_to_num(xyz), exposure)] = _MARK
    black = view.exposure is None and not (xyz[..., 1] > 0).any()  # which suggests no exposure
    facts |= {
        "exposure": None if black else exposure,
        "white_at": 1 / exposure if is_radiance(kept.image.attrs) and not black else None,
        "out_of_gamut": shown.out_of_gamut,
    }
    return Picture(png_bytes(rgb, EFFORT), facts)


def exposed(kept: KeptImage, view: View, white: Array | None) -> tuple[Array, float]:
    """XYZ of a view as an eye adapted to `white` has it, ndarray of shape (Y, X, 3), and the exposure."""
    lit, source = kept.weighted_xyz(view.weights)
    if white is not None:
        lit = adapt_to_d65(lit, white)
        source = source if isinstance(source, float) else adapt_to_d65(source, white)
    exposure = view.exposure or kept.exposure(_looked_at(view, white), lambda: _thinned(lit, view))
    return lit + source, exposure


def exposure_of(kept: KeptImage, view: View, white: Array | None) -> float:
    """The exposure of a view, without drawing it again if it was drawn before."""
    if view.exposure is not None:
        return view.exposure

    def lit() -> Array:
        xyz = kept.weighted_xyz(view.weights)[0]
        return _thinned(xyz if white is None else adapt_to_d65(xyz, white), view)

    return kept.exposure(_looked_at(view, white), lit)


def _looked_at(view: View, white: Array | None) -> tuple[object, ...]:
    """What an exposure depends on."""
    return view.coarse, None if white is None else tuple(white), *sorted(view.weights.items())


def _thinned(lit: Array, view: View) -> Array:
    return lit[::2, ::2] if view.coarse else lit


def components_of(kept: KeptImage, view: View, white: Array | None) -> dict[str, Any]:
    """The components, each a small picture with its share of the luminance; each has an exposure of its own.

    Shares count the weights of the view.
    """
    exposure = exposure_of(kept, view, white)
    held = kept.image.components
    luminances = {name: view.weight(name) * float(np.nansum(kept.xyz((name,))[..., 1])) for name in held}
    whole = sum(luminances.values())
    every = max(1, -(-max(kept.image.size) // (2 * _THUMBNAIL)))
    rows = []
    for facts in component_facts(held):
        name = facts["name"]
        xyz = kept.xyz((name,))[::every, ::every]
        lit = bool(np.nansum(xyz[..., 1]) > 0)
        factor = float(2.0 ** np.floor(np.log2(auto_exposure(xyz) / exposure))) if lit else 1.0
        xyz = xyz if white is None else adapt_to_d65(xyz, white)
        rows.append(
            facts
            | {
                "meaning": "" if name == TOTAL else definition(name).meaning,
                "share": luminances[name] / whole if whole else None,
                "exposure_factor": factor,
                "png": data_url(_thumbnail(show(xyz, factor * exposure).bytes)),
            }
        )
    shares = {"total": 1.0 if whole else None, "reflected": None, "luminescent": None}
    if held != (TOTAL,) and whole:
        for group in ("reflected", "luminescent"):
            shares[group] = sum(luminances[name] for name in select(group, held)) / whole
    return {"components": rows, **shares}


def data_url(png: bytes) -> str:
    """A picture as an address that holds it."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


def _thumbnail(rgb: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    picture = Image.fromarray(rgb)
    picture.thumbnail((_THUMBNAIL, _THUMBNAIL))
    return png_bytes(np.asarray(picture), EFFORT)
