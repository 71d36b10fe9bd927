"""A scene that is looked at while it is traced, in passes of different seeds."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Iterator
from typing import Any

from fluorspar.errors import FluorsparError, OptionError, message
from fluorspar.files.memory import available_memory
from fluorspar.job import RenderJob
from fluorspar.paths.light_paths import trace_job
from fluorspar.view.paths_source import PathsSource
from fluorspar.view.supplies import Supplies
from fluorspar.view.turns import Turns

__all__ = ["SceneSource", "pass_sizes"]

_FIRST = 4  # samples per pixel of what is seen first
_SHARE = 2  # of the memory that is free, for paths
_LONGEST = 2.0  # seconds that a chunk waits for those who look


class SceneSource(PathsSource):
    """A scene, traced in the background until it has the samples of its job.

    Parameters
    ----------
    name : str
    job : RenderJob
        Its seed is that of the first pass; the following have the next ones.
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

    def explain_nothing(self) -> None:
        """Say why there is no path."""
        if self._error is not None:
            raise OptionError(message("the scene could not be traced", where=self.name, got=self._error))
        super().explain_nothing()

    def _trace(self, turns: Turns) -> None:
        try:
            for number, spp in enumerate(pass_sizes(self.job.scene.settings.spp)):
                self._check_memory(spp)
                self._trace_pass(number, spp, turns)
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

    def _trace_pass(self, number: int, spp: int, turns: Turns) -> None:
        job = RenderJob.of(
            self.job.scene.with_settings(spp=spp),
            wavelengths=self.job.grid,
            seed=self.job.seed + number,
            excitation=self.job.excitation,
            variant=self.job.variant,
            threads=self.job.threads,
        )
        doing = "refining" if number else "tracing"

        def progress(done: int, whole: int) -> None:
            if self._stopped.is_set():
                raise _Stopped
            self._state = {"doing": doing, "done": done, "all": whole, "samples": self.samples}
            turns.give_way(_LONGEST)

        progress(0, 1)
        self.passes = (*self.passes, trace_job(job, progress))

    def _check_memory(self, spp: int) -> None:
        held = sum(paths.nbytes for paths in self.passes)
        if self.passes and held / self.samples * spp > available_memory() / _SHARE:
            raise MemoryError


class _Stopped(Exception):
    """The window is closed."""


def pass_sizes(spp: int) -> Iterator[int]:
    """Samples of each pass: a few at first, then as many as there are already, until there are all.

    Examples
    --------
    >>> list(pass_sizes(64)), list(pass_sizes(10)), list(pass_sizes(2))
    ([4, 4, 8, 16, 32], [4, 4, 2], [2])
    """
    done = 0
    while done < spp:
        yield min(max(done, _FIRST), spp - done)
        done += min(max(done, _FIRST), spp - done)
