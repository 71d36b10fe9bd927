"""Open Image Denoise: three channels at a time, guided by the surfaces that the camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.denoising.windows import block_factors

__all__ = ["denoise_channels", "holds_light"]

Array = NDArray[np.float32]

_NEGATIVE = 0.25  # of the mean of a channel: what its negative values may add up to
_MEGABYTES = 400  # that the network may take, for it takes more the larger the picture is


def denoise_channels(
    channels: Array,
    surfaces: tuple[Array, Array] | None,
    *,
    qualities: Sequence[str] = ("Fast",),
    own_means: bool = False,
) -> Array:
    """Denoise channels, three at a time.

    Parameters
    ----------
    channels : ndarray of shape (Y, X, n)
        In any unit; NaN counts as 0. Those that hold no light, see `holds_light`, are returned as they are.
    surfaces : (ndarray, ndarray), optional
        Colours and normals of shape (Y, X, 3), see `seen_first`.
    qualities : sequence of str
        "High", "Balanced" (6 tenths of the time) or "Fast" (4 tenths), of the first three, the next, and so on.
    own_means : bool
        Give blocks their own means again, as far as these are known, see `block_factors`.

    Returns
    -------
    ndarray of shape (Y, X, n)
    """
    guides: dict[str, Any] = {}
    if surfaces is not None:
        of_surfaces = (np.ascontiguousarray(each, np.float32) for each in surfaces)
        guides = dict(zip(("albedo", "normal"), of_surfaces, strict=True))
    lit = np.flatnonzero(holds_light(channels))
    calls = -(-len(lit) // 3)
    out = channels.copy()
    for call in range(calls):
        # 0, 2, 4 and 1, 3, 5: each three reach over all wavelengths, as those of a picture do
        taken = lit[call::calls]
        part = np.nan_to_num(channels[..., np.resize(taken, 3)])
        scale = np.maximum(part.mean(axis=(0, 1), dtype=np.float64), np.finfo(np.float32).tiny).astype(
            np.float32
        )
        clean = _picture(np.ascontiguousarray(part / scale), guides, qualities[call % len(qualities)])
        clean *= scale
        for n, denoised in zip(taken, np.moveaxis(clean, 2, 0), strict=False):
            out[..., n] = denoised * block_factors(channels[..., n], denoised) if own_means else denoised
    return out


def holds_light(channels: Array) -> NDArray[np.bool_]:
    """Whether channels are of light, ndarray of shape (n,), and not noise around zero, as of a camera in the dark.

    A denoiser takes negative values for 0, so the mean of such noise would grow.

    Examples
    --------
    >>> holds_light(np.array([[[0, 1, 1, -2]], [[0, 2, -1, 1]]], np.float32).reshape(2, 1, 4))
    array([ True,  True, False, False])
    """
    if channels.min(initial=0) >= 0:
        return np.ones(channels.shape[2], bool)
    known = np.nan_to_num(channels)
    negative = -np.minimum(known, 0).mean(axis=(0, 1), dtype=np.float64)
    return np.asarray(negative <= _NEGATIVE * known.mean(axis=(0, 1), dtype=np.float64))


def _picture(noisy: Array, guides: dict[str, Any], called: str) -> Array:
    """Denoise three channels; on the processor tile by tile, where they are large, which changes no bit."""
    import mitsuba_oidn as oidn

    quality = getattr(oidn.Quality, called)
    device = oidn.Device()
    if device.type != oidn.DeviceType.CPU:
        return np.array(oidn.denoise(noisy, hdr=True, quality=quality, clean_aux=bool(guides), **guides))
    clean = np.empty_like(noisy)
    tiled = device.new_filter("RT")
    for name, image in ({"color": noisy, "output": clean} | guides).items():
        tiled.set_image(name, image)
    tiled.hdr, tiled.quality, tiled.max_memory_mb = True, quality, _MEGABYTES
    tiled.clean_aux = bool(guides)
    tiled.execute()
    return clean
