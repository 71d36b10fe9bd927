"""The combinations of a sheet: each light and surface that is varied is an axis, and has a list of settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

from fluorspar.errors import OptionError, message
from fluorspar.scene.relit import in_words

__all__ = ["Axis", "axes_of", "count_combinations", "in_order"]

_WHAT = {"lights": "light", "materials": "material", "concentration": "concentration"}
_DIMS = ("point", "y", "x", "channel", "tristimulus", "coordinate")  # of the sheet itself


@dataclass(frozen=True)
class Axis:
    """What is varied, and how.

    Parameters
    ----------
    kind : str
        "lights", "materials" or "concentration", as in `LightPaths.image`.
    key : str
        Id of the light, shape or BSDF.
    name : str
        Of the dimension: the id, followed by what is varied if another dimension has that name.
    settings : tuple
        As in `LightPaths.image`.
    labels : tuple of str or float
        The settings in words; concentrations as numbers.
    """

    kind: str
    key: str
    name: str
    settings: tuple[Any, ...]
    labels: tuple[Any, ...]

    @property
    def title(self) -> str:
        """What is varied, in words.

        Examples
        --------
        >>> axes_of({"lamp": ["A"]}, None, None)[0].title
        "light 'lamp'"
        """
        return f"{_WHAT[self.kind]}{'' if self.kind == 'lights' else ' of'} '{self.key}'"


def axes_of(
    lights: Mapping[str, Sequence[Any]] | None,
    materials: Mapping[str, Sequence[Any]] | None,
    concentration: Mapping[str, Sequence[Any]] | None,
) -> tuple[Axis, ...]:
    """List the axes of a sheet, in the order given: lights, materials, concentrations.

    Raises
    ------
    OptionError
        If there are none, or something is no list.

    Examples
    --------
    >>> axes = axes_of({"lamp": ["D65", 0.5]}, {"wall": ["poster-red"]}, {"wall": [0, 1]})
    >>> [(axis.name, axis.labels) for axis in axes]
    [('lamp', ('D65', 'x 0.5')), ('wall material', ('poster-red',)), ('wall concentration', (0.0, 1.0))]
    """
    given = {"lights": lights, "materials": materials, "concentration": concentration}
    for kind, lists in given.items():
        if lists is not None and not isinstance(lists, Mapping):
            expected = "a dict, id: list of settings"
            raise OptionError(message(f"the {kind} are not readable", got=repr(lists), expected=expected))
    keys = [key for lists in given.values() for key in lists or ()]
    axes = []
    for kind, lists in given.items():
        for key, settings in (lists or {}).items():
            if isinstance(settings, str | bytes | tuple) or not isinstance(settings, Sequence):
                fix = f"{kind}={{{key!r}: [{settings!r}]}}"
                expected = "a list of settings"
                raise OptionError(
                    message(
                        "this is not a list",
                        where=f"{kind} {key}",
                        got=repr(settings),
                        expected=expected,
                        fix=fix,
                    )
                )
            if not settings:
                raise OptionError(message("a list of settings is empty", where=f"{kind} {key}"))
            taken = keys.count(key) > 1 or key in _DIMS
            name = f"{key} {_WHAT[kind]}" if taken else key
            axes.append(Axis(kind, key, name, tuple(settings), _labels(kind, settings)))
    if not axes:
        raise OptionError(
            message(
                "there is nothing to combine",
                expected="settings of a light, a material or a concentration",
                fix="give some, such as --light lamp=D65,A (lights={'lamp': ['D65', 'A']})",
            )
        )
    return tuple(axes)


def count_combinations(axes: Sequence[Axis]) -> int:
    """How many combinations there are.

    Examples
    --------
    >>> count_combinations(axes_of({"lamp": ["D65", "A"]}, {"wall": ["red", "green", "blue"]}, None))
    6
    """
    return prod(len(axis.settings) for axis in axes)


def in_order(axes: Sequence[Axis]) -> Iterator[tuple[tuple[int, ...], dict[str, dict[str, Any]]]]:
    """Go through the combinations: numbers of the settings, and the arguments of `LightPaths.image`.

    Those that differ in lights only follow one another, because unpacked paths serve all of them.

    Examples
    --------
    >>> [numbers for numbers, _ in in_order(axes_of({"lamp": ["D65", "A"]}, {"wall": ["red", "green"]}, None))]
    [(0, 0), (1, 0), (0, 1), (1, 1)]
    """
    slow_first = sorted(range(len(axes)), key=lambda axis: axes[axis].kind == "lights")
    for chosen in product(*(range(len(axes[axis].settings)) for axis in slow_first)):
        number_of = dict(zip(slow_first, chosen, strict=True))
        numbers = tuple(number_of[axis] for axis in range(len(axes)))
        changes: dict[str, dict[str, Any]] = {}
        for axis, number in zip(axes, numbers, strict=True):
            changes.setdefault(axis.kind, {})[axis.key] = axis.settings[number]
        yield numbers, changes


def _labels(kind: str, settings: Sequence[Any]) -> tuple[Any, ...]:
    """The settings in words, those alike with a number behind them."""
    if kind == "concentration" and all(isinstance(setting, int | float) for setting in settings):
        return tuple(map(float, settings))
    words = [
        f"x {setting:g}" if isinstance(setting, int | float) else str(in_words(setting))
        for setting in settings
    ]
    return tuple(
        word if word not in words[:place] else f"{word} ({words[:place].count(word) + 1})"
        for place, word in enumerate(words)
    )
