"""`Scene`: a Mitsuba scene taken apart into geometry, materials and lights."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fluorspar.bispectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparError, SceneNotice
from fluorspar.scene.nodes import build
from fluorspar.scene.sensor import sampler_node
from fluorspar.scene.settings import Settings
from fluorspar.scene.surfaces import Light, Surface
from fluorspar.scene.variants import SPECTRUM_VARIANT, use_variant
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Scene"]


@dataclass(frozen=True)
class Scene:
    """A scene ready to be rendered.

    Attributes
    ----------
    name
        File name or name of the built-in scene.
    materials
        The material table; `Surface.front` and `Surface.back` are rows of it.
    lights
        The light table.
    surfaces
        All shapes.
    settings
        Size, samples and depths from the scene file.
    nodes
        The scene as Mitsuba's parser sees it.
    base
        Folder against which its file names are resolved.
    parameters
        The values given for the `$key` substitutions of its file; that of a mesh as an absolute path.
    """

    name: str
    materials: tuple[Material, ...]
    lights: tuple[Light, ...]
    surfaces: tuple[Surface, ...]
    settings: Settings
    nodes: Any
    base: Path
    parameters: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        s = self.settings
        depths = f"max_depth {s.max_depth}, rr_depth {s.rr_depth}"
        lines = [f"<Scene '{self.name}': {s.width} x {s.height} pixels, {s.spp} samples, {depths}>"]
        lines += [f"  light    {light.name}: {light.plugin}, {light.unit}" for light in self.lights]
        for row, made in enumerate(self.materials):
            on = ", ".join(surface.name for surface in self.surfaces if row in (surface.front, surface.back))
            lines.append(f"  material {made.name}{' (fluorescent)' if made.fluorescent else ''}: on {on}")
        return "\n".join(lines)

    def matrices(self, grid: Wavelengths, stokes: Stokes = "half") -> list[DonaldsonMatrix]:
        """Return the Donaldson matrices of all materials on a grid, by row of the table.

        Parameters
        ----------
        grid
            N wavelengths.
        stokes
            See `DonaldsonMatrix`.

        Raises
        ------
        MaterialError, SpectrumError
            As `Material.on`; the message says on which surfaces the material is.
        """
        found = []
        for row, made in enumerate(self.materials):
            try:
                found.append(made.on(grid, stokes=stokes))
            except FluorsparError as err:
                on = ", ".join(s.name for s in self.surfaces if row in (s.front, s.back))
                raise type(err)(f"{err}\n  in:       material of {on}") from err
        return found

    def with_settings(self, **changes: int | None) -> Scene:
        """Copy the scene with some settings changed; None leaves a setting as it is."""
        return replace(
            self, settings=replace(self.settings, **{k: v for k, v in changes.items() if v is not None})
        )

    def with_whole_samples(self) -> Scene:
        """Copy the scene with as many samples as its sampler can do: some need a square or a power of two.

        Warns
        -----
        SceneNotice
            If that is another number.
        """
        index = sampler_node(self.nodes)
        if index is None or self.nodes.nodes[index].props.plugin_name() == "independent":
            return self
        with use_variant(SPECTRUM_VARIANT):
            sampler = build(self.nodes, index)
            sampler.set_sample_count(self.settings.spp)
            spp = int(sampler.sample_count())
        if spp != self.settings.spp:
            plugin = self.nodes.nodes[index].props.plugin_name()
            warnings.warn(
                f"the sampler '{plugin}' takes {spp} samples instead of {self.settings.spp}",
                SceneNotice,
                stacklevel=3,
            )
        return self.with_settings(spp=spp)
