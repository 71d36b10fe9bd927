"""`fluorspar materials show`."""

from __future__ import annotations

from fluorspar.cli import console
from fluorspar.cli.materials.common import MaterialArgument, PlotOption, write_plot
from fluorspar.cli.options import LibraryOption
from fluorspar.cli.targets import check_plot

__all__ = ["show"]


def show(name: MaterialArgument, plot: PlotOption = None, library: LibraryOption = None) -> None:
    """Describe a material. Source, range of the data, peaks, photon yield, colour under D65; --plot draws its spectra.

    Example:  fluorspar materials show poster-red --plot poster-red.png
    """
    from fluorspar.bispectral.library import material

    check_plot(plot)
    shown = material(name, library or [])
    console.out.print(repr(shown), markup=False, highlight=False)
    if plot is not None:
        from fluorspar.figures.materials import material_figure

        write_plot(material_figure(shown), plot)
