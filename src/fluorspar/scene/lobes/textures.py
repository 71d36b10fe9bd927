"""Textures of a scene as grids of rows: bitmaps and checkerboards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message
from fluorspar.scene.lobes.lobe import Texture
from fluorspar.scene.nodes import build

__all__ = ["bitmap_colours", "placement", "sigmoid", "sky_colours", "sky_placement"]

_LARGEST = 1e4  # coefficient; the sigmoid is then 1 to single precision


def placement(state: Any, index: int, height: int, width: int) -> Texture:
    """Read how a texture node is put on a surface."""
    import mitsuba as mi

    props = state.nodes[index].props
    to_uv = np.array(mi.traverse(build(state, index))["to_uv"].matrix, dtype=np.float64)
    bitmap = props.plugin_name() == "bitmap"
    return Texture(
        width,
        height,
        tuple(to_uv[:2, :3].ravel().tolist()),
        bilinear=bitmap and props.get("filter_type", "bilinear") != "nearest",
        wrap=str(props.get("wrap_mode", "repeat")) if bitmap else "repeat",
        name=Path(str(props.get("filename", props.plugin_name()))).name,
    )


def bitmap_colours(state: Any, index: int, label: str) -> NDArray[np.float32]:
    """Read the sigmoid coefficients of the texels of a bitmap node, as Mitsuba's spectral variants upsample them.

    Returns
    -------
    ndarray of shape (height, width, 3), float32

    Raises
    ------
    SceneError
        If it has a number of channels that means no colour, or values that are not finite.
    """
    import mitsuba as mi

    data = np.array(mi.traverse(build(state, index))["data"])
    props = state.nodes[index].props
    if data.shape[2] == 1:
        return _grey(data[..., 0], label)
    if props.get("raw", False):
        # As a spectral variant of Mitsuba takes it: the texels' luminance.
        return _grey(data[..., :3] @ np.array([0.212671, 0.715160, 0.072169], data.dtype), label)
    _check_finite(data, label)
    return np.clip(data[..., :3], -np.inf, np.inf).astype(np.float32).clip(-_LARGEST, _LARGEST)


def sky_placement(height: int, width: int) -> Texture:
    """How Mitsuba puts the texels of an environment map on the sphere; v is the angle from the zenith over pi."""
    return Texture(
        width,
        height,
        (1.0, 0.0, 0.0, 0.0, (height - 1) / height, 0.5 / height),
        bilinear=True,
        wrap="repeat",
    )


def sky_colours(
    state: Any, index: int, width: int, label: str
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Read the texels of an environment map as Mitsuba's spectral variants take them.

    Returns
    -------
    coefficients : ndarray of shape (height, width, 3), float32
    scale : ndarray of shape (height, width), float32
        What the colours are multiplied with.

    Raises
    ------
    SceneError
        If it is black, or holds values that are negative or not finite.
    """
    import mitsuba as mi

    data = np.array(mi.traverse(build(state, index))["data"])
    # Mitsuba stores the last column before the first, and the first behind the last.
    texels = data[:, 1 : width + 1] if data.shape[1] == width + 2 else data[:, :width]
    _check_finite(texels, label)
    scale = texels[..., 3]
    if scale.min() < 0 or scale.max() == 0:
        fault = "an environment map is black" if scale.max() == 0 else "an environment map is negative"
        raise SceneError(message(fault, where=label, expected="0 or more, and somewhere light"))
    coefficients = texels[..., :3].clip(-_LARGEST, _LARGEST)
    return np.ascontiguousarray(coefficients, np.float32), np.ascontiguousarray(scale, np.float32)


def _grey(values: NDArray[np.floating], label: str) -> NDArray[np.float32]:
    """Coefficients of the colours that have one value at all wavelengths."""
    _check_finite(values, label)
    if values.min() < 0 or values.max() > 1:
        raise SceneError(
            message(
                "a texture of a reflectance leaves 0 to 1",
                where=label,
                got=f"{values.min():g} to {values.max():g}",
                expected="0 to 1",
            )
        )
    y = 2 * values.astype(np.float64) - 1
    constant = y / np.sqrt(np.maximum(1 - y * y, _LARGEST**-2))
    out = np.zeros((*values.shape, 3), dtype=np.float32)
    out[..., 2] = constant.clip(-_LARGEST, _LARGEST)
    return out


def _check_finite(values: NDArray[np.floating], label: str) -> None:
    if not np.isfinite(values).all():
        bad = int(np.size(values) - np.isfinite(values).sum())
        raise SceneError(
            message(
                "a texture holds values that are not finite numbers",
                where=label,
                got=f"{bad} of {np.size(values)}",
                fix="repair the picture",
            )
        )


def sigmoid(coefficients: NDArray[np.floating], wavelengths: NDArray[np.floating]) -> NDArray[np.float64]:
    """Spectra of colours from their sigmoid coefficients.

    Parameters
    ----------
    coefficients : ndarray of shape (..., 3)
    wavelengths : ndarray of shape (N,)
        In nm.

    Returns
    -------
    ndarray of shape (..., N)

    Notes
    -----
    Jakob, Hanika, "A Low-Dimensional Function Space for Efficient Spectral Upsampling", CGF 38 (2), 2019.

    Examples
    --------
    >>> sigmoid(np.array([0.0, 0.0, 0.0]), np.array([400.0, 700.0]))
    array([0.5, 0.5])
    """
    c = np.asarray(coefficients, dtype=np.float64)[..., np.newaxis, :]
    w = np.clip(wavelengths, 360.0, 830.0)
    x = (c[..., 0] * w + c[..., 1]) * w + c[..., 2]
    return np.asarray(0.5 + 0.5 * x / np.sqrt(1 + x * x))
