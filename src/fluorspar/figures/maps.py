"""Figures of two images: pictures, their signed difference, and maps with colour bars."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fluorspar.comparing.comparison import Comparison, ImageComparison
from fluorspar.figures.style import COLOUR_A, blank, put_title, short, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["components_figure", "images_figure", "maps_figure", "signed_picture"]

_MAP_PIXELS = 1024
_LONGEST = 3.0  # ratio of the sides of a panel: beyond it pixels are drawn as rectangles
_TOP = 98  # percentile at which colour bars end: a lamp may well be one per cent of the pixels


def signed_picture(images: ImageComparison) -> tuple[NDArray[np.uint8], float]:
    """Show the signed difference of displayed R, G, B around grey, as in the paper's Figure 29.

    Parameters
    ----------
    images : ImageComparison

    Returns
    -------
    picture : ndarray of shape (Y, X, 3)
        uint8: grey + factor (B - A).
    factor : float
        A power of two, such that all but the greatest differences fit.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> picture, factor = signed_picture(compare(image, image).images)
    >>> picture[0, 0]
    array([128, 128, 128], dtype=uint8)
    """
    factor = _gain(images.rgb_difference) / 2
    signed = np.clip(0.5 + factor * images.rgb_difference, 0, 1)
    return np.asarray(255 * signed + 0.5, np.uint8), factor


def maps_figure(comparison: Comparison) -> Figure:
    """Draw maps with colour bars: CIEDE2000, RMSE, and the signed differences of displayed R, G and B.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> len(maps_figure(compare(image, image)).axes)  # six panels; colour bars are parts of them
    6
    """
    return styled(_maps, _images(comparison))


def _maps(images: ImageComparison) -> Figure:
    figure = _sized(images, 3, rows=2, bars=True)
    panels = figure.subplots(2, 3).ravel()
    limit = max(float(np.percentile(np.abs(images.rgb_difference), _TOP)), 1 / 255)
    _magnitude(figure, panels[0], images.de00, "CIEDE2000")
    _magnitude(figure, panels[1], images.rmse, "RMSE")
    for panel, index, name in zip(panels[3:], range(3), "RGB", strict=True):
        drawn = _picture(panel, images.rgb_difference[..., index], cmap="RdBu_r", vmin=-limit, vmax=limit)
        _bar(figure, panel, drawn, "both")
        put_title(panel, f"displayed {name}, B − A (0 to 1)")
    for panel in panels:
        panel.set_axis_off()
    panels[2].set_axis_on()
    _histogram(panels[2], images)
    return figure


def _histogram(panel: Axes, images: ImageComparison) -> None:
    values = images.de00[np.isfinite(images.de00)]
    put_title(panel, "pixels below, %")
    panel.set_box_aspect(_shape(images.rmse))
    if not values.size:
        panel.text(
            0.5, 0.5, "CIEDE2000 cannot be computed", ha="center", va="center", transform=panel.transAxes
        )
        panel.set(xticks=[], yticks=[])
        return
    share = np.linspace(0, 100, min(len(values), 1000))
    panel.plot(np.percentile(values, share), share, color=COLOUR_A)
    panel.set(xlabel="CIEDE2000", ylim=(0, 100))
    panel.set_xlim(0, max(float(np.percentile(values, _TOP)), 1e-6))
    panel.grid(linewidth=0.3)


def images_figure(comparison: Comparison) -> Figure:
    """Draw both pictures, their signed difference, and maps of CIEDE2000 and RMSE.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> len(images_figure(compare(image, image)).axes)  # six panels; colour bars are parts of them
    6
    """
    return styled(_overview, _images(comparison), comparison)


def _overview(images: ImageComparison, comparison: Comparison) -> Figure:
    figure = _sized(images, 3, rows=2, bars=True)
    panels = figure.subplots(2, 3).ravel()
    _side_by_side(panels[:3], comparison)
    _magnitude(figure, panels[3], images.de00, "CIEDE2000")
    _magnitude(figure, panels[4], images.rmse, "RMSE")
    for panel in panels[:5]:
        panel.set_axis_off()
    _histogram(panels[5], images)
    return figure


def components_figure(comparisons: Mapping[str, Comparison]) -> Figure:
    """Draw a row for each component of two images: both pictures, and their signed difference.

    Parameters
    ----------
    comparisons : mapping of str to Comparison
        By the title of the row, such as those of `compare(a, b, component=name)`. Each row has its own exposure.

    Examples
    --------
    >>> from fluorspar.image.spectral_image import SpectralImage
    >>> from fluorspar.comparing.compare import compare
    >>> from fluorspar.spectral.wavelengths import Wavelengths
    >>> image = SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths())
    >>> names = ("direct_reflection", "direct_luminescence")
    >>> len(components_figure({name: compare(image, image, component=name) for name in names}).axes)
    6
    """
    return styled(_components, comparisons)


def _components(comparisons: Mapping[str, Comparison]) -> Figure:
    figure = _sized(_images(next(iter(comparisons.values()))), 3, rows=len(comparisons))
    panels = figure.subplots(len(comparisons), 3, squeeze=False)
    for row, (name, comparison) in zip(panels, comparisons.items(), strict=True):
        _side_by_side(row, comparison, f"{name}   ")
        for panel in row:
            panel.set_axis_off()
    return figure


def _side_by_side(panels: Iterable[Axes], comparison: Comparison, name: str = "") -> None:
    """Both pictures, and their signed difference."""
    images = _images(comparison)
    signed, factor = signed_picture(images)
    shown = (
        (images.rgb_a, f"{name}A: {short(comparison.title_a)}"),
        (images.rgb_b, f"B: {short(comparison.title_b)}"),
        (signed, f"grey + {factor:g} (B − A)"),
    )
    for panel, (picture, title) in zip(panels, shown, strict=True):
        _picture(panel, picture)
        put_title(panel, title)


def _magnitude(figure: Figure, panel: Axes, values: NDArray[np.float32], title: str) -> None:
    """A map from 0 on; the most different pixels, such as those of a lamp, must not take all of its colours."""
    known = values[np.isfinite(values)]
    greatest = float(known.max()) if known.size else 0.0
    high = (float(np.percentile(known, _TOP)) if known.size else 0.0) or greatest or 1e-6
    drawn = _picture(panel, values, cmap="magma", vmin=0, vmax=high)
    _bar(figure, panel, drawn, "max" if greatest > high else "neither")
    put_title(panel, title)


def _picture(panel: Axes, values: NDArray[Any], **kwargs: Any) -> Any:
    """Pixels in a panel of bounded shape."""
    drawn = panel.imshow(_thin(values), interpolation="nearest", aspect="auto", **kwargs)
    panel.set_box_aspect(_shape(values))
    return drawn


def _bar(figure: Figure, panel: Axes, drawn: Any, extend: str) -> None:
    """A colour bar beside a panel, which stays in line with panels that have none."""
    figure.colorbar(drawn, cax=panel.inset_axes((1.03, 0.05, 0.04, 0.9)), extend=extend)


def _shape(values: NDArray[Any]) -> float:
    """Height over width of a panel: that of the image, unless the figure would become a thread."""
    return float(np.clip(values.shape[0] / values.shape[1], 1 / _LONGEST, _LONGEST))


def _images(comparison: Comparison) -> ImageComparison:
    assert comparison.images is not None
    return comparison.images


def _sized(images: ImageComparison, columns: int, rows: int = 1, bars: bool = False) -> Figure:
    panel = 7.2 / columns * (0.82 if bars and columns == 3 else 0.96)
    return blank(7.2, rows * (panel * _shape(images.rmse) + 0.32) + (0.35 if bars and rows == 1 else 0.0))


def _gain(difference: NDArray[np.float32]) -> float:
    """A power of two that makes all but the greatest differences visible."""
    high = float(np.percentile(np.abs(difference), 99.5))
    return float(2.0 ** np.clip(np.floor(np.log2(1 / high)), 0, 7)) if high > 0 else 1.0


def _thin(values: NDArray[Any]) -> NDArray[Any]:
    """Every n-th pixel of what is larger than a figure can show."""
    every = -(-max(values.shape[:2]) // _MAP_PIXELS)
    return values[::every, ::every]
