"""How figures look, and how they become files."""

from __future__ import annotations

import io
import os
from typing import TYPE_CHECKING, Any

from fluorspar.files.writing import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["COLOUR_A", "COLOUR_B", "blank", "encode", "put_title", "short", "styled", "write_figure"]

# Okabe and Ito's colours, which most colour-blind readers can tell apart
COLOUR_A, COLOUR_B = "#0072B2", "#D55E00"
_STYLE = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "figure.dpi": 100.0,
    "text.parse_math": False,  # names may hold dollar signs
}


def blank(width: float, height: float) -> Figure:
    """An empty figure of this size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def styled(draw: Any, *args: Any) -> Figure:
    """What a function draws in the style of all figures."""
    from matplotlib import rc_context

    with rc_context(_STYLE):
        figure: Figure = draw(*args)
    return figure


def encode(figure: Figure, dpi: int = 200) -> bytes:
    """Encode a figure as PNG.

    Examples
    --------
    >>> encode(blank(1, 1))[1:4]
    b'PNG'
    """
    from matplotlib import rc_context

    stream = io.BytesIO()
    with rc_context(_STYLE):
        # without the version of matplotlib, so that equal figures are equal files
        figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()


def write_figure(figure: Figure, path: str | os.PathLike[str], dpi: int = 200) -> None:
    """Write a figure as PNG.

    Raises
    ------
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> write_figure(blank(1, 1), os.path.join(tempfile.mkdtemp(), "empty.png"))
    """
    content = encode(figure, dpi)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def put_title(panel: Axes, text: str, **kwargs: Any) -> None:
    """A title as it is: dollar signs in names of users are no formulas."""
    panel.set_title(text, loc="left", parse_math=False, **kwargs)


def short(title: str) -> str:
    """The end of a long name, without its folder.

    Examples
    --------
    >>> short("renders/box.nc")
    'box.nc'
    """
    name = os.path.basename(title) or title
    return name if len(name) <= 28 else f"…{name[-27:]}"
