"""Runs inside Blender, not in Fluorspar, and answers requests: see `fluorspar.blender.process`.

Its last arguments are a Python file, or a folder of such, and a mark. Requests are JSON lines on standard input, for
the functions in `ANSWERS` of that file or folder; answers are lines of standard output that begin with the mark.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import traceback
from collections.abc import Callable
from typing import Any

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["serve"]


def serve(answers: dict[str, Callable[..., dict[str, Any]]], mark: str) -> None:
    """Answer requests until there are no more."""

    def answer(said: dict[str, Any]) -> None:
        sys.stdout.flush()
        os.write(1, f"\n{mark} {json.dumps(said)}\n".encode())

    answer({"version": list(bpy.app.version)})
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer(answers[request.pop("do")](**request))
        except Exception:
            answer({"error": traceback.format_exc()})


if __name__ == "__main__":
    folder, name = os.path.split(sys.argv[-2])
    sys.path.insert(0, folder)
    serve(importlib.import_module(name.removesuffix(".py")).ANSWERS, sys.argv[-1])
