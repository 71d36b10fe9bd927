"""Is a measured Donaldson matrix physically possible?"""

from __future__ import annotations

import numpy as np

from fluorspar.bispectral.checks import MOST_PHOTON_YIELD
from fluorspar.bispectral.measured import MeasuredMatrix
from fluorspar.errors import MaterialError, message

__all__ = ["check_measured"]


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
