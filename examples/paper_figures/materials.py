"""The spectra of the box: Donaldson matrices, their factors, reflectances and the lamp."""

from __future__ import annotations

import numpy as np

import fluorspar
from fluorspar.bispectral.conversions import to_unit_norm

from .workshop import Made, Workshop, step

PAINTS = ("poster-red", "poster-green")
WIDE = fluorspar.Wavelengths(300, 780, 5)


@step("2", "Donaldson matrices of the two walls")
def figure_2(work: Workshop) -> Made:
    """Bispectral radiance factors of the red and the green wall, in bands of 5 nm as instruments store them: the
    reflected radiance factor S on the diagonal, the luminescent one above it (emission at longer wavelengths than
    excitation). On a logarithmic scale, because a cell of the diagonal holds a hundred times as much."""
    from matplotlib.colors import LogNorm

    figure, axes = work.panels("", 2, height=3.3)
    numbers = {}
    for panel, name in zip(axes[0], PAINTS, strict=True):
        matrix = fluorspar.material(name).on(WIDE)
        band = matrix.band()
        shown = panel.imshow(
            np.where(band > 1e-5, band, np.nan),
            origin="lower",
            extent=(297.5, 782.5, 297.5, 782.5),
            norm=LogNorm(1e-5, 1),
            cmap="viridis",
            interpolation="nearest",
        )
        panel.set_title(name, fontsize=9)
        panel.set_xlabel("excitation wavelength, nm")
        panel.set_ylabel("emission wavelength, nm")
        numbers[f"{name}, greatest photon yield"] = f"{matrix.photon_yield().max():.3f}"
    figure.colorbar(shown, ax=axes, label="radiance factor in bands of 5 nm")
    return Made([work.save(figure, "figure-2.png")], numbers)


@step("7", "Reflectances and the lamp")
def figure_7(work: Workshop) -> Made:
    """Reflected radiance factors of all surfaces of the box, and the relative spectrum of its lamp, CIE D65. White
    0.85 and gray 0.45 at all wavelengths are assumptions of ours."""
    figure = fluorspar.plot(fluorspar.load_scene("cornell-box"))
    return Made([work.save(figure, "figure-7.png")])


@step("8", "Emission and excitation of the two walls")
def figure_8(work: Workshop) -> Made:
    """The factors alpha (emission) and beta (excitation) of the luminescent part, in the paper's normalisation (Eq. 2):
    the samples of beta, 5 nm apart, have unit Euclidean norm."""
    figure, axes = work.panels("", 2)
    for panel, name in zip(axes[0], PAINTS, strict=True):
        matrix = fluorspar.material(name).on(WIDE)
        alpha, beta = to_unit_norm(matrix.emission, matrix.excitation, WIDE.step)
        panel.plot(WIDE.values, np.atleast_2d(beta).T, "--", color="#0072B2", label="excitation beta")
        panel.plot(WIDE.values, np.atleast_2d(alpha).T, color="#D55E00", label="emission alpha")
        panel.set_title(name, fontsize=9)
        panel.set_xlabel("wavelength, nm")
        panel.legend(fontsize=8)
    axes[0][0].set_ylabel("factor of the matrix (5 nm)")
    return Made([work.save(figure, "figure-8.png")])
