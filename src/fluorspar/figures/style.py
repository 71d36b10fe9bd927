"""How figures look, and how they become files."""

from __future__ import annotations

import io
import os
from typing import TYPE_CHECKING, Any

from fluorspar.errors import OptionError, message
from fluorspar.files.writing import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "COLOUR_A",
    "COLOUR_B",
    "FORMATS",
    "blank",
    "encode",
    "put_title",
    "short",
    "styled",
    "write_figure",
]

FORMATS = (".png", ".pdf", ".svg")
"""Suffixes of files that a figure is written to."""

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
    "pdf.fonttype": 42,  # publishers refuse fonts of type 3
    "svg.hashsalt": "fluorspar",  # so that equal figures are equal files
}
# without date and version, for the same reason
_METADATA = {
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None, "Producer": None},
    ".svg": {"Date": None},
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


def encode(figure: Figure, suffix: str = ".png", dpi: int = 200) -> bytes:
    """Encode a figure as one of `FORMATS`.

    Examples
    --------
    >>> encode(blank(1, 1))[1:4], encode(blank(1, 1), ".pdf")[1:4]
    (b'PNG', b'PDF')
    """
    from matplotlib import rc_context

    stream = io.BytesIO()
    with rc_context(_STYLE):
        figure.savefig(stream, format=suffix[1:], dpi=dpi, metadata=_METADATA[suffix])
    return stream.getvalue()


def write_figure(figure: Figure, path: str | os.PathLike[str], dpi: int = 200) -> None:
    """Write a figure in the format that the suffix says, one of `FORMATS`.

    Raises
    ------
    OptionError
        If it says none of them.
    ImageError
        If the file cannot be written; an older one of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> write_figure(blank(1, 1), os.path.join(tempfile.mkdtemp(), "empty.png"))
    """
    suffix = os.path.splitext(path)[1].lower()
    if suffix not in FORMATS:
        fault, got = "a figure cannot be written as this kind of file", suffix or "no suffix"
        raise OptionError(message(fault, where=path, got=got, expected=", ".join(FORMATS)))
    content = encode(figure, suffix, dpi)
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
