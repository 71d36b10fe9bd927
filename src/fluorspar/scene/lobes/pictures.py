"""The pictures of a scene, as Mitsuba's spectral variants take them."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np

from fluorspar.errors import ApproximationWarning, SceneError, message
from fluorspar.scene.nodes import build, copy_nodes, resolved

__all__ = ["build_picture"]


def build_picture(state: Any, index: int, label: str, *, highest: float = np.inf) -> Any:
    """Read the picture of a `bitmap` or `envmap` node once, check it, and build the node.

    What is `raw` and has colours counts as linear rgb: Mitsuba's spectral variants make no spectrum of it, and its
    others take it for that.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    index : int
        The node.
    label : str
        How messages call it.
    highest : float
        Values from 0 to here mean something.

    Raises
    ------
    SceneError
        If it does not exist, is no picture, or holds values that are not finite; if Mitsuba refuses the node.

    Warns
    -----
    ApproximationWarning
        If values are clipped.
    """
    import mitsuba as mi

    props = state.nodes[index].props
    if "filename" not in props:
        return build(state, index)  # which says what is missing
    name = str(props["filename"])
    if not os.path.isfile(file := resolved(name)):
        raise SceneError(
            message(
                "a picture does not exist",
                where=label,
                got=name,
                expected=f"a file in one of {', '.join(map(str, mi.file_resolver()))}",
                fix="check the name, or add <path value='FOLDER'/> to the scene",
            )
        )
    try:
        picture = mi.Bitmap(str(file))
    except RuntimeError as err:
        raise SceneError(message("a picture cannot be read", where=f"{label}, {name}", got=err)) from err
    part = copy_nodes(state)
    props = part.nodes[index].props
    if props.get("raw", False):
        picture.set_srgb_gamma(False)
        props["raw"] = False
    if picture.component_format() in (mi.Struct.Type.Float16, mi.Struct.Type.Float32, mi.Struct.Type.Float64):
        picture = _checked(picture.convert(component_format=mi.Struct.Type.Float32), label, highest)
    del props["filename"]
    props["bitmap"] = picture
    return build(part, index)


def _checked(picture: Any, label: str, highest: float) -> Any:
    import mitsuba as mi

    values = np.atleast_3d(np.array(picture))
    colours = values[..., : 3 if values.shape[2] > 2 else 1]  # without alpha
    if not np.isfinite(colours).all():
        raise SceneError(
            message(
                "a texture holds values that are not finite numbers",
                where=label,
                got=f"{int(colours.size - np.isfinite(colours).sum())} of {colours.size}",
                fix="repair the picture",
            )
        )
    low, high = float(colours.min()), float(colours.max())
    if low >= 0 and high <= highest:
        return picture
    within = f"0 to {highest:g}" if np.isfinite(highest) else "0 or more"
    warnings.warn(
        f"{label}: the picture holds values from {low:.3g} to {high:.3g}; they are clipped to {within}",
        ApproximationWarning,
        stacklevel=2,
    )
    clipped = mi.Bitmap(np.clip(colours, 0, highest).astype(np.float32))
    clipped.set_srgb_gamma(picture.srgb_gamma())
    return clipped
