"""The window in a notebook: a frame, and a server in the background that lasts as long as Python does."""

from __future__ import annotations

import atexit
import html
from typing import TYPE_CHECKING, Any

from fluorspar.extras import check_extra
from fluorspar.image.spectral_image import SpectralImage

if TYPE_CHECKING:
    from fluorspar.paths.light_paths import LightPaths

__all__ = ["Frame", "frame"]


class Frame:
    """What a notebook shows: the window on an image or on light paths.

    Attributes
    ----------
    address : str
        For a browser on this computer.
    """

    def __init__(self, server: Any, height: int) -> None:
        self._server, self._height = server, height
        self.address: str = server.address
        atexit.register(self.close)

    def close(self) -> None:
        """Stop the server, and free its port."""
        atexit.unregister(self.close)
        self._server.close()

    def __repr__(self) -> str:
        return f"<the window at {self.address}; close() ends it>"

    def _repr_html_(self) -> str:
        address = html.escape(self.address)
        return (
            f"<iframe src='{address}' style='width:100%;height:{self._height}px;border:0' "
            f"title='Fluorspar'></iframe><p><a href='{address}' target='_blank' rel='noopener'>in a window</a></p>"
        )


def frame(shown: SpectralImage | LightPaths, *, height: int = 720, port: int = 0) -> Frame:
    """Open the window on an image or light paths.

    Parameters
    ----------
    shown : SpectralImage or LightPaths
    height : int
        Of the frame, in pixels.
    port : int
        0: any that is free.

    Raises
    ------
    FluorsparError
        If the server's packages are not installed.
    OptionError
        If it cannot listen there.

    Examples
    --------
    >>> import numpy as np
    >>> from fluorspar import Wavelengths
    >>> window = frame(SpectralImage.from_arrays(np.ones((7, 4, 6, 69)), Wavelengths()))
    >>> "iframe" in window._repr_html_()
    True
    >>> window.close()
    """
    check_extra("view")
    from fluorspar.view.paths_source import PathsSource
    from fluorspar.view.server import Server
    from fluorspar.view.sources import ImageSource, Source
    from fluorspar.view.supplies import Supplies
    from fluorspar.view.workspace import Workspace

    supplies = Supplies()
    source: Source
    if isinstance(shown, SpectralImage):
        source = ImageSource(str(shown.attrs.get("scene", "an image")), shown)
    else:
        source = PathsSource(shown.job.scene.name, shown.job, supplies, shown)
    return Frame(Server(Workspace([source], supplies), port=port, framed=True), height)
