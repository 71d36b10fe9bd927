"""What the page asks, as JSON: a whole view with every question, so that windows cannot mix."""

from __future__ import annotations

import json
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = [
    "Compared",
    "CurveAsked",
    "LightSetting",
    "LightSpectrum",
    "MatrixAsked",
    "Pin",
    "Pinned",
    "Relight",
    "Saved",
    "SpectrumAsked",
    "View",
    "WhiteLight",
]

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Factor = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
Weight = Annotated[float, Field(ge=0, le=2)]
Nanometres = Annotated[float, Field(ge=1, le=1e5)]
Region = tuple[int, int, int, int]
"""Columns and rows x0, y0, x1, y1, inclusive."""
Name = Annotated[str, Field(max_length=500)]


class _Question(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class LightSpectrum(_Question):
    """The spectrum of a light: one of these.

    Examples
    --------
    >>> LightSpectrum(blackbody=2856).blackbody
    2856.0
    """

    name: Name | None = None
    blackbody: Annotated[float, Field(ge=500, le=100_000)] | None = None
    gaussian: tuple[Nanometres, Annotated[float, Field(ge=1, le=1000)]] | None = None
    curve: Annotated[list[tuple[Nanometres, Factor]], Field(min_length=2, max_length=5000)] | None = None
    upload: Name | None = None

    @model_validator(mode="after")
    def _one(self) -> LightSpectrum:
        if len(self.model_fields_set & {name for name, value in self if value is not None}) != 1:
            raise ValueError("give one of name, blackbody, gaussian, curve and upload")
        return self


class LightSetting(_Question):
    """What a light is to be: its spectrum (None: the scene's) and a factor."""

    factor: Factor = 1.0
    spectrum: LightSpectrum | None = None


class Relight(_Question):
    """What is changed of the scene, by the ids of lights and surfaces."""

    lights: dict[Name, LightSetting] = {}
    materials: dict[Name, Name] = {}
    concentration: dict[Name, Factor] = {}

    @property
    def key(self) -> str:
        """The same text for the same change."""
        return json.dumps(self.model_dump(), sort_keys=True)

    @property
    def is_nothing(self) -> bool:
        """Whether the scene is as it was traced."""
        return not (self.lights or self.materials or self.concentration)


class WhiteLight(_Question):
    """The white of a light, as it is in the view."""

    light: Name


class View(_Question):
    """What is looked at, and how."""

    source: Name
    relight: Relight = Relight()
    weights: dict[Name, Weight] = {}
    mode: Literal["colour", "band", "standard_error", "relative_error"] = "colour"
    band: tuple[Finite, Finite] | None = None
    exposure: Positive | None = None
    white: Name | WhiteLight | tuple[Positive, Positive, Positive] | None = None
    gamut: bool = False
    range: tuple[Finite, Finite] | None = None
    coarse: bool = False
    window: Region | None = None
    """Of a large image, what is to be seen of it."""

    def weight(self, component: str) -> float:
        """What a component is multiplied with."""
        return self.weights.get(component, 1.0)


class SpectrumAsked(View):
    """The spectrum of a region, perhaps relative to that of another."""

    region: Region
    reference: Region | None = None


class Pin(_Question):
    """A region that was given a name."""

    name: Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f]+$")]  # a line of the table
    region: Region


class Pinned(View):
    """The spectra of several regions as a table."""

    pins: Annotated[list[Pin], Field(min_length=1, max_length=1000)]


class Saved(View):
    """A file of what is looked at."""

    format: Literal["nc", "exr", "png", "csv"]
    name: Name = ""
    pins: Annotated[list[Pin], Field(max_length=1000)] = []


class Compared(_Question):
    """Two views, the second against the first."""

    a: View
    b: View


class CurveAsked(_Question):
    """What a setting of a light means."""

    light: LightSetting
    source: Name
    id: Name


class MatrixAsked(_Question):
    """The Donaldson matrix of a side of a surface."""

    source: Name
    relight: Relight = Relight()
    surface: Name
    side: Literal["front", "back"] = "front"
