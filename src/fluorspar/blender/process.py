"""Blender as a child that answers requests, one JSON line each; what answers inside it is `worker.py`.

Requests go to its standard input. Blender itself writes to standard output, so answers are lines with a mark of their
own there, and everything else is kept to be shown if something goes wrong. Arrays are files in a folder of both.
"""

from __future__ import annotations

import json
import os
import queue
import secrets
import shutil
import subprocess
import tempfile
import threading
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fluorspar.blender.finding import check_version, start_command
from fluorspar.errors import RendererError, message
from fluorspar.files.temporary import temporary_folder

__all__ = ["PATIENCE", "BlenderProcess"]

PATIENCE = 600.0  # seconds without a line of output; Cycles says every now and then how far it is
_SHOWN = 12  # last lines of output in a message
_WORKER = Path(__file__).with_name("worker.py")
_GRACE = 5.0  # seconds to end by itself


class BlenderProcess:
    """Blender, running functions that wait for requests. Use it in a `with` statement: it then ends with it.

    Parameters
    ----------
    inside : Path
        What runs inside Blender: a Python file, or a folder of such, with the functions in `ANSWERS`.
    blender : str or path, optional
        See `start_command`.
    patience : float
        Seconds without any sign of life after which it counts as hung.

    Attributes
    ----------
    folder : Path
        For files of both, removed at the end.
    version : tuple of int
        Of Blender.

    Raises
    ------
    RendererError
        If there is no Blender, it is too old, or it does not start.
    """

    def __init__(
        self, inside: Path, blender: str | os.PathLike[str] | None = None, patience: float = PATIENCE
    ) -> None:
        command = start_command(blender, _WORKER)
        self._mark, self._patience = f"@{secrets.token_hex(8)} ", patience
        self._files = 0
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._last: deque[str] = deque(maxlen=_SHOWN)
        self.folder = Path(tempfile.mkdtemp(prefix="blender-", dir=temporary_folder()))
        try:
            # in a session of its own: Ctrl-C reaches this process only, which ends the child
            self._child = subprocess.Popen(
                [*command, os.path.abspath(inside), self._mark.strip()],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except BaseException:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            self.version: tuple[int, ...] = tuple(self._answer()["version"])
            check_version(self.version[:2], command[0])
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> BlenderProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def ask(self, do: str, **request: Any) -> dict[str, Any]:
        """Send a request and wait for its answer.

        Raises
        ------
        RendererError
            If Blender ends, hangs, or its script fails.
        """
        assert self._child.stdin is not None
        with suppress(OSError):  # it has ended, and its last lines say why
            self._child.stdin.write(json.dumps({"do": do, **request}).encode() + b"\n")
            self._child.stdin.flush()
        return self._answer()

    def put(self, array: ArrayLike, dtype: str) -> str:
        """Write an array as bytes into the folder, to be read once; returns the file name."""
        name = self.name(".bin")
        np.ascontiguousarray(array, dtype=dtype).tofile(name)
        return name

    def name(self, suffix: str) -> str:
        """A new file name in the folder."""
        self._files += 1
        return str(self.folder / f"{self._files}{suffix}")

    def close(self) -> None:
        """End it, and remove the folder."""
        assert self._child.stdin is not None
        with suppress(OSError):
            self._child.stdin.close()
        self._child.terminate()
        try:
            self._child.wait(_GRACE)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        finally:
            self._reader.join()
            shutil.rmtree(self.folder, ignore_errors=True)

    def _read(self) -> None:
        assert self._child.stdout is not None
        with self._child.stdout as output:
            for line in output:
                self._lines.put(line.decode(errors="replace").rstrip())
        self._lines.put(None)

    def _answer(self) -> dict[str, Any]:
        while True:
            try:
                line = self._lines.get(timeout=self._patience)
            except queue.Empty:
                self.close()
                fault = f"Blender has shown no sign of life for {self._patience:g} s"
                raise RendererError(self._told(fault, "it was ended")) from None
            if line is None:
                self._lines.put(None)  # for whoever asks again
                raise RendererError(self._told("Blender ended", f"exit code {self._child.wait()}"))
            if not line.startswith(self._mark):
                if line:
                    self._last.append(line)
                continue
            answer: dict[str, Any] = json.loads(line.removeprefix(self._mark))
            if "error" in answer:
                self._last.extend(answer["error"].splitlines())
                raise RendererError(
                    self._told("the script inside Blender failed", answer["error"].splitlines()[-1])
                )
            return answer

    def _told(self, fault: str, got: str) -> str:
        last = "\n    ".join(self._last) or "(none)"
        return f"{message(fault, got=got)}\n  its last lines:\n    {last}"
