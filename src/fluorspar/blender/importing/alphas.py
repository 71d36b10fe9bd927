"""The transparency of images, as pictures of its own: Mitsuba's textures have none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["alpha_of", "write_alpha"]


def alpha_of(file: Path) -> NDArray[Any] | None:
    """The alpha of an image, of shape (height, width), from 0 to 1; None where all of it is opaque."""
    if file.suffix == ".exr":
        import OpenEXR

        with OpenEXR.File(str(file), separate_channels=True) as exr:
            channels = exr.channels()
            alpha = channels["A"].pixels if "A" in channels else None
    else:
        from PIL import Image, UnidentifiedImageError

        try:
            with Image.open(file) as image:
                has_alpha = "A" in image.getbands() or "transparency" in image.info
                alpha = np.asarray(image.convert("RGBA"))[..., 3] / 255 if has_alpha else None
        except UnidentifiedImageError:  # Radiance's pictures, which have none
            return None
    return alpha if alpha is not None and (alpha < 1).any() else None


def write_alpha(alpha: NDArray[Any], file: Path) -> None:
    """As a grey picture."""
    from PIL import Image

    Image.fromarray(np.round(np.clip(alpha, 0, 1) * 255).astype(np.uint8)).save(file)
