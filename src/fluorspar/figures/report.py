"""The report of a comparison: one HTML file that needs no network and runs no script."""

from __future__ import annotations

import base64
import html
import math
import os
from collections.abc import Sequence

from fluorspar.comparing.comparison import Comparison, ImageComparison, PointComparison
from fluorspar.comparing.noise_text import noise_sentence, share_text, verdict_text
from fluorspar.figures.spectra import bands_figure, encode, maps_figure, points_figure, signed_picture
from fluorspar.files.writing import replacing
from fluorspar.image.display.picture import png_bytes
from fluorspar.version import __version__

__all__ = ["report", "write_report"]

_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1b1b1f; background: #fff; max-width: 72rem; margin: 2rem auto;
  padding: 0 1.5rem; }
h1 { font-size: 1.5rem; margin: 0 0 .25rem; } h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
.sides { color: #555; margin: 0 0 1.2rem; overflow-wrap: anywhere; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .8rem; text-align: right; border-bottom: 1px solid #e2e2e6; vertical-align: top; }
th:first-child, td:first-child { text-align: left; } thead th { border-bottom: 2px solid #888; }
.wide { overflow-x: auto; } .pair { display: flex; gap: 1rem; flex-wrap: wrap; }
.pair figure { flex: 1 1 16rem; } figure { margin: 0 0 1rem; } figcaption { color: #555; font-size: .85rem; }
img { max-width: 100%; height: auto; } .pair img { width: 100%; image-rendering: auto; }
ul { padding-left: 1.2rem; } footer { margin: 3rem 0 1rem; color: #777; font-size: .8rem; }
@media print { body { max-width: none; margin: 0; } }
"""


def write_report(comparison: Comparison, path: str | os.PathLike[str]) -> None:
    """Write the report.

    Parameters
    ----------
    comparison : Comparison
    path : str or path-like
        The HTML file to be written or replaced.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.
    """
    text = report(comparison)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def report(comparison: Comparison) -> str:
    """Compose the report: results, pictures side by side, maps, spectra at the points, tables, what was done.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    str
        HTML whose content security policy allows images in it and inline style, and nothing else.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar.spectral.bands import Bands
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.measuring.point_spectra import PointSpectra
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> spectra = PointSpectra(("1", "2"), Bands(Wavelengths(400, 700, 10)), np.ones((2, 31)))
    >>> "<script" in report(compare(spectra, spectra))
    False
    """
    a, b = html.escape(comparison.title_a), html.escape(comparison.title_b)
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>Comparison of {a} and {b}</title><style>{_STYLE}</style></head><body>",
        "<h1>Comparison of spectra</h1>",
        f'<p class="sides">A, the reference: <b>{a}</b><br>B: <b>{b}</b></p>',
        "<h2>Results</h2>",
        _results(comparison),
    ]
    if comparison.images is not None:
        parts += _image_parts(comparison, comparison.images)
    if comparison.points is not None:
        parts += _point_parts(comparison, comparison.points)
    parts += [
        "<h2>Error of each band</h2>",
        _img(encode(bands_figure(comparison)), "relative error and bias of each band"),
    ]
    parts += [
        "<h2>What was done</h2><ul>",
        *(f"<li>{html.escape(note)}</li>" for note in comparison.notes),
        "</ul>",
    ]
    parts.append(f"<footer>Written by Fluorspar {html.escape(__version__)}.</footer></body></html>")
    return "\n".join(parts) + "\n"


def _results(comparison: Comparison) -> str:
    columns = [("points", comparison.points), ("pixels", comparison.images)]
    present = [(title, part, part.as_dict()) for title, part in columns if part is not None]
    labels = [
        ("RMSE, mean of that of each", "rmse", 1.0, ""),
        ("RMSE, 95 % are below", "rmse_95", 1.0, ""),
        ("RMSE, greatest", "rmse_max", 1.0, ""),
        ("CIEDE2000, mean", "de00_mean", 1.0, ""),
        ("CIEDE2000, 95 % are below", "de00_95", 1.0, ""),
        ("CIEDE2000, greatest", "de00_max", 1.0, ""),
        ("bias, mean of B − A over the mean of A", "bias", 100.0, " %"),
    ]
    rows = [
        [label, *(_number(factor * results[key], unit) for _, _, results in present)]
        for label, key, factor, unit in labels
    ]
    if comparison.at_a_point:
        of_all = [results.get("rmse_eq14") for _, _, results in present]
        cells = ["of points only" if value is None else _number(value) for value in of_all]
        rows.insert(0, ["RMSE, one root over all points (Eq. 14)", *cells])
    for label, text in (("noise explains, of the squared difference", share_text), ("verdict", verdict_text)):
        cells = ["no standard errors" if part.noise is None else text(part.noise) for _, part, _ in present]
        rows.append([label, *cells])
    table = _table(["", *(title for title, _, _ in present)], rows)
    sentences = [
        f"<p>{title.capitalize()}: {html.escape(noise_sentence(part.noise, subject='noise '))}. "
        f"Standard errors of {part.noise.known_of}.</p>"
        for title, part, _ in present
        if part.noise is not None
    ]
    return table + "".join(sentences)


def _image_parts(comparison: Comparison, images: ImageComparison) -> list[str]:
    signed, factor = signed_picture(images)
    shown = (
        (images.rgb_a, f"A: {comparison.title_a}"),
        (images.rgb_b, f"B: {comparison.title_b}"),
        (signed, f"grey + {factor:g} (B − A), displayed R, G, B"),
    )
    white = f"{1 / images.exposure:.4g} cd/m²" if comparison.absolute else "the same radiance"
    pictures = "".join(
        f"<figure>{_img(png_bytes(rgb), caption)}<figcaption>{html.escape(caption)}</figcaption></figure>"
        for rgb, caption in shown
    )
    return [
        f'<h2>Pictures, both with {white} as white</h2><div class="pair">{pictures}</div>',
        "<h2>Maps</h2>",
        _img(encode(maps_figure(comparison)), "maps of CIEDE2000, RMSE and signed differences"),
        "<p>Colour bars end at the 98th percentile.</p>",
    ]


def _point_parts(comparison: Comparison, points: PointComparison) -> list[str]:
    rows = [
        [name, f"{r:.4g}", f"{d:.4g}", *(f"{value:.2f}" for value in (*a, *b))]
        for name, r, d, a, b in zip(
            points.names, points.rmse, points.de00, points.lab_a, points.lab_b, strict=True
        )
    ]
    sides = [f"{side} {axis}" for side in "AB" for axis in ("L*", "a*", "b*")]
    return [
        "<h2>Spectra at the points</h2>",
        _img(encode(points_figure(comparison)), "spectra of A and B at each point"),
        "<p>Bands around the lines are two standard errors to each side.</p>"
        if points.error_a is not None or points.error_b is not None
        else "",
        '<div class="wide">' + _table(["point", "RMSE", "CIEDE2000", *sides], rows) + "</div>",
    ]


def _number(value: float, unit: str = "") -> str:
    return f"{value:.4g}{unit}" if math.isfinite(value) else "cannot be computed"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _img(png: bytes, alt: str) -> str:
    return (
        f'<img alt="{html.escape(alt)}" src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'
    )
