"""General surfaces and lights against stock Mitsuba, in a spectral variant.

Rationale
    Without luminescence Fluorspar must show what the `path` integrator of a spectral variant shows, whatever the
    surfaces: one small scene for each family of plugins, and one of all. Stock's film gets three bands 2 nm wide,
    so narrow that every spectrum is straight within.
Expected
    Image means within 3 standard errors, which are below 0.05 %. Of blocks of 4 x 4 pixels, (ours - stock) /
    standard error has a standard deviation of 0.8-1.3; blocks of which 0.01 % is more than the noise, such as those
    of the sky alone, are left out.
Samples
    32 x 32 pixels x as many samples of ours as the noise of each group asks for, and twice as many of stock.
    The noise of ours is from `standard_error`, of stock from the scatter of eight seeds. All lamps are large and all
    paths end after six vertices, which keeps single samples below 20 times the mean.
Result
    Image means differ by 0.00-0.06 % (0.0-1.9 standard errors), the standard deviation of z is 0.8-1.15.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab import CLOSE, block_sums, narrow_renders, sensor, values_and_errors, write

from fluorspar import load_scene, render
from fluorspar.scene.variants import use_variant

SPP = {
    **{"textures": 3584, "plastics": 2048, "glass": 1536, "metals": 3840, "lights": 3584, "projected": 1024},
    **{"copies": 2560, "principled": 3840, "layers": 2560, "mixed": 5120},
}
SEEDS = 8


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with pictures: `colours.png`, `grey.png`, `normals.png`, `sky.exr`."""
    made = tmp_path_factory.mktemp("general")
    rng = np.random.default_rng(3)
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        def bytes_of(values: object) -> np.ndarray:
            return (np.asarray(values) * 255).astype(np.uint8)

        mi.Bitmap(bytes_of(rng.uniform(0.1, 0.9, (5, 8, 3)))).write(str(made / "colours.png"))
        mi.Bitmap(bytes_of(rng.uniform(0.2, 0.8, (6, 4, 1)))).write(str(made / "grey.png"))
        tilt = rng.uniform(0.35, 0.65, (8, 8, 3))
        tilt[..., 2] = 0.95
        mi.Bitmap(bytes_of(tilt)).write(str(made / "normals.png"))
        sky = rng.uniform(0.2, 1.0, (8, 16, 3)) * np.linspace(2, 0.3, 8)[:, np.newaxis, np.newaxis]
        mi.Bitmap(sky.astype(np.float32)).write(str(made / "sky.exr"))
    return made


def bitmap(name: str, file: str, **more: str) -> str:
    """A texture; `more` are strings, or elements as they are."""
    inside = "".join(v if v.startswith("<") else f'<string name="{k}" value="{v}"/>' for k, v in more.items())
    return (
        f'<texture type="bitmap" name="{name}"> <string name="filename" value="{file}"/> {inside} </texture>'
    )


RAW = '<boolean name="raw" value="true"/>'
TURNED = '<transform name="to_uv"> <scale x="3" y="2"/> <rotate z="1" angle="20"/> </transform>'
CONSTANT = '<emitter type="constant"> <rgb name="radiance" value="0.4, 0.5, 0.6"/> </emitter>'
LAMP = """<shape type="rectangle"> <transform name="to_world"> <rotate x="1" angle="90"/> <scale value="0.9"/>
    <translate y="2.5"/> </transform> <emitter type="area"> {radiance} </emitter> </shape>"""
WHITE_LAMP = LAMP.format(radiance='<rgb name="radiance" value="3, 2.5, 2"/>')
GREY = '<bsdf type="diffuse"> <spectrum name="reflectance" value="400:0.3, 700:0.6"/> </bsdf>'
PLASTIC = '<bsdf type="plastic"> <rgb name="diffuse_reflectance" value="0.2, 0.5, 0.3"/> </bsdf>'


def number(name: str, value: float) -> str:
    return f'<float name="{name}" value="{value}"/>'


def scene(floor: str, left: str, right: str, back: str = GREY, lights: str = CONSTANT + WHITE_LAMP) -> str:
    """A floor, two balls and a wall behind them, of these BSDFs, under a lamp and the sky."""
    return f"""<scene version="3.0.0"> <integrator type="path"> <integer name="max_depth" value="6"/> </integrator>
        {sensor(32, 4, origin="0, 1.2, 4", target="0, 0.5, 0", fov=45)} {lights}
        <shape type="rectangle"> <transform name="to_world"> <rotate x="1" angle="-90"/> <scale value="2.5"/>
            </transform> {floor} </shape>
        <shape type="rectangle"> <transform name="to_world"> <scale value="1.2"/> <translate y="0.8" z="-1.2"/>
            </transform> {back} </shape>
        <shape type="sphere"> <point name="center" x="-0.7" y="0.6" z="0"/> <float name="radius" value="0.6"/>
            {left} </shape>
        <shape type="sphere"> <point name="center" x="0.7" y="0.6" z="0.2"/> <float name="radius" value="0.6"/>
            {right} </shape> </scene>"""


CHECKS = """<bsdf type="diffuse"> <texture type="checkerboard" name="reflectance">
    <rgb name="color0" value="0.8, 0.2, 0.3"/> <spectrum name="color1" value="400:0.1, 700:0.7"/>
    <transform name="to_uv"> <scale x="4" y="6"/> </transform> </texture> </bsdf>"""
GOLD = f"""<bsdf type="roughconductor"> <string name="material" value="Au"/>
    {bitmap("alpha", "grey.png", raw=RAW)} </bsdf>"""
GLASS = '<bsdf type="dielectric"/>'
GROUPS = {
    "textures": scene(
        f'<bsdf type="diffuse"> {bitmap("reflectance", "colours.png", to_uv=TURNED)} </bsdf>',
        f"""<bsdf type="plastic"> {
            bitmap("diffuse_reflectance", "colours.png", filter_type="nearest", wrap_mode="mirror")
        } </bsdf>""",
        f"""<bsdf type="twosided"> <bsdf type="diffuse"> {
            bitmap("reflectance", "grey.png", wrap_mode="clamp", to_uv=TURNED)
        } </bsdf> </bsdf>""",
        back=CHECKS,
    ),
    "plastics": scene(
        """<bsdf type="roughplastic"> <rgb name="diffuse_reflectance" value="0.7, 0.3, 0.2"/>
            <boolean name="nonlinear" value="true"/> <float name="alpha" value="0.2"/> </bsdf>""",
        """<bsdf type="plastic"> <rgb name="specular_reflectance" value="0.9, 0.6, 0.4"/>
            <float name="int_ior" value="1.8"/> </bsdf>""",
        f"""<bsdf type="roughplastic"> {bitmap("diffuse_reflectance", "colours.png")}
            <string name="distribution" value="ggx"/> </bsdf>""",
    ),
    "glass": scene(
        PLASTIC,
        GLASS,
        """<bsdf type="roughdielectric"> <float name="alpha" value="0.2"/>
            <rgb name="specular_transmittance" value="0.9, 0.6, 0.4"/> </bsdf>""",
        back='<bsdf type="thindielectric"/>',
    ),
    "metals": scene(
        f"""<bsdf type="roughconductor"> <spectrum name="eta" value="400:1.5, 700:0.3"/>
            <spectrum name="k" value="400:2, 700:5"/> <float name="alpha_u" value="0.4"/>
            <float name="alpha_v" value="0.2"/> {bitmap("specular_reflectance", "colours.png", to_uv=TURNED)}
            </bsdf>""",
        GOLD,
        """<bsdf type="conductor"> <string name="material" value="Cu"/>
            <rgb name="specular_reflectance" value="0.9, 0.7, 0.8"/> </bsdf>""",
    ),
    "lights": scene(
        PLASTIC,
        GREY,
        GREY,
        lights="""<emitter type="envmap"> <string name="filename" value="sky.exr"/>
            <transform name="to_world"> <rotate x="0.6" y="0.8" angle="50"/> </transform> </emitter>"""
        + LAMP.format(radiance=bitmap("radiance", "colours.png"))
        + """<emitter type="spot"> <transform name="to_world">
            <lookat origin="1, 2, 2" target="-0.3, 0, 0" up="0, 1, 0"/> </transform>
            <rgb name="intensity" value="3, 5, 4"/> </emitter>""",
    ),
    "projected": scene(
        PLASTIC,
        GREY,
        GREY,
        lights=f"""<emitter type="projector"> {bitmap("irradiance", "colours.png")} {number("scale", 1.5)}
            {number("fov", 50)} <transform name="to_world"> <lookat origin="0.5, 1.5, 3" target="0, 0.4, 0"
            up="0.1, 1, 0"/> </transform> </emitter>
            <emitter type="spot"> {bitmap("texture", "colours.png", filter_type="nearest", to_uv=TURNED)}
            <transform name="to_world"> <lookat origin="-1, 2, 2" target="0, 0, 0" up="0, 1, 0"/> </transform>
            <rgb name="intensity" value="3, 5, 4"/> {number("cutoff_angle", 30)} </emitter>
            <emitter type="spot"> {bitmap("texture", "grey.png")} {number("intensity", 4)}
            <transform name="to_world"> <lookat origin="1, 2, 2" target="0.3, 0, 0" up="0, 1, 0"/> </transform>
            </emitter>"""
        + CONSTANT,
    ),
    "copies": scene(
        GREY,
        PLASTIC,
        "<ref id='gold'/>",
        lights=CONSTANT
        + WHITE_LAMP
        + f"""{GOLD.replace(">", " id='gold'>", 1)} <shape type="shapegroup" id="group">
            <shape type="sphere"> <float name="radius" value="0.2"/> <point name="center" x="0" y="0.2" z="0"/>
            <bsdf type="plastic"> {bitmap("diffuse_reflectance", "colours.png")} </bsdf> </shape>
            <shape type="cube"> <transform name="to_world"> <scale value="0.15"/> <translate x="0.1" y="0.5"/>
            </transform> <ref id="gold"/> </shape> </shape>"""
        + "".join(
            f"""<shape type="instance"> <ref id="group"/> <transform name="to_world"> <rotate y="1" angle="{turn}"/>
                <scale value="{size}"/> <translate x="{x}" z="1"/> </transform> </shape>"""
            for turn, size, x in ((0, 1.5, -0.5), (40, 2, 0.7))
        ),
    ),
    "principled": scene(
        f"""<bsdf type="principled"> {bitmap("base_color", "colours.png")} {number("roughness", 0.4)}
            {number("specular", 0.7)} {number("sheen", 0.5)} </bsdf>""",
        f"""<bsdf type="principled"> <rgb name="base_color" value="0.8, 0.3, 0.2"/> {number("metallic", 0.7)}
            {number("clearcoat", 0.6)} {number("anisotropic", 0.4)} {number("roughness", 0.3)} </bsdf>""",
        f"""<bsdf type="principled"> <rgb name="base_color" value="0.8, 0.9, 0.5"/> {number("spec_trans", 0.7)}
            {number("roughness", 0.3)} </bsdf>""",
        back=f"""<bsdf type="principledthin"> <rgb name="base_color" value="0.3, 0.6, 0.7"/>
            {number("diff_trans", 0.8)} {number("spec_trans", 0.3)} {number("roughness", 0.4)} </bsdf>""",
    ),
    "layers": scene(
        f"""<bsdf type="bumpmap"> {bitmap("arbitrary", "grey.png", raw=RAW)} {number("scale", 0.3)}
            <bsdf type="roughplastic"/> </bsdf>""",
        f"""<bsdf type="blendbsdf"> {bitmap("weight", "grey.png", raw=RAW)} {GREY} <bsdf type="roughplastic">
            <rgb name="diffuse_reflectance" value="0.2, 0.4, 0.7"/> </bsdf> </bsdf>""",
        f"""<bsdf type="mask"> {bitmap("opacity", "grey.png", raw=RAW)}
            <bsdf type="twosided"> {CHECKS} </bsdf> </bsdf>""",
        back=f'<bsdf type="normalmap"> {bitmap("normalmap", "normals.png", raw=RAW)} {GREY} </bsdf>',
    ),
    "mixed": scene(
        f'<bsdf type="roughplastic"> {bitmap("diffuse_reflectance", "colours.png", to_uv=TURNED)} </bsdf>',
        GLASS,
        f"""<bsdf type="principled"> {bitmap("base_color", "colours.png")} {number("metallic", 0.4)} </bsdf>""",
        back=GOLD,
        lights=WHITE_LAMP
        + '<emitter type="envmap"> <string name="filename" value="sky.exr"/> <float name="scale" value="0.5"/> '
        "</emitter>",
    ),
}


@pytest.mark.parametrize("name", GROUPS)
def test_against_stock(name: str, folder: Path) -> None:
    xml = GROUPS[name]
    for file in ("colours.png", "grey.png", "normals.png", "sky.exr"):
        xml = xml.replace(f'"{file}"', f'"{folder / file}"')
    spp = SPP[name]
    image = render(load_scene(write(folder, xml)), spp=spp, wavelengths=CLOSE, seed=7)
    y = image.dataset.radiance.values.astype(float)
    assert not y[[2, 4, 5, 6]].any(), "nothing luminesces"
    np.testing.assert_allclose(y.sum(0), image.total().values, rtol=1e-5, atol=1e-6)
    ours, error = (values[..., ::7] for values in values_and_errors(image))
    stock = narrow_renders(xml, spp=2 * spp // SEEDS, seeds=SEEDS)
    theirs, variance = stock.mean(0), error**2 + stock.var(0, ddof=1) / SEEDS

    off = (ours - theirs).mean((0, 1)) / theirs.mean((0, 1))
    off_error = np.sqrt(variance.sum((0, 1))) / theirs.sum((0, 1))
    noise = np.sqrt(block_sums(variance, 8))
    z = (block_sums(ours - theirs, 8) / noise)[noise > 1e-4 * block_sums(theirs, 8)]
    report = {"off": off, "error": off_error, "sd of z": z.std(), "largest z": np.abs(z).max()}
    assert (off_error < 0.0005).all(), report
    assert (np.abs(off) < 3 * off_error).all(), report
    assert 0.8 < z.std() < 1.3, report


def grey(name: str, value: float) -> str:
    return f'<spectrum name="{name}" value="{value}"/>'


GREYS = {
    "plastics": (
        f'<bsdf type="roughplastic"> {grey("diffuse_reflectance", 0.6)} {number("alpha", 0.2)} </bsdf>',
        f'<bsdf type="plastic"> {grey("diffuse_reflectance", 0.2)} {grey("specular_reflectance", 0.7)} </bsdf>',
        '<bsdf type="roughdielectric"> <float name="alpha" value="0.2"/> </bsdf>',
    ),
    "principled": (
        f'<bsdf type="principled"> {grey("base_color", 0.6)} {number("metallic", 0.6)} </bsdf>',
        f'<bsdf type="principled"> {grey("base_color", 0.3)} {number("clearcoat", 0.6)} </bsdf>',
        f"""<bsdf type="principled"> {grey("base_color", 0.7)} {number("spec_trans", 0.7)}
            {number("roughness", 0.3)} </bsdf>""",
    ),
    "layers": (
        f"""<bsdf type="blendbsdf"> {number("weight", 0.4)} <bsdf type="diffuse"/> <bsdf type="roughplastic">
            {grey("diffuse_reflectance", 0.2)} </bsdf> </bsdf>""",
        f'<bsdf type="mask"> {number("opacity", 0.6)} <bsdf type="twosided"> <bsdf type="diffuse"/> </bsdf> </bsdf>',
        f"""<bsdf type="roughconductor"> {grey("eta", 0.3)} {grey("k", 4)} {number("alpha", 0.3)} </bsdf>""",
    ),
}


@pytest.mark.parametrize("name", GREYS)
def test_noise(name: str, folder: Path) -> None:
    """Where all is grey, a sample is as noisy as one of stock's monochrome `path`: lobes are chosen as stock does.

    Expected: at most 1.15 x the variance, which 16 seeds of 1024 pixels know to 2 %; it is 0.99 to 1.03 x.
    """
    lights = (
        LAMP.format(radiance=grey("radiance", 3))
        + f'<emitter type="constant"> {grey("radiance", 0.5)} </emitter>'
    )
    xml = scene(*GREYS[name], back='<bsdf type="diffuse"/>', lights=lights)
    ours = render(load_scene(write(folder, xml)), spp=1024, wavelengths=CLOSE, seed=3)
    _, error = values_and_errors(ours)
    with use_variant("llvm_ad_mono"):
        import mitsuba as mi

        stock = mi.load_string(xml)
        renders = np.array([np.array(mi.render(stock, spp=64, seed=seed)) for seed in range(16)], dtype=float)
    of_sample = 1024 * (error[..., 0] ** 2).sum(), 64 * renders.var(0, ddof=1).sum()
    np.testing.assert_allclose(values_and_errors(ours)[0][..., 0].mean(), renders.mean(), rtol=0.01)
    assert of_sample[0] < 1.15 * of_sample[1], of_sample
