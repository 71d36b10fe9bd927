"""A spectral image in a few lines of text: what it is, and how much light each component holds."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.xyz import luminance
from fluorspar.image.dataset import decoded_attrs, grid_of, names_of, values_of
from fluorspar.image.units import is_radiance, quantity_of, unit_of
from fluorspar.notebook import facts_table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Summary", "summarise"]

_SAMPLE_BYTES = 640 * 2**20
_BLOCK_ROWS = 16


@dataclass(frozen=True)
class Summary:
    """The facts a reader wants first.

    Parameters
    ----------
    facts : tuple of (str, str)
        Names and values in words.
    luminances : dict of str to float
        Mean luminance of each component, cd/m2 if the image holds radiance.
    """

    facts: tuple[tuple[str, str], ...]
    luminances: dict[str, float]

    @property
    def shares(self) -> dict[str, str]:
        """Share of each component in the mean luminance, in per cent."""
        whole = sum(self.luminances.values())
        return {
            name: f"{100 * value / whole:.3g} %" if whole else "-" for name, value in self.luminances.items()
        }

    def text(self) -> str:
        """The summary as lines of text."""
        lines = ["SpectralImage"]
        lines += [f"  {name + ':':<16} {value}" for name, value in self.facts]
        lines += [f"  {'components:':<16} share of the mean luminance"]
        lines += [f"    {name:<24}{share:>8}" for name, share in self.shares.items()]
        return "\n".join(lines)

    def html(self, png: bytes) -> str:
        """The summary as HTML, beside a picture."""
        picture = base64.b64encode(png).decode("ascii")
        beside = f"<img alt='the total in sRGB' style='max-width:24em' src='data:image/png;base64,{picture}'>"
        return facts_table("SpectralImage", [*self.facts, *self.shares.items()], beside)


def summarise(dataset: xr.Dataset) -> Summary:
    """Summarise a spectral image; of a large one, evenly spaced blocks of rows are read.

    Parameters
    ----------
    dataset : Dataset
        A spectral image, in memory or in a file.

    Returns
    -------
    Summary

    Examples
    --------
    >>> from fluorspar.image.dataset import make_dataset
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> dataset = make_dataset(np.ones((7, 4, 3, 69)), Wavelengths(), attrs={"spp": 16})
    >>> summarise(dataset).shares["source"]
    '14.3 %'
    """
    grid, names = grid_of(dataset), names_of(dataset)
    blocks = _sample(dataset)
    spectra = {name: _mean(dataset, "radiance", blocks, name) for name in names}
    luminances = {name: float(luminance(spectrum, grid)) for name, spectrum in spectra.items()}
    attrs = decoded_attrs(dataset.attrs)
    height, width = dataset.sizes["y"], dataset.sizes["x"]
    facts: dict[str, Any] = {
        "size": f"{width} x {height} pixels",
        "wavelengths": f"{grid}, {len(grid)} bands",
        "scene": attrs.get("scene"),
        "method": attrs.get("method"),
        "samples": None
        if "spp" not in attrs
        else f"{attrs['spp']} per pixel, seed {attrs.get('seed', 'not known')}",
        "quantity": None if is_radiance(attrs) else f"{quantity_of(attrs)}, unit {unit_of(attrs)}",
        "mean luminance": f"{sum(luminances.values()):.4g} {'cd/m2' if is_radiance(attrs) else '(relative)'}",
    }
    lit = sum(float(spectrum.mean()) for name, spectrum in spectra.items() if name != "source")
    if "standard_error" in dataset and lit > 0:
        error = float(_mean(dataset, "standard_error", blocks).mean())
        facts["standard error"] = (
            f"{100 * error / lit:.2g} % of the {quantity_of(attrs)} without lamps, per pixel and band"
        )
    if attrs.get("partial"):
        facts["partial"] = "yes, the render was stopped before its end"
    rows = sum(block.stop - block.start for block in blocks)
    if rows < height:
        facts["means"] = f"over {rows} of the {height} rows"
    return Summary(
        tuple(
            (name, value if isinstance(value, str) else str(value)) for name, value in facts.items() if value
        ),
        luminances,
    )


def _sample(dataset: xr.Dataset) -> list[slice]:
    """Evenly spaced blocks of rows, all of them if the image is small enough."""
    height = dataset.sizes["y"]
    starts = range(0, height, _BLOCK_ROWS)
    every = -(-4 * dataset["radiance"].size // _SAMPLE_BYTES)
    return [slice(start, min(start + _BLOCK_ROWS, height)) for start in starts[every // 2 :: max(every, 1)]]


def _mean(
    dataset: xr.Dataset, variable: str, blocks: list[slice], component: str | None = None
) -> NDArray[np.float64]:
    """Mean spectrum of the rendered pixels, ndarray of shape (N,)."""
    total = np.zeros(dataset.sizes["wavelength"])
    count = 0
    for rows in blocks:
        spectra = values_of(dataset, variable, rows, component).reshape(-1, len(total))
        known = np.isfinite(spectra[:, 0])
        if not known.all():
            spectra = spectra[known]
        total += np.ones(len(spectra), np.float32) @ spectra
        count += len(spectra)
    return total / count if count else np.full_like(total, np.nan)
