"""`fluorspar doctor`: does everything work on this machine?"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from importlib import metadata

import typer

from fluorspar.cli import console

__all__ = ["doctor"]

_PACKAGES = (
    "fluorspar",
    "mitsuba",
    "drjit",
    "numpy",
    "numba",
    "numba-cuda",
    "xarray",
    "h5netcdf",
    "OpenEXR",
    "colour-science",
    "karellen-llvm-core",
    "mitsuba-oidn",
)
_ABSENT = {"mitsuba-oidn": 'not installed: pip install "fluorspar[denoise]" to denoise images'}
# A wrong LLVM aborts the process, so each variant is tried in a process of its own.
_TRY = """
from fluorspar.scene.variants import use_variant
with use_variant("{variant}"):
    import drjit as dr
    import mitsuba as mi
    scene = mi.load_dict({{"type": "scene", "sphere": {{"type": "sphere"}}, "light": {{"type": "constant"}}}})
    ray = mi.Ray3f(mi.Point3f(0, 0, -5), mi.Vector3f(0, 0, 1))
    assert bool(dr.all(scene.ray_intersect(ray).is_valid()))
    if "{variant}".startswith("llvm"):
        print(", with LLVM " + ".".join(map(str, dr.detail.llvm_version())), end="")
"""


def doctor() -> None:
    """Check this machine: versions, LLVM, which variants of Mitsuba work, and what a GPU lacks.

    Example:  fluorspar doctor
    """
    from fluorspar.paths.sweeping.gpu import why_not_on_gpu
    from fluorspar.scene.variants import (
        OPTIX_MISSING,
        SPECTRUM_VARIANT,
        TRACE_VARIANTS,
        find_llvm,
        has_optix,
        usable_cores,
    )

    def line(label: str, text: object) -> None:
        console.out.print(f"{label:<20}{text}", markup=False, highlight=False)

    line("python", f"{platform.python_version()} on {platform.platform()}")
    line("cores", f"{usable_cores()} usable, of {os.cpu_count()}")
    for package in _PACKAGES:
        try:
            line(package, metadata.version(package))
        except metadata.PackageNotFoundError:
            line(package, _ABSENT.get(package, "not installed"))
    line(
        "LLVM library",
        find_llvm() or "none found: pip install karellen-llvm-core, or install LLVM 16 or later",
    )
    works = {}
    for backend, variant in {"spectra": SPECTRUM_VARIANT, **TRACE_VARIANTS}.items():
        with console.err.status(f"trying {variant}"):
            tried = subprocess.run(
                [sys.executable, "-c", _TRY.format(variant=variant)],
                capture_output=True,
                text=True,
                check=False,
            )
        works[backend] = tried.returncode == 0
        if works[backend]:
            line(variant, f"works{tried.stdout}")
        else:
            last = (tried.stderr.strip().splitlines() or [f"the process ended with code {tried.returncode}"])[
                -1
            ]
            # The last line of our own errors says how to mend them.
            line(variant, f"does not work: {last.strip().removeprefix('fix:').strip()}")
    line("OptiX", "found" if has_optix() else OPTIX_MISSING)
    line("GPU sweep", why_not_on_gpu() or "works")
    if not (works["spectra"] and works["llvm"]):
        console.error("rendering will not work on this machine")
        raise typer.Exit(2)
