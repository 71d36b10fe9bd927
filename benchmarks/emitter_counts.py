"""Component 5 of the staged method against the one-pass method, for several numbers of emitters.

Prints, for each number, the errors of averages over blocks of 16 x 16 pixels, without the emitting surfaces
and a margin of 8 pixels around them; and the paper's figure of merit, the root mean square difference between
successive numbers of emitters of one surface's contribution, the others not fluorescent, over the mean of that
contribution, over the same pixels.

    python benchmarks/emitter_counts.py [SCENE] [--counts 2 4 8 16] [--spp 256] [--size 128]
    python benchmarks/emitter_counts.py cornell-mesh --mesh FILE --counts 25 100 400 --window 29 29 99 99

The window of the second call is the back wall in an image of 128 x 128 pixels.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation

import fluorspar
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.scene.scene import Scene
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.renderers.mitsuba.renderer import MitsubaRenderer

BLOCK, MARGIN = 16, 8


def blocks(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Averages over the valid pixels of each block that has at least half of them; (blocks, N)."""
    height, width = (side // BLOCK for side in valid.shape)
    shape = (height, BLOCK, width, BLOCK)
    weight = valid.reshape(shape).sum(axis=(1, 3))
    sums = (values * valid[..., None]).reshape(*shape, -1).sum(axis=(1, 3))
    kept = weight >= BLOCK * BLOCK / 2
    return sums[kept] / weight[kept][:, None]


def relative_rmse(image: np.ndarray, reference: np.ndarray) -> float:
    """Root mean square difference of two images over all their values, divided by the mean of the second."""
    return float(np.sqrt(np.mean((image - reference) ** 2)) / np.mean(reference))


def with_one_fluorescent(scene: Scene) -> tuple[Scene, str]:
    """The scene in which one fluorescent material fluoresces, and its name: the object's, or that of a wall."""
    on_object = {surface.front for surface in scene.surfaces if surface.name == "object"}
    glowing = [row for row, made in enumerate(scene.materials) if made.fluorescent]
    first = scene.materials[next((row for row in glowing if row in on_object), glowing[0])]
    materials = tuple(made if made is first else replace(made, fluorophores=()) for made in scene.materials)
    return replace(scene, materials=materials), first.name


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="cornell-box")
    parser.add_argument("--mesh")
    parser.add_argument("--counts", type=int, nargs="+", default=[2, 4, 8, 16])
    parser.add_argument("--mode", default="true")
    parser.add_argument(
        "--exclude",
        nargs="*",
        default=False,
        metavar="ID",
        help="leave out these emitting objects; without ids: each",
    )
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--reference", type=int, default=2048)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--wavelengths", default="440:640:100")
    parser.add_argument(
        "--window", type=int, nargs=4, help="x0 y0 x1 y1: pixels that count, such as those of one wall"
    )
    parser.add_argument(
        "--margin", type=int, default=MARGIN, help="pixels around emitting surfaces that do not count"
    )
    args = parser.parse_args()
    parameters = {"mesh": args.mesh} if args.mesh else None
    scene = load_scene(args.scene, parameters=parameters).with_settings(
        width=args.size, height=args.size, spp=args.spp
    )
    grid = Wavelengths.parse(args.wavelengths)
    began = time.perf_counter()
    paths = fluorspar.render(scene, spp=args.reference, wavelengths=grid, seed=1, component_errors=True)
    print(f"reference: paths, {args.reference} samples, {time.perf_counter() - began:.0f} s")
    rows = [row for row, made in enumerate(scene.materials) if made.fluorescent]
    renderer = MitsubaRenderer()
    with renderer.session():
        seen = renderer.load(scene).rows_seen(seed=0, scale=1)
    emitting = np.isin(seen, rows)
    if args.margin:
        emitting = binary_dilation(emitting, iterations=args.margin)
    valid = ~emitting & (seen >= 0)
    if args.window:
        x0, y0, x1, y1 = args.window
        inside = np.zeros_like(valid)
        inside[y0:y1, x0:x1] = True
        valid &= inside
    name = "luminescent_reflection"
    reference = paths.component(name).values.astype(float)
    band = int(np.argmax(reference.mean(axis=(0, 1))))
    expected = blocks(reference, valid)[:, band]
    print(f"{len(expected)} blocks, {grid.values[band]:g} nm")
    header = "".join(f"{name:>9}" for name in ("mean", "rms", "worst", "total", "seconds"))
    alone, material = with_one_fluorescent(scene)
    print(f"{'count':>6}{header}   {material} alone, to the last count: rms / mean")
    excluded = True if args.exclude == [] else args.exclude
    glowing = {s.name for s in alone.surfaces if alone.materials[s.front].fluorescent}
    excluded_alone = excluded if isinstance(excluded, bool) else sorted(glowing & set(excluded))
    before = None
    for count in args.counts:
        # the emitters of walls vary in a room, those of the object in a scene with a mesh
        walls, patches = (8, count) if "mesh" in args.scene else (count, count)
        samples = max(1024, 65536 // (patches if "mesh" in args.scene else count**2))
        options = StagedOptions(
            emitters=walls,
            patches=patches,
            mode=args.mode,
            exclude_emitter_geometry=excluded,
            patch_samples=samples,
        )
        began = time.perf_counter()
        staged = render(scene, wavelengths=grid, method="staged", seed=2, staged=options)
        seconds = time.perf_counter() - began
        image = staged.component(name).values.astype(float)
        error = blocks(image, valid)[:, band] / expected - 1
        both = [x.total(single_bounce=True).values.astype(float) for x in (staged, paths)]
        whole = blocks(both[0], valid)[:, band].mean() / blocks(both[1], valid)[:, band].mean() - 1
        step = ""
        one = (
            render(
                alone,
                wavelengths=grid,
                method="staged",
                seed=2,
                staged=replace(options, exclude_emitter_geometry=excluded_alone),
            )
            .component(name)
            .values.astype(float)
        )
        if before is not None:
            by_block = relative_rmse(blocks(before, valid), blocks(one, valid))
            step = f"{by_block:.4f} (blocks), {relative_rmse(before[valid], one[valid]):.4f} (pixels)"
        print(
            f"{count:>6}{error.mean():>9.2%}{np.sqrt(np.mean(error**2)):>9.2%}{np.abs(error).max():>9.2%}"
            f"{whole:>9.2%}{seconds:>9.1f}   {step}",
            flush=True,
        )
        before = one


if __name__ == "__main__":
    main()
