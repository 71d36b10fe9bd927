"""Write the spectra of a material on wavelengths of one's choice."""

from __future__ import annotations

from dataclasses import replace

from fluorspar.bispectral.factored import FactoredMatrix, Fluorophore
from fluorspar.bispectral.material import Material
from fluorspar.spectral.spectrum import trapezoid
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["resampled"]


def resampled(material: Material, grid: Wavelengths) -> Material:
    """Return a material whose tables have the wavelengths of a grid.

    Its Donaldson matrix on that grid, and on every grid made of some of its wavelengths, is what it was. Between
    its wavelengths the spectra are linear, so a coarser grid loses detail.

    Parameters
    ----------
    material : Material
        Of factors, without a measured matrix.
    grid : Wavelengths
        N wavelengths, within the data of the reflectance.

    Returns
    -------
    Material
        Fluorophores that this grid does not excite, or whose light it does not hold, are left out.

    Raises
    ------
    MaterialError
        If the material holds a measured matrix.

    Warns
    -----
    ExtrapolationWarning
        If the grid reaches beyond the reflectance.

    Examples
    --------
    >>> from fluorspar.spectral.spectrum import Spectrum
    >>> dye = Fluorophore(Spectrum([500, 550, 600], [0, 0.6, 0]), Spectrum([400, 450, 500], [0, 1, 0]))
    >>> fine = resampled(Material("dyed", Spectrum.constant(0.1), (dye,)), Wavelengths(400, 600, 10))
    >>> fine.fluorophores[0].emission.at(540), len(fine.reflectance.wavelengths)
    (0.48, 21)
    """
    spectra = material.as_spectra()
    w = grid.values
    dyes = []
    for dye in spectra.fluorophores:
        alpha, beta = (s.on(grid, outside="zero") for s in (dye.emission, dye.excitation))
        area = trapezoid(beta, w)  # Fluorophore makes it 1, so alpha takes it up
        if area > 0 and alpha.any():
            dyes.append(
                Fluorophore(
                    replace(dye.emission, wavelengths=w, values=alpha * area),
                    replace(dye.excitation, wavelengths=w, values=beta),
                    dye.name,
                )
            )
    reflectance = replace(spectra.reflectance, wavelengths=w, values=spectra.reflectance.on(grid))
    return replace(material, terms=((1.0, FactoredMatrix(reflectance, tuple(dyes), spectra.name)),))
