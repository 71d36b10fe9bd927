"""What of a Blender scene has no counterpart, and what is done instead: nothing is left out without a word."""

from __future__ import annotations

import warnings

from fluorspar.errors import ApproximationWarning

__all__ = ["Listing"]


class Listing:
    """Sentences, each once, in the order in which they came up.

    Examples
    --------
    >>> listing = Listing()
    >>> listing.add("light 'sun'", "is left out")
    >>> listing.add("light 'sun'", "is left out")
    >>> listing.sentences
    ["light 'sun' is left out"]
    """

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def add(self, where: str, what: str) -> None:
        """Note what is done with something of the scene."""
        sentence = f"{where} {what}"
        if sentence not in self.sentences:
            self.sentences.append(sentence)

    def warn(self) -> None:
        """Say all of it.

        Warns
        -----
        ApproximationWarning
        """
        for sentence in self.sentences:
            warnings.warn(sentence, ApproximationWarning, stacklevel=3)
