"""What an image depends on, in words and digests: two jobs of one fingerprint make the same image, bit for bit."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from fluorspar.job import RenderJob
from fluorspar.scene.records import to_record
from fluorspar.version import __version__

__all__ = ["differences", "fingerprint", "of_sweep"]

_SHORT = 16  # hexadecimal digits of a digest: 64 bits
_MOST = 100  # files, materials or lights with a digest each; HDF5 has no room for more than 64 KiB


def fingerprint(job: RenderJob) -> dict[str, str] | None:
    """What the pixels of a job depend on.

    Parameters
    ----------
    job : RenderJob

    Returns
    -------
    dict of str to str, or None
        Numbers and names as they are; files, materials, lights and the rest of the scene as digests. Not the number of
        threads, and not where the files lie. None if the scene has no geometry, because its light paths are from a
        file.

    Examples
    --------
    >>> once = fingerprint(RenderJob.of("cornell-box", spp=16, variant="llvm"))
    >>> again = fingerprint(RenderJob.of("cornell-box", spp=64, variant="llvm"))
    >>> differences(again, once)
    ['samples: 64, before 16']
    """
    scene, settings, computed = job.scene, job.scene.settings, job.computed_grid
    if scene.files is None:
        return None
    parts = {
        "Fluorspar": __version__,
        "Mitsuba": version("mitsuba"),
        "variant": job.variant,
        "size": f"{settings.width} x {settings.height}",
        "camera": str(settings.viewpoint or "the scene's"),
        "samples": str(settings.spp),
        "max_depth": str(settings.max_depth),
        "rr_depth": str(settings.rr_depth),
        "wavelengths": ":".join(f"{each:.12g}" for each in (job.grid.start, job.grid.stop, job.grid.step)),
        "excitation": f"from {computed.start:.12g} nm",
        **of_sweep(job),
        "seed": str(job.seed),
        "pass": str(job.stream + 1),
    }
    parts |= {f"-D {name}": value for name, value in _parameters(scene.parameters).items()}
    parts |= _digests("file", scene.files)
    parts |= _digests("material", [(each.name, _digest(to_record(each))) for each in scene.materials])
    parts |= _digests("light", [(light.name, _digest(to_record(light))) for light in scene.lights])
    recipe = scene.recipe
    source = recipe.source if isinstance(recipe.source, dict) else None
    rest = [source, recipe.matte, recipe.sensor, to_record([scene.surfaces, scene.lobes])]
    parts["rest of the scene"] = _digest(rest)
    return parts


def of_sweep(job: RenderJob) -> dict[str, str]:
    """The parts that light paths do not depend on, of one scene and grid."""
    return {"Stokes rule": job.stokes, "errors of components": "yes" if job.component_errors else "no"}


def differences(now: Mapping[str, str], before: Mapping[str, str], *, but: tuple[str, ...] = ()) -> list[str]:
    """What differs between two fingerprints, in words.

    Parameters
    ----------
    now, before : mapping
    but : tuple of str
        What may differ.

    Examples
    --------
    >>> differences({"seed": "2", "file 1, a.xml": "0f"}, {"seed": "1", "light 1, lamp": "3c"}, but=("seed",))
    ['file 1, a.xml is new', 'light 1, lamp is gone']
    """
    found = []
    for name in dict.fromkeys([*now, *before]):
        if name in but or now.get(name) == before.get(name):
            continue
        if name not in before:
            found.append(f"{name} is new")
        elif name not in now:
            found.append(f"{name} is gone")
        elif name.startswith(("file", "material", "light", "rest")):
            found.append(f"{name}: changed")
        else:
            found.append(f"{name}: {now[name]}, before {before[name]}")
    return found


def _digests(kind: str, named: Sequence[tuple[str, str]]) -> dict[str, str]:
    if len(named) > _MOST:
        return {f"{kind}s": _digest(named)}
    return {f"{kind} {number}, {name}": digest[:_SHORT] for number, (name, digest) in enumerate(named, 1)}


def _parameters(parameters: Mapping[str, str]) -> dict[str, str]:
    """Without the folders of files, whose content counts."""
    return {name: Path(value).name if os.path.isfile(value) else value for name, value in parameters.items()}


def _digest(value: Any) -> str:
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()[:_SHORT]


def _feed(digest: Any, value: Any) -> None:
    """Feed a tree of plain values, each with its kind, so that no two trees look alike."""
    if isinstance(value, Mapping):
        value = [part for pair in value.items() for part in pair]
    if isinstance(value, list | tuple):
        digest.update(f"[{len(value)}]".encode())
        for part in value:
            _feed(digest, part)
    elif value is None or isinstance(value, bool | int | float | str | Path):
        if isinstance(value, str) and os.path.isabs(value):
            value = os.path.basename(value)  # the content counts
        digest.update(f"{type(value).__name__} {value!r};".encode())
    else:
        array = np.ascontiguousarray(value)  # of numpy, or a matrix of Dr.Jit
        if array.dtype.hasobject:
            raise TypeError(f"a {type(value).__name__} has no digest")
        digest.update(f"{array.dtype} {array.shape};".encode())
        digest.update(array.tobytes())
