"""What can be chosen about the staged method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from fluorspar.errors import OptionError, message
from fluorspar.scene.settings import whole

__all__ = ["ALBEDO_FLOOR", "StagedOptions"]

ALBEDO_FLOOR = 1e-3
"""Reflectance with which a fluorescent surface is rendered where its own is smaller: E = y / S needs S >
0."""

_WHERE = "an option of the staged method"
_MOST = {"emitters": 64, "patches": 4096}
_POSITIVE = ("emitters", "patches", "bounces", "repeats", "patch_samples")


@dataclass(frozen=True)
class StagedOptions:
    """Options of the staged method.

    Parameters
    ----------
    emitters : int
        N: a planar fluorescent surface becomes N x N emitters.
    patches : int
        K: any other fluorescent surface becomes K emitters.
    mode : {"true", "decimated"}
        What the emitters of a mesh are: `"true"`, patches of the surface itself; `"decimated"`, the faces of
        a decimated copy, as in the paper.
    exclude_emitter_geometry : bool or sequence of str
        Leave the emitting object out of its own emitter render, as the paper did: only its emitters stand
        there, black and opaque, so that it reflects none of their light. In mode `"true"` they hide and absorb
        what the object would; in mode `"decimated"` the copy does. True: each fluorescent object; ids of shapes:
        these only. Not with `bounces` of 2 or more.
    bounces : int
        1: light luminesces once (the paper). 2 and more: light that luminesced that often is carried on, and
        component 6 is estimated.
    tolerance : float, optional
        Subdivide the emitters until the emission differs by less than this, in the root mean square and
        relative to the mean, from that of its patch; None: leave `emitters` and `patches` as they are.
    filter_edges : bool
        Median filter over 3 x 3 pixels on the luminescent components where a pixel shows two surfaces
        (section VIII-A of the paper). Not needed here, because E is found per sample and not per pixel.
    keep_intermediate : Path, optional
        Folder for the intermediate images: E_D, E_I, L_F and the emitter render of each object.
    repeats : int
        Independent seeds among which the samples are divided; the standard error is that of their mean. No
        more than there are samples per pixel.
    patch_samples : int
        Light paths for the illumination of one emitter, in all repeats together.

    Raises
    ------
    OptionError
        If a number is out of range.

    Examples
    --------
    >>> StagedOptions(emitters=4).patches
    100
    """

    emitters: int = 8
    patches: int = 100
    mode: Literal["true", "decimated"] = "true"
    exclude_emitter_geometry: bool | Sequence[str] = False
    bounces: int = 1
    tolerance: float | None = None
    filter_edges: bool = False
    keep_intermediate: str | Path | None = None
    repeats: int = 4
    patch_samples: int = 1024

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            object.__setattr__(self, name, whole(f"{name}, {_WHERE},", getattr(self, name)))
            if getattr(self, name) < 1:
                raise OptionError(
                    message(
                        f"{name} is out of range", where=_WHERE, got=getattr(self, name), expected="1 or more"
                    )
                )
        for name, most in _MOST.items():
            # a decimated mesh is limited by its own number of faces
            if getattr(self, name) > most and not (name == "patches" and self.mode == "decimated"):
                raise OptionError(
                    message(
                        f"{name} is out of range",
                        where=_WHERE,
                        got=getattr(self, name),
                        expected=f"1 to {most}: each emitter is a light of its own",
                    )
                )
        if self.mode not in ("true", "decimated"):
            raise OptionError(
                message(
                    "there is no such kind of emitters",
                    where=f"mode, {_WHERE}",
                    got=repr(self.mode),
                    expected="'true' or 'decimated'",
                )
            )
        if self.tolerance is not None and not (
            isinstance(self.tolerance, (int, float, np.number))
            and not isinstance(self.tolerance, bool)
            and self.tolerance > 0
        ):
            raise OptionError(
                message(
                    "the tolerance is out of range",
                    where=_WHERE,
                    got=repr(self.tolerance),
                    expected="a number greater than 0",
                )
            )
        if self.tolerance is not None and self.mode == "decimated":
            raise OptionError(
                message(
                    "the faces of a decimated copy are not subdivided",
                    where=_WHERE,
                    got=f"mode 'decimated' with a tolerance of {self.tolerance:g}",
                    expected="one of them",
                    fix="use mode 'true'",
                )
            )
        object.__setattr__(self, "exclude_emitter_geometry", _ids(self.exclude_emitter_geometry))
        if self.exclude_emitter_geometry and self.bounces > 1:
            raise OptionError(
                message(
                    "the emitting object cannot be left out if its emitters are lit again",
                    where=_WHERE,
                    got=f"exclude_emitter_geometry with bounces={self.bounces}",
                    expected="one of them",
                    fix="leave out exclude_emitter_geometry",
                )
            )

    def excludes(self, name: str) -> bool:
        """Whether the shape of this id is left out of its own emitter render.

        Examples
        --------
        >>> options = StagedOptions(exclude_emitter_geometry=["object"])
        >>> options.excludes("object"), options.excludes("left-wall")
        (True, False)
        """
        chosen = self.exclude_emitter_geometry
        return chosen if isinstance(chosen, bool) else name in chosen


def _ids(given: object) -> bool | tuple[str, ...]:
    """Read which objects are left out: all, none, or ids of shapes."""
    if isinstance(given, bool):
        return given
    ids = (given,) if isinstance(given, str) else given
    if not isinstance(ids, Sequence) or not all(isinstance(each, str) for each in ids):
        raise OptionError(
            message(
                "exclude_emitter_geometry is not readable",
                where=_WHERE,
                got=repr(given),
                expected="True, False, or ids of fluorescent shapes",
            )
        )
    return tuple(ids)
