"""A scene that is looked at while it is traced, with few samples at first."""

from __future__ import annotations

import threading
import traceback
from dataclasses import replace
from typing import Any

from fluorspar.errors import FluorsparError, OptionError, message
from fluorspar.files.memory import available_memory
from fluorspar.job import RenderJob
from fluorspar.paths.trace import trace_job
from fluorspar.view.paths_source import PathsSource
from fluorspar.view.supplies import Supplies
from fluorspar.view.turns import Turns

__all__ = ["SceneSource", "level_sizes"]

_FIRST = 4  # samples per pixel of what is seen first
_MORE = 4  # times as many at each further level: half the noise
_SHARE = 2  # of the memory that is free, for paths
_LIKELY = 25  # bytes of a sample, before any is traced
_LONGEST = 30.0  # seconds that a chunk waits for those who look: the first picture is compiled


class SceneSource(PathsSource):
    """A scene, traced in the background until it has the samples of its job: the image is then that of `render`.

    Parameters
    ----------
    name : str
    job : RenderJob
    supplies : Supplies
    """

    kind = "scene"

    def __init__(self, name: str, job: RenderJob, supplies: Supplies) -> None:
        super().__init__(name, job, supplies)
        self._state: dict[str, Any] | None = {"doing": "tracing", "done": 0, "all": 1, "samples": 0}
        self._error: str | None = None
        self._stopped = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, turns: Turns) -> None:
        """Begin to trace."""
        self._thread = threading.Thread(target=self._trace, args=(turns,), name=f"tracing {self.name}")
        self._thread.start()

    def stop(self) -> None:
        """Stop tracing, and wait until the chunk that is being traced is done."""
        self._stopped.set()
        if self._thread is not None:
            self._thread.join()

    def progress(self) -> dict[str, Any]:
        """How far tracing is, or why it ended too early."""
        return {"generation": self.generation, "progress": self._state, "error": self._error}

    def why_nothing(self) -> FluorsparError:
        """Why there is no path."""
        if self._error is None:
            return super().why_nothing()
        return OptionError(message("the scene could not be traced", where=self.name, got=self._error))

    def _trace(self, turns: Turns) -> None:
        try:
            for spp in level_sizes(self.job.scene.settings.spp):
                self._check_memory(spp)
                self._trace_level(spp, turns)
        except _Stopped:
            pass
        except FluorsparError as err:
            self._error = str(err)
        except MemoryError:
            self._error = "the memory does not suffice for more light paths"
        except Exception as err:  # a fault of ours is to be seen, too
            self._error = "".join(traceback.format_exception_only(err)).strip()
        finally:
            self._state = None

    def _trace_level(self, spp: int, turns: Turns) -> None:
        doing = "tracing" if self.paths is None else "refining"

        def progress(done: int, whole: int) -> None:
            if self._stopped.is_set():
                raise _Stopped
            self._state = {"doing": doing, "done": done, "all": whole, "samples": self.samples}
            turns.give_way(_LONGEST)

        progress(0, 1)
        job = replace(self.job, scene=self.job.scene.with_settings(spp=spp))
        self.paths = trace_job(job, progress)
        self.generation += 1  # afterwards: an image is never taken for a better one than it is

    def _check_memory(self, spp: int) -> None:
        settings = self.job.scene.settings
        known = self.paths.nbytes / self.samples if self.paths else _LIKELY * settings.width * settings.height
        if known * spp > available_memory() / _SHARE:
            fix = "fewer samples (--spp), a smaller image (--size), or light paths in a file ('fluorspar trace')"
            got = f"{self.samples} of {self.job.scene.settings.spp} samples are traced"
            raise OptionError(
                message("the light paths of more samples do not fit into memory", got=got, fix=fix)
            )


class _Stopped(Exception):
    """The window is closed."""


def level_sizes(spp: int) -> list[int]:
    """Samples of each level: a few at first, then four times as many, at last all.

    Examples
    --------
    >>> level_sizes(64), level_sizes(100), level_sizes(2)
    ([4, 16, 64], [4, 16, 100], [2])
    """
    sizes, size = [], _FIRST
    while 2 * size <= spp:
        sizes.append(size)
        size *= _MORE
    return [size for size in sizes if size < spp] + [spp]
