"""What `matte` makes of a surface or a light that varies: its average, with the spectra of Mitsuba's plugins."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message
from fluorspar.scene.nodes import below, build, label
from fluorspar.scene.suggestion import did_you_mean
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["MESH_ATTRIBUTE", "average_light", "average_reflectance", "check_attribute", "uses_mesh"]

MESH_ATTRIBUTE = "mesh_attribute"
"""The texture that has its values from the shape it is on: Mitsuba's memory is read wild without that shape."""

_WAVELENGTHS = np.arange(360.0, 831.0, 10.0)


def uses_mesh(state: Any, index: int) -> bool:
    """Whether a node holds a texture that has its values from the shape it is on."""
    return any(state.nodes[node].props.plugin_name() == MESH_ATTRIBUTE for node in below(state, index))


def average_reflectance(state: Any, index: int, bsdf: Any, shape: int, label: str) -> Spectrum:
    """Estimate the bihemispherical reflectance of a BSDF node, averaged over its texture.

    Light arrives evenly from the hemisphere; what is transmitted counts as lost. A grid of 64 x 64 texture
    positions with a random direction each, the same at every wavelength; with vertex or face attributes as many
    places on the shape, even in area.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    index : int
        The node.
    bsdf : mitsuba.BSDF
        Built of it.
    shape : int
        The node of the shape it is on.
    label : str
        How messages call it.

    Raises
    ------
    SceneError
        If Mitsuba cannot evaluate it, or the shape has no such attribute.
    """
    import mitsuba as mi

    random = np.random.default_rng(0).random((64 * 64, 5)).tolist()
    si = mi.SurfaceInteraction3f()
    si.t = 1.0
    si.sh_frame = mi.Frame3f([0, 0, 1])
    si.n = [0, 0, 1]
    context = mi.BSDFContext()
    total = _Total(si)
    with _naming(label):
        for _, (a, b, c, d, e) in zip(_visit(si, (64, 64), state, index, shape), random, strict=True):
            si.wi = mi.warp.square_to_cosine_hemisphere([a, b])
            direction = mi.Point2f(d, e)
            for row, wavelengths in enumerate(total.wavelengths):
                si.wavelengths = wavelengths
                sample, weight = bsdf.sample(context, si, c, direction)
                if sample.pdf > 0 and sample.wo.z > 0:
                    total.add(row, weight)
    return Spectrum(_WAVELENGTHS, np.clip(total.values() / len(random), 0, 1), name=label)


def average_light(state: Any, index: int, shape: int | None, label: str) -> Spectrum:
    """Average the radiance of a light node over its directions, or over its texture.

    A grid of 128 x 64 directions, or of as many texture positions: of a sun smaller than 3 degrees only as much
    is seen as falls on it.

    Parameters
    ----------
    state, index, label
        As those of `average_reflectance`.
    shape : int or None
        The node of the shape it is on; None for an environment.

    Raises
    ------
    SceneError
        As `average_reflectance`.
    """
    import mitsuba as mi

    light = build(state, index)
    si = mi.SurfaceInteraction3f()
    total = _Total(si)
    with _naming(label):
        for u, v in _visit(si, (128, 64), state, index, shape):
            # Even in the height z, so that all directions count the same.
            si.wi = [0, 0, 1] if shape is not None else mi.warp.square_to_uniform_sphere([v, u])
            for row, wavelengths in enumerate(total.wavelengths):
                si.wavelengths = wavelengths
                total.add(row, light.eval(si))
    return Spectrum(_WAVELENGTHS, total.values() / (128 * 64), name=label)


class _Total:
    """Sums in double precision, four wavelengths at a time; numpy would take ten times as long."""

    def __init__(self, si: Any) -> None:
        import drjit as dr

        self._double = dr.scalar.Array4f64
        self.wavelengths = [type(si.wavelengths)(four) for four in _WAVELENGTHS.reshape(-1, 4).tolist()]
        self._sums = [self._double(0) for _ in self.wavelengths]

    def add(self, row: int, values: Any) -> None:
        self._sums[row] = self._sums[row] + self._double(values)

    def values(self) -> NDArray[np.float64]:
        return np.array(self._sums).ravel()


@contextmanager
def _naming(label: str) -> Iterator[None]:
    """Say in errors of Mitsuba what was averaged."""
    try:
        yield
    except SceneError as err:
        raise err if label in str(err) else SceneError(f"{err}\n  in:       {label}") from err
    except RuntimeError as err:
        expected = "what Mitsuba evaluates at one point of a surface"
        raise SceneError(
            message("Mitsuba cannot average this", where=label, got=err, expected=expected)
        ) from err


def _visit(
    si: Any, grid: tuple[int, int], state: Any, index: int, shape: int | None
) -> Iterator[list[float]]:
    """Put `si` to the centres of the cells of a grid over the unit square; also to places on a shape, if need be."""
    if any(state.nodes[node].props.plugin_name() == "volume" for node in below(state, index)):
        raise SceneError(
            message("a texture of type 'volume' has no average over a surface", expected="other textures")
        )
    columns, rows = grid
    u, v = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    positions = np.stack([u.ravel(), v.ravel()], axis=-1).tolist()
    places: Any = [None] * len(positions)
    if shape is not None and uses_mesh(state, index):
        built = build(state, shape)  # kept here: `si` does not
        for node in below(state, index):
            if (props := state.nodes[node].props).plugin_name() == MESH_ATTRIBUTE:
                check_attribute(props, built, f"shape {label(state.nodes[shape], shape)}")
        si.shape = built
        places = _places(built, positions)
    for uv, place in zip(positions, places, strict=True):
        si.uv = uv
        if place is not None:
            si.prim_index, si.p = place
        yield uv


def check_attribute(props: Any, shape: Any, where: str) -> None:
    """Refuse an attribute that a shape does not have: Mitsuba's vectorised variants take it for 0.

    Parameters
    ----------
    props : mitsuba.Properties
        Of a `mesh_attribute`.
    shape : mitsuba.Shape
    where : str
        How messages call it.

    Raises
    ------
    SceneError
    """
    import mitsuba as mi

    if not shape.has_attribute(name := props["name"]):
        has = [
            key
            for key in mi.traverse(shape).keys()  # noqa: SIM118 (not a dict)
            if key.startswith(("vertex_", "face_")) and shape.has_attribute(key)
        ]
        raise SceneError(
            message(
                f"the shape has no attribute '{name}'",
                where=where,
                got=", ".join(has) or "no attributes",
                expected="the name of an attribute of its vertices or faces",
                fix=did_you_mean(name, has),
            )
        )


def _places(shape: Any, positions: list[list[float]]) -> list[tuple[int, Any]]:
    """Triangles and points on a shape, even in area; of one that is no mesh, 0 and points."""
    import mitsuba as mi

    values = mi.traverse(shape)
    if "faces" not in values:
        return [(0, shape.sample_position(0.0, uv).p) for uv in positions]
    faces = np.array(values["faces"]).reshape(-1, 3)
    corners = np.array(values["vertex_positions"], dtype=np.float64).reshape(-1, 3)[faces]
    edges = corners[:, 1:] - corners[:, :1]
    area = np.cumsum(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1))
    count = len(positions)
    chosen = np.searchsorted(area, (np.arange(count) + 0.5) / count * area[-1])
    random = np.random.default_rng(1).dirichlet([1, 1, 1], count // 3 + 1)
    # three points that have the centroid as their mean: values linear between corners come out exactly
    weights = np.stack([np.roll(random, turn, axis=1) for turn in range(3)], axis=1).reshape(-1, 3)[:count]
    points = (weights[:, :, np.newaxis] * corners[chosen]).sum(axis=1)
    return list(zip(chosen.tolist(), points.tolist(), strict=True))
