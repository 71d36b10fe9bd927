"""How large and how well a scene is to be rendered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluorspar.errors import OptionError, message
from fluorspar.scene.viewpoint import Viewpoint

__all__ = ["MOST_SAMPLES", "UNLIMITED", "Settings", "whole"]

UNLIMITED = -1
MOST_SAMPLES = 2**16
"""Samples per pixel of one render; further passes (`more_samples`) have other random numbers, and so many again."""


def whole(name: str, value: object) -> int:
    """Return a whole number.

    Raises
    ------
    OptionError
        If it is none.

    Examples
    --------
    >>> whole("spp", 16.0)
    16
    """
    if not isinstance(value, bool) and (
        isinstance(value, (int, np.integer)) or (isinstance(value, float) and value.is_integer())
    ):
        return int(value)
    raise OptionError(message(f"{name} is not a whole number", got=repr(value), expected="a whole number"))


@dataclass(frozen=True)
class Settings:
    """How large and how well a scene is to be rendered, as its file says.

    Parameters
    ----------
    width, height : int
        Pixels of the image (of the crop window, where the film has one).
    spp : int
        Samples per pixel.
    max_depth : int
        As in Mitsuba: 1 is visible lights only, 2 adds direct light, -1 is unlimited.
    rr_depth : int
        Depth from which Russian roulette may end a path.
    viewpoint : Viewpoint, optional
        Where the camera stands instead, see `fluorspar.scene.camera.seen_from`.
    """

    width: int
    height: int
    spp: int
    max_depth: int = UNLIMITED
    rr_depth: int = 5
    viewpoint: Viewpoint | None = None

    def __post_init__(self) -> None:
        for name, low, high in (
            ("width", 1, 65_536),
            ("height", 1, 65_536),
            ("spp", 1, MOST_SAMPLES),
            ("rr_depth", 1, 2**31 - 1),
        ):
            object.__setattr__(self, name, whole(name, getattr(self, name)))
            if not low <= getattr(self, name) <= high:
                raise OptionError(
                    message(f"{name} is out of range", got=getattr(self, name), expected=f"{low} to {high}")
                )
        object.__setattr__(self, "max_depth", whole("max_depth", self.max_depth))
        if self.max_depth != UNLIMITED and not 1 <= self.max_depth < 2**31:
            raise OptionError(
                message(
                    "max_depth is out of range",
                    got=self.max_depth,
                    expected=f"1 or more, or -1 for unlimited; at most {2**31 - 1}",
                )
            )
