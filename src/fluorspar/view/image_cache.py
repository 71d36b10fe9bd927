"""Images that were asked for before, as many as fit; those not asked for the longest go first."""

from __future__ import annotations

import threading
from collections import OrderedDict

from fluorspar.view.kept_image import KeptImage

__all__ = ["ImageCache"]


class ImageCache:
    """Images by what was asked.

    Parameters
    ----------
    most : int
        Bytes that are kept at most; the latest image stays even if it is larger.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar import SpectralImage, Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> cache = ImageCache(most=1)
    >>> for key in ("a", "b"):
    ...     _ = cache.put((key,), KeptImage(image))
    >>> cache.get(("a",)), cache.get(("b",)) is not None
    (None, True)
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._kept: OrderedDict[tuple[str, ...], KeptImage] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: tuple[str, ...]) -> KeptImage | None:
        """The image of a key, if it is still there."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
            return self._kept.get(key)

    def put(self, key: tuple[str, ...], image: KeptImage) -> KeptImage:
        """Keep an image in place of the one before; return it."""
        with self._lock:
            self._kept[key] = image
            self._kept.move_to_end(key)
            held = sum(kept.nbytes for kept in self._kept.values())
            while held > self.most and len(self._kept) > 1:
                held -= self._kept.popitem(last=False)[1].nbytes
        return image
