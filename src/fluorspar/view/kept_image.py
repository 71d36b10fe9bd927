"""An image that is kept for the next question, with the tristimulus values of its components."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from fluorspar.image.display.appearance import auto_exposure, xyz_of
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.image.weighting import factors_of

__all__ = ["KeptImage"]

Array = NDArray[np.float64]

_MOST_EXPOSURES = 100


class KeptImage:
    """A spectral image and what was computed of it; threads may share it.

    Parameters
    ----------
    image : SpectralImage
    generation : int
        That of the source when it was made.
    made : bool
        Whether it was made for this; else somebody else has it, and it takes no memory.
    whole : SpectralImage, optional
        What `image` shows a part of, or some of its pixels; default: it is the whole.

    Attributes
    ----------
    notes : tuple of str
        What was warned of when it was made.
    """

    def __init__(
        self,
        image: SpectralImage,
        generation: int = 0,
        *,
        made: bool = True,
        whole: SpectralImage | None = None,
    ) -> None:
        self.image, self.generation, self.made = image, generation, made
        self.whole = whole or image
        self.notes: tuple[str, ...] = ()
        self._xyz: dict[tuple[str, ...], Array] = {}
        self._exposures: dict[tuple[object, ...], float] = {}
        self._lock = threading.Lock()

    @property
    def nbytes(self) -> int:
        """Size in memory, at most."""
        names, height, width, _ = self.image.shape
        return (self.image.dataset.nbytes if self.made else 0) + (names + 2) * height * width * 3 * 8

    def xyz(self, names: tuple[str, ...]) -> Array:
        """XYZ of a sum of components, ndarray of shape (Y, X, 3), not to be written to."""
        with self._lock:
            if names not in self._xyz:
                self._xyz[names] = xyz_of(self.image.dataset, names)
            return self._xyz[names]

    def weighted_xyz(self, weights: Mapping[str, float]) -> tuple[Array, Array | float]:
        """XYZ of everything but visible lamps, and of these, each component times its weight (absent: 1).

        If nothing else is shown, visible lamps are no exception, as in `appearance`.

        Parameters
        ----------
        weights : mapping of str to float

        Returns
        -------
        lit : ndarray of shape (Y, X, 3)
        source : ndarray of shape (Y, X, 3), or 0 if there is none
        """
        factors = factors_of(self.image, weights)
        held = self.image.components
        shown = tuple(name for name in held if factors[name]) or held
        lit = tuple(name for name in shown if name != "source") or shown
        if len(lit) >= len(held) - 1 and all(factors[name] == 1.0 for name in lit):
            sum_of_lit = self.xyz(lit)
        else:
            sum_of_lit = np.zeros((*self.image.shape[1:3], 3))
            for name in lit:
                sum_of_lit += factors[name] * self.xyz((name,))
        return sum_of_lit, 0.0 if lit == shown else factors["source"] * self.xyz(("source",))

    def exposure(self, of: tuple[object, ...], lit: Callable[[], Array]) -> float:
        """The exposure of XYZ without visible lamps, which is asked for unless that of the same is known."""
        with self._lock:
            known = self._exposures.get(of)
        if known is None:
            known = auto_exposure(lit())
            with self._lock:
                if len(self._exposures) >= _MOST_EXPOSURES:
                    self._exposures.clear()
                self._exposures[of] = known
        return known
