"""General surfaces against closed forms: coats, dye maps, layers, furnaces; and paths used for other spectra.

Rationale
    What no other renderer shows has to be known from elsewhere. A base that conserves photons conserves them under a
    coat, which only sends light back to it; a convex body under uniform light shows its albedo; under a distant light
    a matte plate seen from above shows E cos / pi times its matrix, whatever it is nested in.
Expected
    Counts and albedos within 4.5 standard errors and 0.1 %; what has no noise to 1e-5.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import (
    FINE,
    PHOTON_GRID,
    albedo,
    bell,
    curve,
    furnace,
    inline,
    light_values,
    paint,
    photon_conserving,
    sampled,
    values_and_errors,
    write,
)

from fluorspar import COMPONENTS, SpectralImage, load_scene, render
from fluorspar.errors import ApproximationWarning
from fluorspar.job import RenderJob
from fluorspar.paths.chunks import trace_chunks
from fluorspar.paths.render import render_chunks
from fluorspar.scene.variants import use_variant
from fluorspar.spectral.light import light_on

GRID = PHOTON_GRID
DYE = paint("dye", 0.2 + 0.4 * (FINE > 550), bell(580, 40, 0.6), bell(480, 40))


# --- coats


@pytest.mark.parametrize("scatterings", [1, 16])
def test_a_coated_dye_conserves_photons(scatterings: int, tmp_path: Path) -> None:
    """A closed cavity of a dye under a smooth coat, which emits everywhere; see `test_photons.py`.

    Stock's plastic gains 0.12 % of uniform light at each scattering, with which the count must grow.
    """
    xml = furnace(48, 256, max_depth=scatterings + 1, rr_depth=1000)
    coated = (
        f'<bsdf type="fluorescent"> <float name="int_ior" value="1.5"/> {inline(photon_conserving())} </bsdf>'
    )
    scene = load_scene(write(tmp_path, xml.replace('<bsdf type="diffuse"/>', coated)))
    image = render(scene, wavelengths=GRID, excitation="grid", seed=6)
    photons = image.total().values.astype(float) @ GRID.values / (GRID.values @ sampled(light_values(), GRID))
    gain = albedo(
        '<bsdf type="plastic" version="3.0.0"> <float name="int_ior" value="1.5"/>'
        '<boolean name="nonlinear" value="true"/>'
        '<spectrum name="diffuse_reflectance" value="1"/> </bsdf>'
    )
    assert 1 < gain < 1.0015
    expected = sum(gain**k for k in range(scatterings + 1))
    error = photons.std() / np.sqrt(photons.size)
    report = {"off": photons.mean() / expected - 1, "error": error / expected, "gain": gain}
    assert error < 0.0005 * expected, report
    assert abs(photons.mean() - expected) < min(4.5 * error, 0.001 * expected), report


# --- uniform light on a convex body


BODIES = {
    "plastic": ('<bsdf type="plastic" version="3.0.0"> {white} </bsdf>', 1.0012),
    "rough plastic": (
        '<bsdf type="roughplastic" version="3.0.0"> <float name="alpha" value="0.3"/> {white} </bsdf>',
        0.87,
    ),
    "ggx": (
        '<bsdf type="roughplastic" version="3.0.0"> <float name="alpha" value="0.3"/>'
        '<string name="distribution" value="ggx"/> {white} </bsdf>',
        0.68,
    ),
    "glass": ('<bsdf type="dielectric" version="3.0.0"/>', 1.0),
}


def ball(bsdf: str, light: str, size: int = 32, spp: int = 256, max_depth: int = -1) -> str:
    """A ball that fills the picture of an orthographic camera, so that its disk is the mean over cosines."""
    camera = f"""<sensor type="orthographic"> <transform name="to_world"> <lookat origin="0, 0, 4"
        target="0, 0, 0" up="0, 1, 0"/> </transform> <film type="hdrfilm"> <integer name="width" value="{size}"/>
        <integer name="height" value="{size}"/> <rfilter type="box"/> </film> <sampler type="independent">
        <integer name="sample_count" value="{spp}"/> </sampler> </sensor>"""
    return f"""<scene version="3.0.0"> <integrator type="path"> <integer name="max_depth" value="{max_depth}"/>
        </integrator> {camera} {light} <shape type="sphere" id="ball"> {bsdf} </shape> </scene>"""


SKY = f'<emitter type="constant"> {curve("radiance", light_values())} </emitter>'


@pytest.mark.parametrize("name", BODIES)
def test_white_bodies_under_uniform_light(name: str, tmp_path: Path) -> None:
    """White bodies vanish, but for what stock's plugins are known to gain or lose."""
    bsdf, stated = BODIES[name]
    bsdf = bsdf.format(white='<spectrum name="diffuse_reflectance" value="1"/>')
    image = render(
        load_scene(write(tmp_path, ball(bsdf.replace(' version="3.0.0"', ""), SKY))),
        wavelengths=GRID,
        excitation="grid",
        seed=3,
    )
    values, errors = values_and_errors(image)
    L = sampled(light_values(), GRID)
    share = (values / L).mean((0, 1)) - (1 - np.pi / 4)
    error = np.sqrt(((errors / L) ** 2).sum((0, 1))) / values[..., 0].size
    expected = 1.0 if name == "glass" else albedo(bsdf)
    report = {"share": share / (np.pi / 4), "expected": expected, "error": error}
    assert abs(expected - stated) < (0.0003 if stated > 0.99 else 0.01), report
    assert (np.abs(share / (np.pi / 4) - expected) < 4.5 * error / (np.pi / 4) + 2e-4).all(), report


@pytest.mark.parametrize("sky", ["constant", "environment map"])
def test_a_fluorescent_body_under_uniform_light(sky: str, tmp_path: Path) -> None:
    """Each ray that meets it shows D L; there is no light but that of the sky."""
    light, L = SKY, sampled(light_values(), GRID)
    if sky == "environment map":
        with use_variant("scalar_rgb"):
            import mitsuba as mi

            mi.Bitmap(np.ones((4, 8, 3), np.float32)).write(str(tmp_path / "sky.exr"))
        light = f'<emitter type="envmap"> <string name="filename" value="{tmp_path / "sky.exr"}"/> </emitter>'
    scene = load_scene(
        write(tmp_path, ball('<bsdf type="roughplastic"/>', light, spp=128)), materials={"ball": DYE}
    )
    image = render(scene, wavelengths=GRID, excitation="grid", seed=3, component_errors=True)
    if sky == "environment map":
        L = light_on(scene.lights[0].spectrum, GRID)
    D = DYE.on(GRID)
    centre = (slice(8, 24), slice(8, 24))
    for component, expected in (
        (COMPONENTS[1], D.reflect(L)),
        (COMPONENTS[2], D.apply_luminescent(L)),
    ):
        values, errors = (part[centre] for part in values_and_errors(image, component))
        error = np.sqrt((errors**2).sum((0, 1))) / 256
        off = values.mean((0, 1)) - expected
        report = {"off": off / expected.max(), "error": error / expected.max()}
        assert (np.abs(off) < 4.5 * error + 1e-5 * expected.max()).all(), report
        assert (error < 0.002 * expected.max()).all(), report


def test_a_metal_of_index_zero_is_a_mirror(tmp_path: Path) -> None:
    """Public scenes have metals whose red index is 0 or just below, from a fit of their colour."""
    metal = """<bsdf type="conductor"> <rgb name="eta" value="0, 4.1, 4.6"/> <rgb name="k" value="0, 0.1, 1.3"/>
        </bsdf>"""
    with pytest.warns(ApproximationWarning):
        scene = load_scene(write(tmp_path, ball(metal, SKY, spp=16)))
    y = components(render(scene, wavelengths=GRID, excitation="grid", seed=3)).sum(0)[16, 16] / sampled(
        light_values(), GRID
    )
    np.testing.assert_allclose(y[GRID.values >= 620], 1, rtol=1e-4)
    assert (y[GRID.values <= 540] < 0.5).all()


# --- under a distant light, without noise


def plate(bsdf: str, pixels: int = 4, textures: str = "") -> str:
    """A plate that fills the picture, under a distant light of irradiance 1 at 60 degrees."""
    camera = f"""<sensor type="orthographic"> <transform name="to_world"> <lookat origin="0, 0, 4"
        target="0, 0, 0" up="0, 1, 0"/> </transform> <film type="hdrfilm"> <integer name="width" value="{pixels}"/>
        <integer name="height" value="{pixels}"/> <rfilter type="box"/> </film> <sampler type="independent">
        <integer name="sample_count" value="16"/> </sampler> </sensor>"""
    return f"""<scene version="3.0.0"> <integrator type="path"/> {camera} {textures}
        <emitter type="directional"> <vector name="direction" x="0.8660254037844386" y="0" z="-0.5"/>
            {curve("irradiance", 1.0)} </emitter>
        <shape type="rectangle" id="plate"> {bsdf} </shape> </scene>"""


def shown(folder: Path, bsdf: str, pixels: int = 4) -> np.ndarray:
    """Components of the plate over E cos / pi, ndarray of shape (7, Y, X, N), x to the right and y upwards."""
    image = render(
        load_scene(write(folder, plate(bsdf, pixels))), wavelengths=GRID, excitation="grid", seed=2
    )
    return components(image)[:, ::-1] / (0.5 / np.pi)


def components(image: SpectralImage) -> np.ndarray:
    return image.dataset.radiance.values.astype(float)


def picture(folder: Path, name: str, texels: np.ndarray) -> str:
    """A grey picture as a raw texture that is not interpolated, its first row at the bottom."""
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        mi.Bitmap(texels[..., np.newaxis].astype(np.float32)).write(str(folder / f"{name}.exr"))
    return f"""<texture type="bitmap" name="{name}"> <string name="filename" value="{folder / name}.exr"/>
        <boolean name="raw" value="true"/> <string name="filter_type" value="nearest"/> </texture>"""


def expected_of(reflected: float = 1.0, dye: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    D, one = DYE.on(GRID), np.ones(len(GRID))
    return reflected * D.reflect(one), dye * D.apply_luminescent(one)


def assert_shows(y: np.ndarray, reflected: np.ndarray, dye: np.ndarray) -> None:
    """That there is direct light of both kinds, and no other."""
    np.testing.assert_allclose(y[1], np.broadcast_to(reflected, y[1].shape), rtol=3e-5, atol=1e-6)
    np.testing.assert_allclose(y[2], np.broadcast_to(dye, y[2].shape), rtol=3e-5, atol=1e-6)
    np.testing.assert_array_equal(y[[0, 3, 4, 5, 6]], 0)


MAP = np.array([[0.0, 0.25, 1.0, 0.5], [0.75, 0.1, 0.0, 2.0], [1.0, 1.0, 0.3, 0.2], [0.6, 0.9, 0.05, 0.4]])


def test_a_dye_map_prints_the_dye(tmp_path: Path) -> None:
    """Luminescence follows the concentration texel by texel, what is reflected does not."""
    y = shown(
        tmp_path, f'<bsdf type="fluorescent"> {inline(DYE)} {picture(tmp_path, "concentration", MAP)} </bsdf>'
    )
    S, L = expected_of()
    assert_shows(y, S, MAP[..., np.newaxis] * L)


def test_a_reflectance_texture_on_a_dye(tmp_path: Path) -> None:
    """What is reflected follows the picture, luminescence does not."""
    texels = np.clip(MAP, 0.05, 0.95)
    spectra = inline(DYE).split("<spectrum")
    without = "<spectrum".join(part for part in spectra if 'name="reflectance"' not in part)
    y = shown(
        tmp_path, f'<bsdf type="fluorescent"> {without} {picture(tmp_path, "reflectance", texels)} </bsdf>'
    )
    _, L = expected_of()
    assert_shows(y, np.repeat(texels[..., np.newaxis], len(GRID), axis=2), L)


INK = f'<bsdf type="fluorescent"> {inline(DYE)} </bsdf>'
BLACK = '<bsdf type="diffuse"> <spectrum name="reflectance" value="0"/> </bsdf>'
NESTED = {
    "alone": (INK, 1.0),
    "twosided": (f'<bsdf type="twosided"> {INK} </bsdf>', 1.0),
    "blend": (f'<bsdf type="blendbsdf"> <float name="weight" value="0.25"/> {INK} {BLACK} </bsdf>', 0.75),
    "mask": (f'<bsdf type="mask"> <float name="opacity" value="0.4"/> {INK} </bsdf>', 0.4),
    "flat bumps": (f'<bsdf type="bumpmap"> {{flat}} {INK} </bsdf>', 1.0),
    "mask of a blend of two sides": (
        f"""<bsdf type="mask"> <float name="opacity" value="0.4"/> <bsdf type="twosided">
        <bsdf type="blendbsdf"> <float name="weight" value="0.25"/> {INK} {BLACK} </bsdf> </bsdf> </bsdf>""",
        0.3,
    ),
}


@pytest.mark.parametrize("name", NESTED)
def test_a_dye_in_other_surfaces(name: str, tmp_path: Path) -> None:
    bsdf, share = NESTED[name]
    if "flat" in bsdf:
        bsdf = bsdf.format(flat=picture(tmp_path, "bumps", np.full((4, 4), 0.5)))
    assert_shows(shown(tmp_path, bsdf), *expected_of(share, share))


# --- components and relighting


def test_a_matte_scene_shows_the_same_the_general_way(tmp_path: Path) -> None:
    """The Cornell box of fluorescent posters, with a gloss that nobody sees; image means by component."""
    import fluorspar

    source = Path(fluorspar.__file__).parent / "data" / "scenes" / "cornell-box.xml"
    xml = source.read_text()
    gloss = """<shape type="rectangle"> <transform name="to_world"> <scale value="1e-3"/>
        <translate x="1000" y="1000" z="1000"/> </transform> <bsdf type="roughplastic"/> </shape> </scene>"""
    path = write(tmp_path, xml.replace("cornell/", f"{source.parent}/cornell/").replace("</scene>", gloss))
    images = []
    for seed, scene in enumerate((load_scene(source), load_scene(path))):
        assert (scene.lobes is None) == (seed == 0)
        images.append(
            fluorspar.render(
                scene,
                wavelengths=GRID,
                excitation="grid",
                seed=seed,
                spp=256,
                size=(48, 48),
                component_errors=True,
            )
        )
    for component in COMPONENTS:
        (ours, error), (others, other_error) = (values_and_errors(image, component) for image in images)
        off = (others - ours).mean((0, 1))
        off_error = np.sqrt((error**2 + other_error**2).sum((0, 1))) / ours[..., 0].size
        top = ours.mean((0, 1)).max()
        report = {"component": component, "off": off / top, "error": off_error / top}
        assert top > 0, report
        assert (np.abs(off) <= 4.5 * off_error + 1e-6 * top).all(), report
        assert (off_error < 0.02 * top).all(), report


def test_paths_among_black_surfaces_serve_bright_ones(tmp_path: Path) -> None:
    """No spectrum ends a path: those traced among black surfaces show bright ones with no bias.

    Roulette then goes on with a chance of 0.05, so it has to decide only once here, or the mean were that of few.
    """
    jobs = []
    for k, S in enumerate((0.0, 0.8)):
        bsdf = f"""<bsdf type="roughplastic"> <spectrum name="diffuse_reflectance" value="{S}"/>
            <float name="alpha" value="0.3"/> </bsdf>"""
        xml = furnace(32, 256, rr_depth=1, max_depth=2, L=np.ones(len(FINE)))
        jobs.append(
            RenderJob.of(
                load_scene(write(tmp_path, xml.replace('<bsdf type="diffuse"/>', bsdf), f"{k}.xml")),
                wavelengths=GRID,
                seed=k,
            )
        )
    black, bright = jobs
    relit = values_and_errors(render_chunks(trace_chunks(black), bright))
    direct = values_and_errors(render_chunks(trace_chunks(bright), bright))
    off = (relit[0] - direct[0]).mean() / direct[0].mean()
    error = np.sqrt((relit[1][..., 0] ** 2 + direct[1][..., 0] ** 2).sum()) / direct[0][..., 0].sum()
    assert abs(off) < 4.5 * error
    assert error < 0.005
