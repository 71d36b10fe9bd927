"""Lamps and dyes that a view may name: those of the library, and files that were uploaded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from fluorspar.bispectral.material import Material
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.view.lamps import lamp_of
from fluorspar.view.library import known_material, menus
from fluorspar.view.questions import LightSpectrum
from fluorspar.view.uploads import PREFIX, Uploads

__all__ = ["Supplies"]


@dataclass(frozen=True, eq=False)
class Supplies:
    """Where lamps and dyes come from.

    Parameters
    ----------
    folders : sequence of Path
        Of materials of the user's own.
    uploads : Uploads

    Examples
    --------
    >>> Supplies().material("poster-red").name
    'poster-red'
    """

    folders: Sequence[Path] = ()
    uploads: Uploads = field(default_factory=Uploads)

    @cached_property
    def menus(self) -> dict[str, Any]:
        """What there is to choose from."""
        return menus(self.folders)

    def lamp(self, asked: LightSpectrum) -> Spectrum | str:
        """A spectrum of a light, or the name of an illuminant."""
        return lamp_of(asked, self.uploads)

    def material(self, name: str) -> Material:
        """A material by its name, or the id of an upload."""
        if name.startswith(PREFIX):
            return self.uploads.material(name)
        return known_material(name, self.folders)
