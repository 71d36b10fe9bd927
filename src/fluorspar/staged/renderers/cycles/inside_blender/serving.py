"""Answers requests: JSON lines on standard input, answers lines of standard output that begin with a mark."""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from collections.abc import Callable
from typing import Any

from .held_scene import HeldScene

if not __name__.startswith("fluorspar"):  # else there is no Blender, and nothing here is used
    import bpy

__all__ = ["serve"]

HELD: dict[int, HeldScene] = {}


def load(number: int, file: str) -> dict[str, Any]:
    with open(file, encoding="utf-8") as text:
        HELD[number] = HeldScene(json.load(text))
    os.remove(file)
    return {}


def render(number: int, bounces: int, seed: int, scale: int, out: str, **spectra: Any) -> dict[str, Any]:
    held = HELD[number]
    held.choose(bounces, seed)
    if spectra:
        held.colour(**spectra)
    began = time.perf_counter()
    held.render(out, scale)
    return {"seconds": time.perf_counter() - began}


def look(
    number: int, points: str, normals: str, side: int, offset: float, size: float, out: str
) -> dict[str, Any]:
    seen = HELD[number].probes.look(points, normals, side, offset, size)
    with open(out, "wb") as file:
        file.write(seen)
    return {}


def bake(number: int, bounces: int, seed: int, out: str, **spectra: Any) -> dict[str, Any]:
    held = HELD[number]
    held.choose(bounces, seed)
    held.colour(**spectra)
    began = time.perf_counter()
    held.probes.bake(out)
    return {"seconds": time.perf_counter() - began}


def serve() -> None:
    mark = sys.argv[-1]

    def answer(said: dict[str, Any]) -> None:
        sys.stdout.flush()
        os.write(1, f"\n{mark} {json.dumps(said)}\n".encode())

    answer({"version": list(bpy.app.version)})
    known: dict[str, Callable[..., dict[str, Any]]] = {
        "load": load,
        "render": render,
        "look": look,
        "bake": bake,
    }
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer(known[request.pop("do")](**request))
        except Exception:
            answer({"error": traceback.format_exc()})
