"""What a comparison found: numbers, spectra and maps."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.comparing.noise import NoiseVerdict, noise_sentence
from fluorspar.errors import OptionError, message
from fluorspar.spectral.wavelengths import Wavelengths

__all__ = ["LIMITS", "Comparison", "ImageComparison", "PointComparison"]

Array = NDArray[np.float64]

LIMITS = {
    "rmse": "mean RMSE of the points if there are any, else of the pixels; E{RMSE} of Eq. 14 with a point to match at",
    "rmse_max": "greatest RMSE of a point or pixel",
    "de00": "mean CIEDE2000",
    "de00_max": "greatest CIEDE2000",
    "bias": "mean of B - A over the mean of A, without its sign",
    "noise_z": "greatest deviation from what noise alone gives, in standard errors: mean difference of a block of "
    "pixels, a point or everything, and the squared difference of everything",
}
"""Numbers that `--fail-above` can limit, and what they are."""

_DETAILS = ("RMSE is taken", "XYZ: ", "Pictures: ")  # notes that are for the report only


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
    rmse, de00 : ndarray of shape (P,)
        Of each point.
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
        return _results(self) | {"points": each}


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
        "rmse": _mean(part.rmse),
        "rmse_max": _max(part.rmse),
        "rmse_95": _percentile(part.rmse),
        "de00_mean": _mean(part.de00),
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


def _mean(values: NDArray[np.floating]) -> float:
    return float(np.mean(_known(values), dtype=np.float64)) if _known(values).size else math.nan


def _max(values: NDArray[np.floating]) -> float:
    return float(_known(values).max()) if _known(values).size else math.nan


def _percentile(values: NDArray[np.floating]) -> float:
    return float(np.percentile(_known(values), 95)) if _known(values).size else math.nan


@dataclass(frozen=True, eq=False)
class Comparison:
    """All that a comparison found.

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
        What was done, sentence by sentence: bands, scale, white, sums.
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
        """Whether RMSE is that of Eq. 14: each side divided by its own mean at one point."""
        return self.match not in ("none", "luminance")

    @property
    def main(self) -> PointComparison | ImageComparison:
        """The points if there are any, else the images."""
        found = self.points if self.points is not None else self.images
        if found is None:
            raise OptionError(message("the comparison holds neither points nor images"))
        return found

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
        results = self.main.as_dict()
        number = abs(float(results[{"de00": "de00_mean"}.get(name, name)]))
        if math.isnan(number):
            raise OptionError(message(f"{name} cannot be had", got="; ".join(self.notes[-3:])))
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
        lines += [note for note in self.notes if not note.startswith(_DETAILS)]
        for title, part in (("points", self.points), ("pixels", self.images)):
            if part is None:
                continue
            found = part.as_dict()
            count = len(part.names) if isinstance(part, PointComparison) else found["pixels_compared"]
            lines.append(f"{count} {title}")
            name = "E{RMSE}" if self.at_a_point and part is self.points else "mean RMSE"
            for label, key, mean in ((name, "rmse", "rmse"), ("CIEDE2000", "de00", "de00_mean")):
                if math.isnan(found[mean]):
                    lines.append(f"  {label:<12} cannot be had")
                    continue
                below, greatest = found[f"{key}_95"], found[f"{key}_max"]
                lines.append(
                    f"  {label:<12} {found[mean]:.5g}   (95 % below {below:.4g}, greatest {greatest:.4g})"
                )
            lines.append(f"  {'bias':<12} {100 * found['bias']:+.3g} %")
            if part.noise is not None:
                lines.append(f"  {'noise':<12} {noise_sentence(part.noise)}")
        return "\n".join(lines)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
