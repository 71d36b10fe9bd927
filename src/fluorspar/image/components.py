"""The components of a spectral image: what the light did on its way to the camera.

"The paper" is Tominaga, Guarnera, Ohtera, IEEE TVCG 2026, doi 10.1109/TVCG.2026.3668980.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from fluorspar.errors import OptionError, message

__all__ = [
    "COMPONENTS",
    "DEFINITIONS",
    "GROUPS",
    "LUMINESCENT",
    "REFLECTED",
    "SINGLE_BOUNCE",
    "TOTAL",
    "Component",
    "definition",
    "named_in",
    "select",
    "sum_of",
]


@dataclass(frozen=True)
class Component:
    """One component of the radiance towards the camera.

    Parameters
    ----------
    number : int
        Its number k in y_k.
    name : str
        Its name in data sets, files and on the command line.
    meaning : str
        What it is, in one line.
    """

    number: int
    name: str
    meaning: str


DEFINITIONS: tuple[Component, ...] = (
    Component(0, "source", "a light source seen directly"),
    Component(1, "direct_reflection", "light of the sources, reflected"),
    Component(2, "direct_luminescence", "luminescence excited by light of the sources"),
    Component(3, "indirect_reflection", "light that other surfaces reflected, reflected again"),
    Component(4, "indirect_luminescence", "luminescence excited by light that other surfaces reflected"),
    Component(5, "luminescent_reflection", "light that luminesced once on another surface, reflected"),
    Component(6, "reexcitation", "light that luminesced twice or more, on any path"),
)
"""The components in their order, 1 to 5 as in the paper's Eqs. 3-13."""

COMPONENTS: tuple[str, ...] = tuple(component.name for component in DEFINITIONS)
"""The names of the components in their order."""

REFLECTED: tuple[str, ...] = (COMPONENTS[1], COMPONENTS[3])
"""Light that never luminesced, 1 + 3: the reflection image of the paper's Figure 12."""

LUMINESCENT: tuple[str, ...] = (COMPONENTS[2], COMPONENTS[4], COMPONENTS[5])
"""Light that luminesced once, 2 + 4 + 5: the luminescence image of the paper's Figure 12."""

SINGLE_BOUNCE: tuple[str, ...] = COMPONENTS[:6]
"""Light that luminesced at most once, 0 to 5: the paper's Eq. 13 and the visible lamp."""

TOTAL = "total"
"""The one component of an image that is not split, such as that of another program."""

_PLUS = " + "

GROUPS: dict[str, tuple[str, ...]] = {
    "total": COMPONENTS,
    "single_bounce": SINGLE_BOUNCE,
    "reflected": REFLECTED,
    "luminescent": LUMINESCENT,
}
"""Names for sums of components."""


def definition(name: str) -> Component:
    """Look up what a component is.

    Parameters
    ----------
    name : str
        One of `COMPONENTS`.

    Returns
    -------
    Component

    Raises
    ------
    OptionError
        If there is no such component; the message lists the legal names.

    Examples
    --------
    >>> definition("direct_luminescence").meaning
    'luminescence excited by light of the sources'
    """
    for component in DEFINITIONS:
        if component.name == name:
            return component
    raise _unknown(name, COMPONENTS)


def select(what: str | Iterable[str] | None, present: Iterable[str] = COMPONENTS) -> tuple[str, ...]:
    """Turn a choice of components into their names, in the order of `COMPONENTS`.

    Parameters
    ----------
    what : str or iterable of str or None
        A component, a key of `GROUPS`, a sum of these joined by "+", several components, or None for all.
    present : iterable of str
        The components the image holds. A group loses those that it does not hold (the staged method has no
        `reexcitation`); one asked for by name must be there.

    Returns
    -------
    tuple of str

    Raises
    ------
    OptionError
        If a name is unknown or nothing is left, the message lists the legal names; or if a sum holds one twice.

    Examples
    --------
    >>> select("luminescent")
    ('direct_luminescence', 'indirect_luminescence', 'luminescent_reflection')
    >>> select(["reexcitation", "source"])
    ('source', 'reexcitation')
    >>> select("reflected+direct_luminescence")
    ('direct_reflection', 'direct_luminescence', 'indirect_reflection')
    """
    held = tuple(present)
    if held == (TOTAL,):
        if what is None or what == TOTAL or (not isinstance(what, str) and tuple(what) == held):
            return held
        raise _unknown(what, held)
    names: Sequence[str]
    if what is None or isinstance(what, str):
        names = _added_up("total" if what is None else what, held)
    else:
        names = tuple(what)
        for name in names:
            if name not in held:
                raise _unknown(name, held)
    chosen = tuple(name for name in COMPONENTS if name in names and name in held)
    if not chosen:
        raise _unknown(what, held)
    return chosen


def _added_up(text: str, held: tuple[str, ...]) -> list[str]:
    """The components of a sum, each term of which is a component or a group."""
    names: list[str] = []
    for term in map(str.strip, text.split("+")):
        if term not in held and term not in GROUPS:
            raise _unknown(term, held)
        names += GROUPS.get(term, (term,))
    twice = [name for name in COMPONENTS if names.count(name) > 1]
    if twice:
        raise OptionError(message("a sum holds a component twice", got=text, fix=f"name {twice[0]} once"))
    return names


def sum_of(names: Iterable[str]) -> dict[str, str]:
    """The attribute `components` of an image that is the sum of these; none if it is not known what they are.

    Examples
    --------
    >>> sum_of(REFLECTED), sum_of([TOTAL])
    ({'components': 'direct_reflection + indirect_reflection'}, {})
    """
    held = tuple(names)
    return {} if held == (TOTAL,) else {"components": _PLUS.join(held)}


def named_in(attrs: Mapping[str, object]) -> tuple[str, ...] | None:
    """Which components an image that is not split is the sum of, by its attributes; None if they do not say.

    Examples
    --------
    >>> named_in(sum_of(REFLECTED)), named_in({})
    (('direct_reflection', 'indirect_reflection'), None)
    """
    names = tuple(str(attrs.get("components", "")).split(_PLUS))
    if set(names) <= set(COMPONENTS):
        return names
    return SINGLE_BOUNCE if attrs.get("single_bounce") == 1 else None


def _unknown(name: object, held: Iterable[str]) -> OptionError:
    return OptionError(
        message(
            "the image has no such component",
            got=repr(name),
            expected=f"{', '.join(held)} (or a sum: {', '.join(GROUPS)}; or several joined by +)"
            if tuple(held) != (TOTAL,)
            else f"{TOTAL}: the image is not split into components",
        )
    )
