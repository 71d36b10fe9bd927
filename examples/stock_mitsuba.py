"""Render the built-in scene cornell-classic with stock Mitsuba: hero wavelengths, `path` and `specfilm`.

    python examples/stock_mitsuba.py stock.nc --size 128 --spp 4096

The 31 bands of 400-700 nm are triangles of 10 nm FWHM and area 1. Nothing of Fluorspar's rendering is used: its
plugin `fluorescent` gives the scene file its diffuse reflectances, and `SpectralImage` writes the result.
"""

from __future__ import annotations

import argparse

import fluorspar  # before mitsuba: it chooses a working LLVM

# isort: split
import mitsuba as mi
import numpy as np

from fluorspar.scene.builtin import builtin_path

WAVELENGTHS = fluorspar.Wavelengths(400, 700, 10)
SEEDS = 16  # independent renders, whose scatter gives the standard error


def load(size: int) -> mi.Scene:
    """Load the scene with a spectral film."""
    film = [
        f'<film type="specfilm"> <integer name="width" value="{size}"/> <integer name="height" value="{size}"/>'
    ]
    for at in WAVELENGTHS.values:
        step = WAVELENGTHS.step
        triangle = f"{at - step:g}:0, {at:g}:{1 / step:g}, {at + step:g}:0"
        film.append(f'<spectrum name="band{at:04.0f}" value="{triangle}"/>')
    film.append('<rfilter type="box"/> </film>')
    path = builtin_path("cornell-classic")
    before, _, rest = path.read_text().partition("<film")
    text = before + " ".join(film) + rest.partition("</film>")[2]
    resolver = mi.file_resolver()
    resolver.append(str(path.parent))
    return mi.load_string(text)


def main() -> None:
    """Render and write the image."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("output")
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--spp", type=int, default=4096, help=f"in {SEEDS} equal parts")
    given = parser.parse_args()
    if given.spp < SEEDS:
        parser.error(
            f"--spp {given.spp}: at least {SEEDS}, one for each of the renders that give the standard error"
        )
    mi.set_variant("llvm_ad_spectral")
    fluorspar.register_plugins()
    scene = load(given.size)
    each = given.spp // SEEDS
    renders = np.stack([np.array(mi.render(scene, spp=each, seed=seed)) for seed in range(SEEDS)])
    image = fluorspar.SpectralImage.from_arrays(
        renders.mean(axis=0)[np.newaxis],
        WAVELENGTHS,
        renders.std(axis=0, ddof=1) / np.sqrt(SEEDS),
        {
            "scene": "cornell-classic",
            "method": f"Mitsuba {mi.__version__}, path, specfilm",
            "spp": each * SEEDS,
            "repeats": SEEDS,
            "bandwidth_nm": WAVELENGTHS.step,
        },
        components=("total",),
    )
    image.save(given.output)


if __name__ == "__main__":
    main()
