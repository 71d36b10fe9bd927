"""Spectra in the XML files of luminaires: IES TM-27, `.spdx`."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from fluorspar.errors import SpectrumError, message
from fluorspar.files.tables import Table, read_text

__all__ = ["read_spdx"]


def read_spdx(path: Path) -> Table:
    """Read the spectrum of an IES TM-27-14 or TM-27-20 file as a table of wavelength in nm and value.

    Raises
    ------
    SpectrumError
        If the file is missing or not XML, or holds no spectrum, or several.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> values = "".join(f"<SpectralData wavelength='{w}'>{w / 1000}</SpectralData>" for w in (400, 500))
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "lamp.spdx")
    ...     _ = file.write_text(f"<IESTM2714><SpectralDistribution>{values}</SpectralDistribution></IESTM2714>")
    ...     read_spdx(file).rows
    [['400', '0.4'], ['500', '0.5']]
    """
    try:
        root = ElementTree.fromstring(read_text(path, SpectrumError).encode())
    except (ElementTree.ParseError, ValueError, LookupError) as err:
        fix = "export it again, or give a table: wavelength in nm, value"
        raise SpectrumError(message("the file is not readable as XML", where=path, got=err, fix=fix)) from err
    spectra = root.findall(".//{*}SpectralDistribution")
    if len(spectra) != 1:
        expected = "one element SpectralDistribution, as IES TM-27 describes it"
        fault, fix = "the file does not hold one spectrum", "give it as a table: wavelength in nm, value"
        raise SpectrumError(message(fault, where=path, got=len(spectra), expected=expected, fix=fix))
    data = spectra[0].findall("{*}SpectralData")
    if not data:
        fault = "the file holds no rows of numbers"
        raise SpectrumError(message(fault, where=path, expected="elements SpectralData"))
    rows = [[element.get("wavelength", ""), (element.text or "").strip()] for element in data]
    quantity = (spectra[0].findtext("{*}SpectralQuantity") or "value").strip()
    return Table({}, ("wavelength", quantity), rows, path, SpectrumError, tuple(range(len(rows) + 1)))
