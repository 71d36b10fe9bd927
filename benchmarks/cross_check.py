"""Cycles against Mitsuba and against the one-pass method: each component, in the mean and by blocks of pixels.

    python benchmarks/cross_check.py [SCENE ...] [--size 32] [--spp 256] [--seeds 6] [--blender PATH]

Prints a table in Markdown: how far each component of the staged method on either renderer is from that of the one-pass
method, relative to the mean of the component, with its standard error from the seeds; and the root mean square of the
differences between Cycles and Mitsuba over blocks of 8 x 8 pixels, in their standard errors, where 1 is noise alone.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from fluorspar.image.spectral_image import SpectralImage
from fluorspar.rendering import render
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.renderers.cycles.renderer import CyclesRenderer

BLOCK = 8


def blocks(image: SpectralImage) -> dict[str, np.ndarray]:
    """Means over blocks of pixels and all bands, of each component and of the total of 0 to 5."""
    parts = {name: image.component(name).values for name in image.components if name != "reexcitation"}
    parts["total"] = image.total(single_bounce=True).values
    return {
        name: values.astype(float)
        .reshape(values.shape[0] // BLOCK, BLOCK, values.shape[1] // BLOCK, BLOCK, -1)
        .mean(axis=(1, 3, 4))
        for name, values in parts.items()
    }


def images(scene: str, size: int, spp: int, seeds: int, **options: Any) -> dict[str, np.ndarray]:
    """Blocks of each component of some independent images, (seeds, Y, X)."""
    found = [
        blocks(render(scene, size=(size, size), spp=spp, seed=seed, wavelengths="400:700:50", **options))
        for seed in range(seeds)
    ]
    return {name: np.stack([one[name] for one in found]) for name in found[0]}


def row(name: str, paths: np.ndarray, mitsuba: np.ndarray, cycles: np.ndarray) -> str:
    """One line of the table."""
    level = paths.mean()

    def off(one: np.ndarray, other: np.ndarray) -> str:
        means, others = one.mean(axis=(1, 2)), other.mean(axis=(1, 2))
        error = np.sqrt((means.var(ddof=1) + others.var(ddof=1)) / len(means))
        return f"{(means.mean() - others.mean()) / level:+.2%} ± {error / level:.2%}"

    noise = np.sqrt((cycles.var(axis=0, ddof=1) + mitsuba.var(axis=0, ddof=1)) / len(cycles))
    shown = noise > 0
    z = ((cycles.mean(axis=0) - mitsuba.mean(axis=0))[shown] / noise[shown]) ** 2
    cells = (
        off(mitsuba, paths),
        off(cycles, paths),
        off(cycles, mitsuba),
        f"{np.sqrt(np.median(z) / 0.53):.2f}",
    )
    return f"| {name} | " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["cornell-box", "cornell-mesh"])
    parser.add_argument("--size", type=int, default=32)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--emitters", type=int, default=16)
    parser.add_argument("--blender")
    args = parser.parse_args()
    staged = {"method": "staged", "staged": StagedOptions(emitters=args.emitters, patches=400, repeats=1)}
    for scene in args.scenes:
        common = (scene, args.size, args.spp, args.seeds)
        paths = images(*common)
        mitsuba = images(*common, **staged)
        cycles = images(*common, renderer=CyclesRenderer(args.blender), **staged)
        print(
            f"| {scene} | Mitsuba - paths | Cycles - paths | Cycles - Mitsuba | blocks |\n|---|---|---|---|---|"
        )
        for name in paths:
            print(row(name, paths[name], mitsuba[name], cycles[name]), flush=True)
        print()


if __name__ == "__main__":
    main()
