"""The spectrum of a region of a view, its colour, and the table of several."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.temperature import colour_temperature
from fluorspar.colour.xyz import CIE_1931, lab_from_xyz, xyz_from_radiance
from fluorspar.image.components import TOTAL, select
from fluorspar.measuring.point_spectra import PointSpectra, write_point_spectra
from fluorspar.measuring.regions import measure_regions
from fluorspar.view.kept_image import KeptImage
from fluorspar.view.questions import Region, SpectrumAsked, View

__all__ = ["regions_of", "spectrum_of", "table_of"]

Array = NDArray[np.float64]


def regions_of(kept: KeptImage, view: View, regions: Mapping[str, Region], title: str = "") -> PointSpectra:
    """Mean spectra of regions of a view, with its weights."""
    return measure_regions(kept.whole, regions, weights=view.weights, title=title)


def spectrum_of(kept: KeptImage, asked: SpectrumAsked, white: Array) -> dict[str, Any]:
    """What is to be said of a region.

    Parameters
    ----------
    kept : KeptImage
    asked : SpectrumAsked
    white : ndarray of shape (3,)
        XYZ of the white of CIELAB where no reference region is given.
    """
    image = kept.whole

    def mean(region: Region, component: str | None = None) -> PointSpectra:
        name = "{}, {} to {}, {}".format(*region)
        return measure_regions(image, {name: region}, component=component, weights=asked.weights)

    measured = mean(asked.region)
    parts = {name: mean(asked.region, name).radiance[0] for name in image.components}
    total, grid = measured.radiance[0], image.wavelengths
    relative = None
    if asked.reference is not None:
        reference = mean(asked.reference).radiance[0]
        white = xyz_from_radiance(reference, grid)
        relative = np.divide(total, reference, out=np.full_like(total, np.nan), where=reference > 0)
    xyz = xyz_from_radiance(total, grid)
    xy = measured.chromaticity(CIE_1931)[0]
    luminescent = None
    if image.components != (TOTAL,) and xyz[1] > 0:
        names = select("luminescent", image.components)
        luminescent = float(xyz_from_radiance(sum(parts[name] for name in names), grid)[1] / xyz[1])
    x0, y0, x1, y1 = asked.region
    return {
        "wavelengths": grid.values,
        "components": parts,
        "total": total,
        "standard_error": None if measured.standard_error is None else measured.standard_error[0],
        "relative": relative,
        "xyz": xyz,
        "xy": xy,
        "lab": lab_from_xyz(xyz, white) if (white > 0).all() else None,
        "luminance": measured.luminance()[0],
        "cct": colour_temperature(xy),
        "luminescent_share": luminescent,
        "pixels": (x1 - x0 + 1) * (y1 - y0 + 1),
        "unit": measured.unit,
        "white": white,
    }


def table_of(spectra: PointSpectra) -> bytes:
    """The file that `fluorspar measure` writes of some spectra."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "spectra.csv")
        write_point_spectra(spectra, file)
        return file.read_bytes()
