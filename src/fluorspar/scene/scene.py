"""`Scene`: a Mitsuba scene taken apart into geometry, materials and lights."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fluorspar.bispectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.bispectral.material import Material
from fluorspar.errors import FluorsparError
from fluorspar.notebook import facts_table
from fluorspar.scene.carried_nodes import CarriedNodes
from fluorspar.scene.kept_nodes import KeptNodes
from fluorspar.scene.lights import Light
from fluorspar.scene.lobes.lobe import Lobes
from fluorspar.scene.recipe import Recipe
from fluorspar.scene.settings import Settings
from fluorspar.scene.surfaces import Surface
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["Scene"]


@dataclass(frozen=True)
class Scene:
    """A scene ready to be rendered. It can be pickled, and rendered by another process that has its files.

    Attributes
    ----------
    materials : tuple of Material
        The material table; `Surface.front` and `Surface.back` are rows of it.
    lights : tuple of Light
        The light table.
    surfaces : tuple of Surface
        All shapes.
    settings : Settings
        Size, samples and depths from the scene file.
    recipe : Recipe
        What it was loaded from.
    lobes : Lobes or None
        Of surfaces that are not matte or not of one spectrum, if the scene has any.
    """

    materials: tuple[Material, ...]
    lights: tuple[Light, ...]
    surfaces: tuple[Surface, ...]
    settings: Settings
    recipe: Recipe
    _nodes: KeptNodes
    lobes: Lobes | None = None

    def __repr__(self) -> str:
        return "\n".join([f"<{self._title}>", *(f"  {kind:<8} {text}" for kind, text in self._parts())])

    def _repr_html_(self) -> str:
        return facts_table(self._title, self._parts())

    @property
    def _title(self) -> str:
        s = self.settings
        depths = f"max_depth {s.max_depth}, rr_depth {s.rr_depth}"
        return f"Scene '{self.name}': {s.width} x {s.height} pixels, {s.spp} samples, {depths}"

    def _parts(self) -> list[tuple[str, str]]:
        """Its lights and materials in words."""
        parts = [("light", f"{light.name}: {light.plugin}, {light.unit}") for light in self.lights]
        for row, material in enumerate(self.materials):
            kind = " (fluorescent)" if material.fluorescent else ""
            parts.append(("material", f"{material.name}{kind}: on {self._names_with(row)}"))
        return parts + [(kind, f"{name}: on {', '.join(on)}") for (kind, name), on in self._others().items()]

    def _others(self) -> dict[tuple[str, str], list[str]]:
        """What is on surfaces beside materials, by kind and name: textures, metals, and what has no colour."""
        found: dict[tuple[str, str], list[str]] = {}
        for surface in self.surfaces if self.lobes is not None else ():
            assert self.lobes is not None
            parts = self.lobes.parts(surface.node)
            if not parts and any(self.lobes.of_surface[surface.node]):
                parts = [("clear", "no colour of its own")]
            for kind, name in parts:
                if kind != "material":
                    found.setdefault((kind, name), []).append(surface.name)
        return dict(sorted(found.items()))

    @property
    def general(self) -> list[str]:
        """Names of the surfaces that are not matte or not of one spectrum, and of the lights that vary."""
        if self.lobes is None:
            return []
        surfaces = [s.name for s in self.surfaces if not self.lobes.is_matte(s.node)]
        return surfaces + [
            light.name for row, light in enumerate(self.lights) if row in self.lobes.light_textures
        ]

    @property
    def used(self) -> dict[str, str]:
        """Names of the materials, metals and textures, and whom they are due to where that is known."""
        credits = {material.name: material.credit for material in self.materials}
        return {name: "" for kind, name in self._others() if kind != "clear"} | credits

    @property
    def name(self) -> str:
        """File name as it was given, name of the built-in scene, or "dict"."""
        return self.recipe.name

    @property
    def nodes(self) -> Any:
        """The scene as Mitsuba's parser sees it, a `mitsuba.parser.ParserState`; copy it to change it.

        Raises
        ------
        SceneError
            In another process than the one it was loaded in, if its files have changed or are gone since.
        """
        return self._nodes.state()

    def made(self, make: Callable[[Scene], Any]) -> Any:
        """Return what `make` builds of its nodes, whatever its spectra, samples and depths, in the variant that is set.

        Parameters
        ----------
        make : callable
            A function of the module it is in, for it is part of the key. One thing is kept, in this process.
        """
        import mitsuba as mi

        settings = self.settings
        key = make, mi.variant(), settings.width, settings.height, settings.viewpoint
        return self._nodes.made(key, lambda: make(self))

    def carried(self) -> Scene:
        """Copy the scene with the contents of its files: once pickled, it can be rendered on any machine.

        Raises
        ------
        SceneError
            If its meshes or pictures have changed, or are gone, since it was loaded.

        Examples
        --------
        >>> import pickle
        >>> from fluorspar.scene.loading import load_scene
        >>> len(pickle.loads(pickle.dumps(load_scene("furnace").carried())).nodes.nodes)
        9
        """
        if isinstance(self._nodes, CarriedNodes):
            return self
        return replace(self, _nodes=CarriedNodes(self._nodes, self.name))

    @property
    def files(self) -> tuple[tuple[str, str], ...] | None:
        """Names and SHA-256 of the files it was loaded from; None for a scene of light paths from a file."""
        fingerprint = getattr(self._nodes, "fingerprint", None)
        return fingerprint and tuple((Path(name).name, digest) for name, digest in fingerprint.files)

    @property
    def folders(self) -> tuple[str, ...]:
        """Where Mitsuba is to look for its files; the first one that has a file wins."""
        return self._nodes.folders

    @property
    def parameters(self) -> Mapping[str, str]:
        """The values given for the `$key` substitutions of its file; that of a mesh as an absolute path."""
        return self.recipe.parameters

    def matrices(self, grid: Wavelengths, stokes: Stokes = "half") -> list[DonaldsonMatrix]:
        """Return the Donaldson matrices of all materials on a grid, by row of the table.

        Parameters
        ----------
        grid : Wavelengths
            N wavelengths.
        stokes : {"half", "strict"}
            See `DonaldsonMatrix`.

        Raises
        ------
        MaterialError, SpectrumError
            As `Material.on`; the message says on which surfaces the material is.
        """
        matrices = []
        rows = self.materials if self.lobes is None else self.lobes.rows
        for number, row in enumerate(rows):
            try:
                matrices.append(row.on(grid, stokes=stokes))
            except FluorsparError as err:
                names = (
                    self._names_with(number)
                    if self.lobes is None
                    else self._names_of(getattr(row, "base", row))
                )
                raise type(err)(f"{err}\n  in:       material of {names}") from err
        return matrices

    def _names_with(self, row: int) -> str:
        """Names of the surfaces that have a material."""
        if self.lobes is not None:
            return self._names_of(self.materials[row])
        return ", ".join(surface.name for surface in self.surfaces if row in (surface.front, surface.back))

    def _names_of(self, material: Any) -> str:
        """Names of the surfaces with a lobe of a material."""
        assert self.lobes is not None
        return ", ".join(
            surface.name
            for surface in self.surfaces
            if any(part is material for _, part in self.lobes.parts(surface.node))
        )

    def with_settings(self, **changes: Any) -> Scene:
        """Copy the scene with some settings changed; None leaves a setting as it is."""
        return replace(
            self, settings=replace(self.settings, **{k: v for k, v in changes.items() if v is not None})
        )
