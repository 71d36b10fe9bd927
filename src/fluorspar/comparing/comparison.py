"""The result of a comparison: numbers, spectra and maps."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.comparing.difference import mean_rmse
from fluorspar.comparing.noise import NoiseVerdict
from fluorspar.comparing.noise_text import noise_sentence
from fluorspar.errors import OptionError, message
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["LIMITS", "Comparison", "Detail", "ImageComparison", "PointComparison"]

Array = NDArray[np.float64]

LIMITS = {
    "rmse": "mean of the RMSE of each point if there are any, else of each pixel",
    "rmse_eq14": "RMSE of Eq. 14, one root over all points; needs a point to match at",
    "rmse_max": "greatest RMSE of a point or pixel",
    "de00": "mean CIEDE2000",
    "de00_max": "greatest CIEDE2000",
    "bias": "mean of B - A over the mean of A, without its sign",
    "noise_z": "greatest deviation from what noise alone gives, in standard errors: that of a block of pixels, "
    "a point or everything",
}
"""Numbers that `--fail-above` can limit, and what they are."""


class Detail(str):
    """A note for the report, which `Comparison.text` leaves out."""

    __slots__ = ()


@dataclass(frozen=True, eq=False)
class PointComparison:
    """P points on T bands.

    Attributes
    ----------
    names : tuple of str
    a, b : ndarray of shape (P, T)
        Radiance as it was measured, before the scales are matched.
    error_a, error_b : ndarray of shape (P, T) or None
        Standard errors.
    rmse : ndarray of shape (P,)
        Of each point.
    rmse_eq14 : float or None
        Of all points, with one root (Eq. 14); None if the scales are not matched at a point.
    de00 : ndarray of shape (P,)
        CIEDE2000 of each point.
    lab_a, lab_b : ndarray of shape (P, 3)
    band_error, band_bias : ndarray of shape (T,)
        Relative to the mean of A.
    bias : float
        Mean of B - A over the mean of A, after matching.
    noise : NoiseVerdict or None
    """

    names: tuple[str, ...]
    a: Array
    b: Array
    error_a: Array | None
    error_b: Array | None
    rmse: Array
    rmse_eq14: float | None
    de00: Array
    lab_a: Array
    lab_b: Array
    band_error: Array
    band_bias: Array
    bias: float
    noise: NoiseVerdict | None

    def as_dict(self) -> dict[str, Any]:
        """Numbers for JSON."""
        each = [
            {"point": name, "rmse": r, "de00": d, "lab_a": list(a), "lab_b": list(b)}
            for name, r, d, a, b in zip(
                self.names,
                self.rmse.tolist(),
                self.de00.tolist(),
                self.lab_a.tolist(),
                self.lab_b.tolist(),
                strict=True,
            )
        ]
        return _results(self) | {"rmse_eq14": self.rmse_eq14, "points": each}


@dataclass(frozen=True, eq=False)
class ImageComparison:
    """Two images of Y x X pixels on T bands.

    Attributes
    ----------
    rmse, de00 : ndarray of shape (Y, X)
        Maps; NaN where one side was not rendered.
    rgb_a, rgb_b : ndarray of shape (Y, X, 3)
        sRGB pictures at one exposure, uint8.
    rgb_difference : ndarray of shape (Y, X, 3)
        B - A of the displayed R, G, B, -1 to 1.
    exposure : float
        Of the pictures, m2/cd, in the scale of A.
    mean_a, mean_b : ndarray of shape (T,)
        Mean spectra, after the scale of B is matched.
    band_error, band_bias : ndarray of shape (T,)
        Relative to the mean of A.
    bias : float
        Mean of B - A over the mean of A, after matching.
    noise : NoiseVerdict or None
    """

    rmse: NDArray[np.float32]
    de00: NDArray[np.float32]
    rgb_a: NDArray[np.uint8]
    rgb_b: NDArray[np.uint8]
    rgb_difference: NDArray[np.float32]
    exposure: float
    mean_a: Array
    mean_b: Array
    band_error: Array
    band_bias: Array
    bias: float
    noise: NoiseVerdict | None

    def as_dict(self) -> dict[str, Any]:
        """Numbers for JSON."""
        height, width = self.rmse.shape
        compared = int(np.isfinite(self.rmse).sum())
        return {"width": width, "height": height, "pixels_compared": compared} | _results(self)


def _results(part: PointComparison | ImageComparison) -> dict[str, Any]:
    return {
        "rmse": mean_rmse(part.rmse),
        "rmse_max": _max(part.rmse),
        "rmse_95": _percentile(part.rmse),
        "de00_mean": float(np.mean(_known(part.de00), dtype=np.float64))
        if _known(part.de00).size
        else math.nan,
        "de00_max": _max(part.de00),
        "de00_95": _percentile(part.de00),
        "bias": part.bias,
        "band_error": part.band_error.tolist(),
        "band_bias": part.band_bias.tolist(),
        "noise": part.noise.as_dict() if part.noise else None,
    }


def _known(values: NDArray[np.floating]) -> NDArray[np.floating]:
    known: NDArray[np.floating] = values[np.isfinite(values)]
    return known


def _max(values: NDArray[np.floating]) -> float:
    return float(_known(values).max()) if _known(values).size else math.nan


def _percentile(values: NDArray[np.floating]) -> float:
    return float(np.percentile(_known(values), 95)) if _known(values).size else math.nan


@dataclass(frozen=True, eq=False)
class Comparison:
    """The result of a comparison.

    Attributes
    ----------
    title_a, title_b : str
        What is compared.
    grid : Wavelengths
        The common bands.
    rmse_bands : (float, float)
        First and last band of those that RMSE is taken over.
    scale : float
        What B is multiplied with.
    mean_a, mean_b : float
        What each side is divided by for RMSE.
    white : ndarray of shape (3,)
        XYZ of the white of CIELAB, in the scale of A.
    observer : str
    notes : tuple of str
        What was done, sentence by sentence: units, bands, components, points, scale, white, sums. Those that are a
        `Detail` are for the report only.
    points : PointComparison or None
    images : ImageComparison or None
    match : str
        How the scales were matched: "none", "luminance" or a point.
    absolute : bool
        Whether the spectra of A are radiance in W m-2 sr-1 nm-1, so that luminances are in cd/m2.
    """

    title_a: str
    title_b: str
    grid: Wavelengths
    rmse_bands: tuple[float, float]
    scale: float
    mean_a: float
    mean_b: float
    white: Array
    observer: str
    notes: tuple[str, ...]
    points: PointComparison | None
    images: ImageComparison | None
    match: str = "none"
    absolute: bool = True

    @property
    def at_a_point(self) -> bool:
        """Whether spectra are normalised as in Eq. 14: each side divided by its own mean at one point."""
        return self.match not in ("none", "luminance")

    @property
    def main(self) -> PointComparison | ImageComparison:
        """The points if there are any, else the images."""
        part = self.points if self.points is not None else self.images
        if part is None:
            raise OptionError(message("the comparison holds neither points nor images"))
        return part

    def value(self, name: str) -> float:
        """One of the numbers of `LIMITS`.

        Raises
        ------
        OptionError
            If there is no such number, or it is not known.
        """
        if name not in LIMITS:
            raise OptionError(message("there is no such number", got=repr(name), expected=", ".join(LIMITS)))
        if name == "noise_z":
            if self.main.noise is None:
                raise OptionError(
                    message(
                        "noise_z is not known",
                        got="no standard errors",
                        fix="compare renders that hold standard errors",
                    )
                )
            if self.main.noise.differs is None:
                raise OptionError(message("noise_z is not known", got=self.main.noise.doubt))
            return self.main.noise.greatest_z
        if name == "rmse_eq14" and (self.points is None or self.points.rmse_eq14 is None):
            fault, fix = (
                "rmse_eq14 needs points, and one of them to normalise at",
                "give points, and one to match at",
            )
            raise OptionError(message(fault, got=f"scales matched by {self.match!r}", fix=fix))
        results = self.main.as_dict()
        number = abs(float(results[{"de00": "de00_mean"}.get(name, name)]))
        if math.isnan(number):
            raise OptionError(message(f"{name} cannot be computed", got="; ".join(self.notes[-3:])))
        return number

    def as_dict(self) -> dict[str, Any]:
        """All numbers, for JSON."""
        return {
            "a": self.title_a,
            "b": self.title_b,
            "wavelengths": [self.grid.start, self.grid.stop, self.grid.step],
            "rmse_wavelengths": list(self.rmse_bands),
            "scale_of_b": self.scale,
            "divisor_a": self.mean_a,
            "divisor_b": self.mean_b,
            "white_xyz": self.white.tolist(),
            "observer": self.observer,
            "notes": list(self.notes),
            "points": None if self.points is None else self.points.as_dict(),
            "images": None if self.images is None else self.images.as_dict(),
        }

    def to_json(self) -> str:
        """All numbers as JSON; what is not a finite number is null."""
        return json.dumps(_finite(self.as_dict()), indent=2, ensure_ascii=False, allow_nan=False) + "\n"

    def save_json(self, path: str | os.PathLike[str]) -> None:
        """Write all numbers as JSON.

        Raises
        ------
        ImageError
            If the file cannot be written; an older one of that name is then unchanged.
        """
        from fluorspar.files.writing import replacing

        text = self.to_json()
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def text(self) -> str:
        """What was done and the main results as lines of text."""
        lines = [f"A: {self.title_a}", f"B: {self.title_b}"]
        lines += [note for note in self.notes if not isinstance(note, Detail)]
        for one, part in (("point", self.points), ("pixel", self.images)):
            if part is not None:
                lines += _lines(part, one)
        return "\n".join(lines)


def _lines(part: PointComparison | ImageComparison, one: str) -> list[str]:
    """The main results of points or pixels as lines of text."""
    results = part.as_dict()
    lines = [f"{len(part.names) if isinstance(part, PointComparison) else results['pixels_compared']} {one}s"]
    if results.get("rmse_eq14") is not None:
        lines.append(f"  RMSE, Eq. 14 {results['rmse_eq14']:.5g}   (one root over all {one}s)")
    for label, key, mean in (("mean RMSE", "rmse", "rmse"), ("CIEDE2000", "de00", "de00_mean")):
        spread = f"(95 % below {results[f'{key}_95']:.4g}, greatest {results[f'{key}_max']:.4g})"
        known = not math.isnan(results[mean])
        lines.append(
            f"  {label:<12} " + (f"{results[mean]:.5g}   {spread}" if known else "cannot be computed")
        )
    lines.append(f"  {'bias':<12} {100 * results['bias']:+.3g} %")
    if part.noise is not None:
        lines.append(f"  {'noise':<12} {noise_sentence(part.noise)}")
    return lines


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
