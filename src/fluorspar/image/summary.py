"""A spectral image in a few lines of text: what it is, and how much light each component holds."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.colour.xyz import luminance
from fluorspar.image.dataset import VARIABLES, decoded_attrs, grid_of, names_of, values_of
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
        shown = np.isfinite(whole) and whole != 0
        return {
            name: f"{100 * value / whole:.3g} %" if shown else "-" for name, value in self.luminances.items()
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
    means = {name: _mean(dataset, "radiance", blocks, name) for name in names}
    spectra = {name: spectrum for name, (spectrum, _) in means.items()}
    looked_at = sum(block.stop - block.start for block in blocks)
    finished = min(share for _, share in means.values())
    luminances = {name: float(luminance(spectrum, grid)) for name, spectrum in spectra.items()}
    attrs = decoded_attrs(dataset.attrs)
    height, width = dataset.sizes["y"], dataset.sizes["x"]
    memory = 4 * sum(dataset[name].size for name in VARIABLES if name in dataset) / 1e9
    unit = "cd/m2" if is_radiance(attrs) else "(relative)"
    facts: dict[str, Any] = {
        "size": f"{width} x {height} pixels" + (f", {memory:,.3g} GB in memory" if memory >= 0.1 else ""),
        "wavelengths": f"{grid}" if "bands" in str(grid) else f"{grid}, {len(grid)} bands",
        "scene": attrs.get("scene"),
        "method": ", variant ".join(str(attrs[name]) for name in ("method", "variant") if name in attrs),
        "samples": None
        if "spp" not in attrs
        else f"{attrs['spp']} per pixel, seed {attrs.get('seed', 'not known')}",
        "until": _reached(attrs.get("until")),
        "denoised": attrs.get("denoised"),
        "quantity": None if is_radiance(attrs) else f"{quantity_of(attrs)}, unit {unit_of(attrs)}",
        "mean luminance": f"{sum(luminances.values()):.4g} {unit}" if finished else "not known",
    }
    lit = sum(float(spectrum.mean()) for name, spectrum in spectra.items() if name != "source")
    named = {"standard_error": "standard error", "denoised_error": "estimated error"}
    for variable, fact in named.items():
        if variable in dataset and lit > 0:
            error = float(_mean(dataset, variable, blocks)[0].mean())
            if np.isfinite(error):
                facts[fact] = (
                    f"{100 * error / lit:.2g} % of the {quantity_of(attrs)} without lamps, per pixel and band"
                )
    if attrs.get("partial"):
        stopped = (
            "timings" in attrs
        )  # what a store does not say that is being written, or whose writer was killed
        facts["partial"] = (
            "the render was stopped before its end" if stopped else "not finished, being written or stopped"
        ) + (
            f": {100 * finished:.3g} % of the pixels are finished"
            + (", over which means are taken" if finished else "")
        )
    if looked_at < height:
        facts["means"] = (
            f"over {looked_at} of the {height} rows" if looked_at else "not taken: the image is too large"
        )
    return Summary(
        tuple(
            (name, value if isinstance(value, str) else str(value)) for name, value in facts.items() if value
        ),
        luminances,
    )


def _reached(until: Any) -> str | None:
    """What passes were rendered for, and what came of it, see `fluorspar.paths.passes`."""
    if not isinstance(until, dict):
        return None
    errors = [until.get(name) for name in ("mean", "p95")]
    reached = [f"{100 * error:.3g} %" for error in errors if isinstance(error, float | int)] or ["not known"]
    return (
        f"{until.get('target')}, {until.get('stopped')} after {len(until.get('passes', ()))} passes; "
        f"standard error of {until.get('of')} per pixel {', 95th percentile '.join(reached)}"
    )


def _sample(dataset: xr.Dataset) -> list[slice]:
    """Evenly spaced blocks of rows, all of them if the image is small enough."""
    height = dataset.sizes["y"]
    starts = range(0, height, _BLOCK_ROWS)
    every = -(-4 * dataset["radiance"].size // _SAMPLE_BYTES)
    if every > 2 * len(starts):
        return []  # not even a few rows can be read in a moment
    first = 0 if dataset.attrs.get("partial") else every // 2  # renders begin at the top
    return [slice(start, min(start + _BLOCK_ROWS, height)) for start in starts[first :: max(every, 1)]]


def _mean(
    dataset: xr.Dataset, variable: str, blocks: list[slice], component: str | None = None
) -> tuple[NDArray[np.float64], float]:
    """Mean spectrum of the finished pixels, ndarray of shape (N,), and the share of these."""
    total = np.zeros(dataset.sizes["wavelength"])
    count = pixels = 0
    for rows in blocks:
        spectra = values_of(dataset, variable, rows, component).reshape(-1, len(total))
        known = np.isfinite(spectra[:, 0])
        pixels += len(spectra)
        if not known.all():
            spectra = spectra[known]
        total += np.ones(len(spectra), np.float32) @ spectra
        count += len(spectra)
    return (total / count, count / pixels) if count else (np.full_like(total, np.nan), 0.0)
