"""Time for the staged and for the one-pass method to reach the same error, in one run.

The error is the root mean square over pixels, per band, of `total(single_bounce=True)` against a converged
one-pass reference. Noise falls with the square root of time, so the time of one method to reach the error of
the other follows from one render of each. What does not fall with time is the bias of the staged method from
its finite number of emitters: it is the error left when the noise, known from the standard errors, is taken
out.

    python benchmarks/equal_error.py [SCENE] [--size 64] [--spp 64] [--emitters 8]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import fluorspar
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.timings import timing_table


def single(image: SpectralImage) -> np.ndarray:
    """Total of components 0 to 5, (pixels, N)."""
    values = image.total(single_bounce=True).values.astype(float)
    return values.reshape(-1, values.shape[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="cornell-box")
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--reference", type=int, default=8192)
    parser.add_argument("--emitters", type=int, default=8)
    parser.add_argument("--wavelengths", default="360:700:5")
    args = parser.parse_args()
    scene = load_scene(args.scene).with_settings(width=args.size, height=args.size, spp=args.spp)
    grid = Wavelengths.parse(args.wavelengths)
    reference = fluorspar.render(scene, spp=args.reference, wavelengths=grid, seed=99)
    truth = single(reference)
    # pixels that show a lamp, at its edge, would drown the rest
    dark = reference.component("source").values.max(-1).ravel() == 0
    truth_noise = np.mean(reference.standard_error().values.reshape(truth.shape)[dark] ** 2, axis=0)

    fluorspar.render(scene, spp=args.spp, wavelengths=grid)  # compiles
    began = time.perf_counter()
    paths = fluorspar.render(scene, spp=args.spp, wavelengths=grid, seed=1)
    paths_seconds = time.perf_counter() - began

    options = StagedOptions(emitters=args.emitters)
    small = scene.with_settings(width=8, height=8)
    render(small, wavelengths=Wavelengths(400, 700, 100), method="staged", staged=options)  # compiles
    began = time.perf_counter()
    staged = render(scene, wavelengths=grid, method="staged", seed=1, staged=options)
    staged_seconds = time.perf_counter() - began

    paths_error, staged_error = (
        np.sqrt(np.maximum(np.mean((single(image) - truth)[dark] ** 2, axis=0) - truth_noise, 0))
        for image in (paths, staged)
    )
    noise = np.mean(staged.standard_error().values.reshape(truth.shape)[dark] ** 2, axis=0)
    bias = np.sqrt(np.maximum(staged_error**2 - noise, 0))
    level = truth[dark].mean(axis=0)
    ratio = staged_seconds / (paths_seconds * (paths_error / staged_error) ** 2)
    paths_share, staged_share, bias_share = (np.median(e / level) for e in (paths_error, staged_error, bias))
    print(f"{args.scene}, {args.size} x {args.size}, {len(grid)} bands, {args.spp} samples")
    print(f"paths   {paths_seconds:8.2f} s   error {paths_share:.3%} of the mean (median band)")
    print(f"staged  {staged_seconds:8.2f} s   error {staged_share:.3%}, of which bias {bias_share:.3%}")
    print(f"        with {args.emitters} x {args.emitters} emitters a wall")
    print(
        f"time of staged over time of paths for the same error: {np.median(ratio):.1f} "
        f"({ratio.min():.1f} to {ratio.max():.1f} over bands)"
    )
    print(f"without regard to error: {staged_seconds / paths_seconds:.1f}")
    print(timing_table(staged.attrs["timings"]))


if __name__ == "__main__":
    main()
