"""The laboratory of the physics tests: materials, scenes, stock renders, closed forms, statistics.

Statistics
----------
The bands of a pixel are almost fully correlated, so pixels are the independent observations, band by band. A
standard error comes from B = min(spp, 32) batches, so a z-score is Student-t with B - 1 degrees of freedom,
whose standard deviation is sqrt((B - 1) / (B - 3)) and not 1; `z_scores` divides by it. Skewed samples shift
the mean of a t-value by -skew / (2 sqrt(spp)); each test says why its spp make that small.
"""

from __future__ import annotations

from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluorspar import Fluorophore, Material, SpectralImage, Spectrum, Wavelengths
from fluorspar.scene.variants import use_variant

Array = NDArray[np.float64]

FINE = np.arange(300.0, 781.0)

# --- materials and lights, tabulated every nanometre so that grids of 2.5, 5 and 10 nm see the same curves


def bell(peak: float, width: float, height: float = 1.0) -> Array:
    """Gaussian on FINE, ndarray of shape (481,)."""
    return height * np.exp(-0.5 * ((FINE - peak) / width) ** 2)


def paint(name: str, S: ArrayLike, alpha: ArrayLike | None = None, beta: ArrayLike | None = None) -> Material:
    """Material from values on FINE (or constants)."""
    reflectance = Spectrum(FINE, np.broadcast_to(np.asarray(S, float), FINE.shape), name=f"S of {name}")
    dyes = () if alpha is None else (Fluorophore(Spectrum(FINE, alpha), Spectrum(FINE, beta), name),)
    return Material(name, reflectance, dyes)


def light_values() -> Array:
    """A spectrum that is not flat, on FINE, W m-2 sr-1 nm-1."""
    return 0.6 + 0.3 * np.sin((FINE - 300) / 60) + 0.4 * (FINE - 300) / 480


def sampled(values: ArrayLike, grid: Wavelengths) -> Array:
    """Values on FINE, linear in between, on a render grid; 0 beyond FINE."""
    values = np.broadcast_to(np.asarray(values, float), FINE.shape)
    return np.interp(grid.values, FINE, values, left=0.0, right=0.0)


def luminescence(alpha: ArrayLike, beta: ArrayLike, grid: Wavelengths, equal: float = 0.5) -> Array:
    """Band-weighted luminescent operator of one dye, ndarray of shape (N, N): h alpha(em) beta(ex), em > ex.

    Written out from its definition (docs/arrays.md) and not taken from the code under test. `beta` is normalised
    to integral 1 over FINE, `equal` is the weight of em = ex.
    """
    a = sampled(alpha, grid)
    b = sampled(np.asarray(beta) / np.trapezoid(beta, FINE), grid)
    D_L = grid.step * np.outer(a, b)
    return np.tril(D_L, -1) + equal * np.diag(np.diag(D_L))


PHOTON_GRID = Wavelengths(400, 700, 20)
"""The grid on which `photon_conserving` conserves photons."""


def photon_conserving() -> Material:
    """S(ex) = 1 - sum over em of B(em, ex) em / ex: what is not turned into longer waves is reflected."""
    alpha, beta = bell(560, 50, 0.5), bell(480, 50)
    w = PHOTON_GRID.values
    S = 1 - (w @ luminescence(alpha, beta, PHOTON_GRID)) / w
    assert 0.2 < S.min() < 0.6, "much of the light at some wavelengths is turned into longer waves"
    made = paint("conserving", np.interp(FINE, w, S), alpha, beta)
    np.testing.assert_allclose(made.on(PHOTON_GRID).photon_yield(), 1, rtol=1e-9)
    return made


def inline(material: Material) -> str:
    """A material of one dye as spectra of a `fluorescent` BSDF."""
    dye = material.fluorophores[0]
    named = {"reflectance": material.reflectance, "emission": dye.emission, "excitation": dye.excitation}
    return "".join(curve(name, [spectrum.at(w) for w in FINE]) for name, spectrum in named.items())


# --- closed forms


def albedo(bsdf: str, samples: int = 1 << 22) -> float:
    """Share of uniform light that a grey BSDF of stock Mitsuba sends on, as its own samples say.

    Parameters
    ----------
    bsdf : str
        XML.
    samples
        A few million know it to 0.02 %.
    """
    with use_variant("llvm_ad_rgb"):
        import drjit as dr
        import mitsuba as mi

        plugin = mi.load_string(bsdf)
        rng = mi.PCG32(samples)
        si = dr.zeros(mi.SurfaceInteraction3f, samples)
        si.wi = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
        picks = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
        _, weight = plugin.sample(mi.BSDFContext(), si, *picks)
        return float(np.mean(np.array(weight[0]), dtype=float))


def cavity(S: Array, D_L: Array, L: Array, scatterings: int | None = None) -> Array:
    """Components of what a closed, uniformly emitting cavity shows, ndarray of shape (7, N).

    Parameters
    ----------
    S : ndarray of shape (N,)
    D_L : ndarray of shape (N, N)
        Band-weighted.
    L : ndarray of shape (N,)
        Emitted radiance.
    scatterings
        Longest path, max_depth - 1; None is unlimited.
    """
    n = len(S)
    if scatterings is None:
        R = L / (1 - S)
        F = (D_L @ R) / (1 - S)
        G = np.linalg.solve(np.eye(n) - np.diag(S) - D_L, L) - R - F
    else:
        R = F = G = np.zeros(n)
        for _ in range(scatterings):
            R, F, G = L + S * R, S * F + D_L @ R, S * G + D_L @ (F + G)
    if scatterings == 0:
        return np.array([L, *np.zeros((6, n))])
    return np.array([L, S * L, D_L @ L, S * (R - L), D_L @ (R - L), S * F, S * G + D_L @ (F + G)])


def two_part_sphere(share: Array, S: Array, D_L: Array, L: Array) -> Array:
    """Components of what M materials on the inside of a sphere show, ndarray of shape (M, 7, N).

    In a sphere every surface element sends the same share of its light to every other, so the incident light
    is uniform: E = sum_i a_i (L_i + D_i E).

    Parameters
    ----------
    share : ndarray of shape (M,)
        Area fractions a_i.
    S, L : ndarray of shape (M, N)
    D_L : ndarray of shape (M, N, N)
    """
    direct = share @ L
    mean_S, mean_D_L = share @ S, np.tensordot(share, D_L, 1)
    R = direct / (1 - mean_S)
    F = (mean_D_L @ R) / (1 - mean_S)
    G = np.linalg.solve(np.eye(len(direct)) - np.diag(mean_S) - mean_D_L, direct) - R - F
    return np.array(
        [
            [own, s * direct, d @ direct, s * (R - direct), d @ (R - direct), s * F, s * G + d @ (F + G)]
            for s, d, own in zip(S, D_L, L, strict=True)
        ]
    )


# --- scenes, as a user writes them


def sensor(size: int, spp: int, *, origin: str, target: str, fov: float = 60, up: str = "0, 1, 0") -> str:
    """A square perspective camera with independent samples."""
    return f"""<sensor type="perspective"> <float name="fov" value="{fov}"/>
        <transform name="to_world"><lookat origin="{origin}" target="{target}" up="{up}"/></transform>
        <film type="hdrfilm"> <integer name="width" value="{size}"/> <integer name="height" value="{size}"/>
            <rfilter type="box"/> </film>
        <sampler type="independent"> <integer name="sample_count" value="{spp}"/> </sampler> </sensor>"""


def integrator(max_depth: int = -1, rr_depth: int = 10) -> str:
    return f"""<integrator type="path"> <integer name="max_depth" value="{max_depth}"/>
        <integer name="rr_depth" value="{rr_depth}"/> </integrator>"""


def curve(name: str, values: ArrayLike) -> str:
    """A spectrum property with values on FINE."""
    pairs = ", ".join(
        f"{w:g}:{v:.9g}" for w, v in zip(FINE, np.broadcast_to(values, FINE.shape), strict=True)
    )
    return f'<spectrum name="{name}" value="{pairs}"/>'


def furnace(
    size: int,
    spp: int,
    *,
    shape: str = "cube",
    max_depth: int = -1,
    rr_depth: int = 10,
    L: ArrayLike | None = None,
) -> str:
    """A closed cavity, `id="cavity"`, that emits everywhere; its material comes from outside."""
    emitted = light_values() if L is None else np.asarray(L)
    return f"""<scene version="3.0.0"> {integrator(max_depth, rr_depth)}
        {sensor(size, spp, origin="0.1, -0.2, -0.5", target="0.3, 0.2, 1", fov=80)}
        <shape type="{shape}" id="cavity"> <boolean name="flip_normals" value="true"/>
            <bsdf type="diffuse"/> <emitter type="area"> {curve("radiance", emitted)} </emitter> </shape>
            </scene>"""


# --- stock Mitsuba, for what does not fluoresce: three bands are its red, green and blue

BANDS = Wavelengths(450, 650, 100)
"""The three bands of comparisons with stock Mitsuba."""


def colour(name: str, value: ArrayLike, *, stock: bool) -> str:
    """Three numbers as a spectrum property: `rgb` for stock Mitsuba, a table over BANDS for Fluorspar."""
    numbers = [float(v) for v in np.broadcast_to(value, 3)]
    if stock:
        return f'<rgb name="{name}" value="{numbers[0]}, {numbers[1]}, {numbers[2]}"/>'
    pairs = ", ".join(f"{w:g}:{v}" for w, v in zip(BANDS.values, numbers, strict=True))
    return f'<spectrum name="{name}" value="{pairs}"/>'


def stock_renders(xml: str, spp: int, seeds: int) -> Array:
    """Render with stock `path` in an rgb variant, once for each seed; ndarray of shape (seeds, Y, X, 3)."""
    with use_variant("llvm_ad_rgb"):
        import mitsuba as mi

        scene = mi.load_string(xml)
        return np.array(
            [np.array(mi.render(scene, spp=spp, seed=1000 + k)) for k in range(seeds)], dtype=float
        )


NARROW = Wavelengths(452, 652, 100)
"""Three bands for comparisons with spectral variants: off the knots of tabulated spectra."""
CLOSE = Wavelengths(452, 652, 100 / 7)
"""Every seventh band is one of NARROW; close enough that lamps are sampled, and not averaged over bands."""


def narrow_renders(xml: str, spp: int, seeds: int) -> Array:
    """Render with stock `path` in a spectral variant, whose film has the bands NARROW, 2 nm wide.

    Parameters
    ----------
    xml : str
        With the film that `sensor` writes.

    Returns
    -------
    ndarray of shape (seeds, Y, X, 3)
        Radiance per nm.
    """
    bands = "".join(
        f'<spectrum name="band{w:g}" value="{w - 1:g}:1, {w:g}:1, {w + 1:g}:1"/>' for w in NARROW.values
    )
    xml = xml.replace('<film type="hdrfilm">', f'<film type="specfilm"> {bands}')
    with use_variant("llvm_ad_spectral"):
        import mitsuba as mi

        scene = mi.load_string(xml)
        renders = [np.array(mi.render(scene, spp=spp, seed=1000 + k)) for k in range(seeds)]
    return np.array(renders, dtype=float)[..., :3] / 2


def write(folder: Path, xml: str, name: str = "scene.xml") -> Path:
    path = folder / name
    path.write_text(xml)
    return path


# --- statistics


def values_and_errors(image: SpectralImage, component: str | None = None) -> tuple[Array, Array]:
    """Radiance of the total or of a component and its standard error, each ndarray of shape (Y, X, N)."""
    if component is None:
        return image.total().values.astype(float), image.standard_error().values.astype(float)
    index = image.components.index(component)
    errors = image.dataset["component_standard_error"].values[index]
    return image.component(component).values.astype(float), errors.astype(float)


def z_scores(values: Array, errors: Array, expected: Array, spp: int) -> Array:
    """(value - expected) / standard error, scaled to standard deviation 1; shape of `values`."""
    freedom = min(spp, 32) - 1
    return (values - expected) / errors / np.sqrt(freedom / (freedom - 2))


def block_sums(values: Array, blocks: int) -> Array:
    """Sum over blocks x blocks equal parts of an image: (Y, X, N) to (blocks, blocks, N)."""
    height, width, bands = values.shape
    parts = values.reshape(blocks, height // blocks, blocks, width // blocks, bands)
    return parts.sum(axis=(1, 3))


def bound(observations: int, chance: float = 1e-3) -> float:
    """The |z| that the largest of so many normal values exceeds by chance with this probability (Bonferroni)."""
    return NormalDist().inv_cdf(1 - chance / (2 * observations))


def assert_agrees(image: SpectralImage, others: Array, *, blocks: int, bias: float) -> dict[str, Any]:
    """Hold an image of BANDS against independent renders of stock Mitsuba.

    Asserts that no block mean of any band is further off than the noise explains (bounded for their number),
    and that the mean over the image differs by less than `bias` in each band.

    Parameters
    ----------
    image
        Ours; its standard errors tell its noise.
    others : ndarray of shape (K, Y, X, 3)
        K independent renders; the noise of their mean is their scatter, pooled over the pixels of a block.
    """
    ours, error = values_and_errors(image)
    theirs, theirs_error = others.mean(0), others.std(0, ddof=1) / np.sqrt(len(others))
    variance = block_sums(error**2 + theirs_error**2, blocks)
    z = block_sums(ours - theirs, blocks) / np.sqrt(np.where(variance > 0, variance, np.inf))
    scale = theirs.mean((0, 1))
    off = (ours - theirs).mean((0, 1)) / scale
    off_error = np.sqrt((error**2 + theirs_error**2).sum((0, 1))) / theirs[..., 0].size / scale
    report = {"largest z": np.abs(z).max(), "bound": bound(z.size), "bias": off, "error of bias": off_error}
    assert (scale > 0).all(), report
    assert np.abs(z).max() < bound(z.size), report
    assert np.abs(off).max() < bias, report
    assert (np.abs(off) < 4.5 * off_error).all(), report
    return report
