"""What a BSDF is made of: lobes whose coefficients a probe tells, each times a spectrum.

Mitsuba's BSDFs are used as they are, in a variant with three colour channels. In place of its colours a BSDF gets
*probes*: plastic gets diffuse = (d, 0, 0) and specular = (0, s, 0). Channel t of its value then is the coefficient of
lobe t, whatever the wavelength, and the value at a wavelength is the sum over the lobes of coefficient x spectrum.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.donaldson import DonaldsonMatrix, Stokes
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = [
    "ANGLES",
    "CHANNELS",
    "DARK",
    "FULL",
    "HALF",
    "METAL",
    "PLAIN",
    "REST",
    "STRAIGHT",
    "DyeMap",
    "Edit",
    "Lobe",
    "LobeRow",
    "Lobes",
    "Texture",
    "operate",
]

CHANNELS = 3  # colour channels of a probe
ANGLES = 65
"""Angles for which a conductor has rows; with linear interpolation between them the error is below 3e-4."""
STRAIGHT = 3  # in place of a channel: light that goes straight through, which no probe colours
_TEXELS_AT_A_TIME = 1 << 16

PLAIN, REST, DARK, HALF, FULL = 0.0, -1.0, -2.0, -3.0, -4.0
"""What `operate` makes of S: S; 1 - S; the three of Lagrange's polynomials in the root of S for 0, 1/2 and 1."""

METAL = -5.0
"""From here on down: S times one of `ANGLES` rows, the first of which is `METAL` less the operation."""


def operate(S: NDArray[np.floating], operation: NDArray[np.floating] | float) -> NDArray[np.float64]:
    """Make of reflectances what a lobe needs.

    Parameters
    ----------
    S : ndarray
    operation : ndarray or float
        One of the numbers above, or r > 0: S (1 - r) / (1 - r S), the base of a nonlinear plastic whose coat reflects
        the share r back. Of a metal's, S alone.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> operate(np.array([0.25, 1.0]), REST), operate(np.array([0.25, 1.0]), HALF)
    (array([0.75, 0.  ]), array([1., 0.]))
    """
    S, operation = np.asarray(S, dtype=np.float64), np.asarray(operation, dtype=np.float64)
    r, s = np.maximum(operation, 0), np.sqrt(np.maximum(S, 0))
    return np.select(
        [operation == REST, operation == DARK, operation == HALF, operation == FULL],
        [1 - S, 2 * (s - 0.5) * (s - 1), 4 * s * (1 - s), 2 * s * (s - 0.5)],
        S * (1 - r) / (1 - r * S),
    )


class LobeRow(Protocol):
    """A row of the table of spectra that lobes refer to."""

    def on(self, grid: Wavelengths, *, stokes: Stokes) -> DonaldsonMatrix:
        """Return it on a grid."""
        ...


@dataclass(frozen=True)
class Texture:
    """A grid of rows over a surface.

    Attributes
    ----------
    width, height : int
        Its texels; the row of texel (x, y) is that of the lobe, plus y x width + x.
    to_uv : tuple of float
        Six numbers: u' = a u + b v + c, v' = d u + e v + f.
    bilinear : bool
        Interpolate between texels, by picking one of four at random; or take the nearest.
    wrap : str
        `"repeat"`, `"mirror"` or `"clamp"`.
    mesh : int
        Node of the mesh whose faces or vertices the rows belong to, in place of texels; -1: none.
    per_face : bool
        To its faces; or to its vertices, one of three at random, with the barycentric coordinates as chances.
    name : str
        Of its picture file, or its plugin.
    """

    width: int
    height: int
    to_uv: tuple[float, ...]
    bilinear: bool
    wrap: str
    mesh: int = -1
    per_face: bool = False
    name: str = ""


@dataclass(frozen=True)
class Lobe:
    """One lobe of one side of a surface.

    Attributes
    ----------
    channel : int
        Channel of the probe that tells its coefficient, or `STRAIGHT`.
    row : int
        Its first row: of `Lobes.rows`, or, from their number on, of `Lobes.colours`. Behind these each colour has
        `angles` rows more, where it is a metal's.
    unit : float
        What the channel says where the coefficient is 1.
    texture : int
        Number in `Lobes.textures`; -1: the same row everywhere.
    angles : int
        Rows for so many angles of reflection, even in the root of the cosine of the half angle (conductors), for each
        texel of a texture; 0: one.
    gloss : bool
        Whether it is a highlight, or light that goes through, of plastic or glass: no material by itself.
    ids : tuple of str
        Of the BSDFs that it is read from, the outermost first.
    """

    channel: int
    row: int
    unit: float
    texture: int = -1
    angles: int = 0
    gloss: bool = False
    ids: tuple[str, ...] = ()


@dataclass(frozen=True)
class Edit:
    """How a node of the scene becomes a probe.

    Attributes
    ----------
    node : int
        Its number.
    values : mapping of str to float, str, (float, float, float) or None
        Properties it gets; three numbers are a colour, None takes one away.
    plugin : str, optional
        The plugin it becomes, without any of its own properties.
    """

    node: int
    values: Mapping[str, float | str | tuple[float, float, float] | None]
    plugin: str | None = None


@dataclass(frozen=True)
class DyeMap:
    """A surface whose dye varies in concentration: the probe's reflectance becomes a picture.

    Attributes
    ----------
    picture : int
        Node of the texture of the concentration.
    channel : int
        Of the dye; what the picture says.
    reflected, mean : int, float
        Channel of what is reflected, and what it says everywhere.
    """

    picture: int
    channel: int
    reflected: int
    mean: float


@dataclass(frozen=True)
class Lobes:
    """All lobes of a scene.

    Attributes
    ----------
    rows : tuple of LobeRow
        Spectra.
    colours : ndarray of shape (texels, 4), float32
        Spectra of texels: Mitsuba's three sigmoid coefficients of a colour, and what is made of it, see `operate`.
    textures : tuple of Texture
    of_surface : mapping of int to (front, back)
        The lobes of both sides of a surface, by its node.
    edits : tuple of Edit
        What makes probes of its BSDFs.
    replaced : mapping of int to bool
        Surfaces, by node, whose BSDF a material from outside replaces: it becomes diffuse with the probe (1, 0, 0);
        whether on both sides.
    skies : mapping of int to ndarray of shape (height, width), float32
        Environment maps, by node: the scale of each texel, which Mitsuba interpolates apart from its colour.
    light_colours : ndarray of shape (texels, 4), float32
        Colours of lights that vary: sigmoid coefficients, and the row of the light whose spectrum they multiply.
    light_textures : mapping of int to (int, int)
        Number in `textures` and first row in `light_colours` of lights that vary, by row of the light table.
    maps : mapping of int to DyeMap
        Maps of dyes, by the node of the BSDF.
    behind : int
        How many rows of kept paths come before these, see `numbered`.
    """

    rows: tuple[LobeRow, ...] = ()
    colours: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 4), dtype=np.float32))
    textures: tuple[Texture, ...] = ()
    of_surface: Mapping[int, tuple[tuple[Lobe, ...], tuple[Lobe, ...]]] = field(default_factory=dict)
    edits: tuple[Edit, ...] = ()
    replaced: Mapping[int, bool] = field(default_factory=dict)
    skies: Mapping[int, NDArray[np.float32]] = field(default_factory=dict)
    light_colours: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 4), dtype=np.float32))
    light_textures: Mapping[int, tuple[int, int]] = field(default_factory=dict)
    maps: Mapping[int, DyeMap] = field(default_factory=dict)
    behind: int = 0

    @property
    def terms(self) -> int:
        """The most rows that a vertex needs: one for each lobe, and two where light found and light sent on differ."""
        sides = [side for both in self.of_surface.values() for side in both]
        return max((sum(2 if lobe.angles else 1 for lobe in side) for side in sides), default=1)

    def parts(self, surface: int) -> list[tuple[str, Any]]:
        """What the lobes of a surface have their spectra from.

        Parameters
        ----------
        surface : int
            Its node.

        Returns
        -------
        list of (str, Any)
            `"texture"` and its name, `"metal"` and its name, or `"material"` and the `Material`, that below a coat too.
            What is white, such as glass and highlights, is left out.
        """
        found: list[tuple[str, Any]] = []
        for lobe in (lobe for side in self.of_surface[surface] for lobe in side):
            if lobe.texture >= 0:
                found.append(("texture", self.textures[lobe.texture].name))
            if lobe.row in range(1, len(self.rows)):
                count = 1
                if lobe.texture >= 0:
                    count = self.textures[lobe.texture].width * self.textures[lobe.texture].height
                for row in self.rows[lobe.row : lobe.row + count]:
                    found.append(
                        ("metal", getattr(row, "name", ""))
                        if lobe.angles
                        else ("material", getattr(row, "base", row))
                    )
        return [part for number, part in enumerate(found) if part not in found[:number]]

    def is_matte(self, surface: int) -> bool:
        """Whether a surface, by its node, is matte and of one spectrum on each side."""
        sides = [side for side in self.of_surface[surface] if side]
        plain = all(len(side) == 1 and side[0].texture < 0 and not side[0].angles for side in sides)
        rows = range(1, len(self.rows))
        return plain and all(s[0].row in rows and hasattr(self.rows[s[0].row], "reflectance") for s in sides)

    def more_on(self, grid: Wavelengths, stokes: Stokes) -> list[DonaldsonMatrix] | None:
        """What luminesces more than once at one surface, by row; None if nothing does."""
        if not any(hasattr(row, "more_on") for row in self.rows):
            return None
        nothing = DonaldsonMatrix(grid, np.zeros(len(grid)), stokes=stokes)
        return [row.more_on(grid, stokes=stokes) if hasattr(row, "more_on") else nothing for row in self.rows]

    @cached_property
    def brightest(self) -> NDArray[np.float32]:
        """Largest value of the spectrum of each texel, ndarray of shape (texels,).

        A spectrum is extreme at the ends of the range and at the vertex of its parabola, and nowhere else. What is
        made of it by the operations of a square root may be larger in between; roulette is then less apt, not wrong.
        """
        most = np.zeros(len(self.colours), np.float32)
        for first in range(0, len(most), _TEXELS_AT_A_TIME):
            part = slice(first, first + _TEXELS_AT_A_TIME)
            a, b, c, operation = np.ascontiguousarray(self.colours[part].T)
            half = np.float32(0.5)
            vertex = np.clip(-b / np.where(a == 0, np.float32(np.inf), 2 * a), 360, 830)
            for wavelength in (np.float32(360), np.float32(830), vertex):
                x = (a * wavelength + b) * wavelength + c
                S = half + half * x / np.sqrt(1 + x * x)
                value = S if not operation.any() else np.abs(operate(S, operation))
                np.maximum(most[part], value, out=most[part], casting="same_kind")
        return most
