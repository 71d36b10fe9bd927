"""Textures of a scene as grids of rows: bitmaps and checkerboards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message
from fluorspar.scene.averages import check_attribute
from fluorspar.scene.lobes.lobe import Texture
from fluorspar.scene.lobes.pictures import build_picture
from fluorspar.scene.nodes import build, children, copy_nodes

__all__ = [
    "placement",
    "positive_scale",
    "read_attribute",
    "read_bitmap",
    "sigmoid",
    "sky_colours",
    "sky_placement",
]

_LARGEST = 1e4  # coefficient; the sigmoid is then 1 to single precision


def placement(state: Any, index: int, built: Any, height: int, width: int) -> Texture:
    """Read how a texture node, and what is built of it, is put on a surface."""
    import mitsuba as mi

    props = state.nodes[index].props
    to_uv = np.array(mi.traverse(built)["to_uv"].matrix, dtype=np.float64)
    bitmap = props.plugin_name() == "bitmap"
    return Texture(
        width,
        height,
        tuple(to_uv[:2, :3].ravel().tolist()),
        bilinear=bitmap and props.get("filter_type", "bilinear") != "nearest",
        wrap=str(props.get("wrap_mode", "repeat")) if bitmap else "repeat",
        name=Path(str(props.get("filename", props.plugin_name()))).name,
    )


def read_bitmap(state: Any, index: int, label: str) -> tuple[NDArray[np.float32], Texture]:
    """Read a bitmap node as Mitsuba's spectral variants upsample it, clipped to 0-1.

    Returns
    -------
    coefficients : ndarray of shape (texels, 3), float32
        Of the sigmoid.
    texture : Texture

    Raises
    ------
    SceneError
        See `build_picture`.
    """
    import mitsuba as mi

    built = build_picture(state, index, label, highest=1.0)
    data = np.array(mi.traverse(built)["data"])
    texels = _grey(data[..., 0]) if data.shape[2] == 1 else data[..., :3].clip(-_LARGEST, _LARGEST)
    texture = placement(state, index, built, *data.shape[:2])
    return np.ascontiguousarray(texels, np.float32).reshape(-1, 3), texture


def read_attribute(state: Any, index: int, shape: int, label: str) -> tuple[NDArray[np.float32], Texture]:
    """Read the colours of the vertices or faces of a mesh from a `mesh_attribute` node; see `read_bitmap`.

    Raises
    ------
    SceneError
        If the shape is no mesh, or has no such attribute; if the attribute is scaled.
    """
    import mitsuba as mi

    props = state.nodes[index].props
    if props.get("scale", 1.0) != 1.0:
        raise SceneError(
            message(
                "the scale of a mesh attribute is not supported", where=label, got=props["scale"], expected=1
            )
        )
    part = copy_nodes(state)
    for key, _ in children(state, shape):  # Mitsuba's plastics do not take the texture, and nobody asks them
        del part.nodes[shape].props[key]
    built = build(part, shape)
    check_attribute(props, built, label)
    values = mi.traverse(built)
    per_face = (name := str(props["name"])).startswith("face_")
    count = len(values["faces" if per_face else "vertex_positions"]) // 3
    data = np.array(values[name]).reshape(count, -1)  # of colours, coefficients
    texels = _grey(data[:, 0].clip(0, 1)) if data.shape[1] == 1 else data.clip(-_LARGEST, _LARGEST)
    texture = Texture(1, 1, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0), not per_face, "repeat", shape, per_face)
    return np.ascontiguousarray(texels, np.float32), texture


def sky_placement(height: int, width: int) -> Texture:
    """How Mitsuba puts the texels of an environment map on the sphere; v is the angle from the zenith over pi."""
    return Texture(
        width,
        height,
        (1.0, 0.0, 0.0, 0.0, (height - 1) / height, 0.5 / height),
        bilinear=True,
        wrap="repeat",
    )


def sky_colours(state: Any, index: int, label: str) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Read the texels of an environment map as Mitsuba's spectral variants take them.

    Returns
    -------
    coefficients : ndarray of shape (height, width, 3), float32
    scale : ndarray of shape (height, width), float32
        What the colours are multiplied with.

    Raises
    ------
    SceneError
        See `build_picture`; or if its scale is negative.
    """
    import mitsuba as mi

    positive_scale(state, index, label)
    values = mi.traverse(build_picture(state, index, label))
    # Mitsuba stores the last column before the first, and the first behind the last.
    texels = np.array(values["data"])[:, 1:-1]
    coefficients = texels[..., :3].clip(-_LARGEST, _LARGEST)
    return np.ascontiguousarray(coefficients, np.float32), np.ascontiguousarray(texels[..., 3], np.float32)


def positive_scale(state: Any, index: int, label: str) -> float:
    """What a light multiplies its picture with, 0 or more."""
    factor = float(state.nodes[index].props.get("scale", 1.0))
    if factor < 0:
        raise SceneError(message("a light is negative", where=label, got=factor, expected=">= 0"))
    return factor


def _grey(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Coefficients of the colours that have one value at all wavelengths."""
    y = 2 * values.astype(np.float64) - 1
    constant = y / np.sqrt(np.maximum(1 - y * y, _LARGEST**-2))
    out = np.zeros((*values.shape, 3), dtype=np.float32)
    out[..., 2] = constant.clip(-_LARGEST, _LARGEST)
    return out


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
