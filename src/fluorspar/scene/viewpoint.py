"""Where a camera stands, what it looks at, and how wide: in place of what a scene file says."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import OptionError, message

__all__ = ["Viewpoint", "ViewpointSetting"]

Array = NDArray[np.float64]
Place: TypeAlias = tuple[float, float, float]

_PARTS = ("origin", "target", "up", "fov")
_EXPECTED = "some of origin=X,Y,Z target=X,Y,Z up=X,Y,Z fov=DEGREES"
_PART = re.compile(r"\s*(\w+)\s*=\s*([^=]*?)\s*(?=\w+\s*=|$)")
_LEVEL = 1e-6  # sine of the angle between two directions that count as one


@dataclass(frozen=True)
class Viewpoint:
    """Where a camera stands, what it looks at, and how wide; what is None stays as the scene has it.

    The names are those of `lookat` and of the cameras in Mitsuba's scene files.

    Parameters
    ----------
    origin : (float, float, float), optional
        Position of the camera, in scene units.
    target : (float, float, float), optional
        The point in the middle of its view. Without it the camera looks in the direction it did.
    up : (float, float, float), optional
        What is upwards in the image. Without it, where there is a target, the axis nearest to what was upwards.
    fov : float, optional
        Field of view in degrees, along the axis that the scene file names (`fov_axis`), else the width.

    Raises
    ------
    OptionError
        If these are no places, nothing is given, the camera would stand at its target or look upwards, or `fov` is not
        between 0 and 180 degrees.

    Examples
    --------
    >>> print(Viewpoint(origin=(0, 1, 5), fov=40))
    origin=0,1,5 fov=40
    """

    origin: Place | None = None
    target: Place | None = None
    up: Place | None = None
    fov: float | None = None

    def __post_init__(self) -> None:
        for name in ("origin", "target", "up"):
            object.__setattr__(self, name, _place(name, getattr(self, name)))
        if self.fov is not None:
            object.__setattr__(self, "fov", _numbers("fov", [self.fov])[0])
            if not 0 < self.fov < 180:
                raise _impossible("fov is out of range", self.fov, "degrees between 0 and 180")
        if not str(self):
            raise _impossible("no change of the camera is given", "nothing", _EXPECTED)
        if self.origin is not None and self.origin == self.target:
            raise _impossible("the camera stands at its target", self, "two places")
        if self.up is not None and not any(self.up):
            raise _impossible("up is a vector of length 0", self, "a vector that is not 0")

    def __str__(self) -> str:
        """As `of` reads it, to the last digit."""
        said = ((name, getattr(self, name)) for name in _PARTS)
        return " ".join(
            f"{name}={','.join(repr(each).removesuffix('.0') for each in np.atleast_1d(value).tolist())}"
            for name, value in said
            if value is not None
        )

    @classmethod
    def of(cls, given: ViewpointSetting) -> Viewpoint:
        """Read a viewpoint, as text or as a dict of the same names.

        Raises
        ------
        OptionError
            If it is not readable.

        Examples
        --------
        >>> Viewpoint.of("origin=278,273,-800 fov=20") == Viewpoint.of({"origin": (278, 273, -800), "fov": 20})
        True
        """
        if isinstance(given, Viewpoint):
            return given
        parts: Any = given
        if isinstance(given, str):
            found = _PART.findall(given)
            rest = _PART.sub("", given).strip()
            parts = dict(found)
            if rest or len(parts) < len(found):
                raise _impossible("the camera is not readable", repr(given), _EXPECTED)
            parts = {name: re.split(r"\s*,\s*|\s+", text) for name, text in parts.items()}
            if len(parts.get("fov", "1")) == 1 and "fov" in parts:
                parts["fov"] = parts["fov"][0]
        if not isinstance(parts, Mapping):
            raise _impossible("the camera is not readable", repr(given), f"{_EXPECTED}, or a dict of these")
        for name in parts:
            if name not in _PARTS:
                raise _impossible(f"a camera has no '{name}'", repr(given), _EXPECTED)
        return cls(**parts)

    def completed(self, to_world: Array) -> Viewpoint:
        """With place, target and what is upwards in full, if one of them changes.

        Parameters
        ----------
        to_world : ndarray of shape (4, 4)
            Of the camera as it is: it looks along z, y is upwards.

        Raises
        ------
        OptionError
            If it would look upwards.
        """
        if self.origin is None and self.target is None and self.up is None:
            return self
        origin = to_world[:3, 3] if self.origin is None else np.array(self.origin)
        target = origin + _unit(to_world[:3, 2]) if self.target is None else np.array(self.target)
        before = to_world[:3, 1]
        nearest = int(np.argmax(np.abs(before)))
        up = before if self.target is None else np.sign(before[nearest]) * np.eye(3)[nearest]
        up = up if self.up is None else np.array(self.up)
        whole = Viewpoint(tuple(origin.tolist()), tuple(target.tolist()), tuple(up.tolist()), self.fov)
        with np.errstate(all="ignore"):
            across = np.linalg.norm(np.cross(_unit(up), _unit(target - origin)))
        if not across >= _LEVEL:  # nor a number, where one is too short or too long
            fix = "say what is upwards in the image (up=X,Y,Z)"
            raise OptionError(message("the camera looks upwards or downwards", got=whole, fix=fix))
        return whole

    def to_world(self, before: Array) -> Array:
        """The matrix of a camera that is moved here, with the scale and the mirror image it had; (4, 4)."""
        if self.origin is None or self.target is None or self.up is None:
            return before
        kept = _axes(before[:3, 2], before[:3, 1]).T @ before[:3, :3]
        moved = np.eye(4)
        moved[:3, :3] = _axes(np.subtract(self.target, self.origin), np.array(self.up)) @ kept
        moved[:3, 3] = self.origin
        return moved


ViewpointSetting: TypeAlias = Viewpoint | str | Mapping[str, Any]
"""A `Viewpoint`, or what `Viewpoint.of` reads."""


def _axes(forward: Array, up: Array) -> Array:
    """Axes of a camera in columns: to the left, upwards, forward."""
    left = _unit(np.cross(up, forward))
    return np.stack([left, _unit(np.cross(forward, left)), _unit(forward)], axis=1)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


def _place(name: str, given: Any) -> Place | None:
    if given is None:
        return None
    x, y, z = _numbers(name, given, 3)
    return x, y, z


def _numbers(name: str, given: Any, count: int = 1) -> list[float]:
    try:
        numbers = [float(each) for each in given]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        expected = "X,Y,Z, three finite numbers" if count == 3 else "a finite number"
        got = ",".join(map(str, given)) if isinstance(given, list | tuple) else repr(given)
        raise _impossible(f"{name} is not readable", got, expected)
    return numbers


def _impossible(fault: str, got: Any, expected: str) -> OptionError:
    return OptionError(message(fault, where="the camera", got=got, expected=expected))
