"""Donaldson matrices as instruments deliver them: cells on wavelengths of their own."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fluorspar.bispectral.checks import MOST_PHOTON_YIELD, SPARE_PHOTONS, check_stokes_side, photon_yield
from fluorspar.bispectral.conversions import Stokes
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.bispectral.matrix_noise import estimate_noise, stokes_shift
from fluorspar.errors import ApproximationWarning, ExtrapolationWarning, MaterialError, message
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["MeasuredMatrix", "check_measured"]

Array = NDArray[np.float64]

_SAME = 1e-4  # nm


@dataclass(frozen=True, eq=False)
class MeasuredMatrix:
    """A measured bispectral radiance factor, band-weighted, as the instrument gave it.

    Parameters
    ----------
    emission : ndarray of shape (M,)
        Emission wavelengths of the rows, nm, evenly spaced.
    excitation : ndarray of shape (P,)
        Excitation wavelengths of the columns, nm, with the same step and a common range of two or more.
    cells : ndarray of shape (M, P)
        Where emission and excitation are the same wavelength: S. Elsewhere: D_L times the step.
    name : str
        For messages.
    room : ndarray of shape (P,), optional
        The most S may be where it was not measured; by default what luminescence leaves of the photons.

    Raises
    ------
    MaterialError
        If shapes or wavelengths do not fit, a cell is not finite, or the matrix is transposed.

    Examples
    --------
    >>> w = np.array([400.0, 410.0, 420.0])
    >>> sheet = MeasuredMatrix(w, w, [[0.5, 0, 0], [0.1, 0.5, 0], [0.2, 0.1, 0.5]], name="a sheet")
    >>> sheet.step, sheet.reflectance.values
    (10.0, array([0.5, 0.5, 0.5]))
    >>> sheet.on(Wavelengths(400, 420, 5)).density()[2:, 0]
    array([0.01 , 0.015, 0.02 ])
    """

    emission: Array
    excitation: Array
    cells: Array
    name: str = ""
    room: Array | None = None

    def __post_init__(self) -> None:
        for field in ("emission", "excitation", "cells"):
            array = np.array(getattr(self, field), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, field, array)
        if self.cells.shape != (len(self.emission), len(self.excitation)):
            expected = (len(self.emission), len(self.excitation))
            fault = "the cells of a Donaldson matrix do not fit its wavelengths"
            raise MaterialError(message(fault, where=self.title, got=self.cells.shape, expected=expected))
        if not np.all(np.isfinite(self.cells)):
            i, j = np.argwhere(~np.isfinite(self.cells))[0]
            where = f"{self.title}, emission {self.emission[i]:g} nm, excitation {self.excitation[j]:g} nm"
            raise MaterialError(
                message("a Donaldson matrix holds a value that is not a finite number", where=where)
            )
        self._check_wavelengths()
        check_stokes_side(self._luminescent_cells(), self.emission, self.excitation, self.title)

    def __str__(self) -> str:
        """Its ranges and peak in words."""
        i, j = np.unravel_index(self.density.argmax(), self.density.shape)
        em, ex = self.emission, self.excitation
        return (
            f"a measured matrix: excitation {ex[0]:g}-{ex[-1]:g} nm, "
            f"emission {em[0]:g}-{em[-1]:g} nm by {self.step:g}, peak {ex[j]:g} nm to {em[i]:g} nm"
        )

    def _check_wavelengths(self) -> None:
        for what, values in (("excitation", self.excitation), ("emission", self.emission)):
            steps = np.diff(values)
            if len(values) < 2 or not np.all(steps > 0):
                fault = f"the {what} wavelengths of a Donaldson matrix do not ascend"
                worst = int(np.argmin(steps)) if len(steps) else 0
                got = (
                    f"{values[worst]:g} nm, then {values[worst + 1]:g} nm" if len(steps) else "fewer than two"
                )
                raise MaterialError(message(fault, where=self.title, got=got, fix="sort them, two or more"))
            if np.any(np.abs(steps - self.step) > _SAME):
                fault = f"the {what} wavelengths of a Donaldson matrix are not evenly spaced"
                worst = int(np.argmax(np.abs(steps - self.step)))
                got = f"{values[worst]:g} nm, then {values[worst + 1]:g} nm"
                expected, fix = f"steps of {self.step:g} nm", "resample the measurement to an even step"
                raise MaterialError(message(fault, where=self.title, got=got, expected=expected, fix=fix))
        offset = (self.emission[0] - self.excitation[0]) / self.step
        if abs(offset - round(offset)) * self.step > _SAME or np.count_nonzero(self._is_diagonal()) < 2:
            fault = "a Donaldson matrix has fewer than two cells of equal emission and excitation wavelength"
            fix = "they hold its reflectance: give rows and columns the same wavelengths where they overlap"
            raise MaterialError(message(fault, where=self.title, fix=fix))

    @property
    def title(self) -> str:
        """The name, or "a Donaldson matrix" if it has none."""
        return self.name or "a Donaldson matrix"

    @property
    def step(self) -> float:
        """Step of the excitation wavelengths in nm."""
        return float((self.excitation[-1] - self.excitation[0]) / (len(self.excitation) - 1))

    def grid(self, step: float | None = None) -> Wavelengths:
        """Return the wavelengths of excitation and emission together, with the step of the measurement or another.

        Examples
        --------
        >>> w = np.array([400.0, 410.0])
        >>> print(MeasuredMatrix(w, w, [[0.5, 0], [0.1, 0.4]]).grid())
        400-410 nm by 10
        """
        h = self.step if step is None else step
        first = float(min(self.excitation[0], self.emission[0]))
        last = float(max(self.excitation[-1], self.emission[-1]))
        return Wavelengths(first, first + h * float(np.floor((last - first) / h + 1e-6)), h)

    @property
    def reflectance(self) -> Spectrum:
        """S, the cells of equal emission and excitation wavelength."""
        rows, columns = np.nonzero(self._is_diagonal())
        return Spectrum(self.emission[rows], self.cells[rows, columns], name=f"reflectance of {self.title}")

    @property
    def density(self) -> Array:
        """D_L in 1/nm, ndarray of shape (M, P), 0 in the cells that hold S."""
        return self._luminescent_cells() / self.step

    @property
    def fluorescent(self) -> bool:
        """Whether it has a luminescent cell that is not 0."""
        return bool(np.any(self.density))

    def photon_yield(self) -> Array:
        """Return photons out per photon in, ndarray of shape (P,); S counts where it was measured.

        Examples
        --------
        >>> w = np.array([400.0, 500.0])
        >>> MeasuredMatrix(w, w, [[0.1, 0], [0.4, 0.7]]).photon_yield()  # 0.1 + 0.4 x 500 / 400
        array([0.6, 0.7])
        """
        reflected = np.where(self._is_diagonal(), self.cells, 0.0).sum(axis=0)
        return np.asarray(reflected + self.luminescent_photon_yield())

    def luminescent_photon_yield(self) -> Array:
        """Return the luminescent part of `photon_yield`, ndarray of shape (P,)."""
        return photon_yield(self._luminescent_cells(), self.emission, self.excitation)

    def energy_yield(self) -> Array:
        """Return energy out per energy in, ndarray of shape (P,); S counts where it was measured.

        Examples
        --------
        >>> w = np.array([400.0, 500.0])
        >>> MeasuredMatrix(w, w, [[0.1, 0], [0.4, 0.7]]).energy_yield()
        array([0.5, 0.7])
        """
        return np.asarray(self.cells.sum(axis=0))

    def scaled_luminescence(self, factor: float) -> MeasuredMatrix:
        """Return it with the luminescent cells times `factor` and S as it is, also where it was not measured."""
        cells = np.where(self._is_diagonal(), self.cells, factor * self.cells)
        return replace(self, cells=cells, room=self._room())

    def stokes_side(self) -> MeasuredMatrix:
        """Return it with 0 above the diagonal, where light would be shifted to shorter wavelengths: noise.

        Examples
        --------
        >>> w = np.array([400.0, 410.0])
        >>> MeasuredMatrix(w, w, [[0.5, 0.01], [0.1, 0.4]]).stokes_side().cells
        array([[0.5, 0. ],
               [0.1, 0.4]])
        """
        above = self.emission[:, np.newaxis] < self.excitation - _SAME
        return replace(self, cells=np.where(above, 0.0, self.cells))

    def within_noise(self) -> MeasuredMatrix:
        """Return it with a reflectance that leaves 0 to 1 by no more than noise set to 0 or 1.

        Noise is three times that of the cells beside the diagonal, and 0.01 at least.

        Warns
        -----
        ApproximationWarning
            If there is such a reflectance.

        Examples
        --------
        >>> w = np.array([400.0, 410.0])
        >>> MeasuredMatrix(w, w, [[0.5, 0], [0.1, 0.4]]).within_noise().reflectance.values
        array([0.5, 0.4])
        """
        S = self.reflectance
        bounded = np.clip(S.values, 0.0, 1.0)
        off = np.abs(S.values - bounded)
        noise = estimate_noise(self.cells, stokes_shift(self.emission, self.excitation, self.step))
        if not 0 < off.max() <= max(0.01, 3 * noise.near):
            return self
        worst = int(np.argmax(off))
        text = (
            f"{self.title}: a reflectance of {S.values[worst]:.4g} at {S.wavelengths[worst]:g} nm is set to"
        )
        warnings.warn(f"{text} {bounded[worst]:g}: noise", ApproximationWarning, stacklevel=3)
        cells = self.cells.copy()
        cells[np.nonzero(self._is_diagonal())] = bounded
        return replace(self, cells=cells)

    def _room(self) -> Array:
        if self.room is not None:
            return self.room
        lit = self.luminescent_photon_yield()
        return np.where(lit > 0, np.clip(1 - SPARE_PHOTONS - lit, 0.0, 1.0), 1.0)

    def _is_diagonal(self) -> NDArray[np.bool_]:
        return np.abs(self.emission[:, None] - self.excitation[None, :]) < _SAME

    def _luminescent_cells(self) -> Array:
        return np.where(self._is_diagonal(), 0.0, self.cells)

    def on(self, grid: Wavelengths, stokes: Stokes = "half") -> DonaldsonMatrix:
        """Resample to a render grid.

        On wavelengths that were measured, with the step that was measured, the cells come back exactly as
        given, noise above the diagonal included. On any other grid D_L is interpolated linearly as a
        density, on either side of the diagonal by itself. S is interpolated by itself and never scaled.
        Where nothing was measured, D_L is 0 and S keeps its end value, or less where luminescence leaves
        no room for it, with a warning.

        Parameters
        ----------
        grid : Wavelengths
            N wavelengths.
        stokes : {"half", "strict"}
            "strict" leaves out the cells above the diagonal (see `stokes_side`); by default all are used as given.

        Returns
        -------
        DonaldsonMatrix
            Of shape (N, N), in full.

        Raises
        ------
        SpectrumError
            If the grid does not overlap the measured reflectance.

        Warns
        -----
        ExtrapolationWarning
            If the grid reaches beyond the measured reflectance or excitation.

        Examples
        --------
        >>> w = np.array([400.0, 410.0])
        >>> MeasuredMatrix(w, w, [[0.5, 0], [0.2, 0.4]]).on(Wavelengths(400, 410, 10)).luminescent
        array([[0.  , 0.  ],
               [0.02, 0.  ]])
        """
        if stokes == "strict":
            return replace(self.stokes_side().on(grid), stokes=stokes)
        w = grid.values
        held = self.reflectance.on(grid, outside="hold")
        reflectance = self._with_room(held, w)
        self._warn_outside(grid, bool(np.any(reflectance < held)))
        rows, columns = _indices(w, self.emission), _indices(w, self.excitation)
        inside = np.outer(_inside(rows, self.emission), _inside(columns, self.excitation))
        at = rows.clip(0, len(self.emission) - 1), columns.clip(0, len(self.excitation) - 1)
        if (
            abs(grid.step - self.step) < _SAME
            and _on_samples(rows, self.emission)
            and _on_samples(columns, self.excitation)
        ):
            density = _bilinear(self.density, *at)
        else:
            n = len(w)
            below, above = (_bilinear(self._filled_density(side), *at) for side in (1, -1))
            density = np.where(np.tri(n, k=-1), below, np.where(np.tri(n), 0.0, above))
        return DonaldsonMatrix(grid, reflectance, luminescent=np.where(inside, density, 0.0), stokes=stokes)

    def _with_room(self, S: Array, w: Array) -> Array:
        """Lower S, where it was not measured, as far as luminescence leaves no room for it; all of shape (N,)."""
        first, last = self.reflectance.support
        unknown = (w < first - _SAME) | (w > last + _SAME)
        room = np.interp(w, self.excitation, self._room(), left=1.0, right=1.0)
        return np.where(unknown, np.minimum(S, room), S)

    def _warn_outside(self, grid: Wavelengths, lowered: bool) -> None:
        first, last = self.reflectance.support
        excited = (float(self.excitation[0]), float(self.excitation[-1]))
        gaps = [
            f"{what} measured for {a:g}-{b:g} nm ({assumed} outside)"
            for what, (a, b), assumed in (
                (
                    "reflectance",
                    (first, last),
                    "end value held" + ", or less where luminescence leaves no room," * lowered,
                ),
                ("excitation", excited, "0 assumed"),
                ("emission", (float(self.emission[0]), float(self.emission[-1])), "0 assumed"),
            )
            if grid.start < a - _SAME or grid.stop > b + _SAME
        ]
        if gaps:
            text = f"{self.title}: used on {grid}, beyond its data: {', '.join(gaps)}"
            warnings.warn(text, ExtrapolationWarning, stacklevel=3)

    def _filled_density(self, side: int) -> Array:
        """D_L with values on and just beyond the diagonal, so that it can be interpolated up to it from one side.

        D_L is unknown where S stands. It continues there the plane through its three neighbours below (`side` 1) or
        above the diagonal (-1), which is exact to first order; a cell just beyond continues the plane through the
        three before it.
        """
        d = self.density.copy()
        last_row, last_column = len(self.emission) - 1, len(self.excitation) - 1
        cells = list(zip(*np.nonzero(self._is_diagonal()), strict=True))
        for i, j in cells:
            below, left = i + side, j - side  # the next row and column on that side
            has_row, has_column = 0 <= below <= last_row, 0 <= left <= last_column
            if has_row and has_column:
                d[i, j] = d[below, j] + d[i, left] - d[below, left]
            else:
                d[i, j] = d[below, j] if has_row else (d[i, left] if has_column else 0.0)
        for i, j in cells:
            row, column = i + side, j + side
            if 0 <= row <= last_row and 0 <= column <= last_column:
                d[i, column] = d[i, j] + d[row, column] - d[row, j]
        return np.asarray(d)


def _indices(wavelengths: Array, samples: Array) -> Array:
    """Fractional index of each wavelength among evenly spaced samples, rounded where it is one of them."""
    index = (wavelengths - samples[0]) / ((samples[-1] - samples[0]) / (len(samples) - 1))
    whole = np.round(index)
    return np.asarray(np.where(np.abs(index - whole) < _SAME, whole, index))


def _inside(index: Array, samples: Array) -> NDArray[np.bool_]:
    return (index >= 0) & (index <= len(samples) - 1)


def _on_samples(index: Array, samples: Array) -> bool:
    inside = index[_inside(index, samples)]
    return bool(np.all(inside == np.round(inside)))


def _bilinear(table: Array, rows: Array, columns: Array) -> Array:
    """Interpolate a table, shape (M, P), linearly at fractional rows (R,) and columns (C,); shape (R, C)."""
    i = np.minimum(rows.astype(int), len(table) - 2)
    j = np.minimum(columns.astype(int), table.shape[1] - 2)
    u, v = (rows - i)[:, None], (columns - j)[None, :]
    upper = table[np.ix_(i, j)] * (1 - v) + table[np.ix_(i, j + 1)] * v
    lower = table[np.ix_(i + 1, j)] * (1 - v) + table[np.ix_(i + 1, j + 1)] * v
    return np.asarray(upper * (1 - u) + lower * u)


def check_measured(measured: MeasuredMatrix) -> MeasuredMatrix:
    """Return the matrix as it is if a real sample could have it.

    Raises
    ------
    MaterialError
        If an excitation wavelength gives out more than 1.15 times its photons: a corrupt file, or cells
        that are not band-weighted with the step of the wavelengths.

    Examples
    --------
    >>> w = np.array([400.0, 410.0])
    >>> check_measured(MeasuredMatrix(w, w, [[0.5, 0], [0.1, 0.5]])).step
    10.0
    """
    yields = measured.photon_yield()
    worst = int(np.argmax(yields))
    if yields[worst] <= MOST_PHOTON_YIELD:
        return measured
    column = measured.cells[:, worst]
    largest = int(np.argmax(column))
    raise MaterialError(
        message(
            "a Donaldson matrix gives out more photons than it gets",
            where=f"{measured.title}, excitation {measured.excitation[worst]:g} nm",
            got=f"{yields[worst]:.3g} photons per photon; the column adds up to {column.sum():.3g}, "
            f"its largest cell is {column[largest]:.3g} at emission {measured.emission[largest]:g} nm",
            expected=f"at most 1 (up to {MOST_PHOTON_YIELD} passes as measurement error)",
            fix="the file is corrupt, or its cells are not what it says (band-weighted or density, step)",
        )
    )
