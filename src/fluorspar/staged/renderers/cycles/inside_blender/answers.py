"""What answers the requests of Fluorspar, one function each."""

from __future__ import annotations

import json
import os
import time
from typing import Any

from .held_scene import HeldScene

__all__ = ["bake", "load", "look", "render"]

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


def look(number: int, out: str, **where: Any) -> dict[str, Any]:
    seen = HELD[number].probes.look(**where)
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
