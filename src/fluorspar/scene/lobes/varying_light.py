"""Lights that vary with direction or place: their texels become colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import SceneError, message
from fluorspar.scene.lights import Light, light_names, read_light
from fluorspar.scene.lobes.lobe import Texture
from fluorspar.scene.lobes.textures import positive_scale, read_bitmap, sky_colours, sky_placement
from fluorspar.scene.nodes import copy_nodes
from fluorspar.scene.plugin_spectra import white_light
from fluorspar.spectral.spectrum import Spectrum

__all__ = ["VaryingLights", "varies"]


class VaryingLights:
    """Grows while lights are read.

    Parameters
    ----------
    state : mitsuba.parser.ParserState
        Parsed scene; the variant set is `scalar_spectral`.
    textures : list of Texture
        Gets those of lights too.

    Attributes
    ----------
    skies, colours, textures_of
        As `skies`, `light_colours` and `light_textures` of `Lobes`.
    """

    def __init__(self, state: Any, textures: list[Texture]) -> None:
        self.state = state
        self.textures = textures
        self.skies: dict[int, NDArray[np.float32]] = {}
        self.colours: list[NDArray[np.float32]] = []
        self.textures_of: dict[int, tuple[int, int]] = {}

    def read(self, index: int, row: int, shape: int | None) -> Light | None:
        """Read a light that varies with direction or place; None if this one does not.

        Parameters
        ----------
        index : int
            Its node.
        row : int
            The row of the light table that it gets.
        shape : int or None
            The node of the shape that it is on.

        Raises
        ------
        SceneError
            If its picture cannot be read; if it is negative.
        """
        if not varies(self.state, index):
            return None
        plugin = self.state.nodes[index].props.plugin_name()
        name, where = light_names(self.state, index, shape)
        unit = "W m-2 sr-1 nm-1"
        if plugin == "envmap":
            colours, scale = sky_colours(self.state, index, f"light '{name}'")
            self.skies[index] = scale
            texture = sky_placement(*scale.shape)
            spectrum = white_light(1.0, f"radiance of light '{name}'")
        else:
            quantity = _PICTURES[plugin]
            child = _picture(self.state, index)
            if child is None:
                raise SceneError(
                    message(
                        f"the {quantity} of a '{plugin}' is not a picture", where=where, expected="a bitmap"
                    )
                )
            colours, texture = read_bitmap(self.state, child, f"{quantity} of light '{name}'")
            if plugin == "spot":
                part = copy_nodes(self.state)
                del part.nodes[index].props[quantity]
                plain = read_light(part, index, shape, matte=False)
                spectrum, unit = plain.spectrum, plain.unit
            else:  # of which Mitsuba's spectral variants make no D65
                factor = positive_scale(self.state, index, f"light '{name}'")
                spectrum = Spectrum.constant(factor, f"{quantity} of light '{name}'")
                unit = "W m-2 nm-1" if plugin == "projector" else unit
        flat = colours.reshape(-1, 3)
        self.textures_of[row] = len(self.textures), sum(map(len, self.colours))
        self.textures.append(texture)
        self.colours.append(np.concatenate([flat, np.full((len(flat), 1), row, np.float32)], axis=1))
        return Light(name, plugin, spectrum, unit, index)


_PICTURES = {"area": "radiance", "spot": "texture", "projector": "irradiance"}


def varies(state: Any, index: int) -> bool:
    """Whether a light is one that `VaryingLights` reads."""
    plugin = state.nodes[index].props.plugin_name()
    if plugin == "spot":
        return "texture" in state.nodes[index].props
    return plugin in ("envmap", "projector") or (plugin == "area" and _picture(state, index) is not None)


def _picture(state: Any, index: int) -> int | None:
    """The bitmap of a light that is none of an environment."""
    import mitsuba as mi

    props = state.nodes[index].props
    name = _PICTURES[props.plugin_name()]
    if name not in props or props.type(name) != mi.Properties.Type.ResolvedReference:
        return None
    child: int = props[name].index()
    return child if state.nodes[child].props.plugin_name() == "bitmap" else None
