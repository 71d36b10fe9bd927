"""The passes that Cycles writes, by whatever names its version gives them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import RendererError, message

__all__ = ["read_passes"]

# before and from Blender 5.0 on
_NAMES = {
    "direct": ("DiffDir", "Diffuse Direct"),
    "indirect": ("DiffInd", "Diffuse Indirect"),
    "emitted": ("Emit", "Emission"),
    "background": ("Env", "Environment"),
    "row": ("row",),
}
_CHANNELS = ("RGB", "XYZ", "X", "V")


def read_passes(file: str) -> dict[str, NDArray[np.float32]]:
    """Read a multilayer EXR file of Blender.

    Returns
    -------
    dict of str to ndarray of shape (Y, X, 1 or 3)
        `direct`, `indirect`, `emitted`, `background`, `row`.

    Raises
    ------
    RendererError
        If a pass is missing.
    """
    import OpenEXR

    channels: dict[tuple[str, str], NDArray[np.float32]] = {}
    with OpenEXR.File(file, separate_channels=True) as exr:
        for part in exr.parts:
            for name, channel in part.channels.items():
                *_, layer, component = name.split(".")
                channels[layer, component] = channel.pixels
    found = {}
    for name, known in _NAMES.items():
        for layer in known:
            for components in _CHANNELS:
                if all((layer, component) in channels for component in components):
                    found[name] = np.stack([channels[layer, component] for component in components], axis=-1)
        if name not in found:
            there = ", ".join(sorted({layer for layer, _ in channels}))
            raise RendererError(
                message(
                    f"a pass that Cycles renders is missing: {known[-1]}", where=Path(file).name, got=there
                )
            )
    return found
