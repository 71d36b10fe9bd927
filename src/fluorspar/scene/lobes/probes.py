"""Make probes of the BSDFs of a scene, and find out whether Mitsuba builds them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from fluorspar.errors import SceneError
from fluorspar.scene.lobes.lobe import Edit
from fluorspar.scene.nodes import build, children, copy_nodes

__all__ = ["apply_edits", "check_probes"]


def apply_edits(state: Any, edits: Iterable[Edit]) -> None:
    """Make probes of nodes; colours need a variant that has them."""
    import mitsuba as mi

    for edit in edits:
        props = state.nodes[edit.node].props
        if edit.plugin is not None:
            for name in list(props.keys()):
                del props[name]
            props.set_plugin_name(edit.plugin)
        for name, value in edit.values.items():
            if name in props:
                del props[name]
            if value is not None:
                props[name] = mi.ScalarColor3f(*value) if isinstance(value, tuple) else value


def check_probes(state: Any, edits: Iterable[Edit], bsdfs: Mapping[int, str]) -> None:
    """Let Mitsuba build the BSDFs: it knows which properties they have, and which files there are.

    Those that differ in numbers only are built once: a rough plastic takes 0.2 s.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    edits : iterable of Edit
    bsdfs : mapping of int to str
        Where a BSDF is, by its node.

    Raises
    ------
    SceneError
        If Mitsuba refuses one.
    """
    part = copy_nodes(state)
    apply_edits(part, edits)
    different = {_signature(part, index): index for index in reversed(list(bsdfs))}
    for index in sorted(different.values()):
        try:
            build(part, index)
        except SceneError as err:
            raise SceneError(f"{err}\n  in:       {bsdfs[index]}") from err


def _signature(state: Any, index: int) -> tuple[object, ...]:
    """All of a node but its numbers."""
    import mitsuba as mi

    props, inner = state.nodes[index].props, dict(children(state, index))
    return (
        props.plugin_name(),
        *(
            (
                name,
                str(of := props.type(name)),
                props[name] if of in (mi.Properties.Type.String, mi.Properties.Type.Bool) else None,
                _signature(state, inner[name]) if name in inner else None,
            )
            for name in sorted(props.keys())
        ),
    )
