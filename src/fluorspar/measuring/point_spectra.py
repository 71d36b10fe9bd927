"""Spectra of numbered points, measured in an image or with an instrument, and their CSV files."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.observers import observer_named
from fluorspar.colour.xyz import CIE_1931, luminance, xyz_from_radiance
from fluorspar.errors import OptionError, SpectrumError, message
from fluorspar.files.names import text_of
from fluorspar.files.tables import read_table
from fluorspar.files.writing import replacing
from fluorspar.image.units import NOT_STATED, UNITS, same_unit
from fluorspar.measuring.spectra_table import TIDY, bandwidth_of, correlated_in, on_even_grid, tidy_spectra
from fluorspar.spectral.bands import Bands, band_weights, errors_on_bands
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["PointSpectra", "read_point_spectra", "write_point_spectra"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PointSpectra:
    """Spectra of P points on N wavelengths.

    Parameters
    ----------
    names : tuple of str
        The P names, each once.
    bands : Bands
        The N wavelengths and the shape of the bands.
    radiance : ndarray of shape (P, N)
        W m-2 sr-1 nm-1, or relative, as `unit` says.
    standard_error : ndarray of shape (P, N), optional
        Same unit.
    unit : str
        Unit of the radiance.
    whites : dict of str to float
        Points that are a known white, and its reflectance.
    title : str
        Where the spectra come from.
    notes : tuple of str
        What was done to them, sentence by sentence.
    correlated : bool
        Whether the errors of the bands of a point are fully correlated, as those of a render are; else they are
        independent.
    freedom : ndarray of shape (P,), optional
        Degrees of freedom of the standard errors of each point; None: they count as known.
    denoised : str
        How the image was denoised that they were measured in: pixels share errors, which are estimates.

    Raises
    ------
    SpectrumError
        If shapes do not match, a name occurs twice, or a number is not finite.

    Examples
    --------
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31)))
    >>> spectra.at("2").shape
    (31,)
    """

    names: tuple[str, ...]
    bands: Bands
    radiance: Array
    standard_error: Array | None = None
    unit: str = UNITS
    whites: dict[str, float] = field(default_factory=dict)
    title: str = ""
    notes: tuple[str, ...] = ()
    correlated: bool = False
    freedom: Array | None = None
    denoised: str = ""

    def __post_init__(self) -> None:
        expected = (len(self.names), len(self.bands.grid))
        for values in (self.radiance, self.standard_error):
            if values is not None and values.shape != expected:
                fault = "spectra of points have the wrong shape"
                raise SpectrumError(
                    message(fault, where=self.title or None, got=values.shape, expected=expected)
                )
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise SpectrumError(
                message("a point occurs twice", where=self.title or None, got=", ".join(twice))
            )
        bad = ~np.isfinite(self.radiance)
        if bad.any():
            point, band = np.argwhere(bad)[0]
            where = f"{self.title or 'spectra of points'}, point {self.names[point]}, {self.grid.values[band]:g} nm"
            raise SpectrumError(message("a radiance is not a finite number", where=where))

    @property
    def grid(self) -> Wavelengths:
        """The wavelengths."""
        return self.bands.grid

    def index(self, name: str) -> int:
        """The number of a point, from 0.

        Raises
        ------
        OptionError
            If there is no such point; the message lists those there are.
        """
        if name not in self.names:
            close = [known for known in self.names if known.lower().strip("p #") == name.lower().strip("p #")]
            raise OptionError(
                message(
                    "there is no such point",
                    where=self.title or None,
                    got=repr(name),
                    expected=", ".join(self.names),
                    fix=f"did you mean {' or '.join(close)}?" if close else "",
                )
            )
        return self.names.index(name)

    def at(self, name: str) -> Array:
        """The radiance of one point, ndarray of shape (N,)."""
        return np.asarray(self.radiance[self.index(name)])

    def luminance(self, observer: str = CIE_1931) -> Array:
        """Luminance of each point in cd/m2 (of radiance that is not relative), ndarray of shape (P,).

        Examples
        --------
        >>> grid = Wavelengths(360, 830, 5)
        >>> PointSpectra(("1",), Bands(grid), np.ones((1, 95))).luminance().round(0)
        array([72983.])
        """
        return np.atleast_1d(luminance(self.radiance, self.grid, observer))

    def chromaticity(self, observer: str | int = CIE_1931) -> Array:
        """CIE x and y of each point, ndarray of shape (P, 2); NaN of a black one.

        Examples
        --------
        >>> spectra = PointSpectra(("1",), Bands(Wavelengths(360, 830, 5)), np.ones((1, 95)))
        >>> spectra.chromaticity().round(4)
        array([[0.3333, 0.3333]])
        """
        xyz = xyz_from_radiance(self.radiance, self.grid, observer_named(observer))
        total = xyz.sum(axis=-1, keepdims=True)
        return np.asarray(np.divide(xyz[..., :2], total, out=np.full((len(xyz), 2), np.nan), where=total > 0))

    def illuminance(self, observer: str = CIE_1931) -> dict[str, float]:
        """Illuminance in lux of the points that are a known matte white: pi L / reflectance.

        Examples
        --------
        >>> grid = Wavelengths(550, 560, 5)
        >>> spectra = PointSpectra(("1",), Bands(grid), np.array([[0, 0.2, 0]]), whites={"1": 1.0})
        >>> round(spectra.illuminance()["1"], 1)  # 683 cd/m2
        2145.7
        """
        luminances = self.luminance(observer)
        return {
            name: float(np.pi * luminances[self.index(name)] / white) for name, white in self.whites.items()
        }

    def scaled(self, factor: float, unit: str, note: str) -> PointSpectra:
        """Return them times a factor, in another unit, with a note that says why."""
        error = None if self.standard_error is None else self.standard_error * factor
        notes = (*self.notes, note)
        return replace(self, radiance=self.radiance * factor, standard_error=error, unit=unit, notes=notes)

    def through(self, fwhm: float) -> PointSpectra:
        """Return what an instrument of triangular bands would show.

        Where the errors of the bands are fully correlated, as in a render, standard errors are averaged like the
        radiance; else as those of independent numbers.

        Parameters
        ----------
        fwhm : float
            Full width at half maximum in nm; 0 changes nothing.

        Raises
        ------
        OptionError
            If the spectra are bands already.

        Examples
        --------
        >>> spectra = PointSpectra(("1",), Bands(Wavelengths(400, 700, 5)), np.eye(1, 61, 30))
        >>> spectra.through(5.0).radiance[0, 29:32].round(3)
        array([0.167, 0.667, 0.167])
        """
        if fwhm == 0:
            return self
        if self.bands.fwhm:
            raise OptionError(message("the spectra have a bandwidth already", got=f"{self.bands.fwhm:g} nm"))
        bands = Bands(self.grid, fwhm)
        weights = band_weights(self.grid.values, self.grid.values, fwhm)
        error = errors_on_bands(self.standard_error, weights, self.correlated)
        note = f"instrument bandwidth: triangular, {fwhm:g} nm FWHM"
        return replace(
            self,
            bands=bands,
            radiance=self.radiance @ weights.T,
            standard_error=error,
            notes=(*self.notes, note),
        )


def read_point_spectra(path: str | os.PathLike[str]) -> PointSpectra:
    """Read a table of measured spectra.

    Either tidy, one row for each point and wavelength, with the columns `point`, `wavelength`, `radiance` and
    perhaps `standard_error` and its degrees of `freedom` (without them the errors count as known); or wide, with the
    column `wavelength` first and then one column for each point. A comment line `# bandwidth: 10` gives the
    instrument's FWHM in nm (0: samples), `# unit: W m-2 sr-1 nm-1` the unit (else it is "not stated", and luminances
    are relative), `# errors: correlated` says that the errors of the bands are fully correlated, as in a render, and
    `# denoised: how` that the image was denoised.

    Parameters
    ----------
    path : str or path-like
        A `.csv` or `.txt` file, cells separated by commas, semicolons or tabs.

    Returns
    -------
    PointSpectra

    Raises
    ------
    SpectrumError
        If the file is missing, a column is unknown, a cell is not a number, a point lacks a wavelength that
        others have, a standard error or the bandwidth is impossible, or the wavelengths are far from evenly
        spaced.

    Warns
    -----
    ApproximationWarning
        If the wavelengths are nearly, but not quite evenly spaced: spectra are then interpolated.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "measured.csv"
    >>> _ = path.write_text("# bandwidth: 5\\nwavelength,1,2\\n400,0.1,0.2\\n405,0.3,0.4\\n410,0.3,0.4\\n")
    >>> read_point_spectra(path).names
    ('1', '2')
    """
    path = Path(path)
    table = read_table(path, named_rows=True)
    header = [name.lower() for name in table.header]
    if "point" in header:
        names, wavelengths, radiance, error, freedom = tidy_spectra(table)
    elif header and (header[0].startswith("wavelength") or header[0] == "nm"):
        values = table.numbers()
        order = np.argsort(values[:, 0], kind="stable")
        names, wavelengths = tuple(table.header[1:]), values[order, 0]
        radiance, error, freedom = values[order, 1:].T.copy(), None, None
    else:
        raise SpectrumError(
            message(
                "the file is not a table of spectra",
                where=path,
                got=f"columns {', '.join(table.header)}",
                expected="point, wavelength, radiance[, standard_error[, freedom]]; or wavelength and a column a point",
            )
        )
    radiance, error, grid = on_even_grid(radiance, error, wavelengths, path)
    bands = Bands(grid, bandwidth_of(table))
    unit = table.keys.get("unit") or NOT_STATED
    correlated = correlated_in(table)
    return PointSpectra(
        names,
        bands,
        radiance,
        error,
        unit,
        title=text_of(path.name),
        correlated=correlated,
        freedom=freedom,
        denoised=table.keys.get("denoised", ""),
    )


def write_point_spectra(spectra: PointSpectra, path: str | os.PathLike[str]) -> None:
    """Write a tidy CSV file: point, wavelength, radiance, standard_error, freedom, with the notes as comments.

    Parameters
    ----------
    spectra : PointSpectra
    path : str or path-like
        The file to be written or replaced.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> spectra = PointSpectra(("1",), Bands(Wavelengths(400, 410, 5)), np.ones((1, 3)), title="a room")
    >>> path = Path(tempfile.mkdtemp()) / "points.csv"
    >>> write_point_spectra(spectra, path)
    >>> print(path.read_text().splitlines()[-1])
    1,410,1.0
    """
    stream = io.StringIO()
    stream.write(f"# spectra of points in: {spectra.title}\n# unit: {spectra.unit}\n")
    if spectra.bands.fwhm is not None:
        stream.write(f"# bandwidth: {spectra.bands.fwhm:g}\n")
    if spectra.standard_error is not None and spectra.correlated:
        stream.write("# errors: correlated\n")
    if spectra.denoised:
        stream.write(f"# denoised: {spectra.denoised}\n")
    luminances, illuminances = spectra.luminance(), spectra.illuminance()
    absolute = same_unit(spectra.unit, UNITS)
    for name, value in zip(spectra.names, luminances, strict=True):
        if absolute:
            lux = f", illuminance {illuminances[name]:.6g} lx" if name in illuminances else ""
            stream.write(f"# point {name} has luminance {value:.6g} cd/m2{lux}\n")
    for note in spectra.notes:
        stream.write(f"# {note}\n")
    writer = csv.writer(stream, lineterminator="\n")
    # a render of one sample per pixel has none
    errors = (
        None
        if spectra.standard_error is None or np.isnan(spectra.standard_error).any()
        else spectra.standard_error
    )
    freedom = (
        None
        if errors is None or spectra.freedom is None or np.isinf(spectra.freedom).all()
        else spectra.freedom
    )
    writer.writerow(TIDY[: 3 + (errors is not None) + (freedom is not None)])
    for p, name in enumerate(spectra.names):
        for k, wavelength in enumerate(spectra.grid.values):
            row = [name, f"{wavelength:.10g}", repr(float(spectra.radiance[p, k]))]
            if errors is not None:
                row.append(repr(float(errors[p, k])))
            if freedom is not None:
                row.append(f"{freedom[p]:.6g}")
            writer.writerow(row)
    with replacing(path) as temporary:
        temporary.write_text(stream.getvalue(), encoding="utf-8")
