"""The sweep among general surfaces: the recursion, by matrices, of paths made up at random."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fluorspar.bispectral.coated import under_a_coat
from fluorspar.bispectral.donaldson import DonaldsonMatrix
from fluorspar.image.pixels import Pixels
from fluorspar.paths.log import BLOCK, END, Chunk, Log
from fluorspar.paths.sweeping.lobe_kernel import lobe_tables
from fluorspar.paths.sweeping.sweep import sweep
from fluorspar.scene.lobes.lobe import DARK, FULL, HALF, PLAIN, REST, Lobes, operate
from fluorspar.scene.lobes.textures import sigmoid
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(400, 700, 10)
N, TERMS, SAMPLES, VERTICES = len(GRID), 3, 24, 5
OPERATIONS = (PLAIN, REST, DARK, HALF, FULL, 0.6)


def dyed(rng, stokes="half"):
    emission, excitation = rng.random((2, 1, N)) * 0.02
    return DonaldsonMatrix(GRID, rng.random(N) * 0.4, emission, excitation, stokes=stokes)


def by_matrices(path, once, more, colours, lights):
    """The components of one path: for each vertex rows, d, c, h and the rows of both lights."""
    R = F = G = np.zeros(N)
    for k, (rows, found, sent, h, (a, b)) in reversed(list(enumerate(path))):
        La, Lb = lights[a], lights[b]
        A = B = first = second = again = under = np.zeros(N)
        for row, d, c in zip(rows, found, sent, strict=True):
            if row >= len(once):
                S = colours[row - len(once)]
            else:
                S = once[row].reflectance
                first = first + once[row].apply_luminescent(d * La + c * h * Lb)
                second = second + once[row].apply_luminescent(c * R)
                again = again + once[row].apply_luminescent(c * (F + G))
                under = under + more[row].apply(d * La + c * (h * Lb + R + F + G))
            A, B = A + c * S, B + d * S
        if k == 0:
            return np.array(
                [np.zeros(N), B * La + A * h * Lb, first, A * R, second, A * F, A * G + again + under]
            )
        R, F, G = A * (R + h * Lb) + B * La, A * F + first + second, A * G + again + under
    return None


def test_components_are_those_of_the_recursion():
    rng = np.random.default_rng(5)
    plain = DonaldsonMatrix(GRID, rng.random(N))
    nothing = DonaldsonMatrix(GRID, np.zeros(N))
    coated = under_a_coat(dyed(rng), 0.5)
    once, more = [plain, dyed(rng), coated[0]], [nothing, nothing, coated[1]]
    coefficients = np.array(
        [[0, 0.01 * x, -5 * x] for x in rng.normal(size=len(OPERATIONS))], dtype=np.float32
    )
    colours = np.column_stack([coefficients, OPERATIONS]).astype(np.float32)
    spectra = operate(sigmoid(coefficients, GRID.values), np.array(OPERATIONS)[:, np.newaxis])
    lamps = list(rng.random((2, N)))
    of_light = np.array([[0, 0.004, -2, 1], [0, -0.01, 6, 0]], dtype=np.float32)
    lights = [*lamps, *(lamps[int(c[3])] * sigmoid(c[:3], GRID.values) for c in of_light)]

    entries = SAMPLES * VERTICES
    shape = (TERMS, entries, BLOCK)
    row = rng.integers(0, len(once) + len(colours), size=shape, dtype=np.uint32)
    direct, weight = rng.random((2, *shape), dtype=np.float32) * (rng.random((2, *shape)) < 0.7)
    direct, weight = direct.astype(np.float32), weight.astype(np.float32)
    sampled = rng.random(shape[1:], dtype=np.float32)
    sampled_light, direct_light = rng.integers(0, len(lights), size=(2, *shape[1:]), dtype=np.uint32)
    sampled[::VERTICES] = 0  # no light seen directly
    weight[0] = np.maximum(weight[0], 0.1)  # paths go on,
    row[:, VERTICES - 1 :: VERTICES] = END  # to here
    log = Log(
        sampled,
        row,
        direct,
        weight,
        sampled_light,
        direct_light,
        np.array([[0, entries]]),
        np.full(BLOCK, -1, dtype=np.int32),
        np.full(BLOCK, entries, dtype=np.int32),
    )
    expected = np.zeros((7, N))
    for begin in range(0, entries, VERTICES):
        at = range(begin, begin + VERTICES - 1)
        path = [
            (
                row[:, i, 0],
                direct[:, i, 0],
                weight[:, i, 0],
                sampled[i + 1, 0],
                (direct_light[i, 0], sampled_light[i + 1, 0]),
            )
            for i in at
        ]
        expected += by_matrices(path, once, more, spectra, lights)

    lobes = Lobes(colours=colours, light_colours=of_light)
    tables = lobe_tables(once, lobes, lamps, more)
    out = Pixels(np.zeros((7, 1, N), dtype=np.float32), np.zeros((1, N), dtype=np.float32), None)
    with ThreadPoolExecutor(1) as pool:
        sweep(Chunk(0, 1, SAMPLES, log), tables, pool, out)
    assert (expected[1:] > 0).any(axis=1).all()
    np.testing.assert_allclose(out.radiance[:, 0], expected / SAMPLES, rtol=2e-5, atol=2e-6 * expected.max())
