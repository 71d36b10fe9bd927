"""Donaldson matrices as instruments deliver them: cells on wavelengths of their own."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.errors import ExtrapolationWarning, MaterialError, message
from fluorspar.spectral.checks import check_stokes_side, photon_yield
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.tables import read_table
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["MeasuredMatrix", "read_donaldson_csv"]

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
    >>> S, density = sheet.on(Wavelengths(400, 420, 5))
    >>> density[2:, 0]
    array([0.01 , 0.015, 0.02 ])
    """

    emission: Array
    excitation: Array
    cells: Array
    name: str = ""

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

    def _check_wavelengths(self) -> None:
        for what, values in (("excitation", self.excitation), ("emission", self.emission)):
            if len(values) < 2 or not np.all(np.diff(values) > 0):
                fault = f"the {what} wavelengths of a Donaldson matrix do not ascend"
                raise MaterialError(message(fault, where=self.title, got=values))
            if np.any(np.abs(np.diff(values) - self.step) > _SAME):
                fault = f"the {what} wavelengths of a Donaldson matrix are not evenly spaced"
                raise MaterialError(
                    message(fault, where=self.title, got=values, expected=f"steps of {self.step:g} nm")
                )
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

    @property
    def reflectance(self) -> Spectrum:
        """S, the cells of equal emission and excitation wavelength."""
        rows, columns = np.nonzero(self._is_diagonal())
        return Spectrum(self.emission[rows], self.cells[rows, columns], name=f"reflectance of {self.title}")

    @property
    def density(self) -> Array:
        """D_L in 1/nm, ndarray of shape (M, P), 0 in the cells that hold S."""
        return self._luminescent_cells() / self.step

    def photon_yield(self) -> Array:
        """Return photons out per photon in, ndarray of shape (P,); S counts where it was measured.

        Examples
        --------
        >>> w = np.array([400.0, 500.0])
        >>> MeasuredMatrix(w, w, [[0.1, 0], [0.4, 0.7]]).photon_yield()  # 0.1 + 0.4 x 500 / 400
        array([0.6, 0.7])
        """
        reflected = np.where(self._is_diagonal(), self.cells, 0.0).sum(axis=0)
        return np.asarray(reflected + photon_yield(self._luminescent_cells(), self.emission, self.excitation))

    def scaled_luminescence(self, factor: float) -> MeasuredMatrix:
        """Return it with the luminescent cells times `factor` and S as it is."""
        return replace(self, cells=np.where(self._is_diagonal(), self.cells, factor * self.cells))

    def _is_diagonal(self) -> NDArray[np.bool_]:
        return np.abs(self.emission[:, None] - self.excitation[None, :]) < _SAME

    def _luminescent_cells(self) -> Array:
        return np.where(self._is_diagonal(), 0.0, self.cells)

    def on(self, grid: Wavelengths) -> tuple[Array, Array]:
        """Resample to a render grid.

        On wavelengths that were measured, with the step that was measured, the cells come back exactly as
        given, noise above the diagonal included. On any other grid D_L is interpolated linearly as a
        density and only cells strictly below the diagonal are kept. S is interpolated by itself and never
        scaled. Where nothing was measured, D_L is 0 and S keeps its end value, with a warning.

        Parameters
        ----------
        grid
            N wavelengths.

        Returns
        -------
        reflectance : ndarray of shape (N,)
        luminescent : ndarray of shape (N, N)
            D_L, 1/nm, rows are emission wavelengths.

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
        >>> MeasuredMatrix(w, w, [[0.5, 0], [0.2, 0.4]]).on(Wavelengths(400, 410, 10))
        (array([0.5, 0.4]), array([[0.  , 0.  ],
               [0.02, 0.  ]]))
        """
        w = grid.values
        reflectance = self.reflectance.on(grid, outside="hold")
        self._warn_outside(grid)
        rows, columns = _indices(w, self.emission), _indices(w, self.excitation)
        density = np.zeros((len(w), len(w)))
        if (
            abs(grid.step - self.step) < _SAME
            and _on_samples(rows, self.emission)
            and _on_samples(columns, self.excitation)
        ):
            filled = self.density
            keep = np.ones_like(density, dtype=bool)
        else:
            filled = self._filled_density()
            keep = np.tri(len(w), k=-1, dtype=bool)
        inside = np.outer(_inside(rows, self.emission), _inside(columns, self.excitation))
        values = _bilinear(
            filled, rows.clip(0, len(self.emission) - 1), columns.clip(0, len(self.excitation) - 1)
        )
        density[inside & keep] = values[inside & keep]
        return reflectance, density

    def _warn_outside(self, grid: Wavelengths) -> None:
        first, last = self.reflectance.support
        excited = (float(self.excitation[0]), float(self.excitation[-1]))
        gaps = [
            f"{what} measured for {a:g}-{b:g} nm ({assumed} outside)"
            for what, (a, b), assumed in (
                ("reflectance", (first, last), "end value held"),
                ("excitation", excited, "0 assumed"),
                ("emission", (float(self.emission[0]), float(self.emission[-1])), "0 assumed"),
            )
            if grid.start < a - _SAME or grid.stop > b + _SAME
        ]
        if gaps:
            text = f"{self.title}: used on {grid}, beyond its data: {', '.join(gaps)}"
            warnings.warn(text, ExtrapolationWarning, stacklevel=3)

    def _filled_density(self) -> Array:
        """D_L with values on and just above the diagonal, so that it can be interpolated up to it.

        D_L is unknown where S stands. It continues there the plane through its three neighbours on the Stokes
        side, which is exact to first order; a cell just above continues the plane through the three below it.
        """
        d = self.density.copy()
        rows, columns = np.nonzero(self._is_diagonal())
        last_row = len(self.emission) - 1
        for i, j in zip(rows, columns, strict=True):
            below = d[i + 1, j] if i < last_row else None
            left = d[i, j - 1] if j > 0 else None
            if below is not None and left is not None:
                d[i, j] = below + left - d[i + 1, j - 1]
            else:
                d[i, j] = below if below is not None else (left if left is not None else 0.0)
        for i, j in zip(rows, columns, strict=True):
            if i < last_row and j + 1 < len(self.excitation):
                d[i, j + 1] = d[i, j] + d[i + 1, j + 1] - d[i + 1, j]
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


def read_donaldson_csv(path: str | Path) -> MeasuredMatrix:
    """Read a Donaldson matrix file.

    The file has comment lines `# quantity: band` (or `density`) and `# step: 10`, a header row with the
    excitation wavelengths, and one row per emission wavelength, which stands first in it. In both
    quantities the cells of equal wavelength are S; the others are D_L times the step, or D_L in 1/nm.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    MaterialError
        If the file is missing, malformed, or not a possible matrix.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "sheet.csv")
    ...     _ = file.write_text("# quantity: density\\n# step: 10\\nnm,400,410\\n400,0.5,0\\n410,0.02,0.4")
    ...     read_donaldson_csv(file).cells
    array([[0.5, 0. ],
           [0.2, 0.4]])
    """
    table = read_table(Path(path), error=MaterialError)
    fix = "write lines such as '# quantity: band' and '# step: 10' above the table"
    quantity, step_text = table.keys.get("quantity", ""), table.keys.get("step", "")
    if quantity not in ("band", "density"):
        fault, got = "a Donaldson file does not say what its cells are", repr(quantity)
        raise MaterialError(message(fault, where=path, got=got, expected="'band' or 'density'", fix=fix))
    try:
        excitation = np.array([float(cell) for cell in table.header[1:]])
        step = float(step_text)
    except ValueError as err:
        fault = "a Donaldson file has no readable step or header of excitation wavelengths"
        raise MaterialError(message(fault, where=path, got=err, fix=fix)) from err
    emission, cells = table.rows[:, 0], table.rows[:, 1:]
    if len(excitation) != cells.shape[1] or len(excitation) < 2:
        fault = "the header of a Donaldson file does not name every column"
        raise MaterialError(message(fault, where=path, got=len(excitation), expected=cells.shape[1]))
    if abs(np.diff(excitation).mean() - step) > _SAME:
        fault = "the step of a Donaldson file is not that of its excitation wavelengths"
        raise MaterialError(
            message(fault, where=path, got=f"{step:g} nm", expected=f"{np.diff(excitation).mean():g} nm")
        )
    if quantity == "density":
        diagonal = np.abs(emission[:, None] - excitation[None, :]) < _SAME
        cells = np.where(diagonal, cells, step * cells)
    return MeasuredMatrix(emission, excitation, cells, Path(path).name)
