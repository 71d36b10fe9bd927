"""Read an excitation-emission matrix in relative units, as fluorometers export it."""

from __future__ import annotations

from pathlib import Path

from fluorspar.bispectral.eem import Eem
from fluorspar.bispectral.files.matrix_table import matrix_of_table
from fluorspar.errors import MaterialError, message
from fluorspar.files.tables import read_table

__all__ = ["read_eem"]


def read_eem(path: str | Path) -> Eem:
    """Read an excitation-emission matrix from a table of any of the layouts of `matrix_of_table`.

    Titles above the table and what stands below it are passed over. A line `# units: photon` or `# units: energy` says
    what the intensities count.

    Raises
    ------
    MaterialError
        If the file is missing or malformed, or says that it is a Donaldson matrix, which is absolute, or a material.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "dye.dat")
    ...     _ = file.write_text("a dye in water\\n\\nnm\\t450\\t350\\n500\\t7\\t8\\n520\\t5\\t6\\n")
    ...     read_eem(file).cells
    array([[8., 7.],
           [6., 5.]])
    """
    path = Path(path)
    table = read_table(path, error=MaterialError)
    for key, kind, fix in (
        (
            "quantity",
            "a Donaldson matrix, which is absolute",
            "`fluorspar materials fit` makes a material of it",
        ),
        ("fluorspar-material", "a material", "use it as it is"),
    ):
        if key in table.keys:
            expected = "intensities in relative units"
            raise MaterialError(message(f"the file is {kind}", where=path, expected=expected, fix=fix))
    return Eem(*matrix_of_table(table), units=table.keys.get("units", "").lower(), name=path.stem)
