"""The one place that imports colour-science, for its tables."""

from __future__ import annotations

from types import ModuleType

import numpy as np

__all__ = ["colour_science"]


def colour_science() -> ModuleType:
    """Import colour-science late, since that takes 1.5 s, and without its change to how NumPy prints arrays.

    Examples
    --------
    >>> "D65" in colour_science().SDS_ILLUMINANTS
    True
    """
    with np.printoptions():
        import colour
    return colour  # type: ignore[no-any-return]
