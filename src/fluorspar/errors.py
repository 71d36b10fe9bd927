"""What Fluorspar raises and warns: one base class each, a handful of subclasses.

Every message says what went wrong, where, what was found, what was expected and how to fix it.
"""

from __future__ import annotations

__all__ = [
    "ApproximationWarning",
    "ClusterError",
    "ExtrapolationWarning",
    "FluorsparError",
    "FluorsparWarning",
    "ImageError",
    "MaterialError",
    "OptionError",
    "PathsError",
    "PhotonYieldWarning",
    "RendererError",
    "SceneError",
    "SceneNotice",
    "SpectrumError",
    "message",
]


def message(
    what: str, *, where: object = None, got: object = None, expected: object = None, fix: str = ""
) -> str:
    """Compose an error message: what, where, got, expected, how to fix.

    Parameters
    ----------
    what : str
        The fault in one sentence, without a full stop.
    where : object
        File, line, object or option in which it was found.
    got, expected : object
        What was found and what would have been right.
    fix : str
        What the user can do about it.

    Returns
    -------
    str
        One line per part that was given.

    Examples
    --------
    >>> print(message("a reflectance is negative", where="paint.csv, line 3", got=-0.2, expected=">= 0"))
    a reflectance is negative
      where:    paint.csv, line 3
      got:      -0.2
      expected: >= 0
    """
    parts = [what]
    for label, part in (("where", where), ("got", got), ("expected", expected), ("fix", fix or None)):
        if part is not None:
            parts.append(f"  {label + ':':<9} {part}")
    return "\n".join(parts)


class FluorsparError(Exception):
    """Base class of all errors a user can cause or mend; the command line turns it into exit code 2."""


class SpectrumError(FluorsparError):
    """A spectrum or a wavelength grid is not usable."""


class MaterialError(FluorsparError):
    """A material or a Donaldson matrix is unknown, malformed or physically impossible."""


class SceneError(FluorsparError):
    """A scene cannot be read, or holds something the method cannot handle."""


class ImageError(FluorsparError):
    """A spectral image file cannot be read or written."""


class PathsError(FluorsparError):
    """A file of light paths cannot be read."""


class OptionError(FluorsparError):
    """An option has a value outside its range or contradicts another."""


class RendererError(FluorsparError):
    """The renderer, LLVM or CUDA is missing or does not work."""


class ClusterError(FluorsparError):
    """A scheduler or its workers are lost, do not fit, or fail."""


class FluorsparWarning(UserWarning):
    """Base class of all warnings."""


class ExtrapolationWarning(FluorsparWarning):
    """A spectrum is used outside its data; the message says what is assumed there."""


class PhotonYieldWarning(FluorsparWarning):
    """A material gives out slightly more photons than it takes in (measurement error)."""


class ApproximationWarning(FluorsparWarning):
    """Part of a scene is rendered as something simpler than it is."""


class SceneNotice(FluorsparWarning):
    """A setting of the scene was replaced or ignored."""
