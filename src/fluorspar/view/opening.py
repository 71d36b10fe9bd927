"""What the names given to `fluorspar view` mean: images, light paths, scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fluorspar.files.names import text_of
from fluorspar.image.formats.registry import SUFFIXES
from fluorspar.image.opening import open as open_image
from fluorspar.job import RenderJob
from fluorspar.paths.light_paths import load_paths
from fluorspar.scene.loading import load_scene
from fluorspar.view.paths_source import PathsSource
from fluorspar.view.scene_source import SceneSource
from fluorspar.view.sources import ImageSource, Source
from fluorspar.view.supplies import Supplies

__all__ = ["PATHS", "opened"]

PATHS = ".paths"
"""Suffix of files of light paths."""


def opened(
    names: Sequence[str], supplies: Supplies, parameters: Mapping[str, str] | None = None, **options: Any
) -> list[Source]:
    """Open images and light paths, and load scenes.

    Parameters
    ----------
    names : sequence of str
        Files; or scenes, by file or name.
    supplies : Supplies
    parameters : mapping of str to str, optional
        Values of the `$key` substitutions of scenes.
    **options
        Of scenes, as in `fluorspar.trace`: `spp`, `size`, `wavelengths`, `camera`, `lights`, ...

    Raises
    ------
    FluorsparError
        If one of them cannot be read.

    Examples
    --------
    >>> opened(["cornell-box"], Supplies(), spp=4)[0].kind
    'scene'
    """
    return [_opened(name, supplies, parameters or {}, options) for name in names]


def _opened(
    name: str, supplies: Supplies, parameters: Mapping[str, str], options: Mapping[str, Any]
) -> Source:
    suffix = Path(name).suffix.lower()
    if suffix in SUFFIXES:
        return ImageSource(text_of(name), open_image(name))
    if suffix == PATHS:
        paths = load_paths(name)
        return PathsSource(text_of(name), paths.job, supplies, paths)
    scene = load_scene(name, parameters=parameters, library=supplies.folders)
    return SceneSource(text_of(name), RenderJob.of(scene, **options), supplies)
