"""Lights that vary with direction or place: their texels become colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.scene.lights import Light, light_names
from fluorspar.scene.lobes.lobe import Texture
from fluorspar.scene.lobes.textures import read_bitmap, sky_colours, sky_placement
from fluorspar.scene.nodes import children
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
        """
        import mitsuba as mi

        props = self.state.nodes[index].props
        plugin = props.plugin_name()
        name, _ = light_names(self.state, index, shape)
        if plugin == "envmap":
            colours, scale = sky_colours(self.state, index, f"light '{name}'")
            self.skies[index] = scale
            texture = sky_placement(*scale.shape)
            spectrum = white_light(1.0, f"radiance of light '{name}'")
        elif (
            plugin == "area"
            and "radiance" in props
            and props.type("radiance") == mi.Properties.Type.ResolvedReference
        ):
            child = props["radiance"].index()
            if self.state.nodes[child].props.plugin_name() != "bitmap":
                return None
            colours, texture = read_bitmap(self.state, child, f"radiance of light '{name}'")
            spectrum = Spectrum.constant(1.0, f"radiance of light '{name}'")
        else:
            return None
        flat = colours.reshape(-1, 3)
        self.textures_of[row] = len(self.textures), sum(map(len, self.colours))
        self.textures.append(texture)
        self.colours.append(np.concatenate([flat, np.full((len(flat), 1), row, np.float32)], axis=1))
        return Light(name, plugin, spectrum, "W m-2 sr-1 nm-1", index)


def varies(state: Any, index: int) -> bool:
    """Whether a light is one that `VaryingLights` reads."""
    plugins = [state.nodes[child].props.plugin_name() for _, child in children(state, index)]
    plugin = state.nodes[index].props.plugin_name()
    return plugin == "envmap" or (plugin == "area" and "bitmap" in plugins)
