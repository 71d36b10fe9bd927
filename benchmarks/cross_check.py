"""Cycles against Mitsuba and against the one-pass method, component by component: numbers and pictures.

    python benchmarks/cross_check.py [SCENE ...] [--seeds 6] [--spp 576] [--blender PATH]
    python benchmarks/cross_check.py [SCENE ...] -o out/cross-check

The first prints a table in Markdown: how far each component of the staged method on either renderer is from that of
the one-pass method, and on Cycles from that on Mitsuba, relative to the mean of the component, with its standard error
from the seeds. In brackets is the root mean square of the differences over blocks of 8 x 8 pixels in their standard
errors, where 1 is noise alone.

The second draws the same, as Figures 18, 19, 28 and 29 of the paper do for its independent renderer: pictures of each
component on Mitsuba and on Cycles with their difference, and for `cornell-box` the spectra at 13 points.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from fluorspar.comparing.compare import compare
from fluorspar.figures.maps import components_figure
from fluorspar.figures.spectra import points_figure, write_figure
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.rendering import render
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.renderers.cycles.renderer import CyclesRenderer

BLOCK = 8
FREE = 8  # samples of the one-pass method for each of the staged one: it takes a fraction of the time
BOX, MESH = "cornell-box", "cornell-mesh"
APERTURE = 5  # pixels across, at each point
POINTS = Path(__file__).parents[1] / "examples" / "cornell-points.csv"


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


def off(one: np.ndarray, other: np.ndarray, level: float) -> str:
    """The difference of the means and its error, over `level`, and that of blocks in their errors."""
    seeds = len(one)
    means, others = one.mean(axis=(1, 2)), other.mean(axis=(1, 2))
    error = np.sqrt((means.var(ddof=1) + others.var(ddof=1)) / seeds)
    noise = np.sqrt((one.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / seeds)
    shown = noise > 0
    t = (one.mean(axis=0) - other.mean(axis=0))[shown] / noise[shown]
    free = 2 * (seeds - 1)  # the mean square of Student's t is free / (free - 2)
    ratio = np.sqrt((t**2).mean() * (free - 2) / free)
    return f"{(means.mean() - others.mean()) / level:+.2%} ± {error / level:.2%} ({ratio:.2f})"


def table(scene: str, args: argparse.Namespace, staged: dict[str, Any], renderer: CyclesRenderer) -> None:
    """Print how far the components are from each other."""
    paths = images(scene, args.size, FREE * args.spp, args.seeds)
    mitsuba = images(scene, args.size, args.spp, args.seeds, **staged)
    cycles = images(scene, args.size, args.spp, args.seeds, renderer=renderer, **staged)
    print(f"| {scene} | share | Mitsuba - paths | Cycles - paths | Cycles - Mitsuba |\n|---|---|---|---|---|")
    for name in paths:
        level = paths[name].mean()
        cells = [f"{level / paths['total'].mean():.1%}"]
        for one, other in ((mitsuba, paths), (cycles, paths), (cycles, mitsuba)):
            cells.append(off(one[name], other[name], level))
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    print()


def pictures(scene: str, args: argparse.Namespace, staged: dict[str, Any], renderer: CyclesRenderer) -> None:
    """Render on both renderers, and draw the components and the spectra at points."""
    folder = args.out / scene
    folder.mkdir(parents=True, exist_ok=True)
    files = folder / "mitsuba.nc", folder / "cycles.nc"
    for file, on in zip(files, (None, renderer), strict=True):
        image = render(
            scene,
            size=(args.size, args.size),
            spp=args.spp,
            wavelengths=args.wavelengths,
            seed=1,
            renderer=on,
            **staged,
        )
        image.save(file)
    rows = {name: compare(*files, component=name) for name in image.components if name != "source"}
    write_figure(components_figure({"total": compare(*files), **rows}), folder / "components.png")
    if scene == BOX:  # the points are on its blocks, too
        write_figure(
            points_figure(compare(*files, points=POINTS, aperture=f"{APERTURE}px")), folder / "points.png"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=[BOX, MESH])
    parser.add_argument("-o", dest="out", type=Path, help="folder of pictures, which are drawn instead")
    parser.add_argument("--size", type=int)
    parser.add_argument("--spp", type=int)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--emitters", type=int, default=16)
    parser.add_argument("--wavelengths", default="400:700:10", help="of pictures")
    parser.add_argument("--blender")
    args = parser.parse_args()
    args.size = args.size or (128 if args.out else 32)
    args.spp = args.spp or (64 if args.out else 576)
    repeats = 4 if args.out else 1  # pictures get their errors from repeats, the table from seeds
    options = StagedOptions(emitters=args.emitters, patches=400, repeats=repeats)
    staged = {"method": "staged", "staged": options}
    for scene in args.scenes:
        (pictures if args.out else table)(scene, args, staged, CyclesRenderer(args.blender))


if __name__ == "__main__":
    main()
