"""Time for the staged and for the one-pass method to reach the same error, in one run.

The error is the root mean square over pixels, per band, of `total(single_bounce=True)` against a converged
one-pass reference. Noise falls with the square root of time, so the time of one method to reach the error of
the other follows from one render of each. What does not fall with time is the bias of the staged method from
its finite number of emitters: it is the error left when the noise, known from the standard errors, is taken
out.

    python benchmarks/equal_error.py [SCENE] [--size 64] [--spp 64] [--emitters 8] [--renderer cycles]

Or time for the one-pass method to reach the same error in a hall of many lamps and in one of one lamp:

    python benchmarks/equal_error.py --lamps 200 [--size 64] [--spp 256]

Or how noisy an image is against one of independent random numbers, and whether its standard errors say so:

    python benchmarks/equal_error.py --samples [--size 64] [--spp 64]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

import fluorspar
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene
from fluorspar.scene.scene import Scene
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.options import StagedOptions
from fluorspar.staged.renderers.cycles.renderer import CyclesRenderer
from fluorspar.staged.renderers.named import renderer_of
from fluorspar.staged.timings import timing_table
from lamp_hall import write_hall


def single(image: SpectralImage) -> np.ndarray:
    """Total of components 0 to 5, (pixels, N)."""
    values = image.total(single_bounce=True).values.astype(float)
    return values.reshape(-1, values.shape[-1])


def lamps(count: int, size: int, spp: int) -> None:
    """Print noise and time of halls of matte and of general surfaces, with one lamp and with many.

    Many lamps also with the probabilities that Mitsuba gives them, all alike.
    """
    # The module is imported with a variant set, so not before a scene was rendered.
    fluorspar.render("furnace", size=(8, 8), spp=1)
    from fluorspar.paths.tracing import light_choice

    few = light_choice._FEW
    with tempfile.TemporaryDirectory() as folder:
        for general in (False, True):
            for number, even in ((1, False), (count, False), (count, True)):
                light_choice._FEW = 10 * number if even else few
                file = write_hall(Path(folder, f"{general}-{number}.xml"), number, general=general)
                scene = load_scene(file).with_settings(width=size, height=size, spp=spp)
                variance, seconds = noise(scene)
                surfaces, choice = ("general" if general else "matte"), "evenly" if even else "by place"
                print(
                    f"{surfaces:8} {number:4} lamps {choice:9} {seconds:7.2f} s   variance of a sample "
                    f"{variance:8.3f} of the squared mean   {variance * seconds / spp / size**2 * 1e6:8.2f} us"
                )


_CAMERA = """<sensor type="perspective"> <float name="fov" value="50"/> <transform name="to_world">
    <lookat origin="0, 1.5, 5.5" target="0, 0.7, 0" up="0, 1, 0"/> </transform> <film type="hdrfilm"/> </sensor>"""
_BALL = """<shape type="sphere"> <point name="center" x="0" y="0.7" z="0"/> <float name="radius" value="0.7"/>
    <bsdf type="diffuse"> <spectrum name="reflectance" value="0.4"/> </bsdf> </shape>"""
# Under the sky that is black; and a white room with a lamp that shines up to its ceiling.
_OPEN = """<shape type="rectangle"> <transform name="to_world"> <scale value="4"/> <rotate x="1" angle="-90"/>
    </transform> <bsdf type="diffuse"> <spectrum name="reflectance" value="0.6"/> </bsdf> </shape>
    <emitter type="point"> <point name="position" x="-2" y="3" z="2"/> <spectrum name="intensity" value="20"/>
    </emitter> <shape type="rectangle"> <transform name="to_world"> <scale value="0.5"/> <rotate x="1" angle="90"/>
    <translate x="1" y="4"/> </transform> <emitter type="area"> <spectrum name="radiance" value="10"/> </emitter>
    </shape>"""
_BOUNCE = """<shape type="cube"> <transform name="to_world"> <scale x="3" y="2" z="6"/> <translate y="2"/> </transform>
    <bsdf type="twosided"> <bsdf type="diffuse"> <spectrum name="reflectance" value="0.85"/> </bsdf> </bsdf> </shape>
    <shape type="rectangle"> <transform name="to_world"> <scale value="0.5"/> <rotate x="1" angle="-90"/>
    <translate x="1.5" y="3"/> </transform> <emitter type="area"> <spectrum name="radiance" value="10"/> </emitter>
    </shape>"""


def samples(size: int, spp: int, reference: int) -> None:
    """Print the noise of a few scenes, and how far off a converged image they are in their standard errors."""
    fluorspar.render("furnace", size=(8, 8), spp=1)  # sets a variant
    from fluorspar.paths.tracing import numbers

    sets = numbers.sample_sets
    grid, shape = Wavelengths(400, 700, 100), (size, size)
    with tempfile.TemporaryDirectory() as folder:
        for name, parts in (("cornell-box", ""), ("open", _OPEN), ("bounce", _BOUNCE)):
            file: str | Path = name
            if parts:
                file = Path(folder, f"{name}.xml")
                file.write_text(f'<scene version="3.0.0"> {_CAMERA} {_BALL} {parts} </scene>')
            scene = load_scene(file).with_settings(width=size, height=size, spp=spp)
            truth = fluorspar.render(scene, spp=reference, wavelengths=grid, seed=99)
            images = [fluorspar.render(scene, wavelengths=grid, seed=seed) for seed in range(8)]
            numbers.sample_sets = lambda settings: settings.spp  # each sample a set of its own
            independent = [fluorspar.render(scene, wavelengths=grid, seed=seed) for seed in range(8)]
            numbers.sample_sets = sets
            some = (truth, *images, *independent)
            dark = ~np.any([image.component("source").values.any(axis=-1) for image in some], axis=0)
            print(
                f"{name}, {shape[0]} x {shape[1]}, {spp} samples: variance over that of independent numbers"
            )
            for part in ("total", "direct_reflection", "direct_luminescence", "indirect_reflection"):
                spread, alone = (
                    np.var(
                        [
                            image.dataset.radiance.values.sum(axis=0)
                            if part == "total"
                            else image.component(part).values
                            for image in each
                        ],
                        axis=0,
                        ddof=1,
                    )[dark].sum()
                    for each in (images, independent)
                )
                if alone > 0:
                    print(f"  {part:20} {spread / alone:.3f}")
            off = np.array([image.total().values - truth.total().values for image in images])[:, dark]
            errors = [
                np.hypot(i.dataset.standard_error, truth.dataset.standard_error).values[dark] for i in images
            ]
            lit = np.min(errors, axis=0) > 0
            z = (off / np.where(lit, errors, 1))[:, lit]
            print(
                f"  standard deviation of z {z.std():.3f}, mean {z.mean():+.3f}, beyond 3: {np.mean(abs(z) > 3):.2%}"
            )
            mean = np.mean([image.total().values[dark].mean() for image in images])
            print(f"  mean of the image off by {mean / truth.total().values[dark].mean() - 1:+.3%}")


def noise(scene: Scene, images: int = 8) -> tuple[float, float]:
    """Mean variance of a sample of a pixel without lamps in it, over the squared mean; seconds for an image."""
    grid = Wavelengths(400, 700, 100)
    fluorspar.render(scene, spp=1, wavelengths=grid)  # compiles
    values, seconds = [], []
    for seed in range(images):
        began = time.perf_counter()
        image = fluorspar.render(scene, wavelengths=grid, seed=seed)
        seconds.append(time.perf_counter() - began)
        values.append(image.total().values[..., 0].astype(float))
    dark = image.component("source").values[..., 0] == 0
    variance = np.var(values, axis=0, ddof=1)[dark].mean() * scene.settings.spp
    return float(variance / np.mean(values, axis=0)[dark].mean() ** 2), min(seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="cornell-box")
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--reference", type=int, default=8192)
    parser.add_argument("--emitters", type=int, default=8)
    parser.add_argument("--renderer", default="mitsuba", help="of the staged method: mitsuba or cycles")
    parser.add_argument("--wavelengths", default="360:700:5")
    parser.add_argument("--lamps", type=int, help="of a hall")
    parser.add_argument("--samples", action="store_true", help="noise against independent random numbers")
    args = parser.parse_args()
    if args.samples:
        samples(args.size, args.spp, args.reference)
        return
    if args.lamps:
        lamps(args.lamps, args.size, args.spp)
        return
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
    render(
        small,
        wavelengths=Wavelengths(400, 700, 100),
        method="staged",
        staged=options,
        renderer=renderer_of(args.renderer),
    )  # compiles
    chosen = renderer_of(args.renderer)
    began = time.perf_counter()
    staged = render(scene, wavelengths=grid, method="staged", seed=1, staged=options, renderer=chosen)
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
    print(f"        on {args.renderer}, with {args.emitters} x {args.emitters} emitters a wall")
    if isinstance(chosen, CyclesRenderer):
        print(f"        {chosen.seconds:.2f} s of which Blender renders")
    print(
        f"time of staged over time of paths for the same error: {np.median(ratio):.1f} "
        f"({ratio.min():.1f} to {ratio.max():.1f} over bands)"
    )
    print(f"without regard to error: {staged_seconds / paths_seconds:.1f}")
    print(timing_table(staged.attrs["timings"]))


if __name__ == "__main__":
    main()
