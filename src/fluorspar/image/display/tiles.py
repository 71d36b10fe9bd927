"""A sheet of labelled pictures of one size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont

__all__ = ["Tile", "draw_tiles"]

_WIDTH = (320, 512)  # least and greatest width of a picture on the sheet
_PAPER, _INK, _FAINT = (24, 24, 27), (244, 244, 245), (161, 161, 170)


@dataclass(frozen=True)
class Tile:
    """A picture with two lines below it.

    Parameters
    ----------
    name : str
        What a file of it is called.
    label, note : str
        What it is, and a remark in smaller letters.
    picture : ndarray of shape (y, x, 3), uint8
    """

    name: str
    label: str
    note: str
    picture: NDArray[np.uint8]


def draw_tiles(tiles: Sequence[Tile], title: str, columns: int) -> NDArray[np.uint8]:
    """Draw pictures of one size in rows; lines that are too long end with an ellipsis.

    Returns
    -------
    ndarray of shape (y, x, 3)
        uint8.

    Examples
    --------
    >>> tile = Tile("red", "red", "bright", np.zeros((4, 6, 3), np.uint8))
    >>> draw_tiles([tile, tile], "two", 2).ndim
    3
    """
    from matplotlib import get_data_path
    from PIL import Image, ImageDraw, ImageFont

    height, width, _ = tiles[0].picture.shape
    least, greatest = _WIDTH
    zoom = greatest / width if width > greatest else max(1, round(least / width))
    tile = (round(width * zoom), max(1, round(height * zoom)))
    unit = max(tile[0] // 24, 14)  # the size of the letters; everything else is a multiple of it
    gap, caption, above = unit * 3 // 2, unit * 7 // 2, unit * 4
    rows = -(-len(tiles) // columns)
    canvas = Image.new(
        "RGB",
        (gap + columns * (tile[0] + gap), above + rows * (tile[1] + caption + gap)),
        _PAPER,
    )
    draw = ImageDraw.Draw(canvas)
    typeface = Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"  # Pillow's own has no ×
    large, small = ImageFont.truetype(typeface, unit), ImageFont.truetype(typeface, unit * 4 // 5)
    fitting = _fitting(title, large, canvas.width - 2 * gap)
    draw.text((gap, above // 2), fitting, _INK, large, anchor="lm")
    for number, shown in enumerate(tiles):
        row, column = divmod(number, columns)
        left, top = gap + column * (tile[0] + gap), above + row * (tile[1] + caption + gap)
        smooth = Image.Resampling.LANCZOS if zoom < 1 else Image.Resampling.NEAREST
        canvas.paste(Image.fromarray(shown.picture).resize(tile, smooth), (left, top))
        below, room = top + tile[1], tile[0] + gap // 2
        draw.text((left, below + unit), _fitting(shown.label, large, room), _INK, large, anchor="lm")
        draw.text(
            (left, below + unit * 12 // 5), _fitting(shown.note, small, room), _FAINT, small, anchor="lm"
        )
    return np.asarray(canvas)


def _fitting(text: str, font: FreeTypeFont, room: int) -> str:
    """As much of a text as there is room for."""
    if font.getlength(text) <= room:
        return text
    while text and font.getlength(f"{text}…") > room:
        text = text[:-1]
    return f"{text}…"
