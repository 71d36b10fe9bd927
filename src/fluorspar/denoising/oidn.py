"""Open Image Denoise: three channels at a time, guided by the surfaces that the camera sees."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["denoise_channels"]

Array = NDArray[np.float32]


def denoise_channels(channels: Array, surfaces: tuple[Array, Array] | None, *, fast: bool = False) -> Array:
    """Denoise channels, three at a time.

    Parameters
    ----------
    channels : ndarray of shape (Y, X, n)
        In any unit; NaN counts as 0.
    surfaces : (ndarray, ndarray), optional
        Colours and normals of shape (Y, X, 3), see `seen_first`.
    fast : bool
        In half the time, and a little less well.

    Returns
    -------
    ndarray of shape (Y, X, n)
    """
    import mitsuba_oidn as oidn

    guides: dict[str, Any] = {} if surfaces is None else {"albedo": surfaces[0], "normal": surfaces[1]}
    quality = oidn.Quality.Fast if fast else oidn.Quality.High
    count = channels.shape[2]
    calls = -(-count // 3)
    out = np.empty_like(channels)
    for call in range(calls):
        # 0, 2, 4 and 1, 3, 5: each three reach over all wavelengths, as those of a picture do
        taken = np.arange(call, count, calls)
        part = np.nan_to_num(channels[..., np.resize(taken, 3)])
        scale = np.maximum(part.mean(axis=(0, 1), dtype=np.float64), np.finfo(np.float32).tiny).astype(
            np.float32
        )
        white = np.ascontiguousarray(part / scale)
        clean = scale * oidn.denoise(white, hdr=True, quality=quality, **guides)
        out[..., taken] = clean[..., : len(taken)]
    return out
