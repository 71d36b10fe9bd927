"""What `--matte` takes, as what, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fluorspar import Scene, load_scene, render
from fluorspar.errors import ApproximationWarning, SceneError
from fluorspar.scene import averages
from fluorspar.scene.nodes import build, resolving
from fluorspar.scene.variants import SPECTRUM_VARIANT, use_variant
from xml_scene import QUAD, coloured_ply, mesh, xml_scene

PLY = coloured_ply(
    """0 0 0 0.2 0.2 0.2
1 0 0 0.8 0.8 0.8
0 1 0 0.2 0.2 0.2
-3 0 0 0.5 0.5 0.5
0 1 0 0.5 0.5 0.5""",
    """3 0 1 2 0.1 0.1 0.1
3 0 4 3 0.5 0.5 0.5""",
)
"""Two triangles of areas 1 : 3, with grey faces and grey vertices."""


def attribute(name: str, of: str = "face_color") -> str:
    return f'<texture type="mesh_attribute" name="{name}"> <string name="name" value="{of}"/> </texture>'


def on_ball(bsdf: str) -> str:
    return f'<shape type="sphere" id="ball"> {bsdf} </shape>'


def averaged(path: Path) -> Scene:
    with pytest.warns(ApproximationWarning, match="average"):
        return load_scene(path, matte=True)


class TestTransmission:
    """What lets light through has no average that a matte surface could have."""

    @pytest.mark.parametrize(
        "bsdf",
        [
            '<bsdf type="dielectric"/>',
            '<bsdf type="thindielectric"/>',
            '<bsdf type="roughdielectric"/>',
            '<bsdf type="null"/>',
            '<bsdf type="mask"> <bsdf type="diffuse"/> </bsdf>',
            '<bsdf type="principled"> <float name="spec_trans" value="0.5"/> </bsdf>',
            '<bsdf type="principledthin"> <float name="spec_trans" value="0.5"/> </bsdf>',
            '<bsdf type="blendbsdf"> <float name="weight" value="0.5"/> <bsdf type="diffuse"/>'
            '<bsdf type="dielectric"/> </bsdf>',
        ],
    )
    def test_is_refused(self, bsdf: str, tmp_path: Path) -> None:
        path = xml_scene(tmp_path, on_ball(bsdf))
        with pytest.raises(SceneError, match=r"(?s)lets light through.*'ball'"):
            load_scene(path, matte=True)
        assert load_scene(path).lobes is not None

    def test_no_surface_of_two_sides_does(self, tmp_path: Path) -> None:
        mask = '<bsdf type="twosided"> <bsdf type="mask"> <bsdf type="diffuse"/> </bsdf> </bsdf>'
        path = xml_scene(tmp_path, on_ball(mask))
        for matte in (True, False):
            with pytest.raises(SceneError, match=r"(?s)lets light through|without a transmission.*'ball'"):
                load_scene(path, matte=matte)

    def test_unless_it_gets_a_material_from_outside(self, tmp_path: Path) -> None:
        path = xml_scene(tmp_path, on_ball('<bsdf type="dielectric"/>'))
        assert load_scene(path, materials={"ball": "poster-red"}).materials[0].fluorescent

    def test_what_only_reflects_is_averaged(self, tmp_path: Path) -> None:
        opaque = '<bsdf type="principled"> <float name="spec_trans" value="0"/> </bsdf>'
        assert 0.3 < averaged(xml_scene(tmp_path, on_ball(opaque))).materials[0].reflectance.at(550) < 0.7


class TestNestedFluorescent:
    DYED = '<bsdf type="fluorescent" id="dye"> <string name="material" value="poster-red"/> </bsdf>'

    @pytest.mark.parametrize("inner", [DYED, '<ref id="dye"/>'])
    @pytest.mark.parametrize(
        "outer",
        [
            '<bsdf type="blendbsdf"> <float name="weight" value="0.5"/> {} <bsdf type="diffuse"/> </bsdf>',
            '<bsdf type="mask"> {} </bsdf>',
            '<bsdf type="bumpmap"> <texture type="checkerboard"/> {} </bsdf>',
            '<bsdf type="normalmap"> <texture name="normalmap" type="checkerboard"/> {} </bsdf>',
            '<bsdf type="twosided"> <bsdf type="bumpmap"> <texture type="checkerboard"/> {} </bsdf> </bsdf>',
        ],
    )
    def test_has_no_average(self, inner: str, outer: str, tmp_path: Path) -> None:
        parts = [self.DYED] if "ref" in inner else []
        path = xml_scene(tmp_path, *parts, on_ball(outer.format(inner)))
        with pytest.raises(SceneError, match=r"(?s)would lose its luminescence.*'ball'"):
            load_scene(path, matte=True)
        assert any(material.fluorescent for material in load_scene(path).materials)

    def test_twosided_works(self, tmp_path: Path) -> None:
        path = xml_scene(tmp_path, on_ball(f'<bsdf type="twosided"> {self.DYED} </bsdf>'))
        assert load_scene(path, matte=True).materials[0].fluorescent


class TestMeshAttributes:
    @pytest.fixture(autouse=True)
    def files(self, tmp_path: Path) -> None:
        (tmp_path / "two.ply").write_text(PLY)
        (tmp_path / "quad.obj").write_text(QUAD)

    def scene(self, folder: Path, texture: str) -> Path:
        return xml_scene(folder, mesh("two.ply", f'<bsdf type="diffuse"> {texture} </bsdf>'))

    def test_without_matte_it_varies(self, tmp_path: Path) -> None:
        assert load_scene(self.scene(tmp_path, attribute("reflectance"))).lobes is not None

    @pytest.mark.parametrize(
        ("of", "mean"),
        [("face_color", (0.1 + 3 * 0.5) / 4), ("vertex_color", (1.2 / 3 + 3 * 1.2 / 3) / 4)],
    )
    def test_is_averaged_over_the_area(self, of: str, mean: float, tmp_path: Path) -> None:
        (paint,) = averaged(self.scene(tmp_path, attribute("reflectance", of))).materials
        np.testing.assert_allclose(paint.reflectance.values, mean, atol=1.5 / 4096)

    def test_a_shared_bsdf_has_a_row_for_each_shape(self, tmp_path: Path) -> None:
        (tmp_path / "dark.ply").write_text(PLY.replace("0.5 0.5 0.5", "0 0 0"))
        shared = f'<bsdf type="diffuse" id="paint"> {attribute("reflectance")} </bsdf>'
        shapes = [
            f'<shape type="ply"> <string name="filename" value="{name}.ply"/> <ref id="paint"/> </shape>'
            for name in ("two", "dark")
        ]
        made = averaged(xml_scene(tmp_path, shared, *shapes)).materials
        assert [m.reflectance.at(550) for m in made] == pytest.approx([0.4, 0.025], abs=4e-4)

    def test_inside_another_texture_and_bsdf(self, tmp_path: Path) -> None:
        checks = f'<texture type="checkerboard" name="base_color"> {attribute("color0")} </texture>'
        path = xml_scene(tmp_path, mesh("two.ply", f'<bsdf type="principled"> {checks} </bsdf>'))
        assert 0 < averaged(path).materials[0].reflectance.at(550) < 1

    def test_of_a_shape_that_is_no_mesh(self, tmp_path: Path) -> None:
        """Mitsuba takes a texture of the shape; half of its checks are 0.4, half 0.2."""
        ball = f'<shape type="rectangle"> <texture type="checkerboard" name="vertex_color"/> \
            <bsdf type="diffuse"> {attribute("reflectance", "vertex_color")} </bsdf> </shape>'
        (paint,) = averaged(xml_scene(tmp_path, ball)).materials
        assert paint.reflectance.at(550) == pytest.approx(0.3)

    def test_on_a_lamp(self, tmp_path: Path) -> None:
        lamp = f'<emitter type="area"> {attribute("radiance")} </emitter>'
        scene = averaged(xml_scene(tmp_path, mesh("two.ply", lamp), light=""))
        np.testing.assert_allclose(scene.lights[0].spectrum.values, 0.4, rtol=1e-3)

    @pytest.mark.parametrize(
        ("file", "has"), [("two.ply", "face_color, vertex_color"), ("quad.obj", "no attr")]
    )
    def test_missing(self, file: str, has: str, tmp_path: Path) -> None:
        bsdf = f'<bsdf type="diffuse"> {attribute("reflectance", "vertex_heat")} </bsdf>'
        path = xml_scene(tmp_path, mesh(file, bsdf))
        with (
            pytest.raises(SceneError, match=rf"(?s)no attribute 'vertex_heat'.*'mesh'.*{has}"),
            pytest.warns(ApproximationWarning),
        ):
            load_scene(path, matte=True)


def test_what_mitsuba_cannot_evaluate_is_named(tmp_path: Path) -> None:
    bumps = '<bsdf type="bumpmap"> <texture type="checkerboard"/> <bsdf type="diffuse"/> </bsdf>'
    with (
        pytest.raises(SceneError, match=r"(?s)cannot average this.*bumpmap.*'ball'.*not implemented"),
        pytest.warns(ApproximationWarning),
    ):
        load_scene(xml_scene(tmp_path, on_ball(bumps)), matte=True)


def test_the_average_is_the_sum_that_mitsuba_gives_point_by_point(tmp_path: Path) -> None:
    """The same samples, in numpy and one by one: bit for bit the same."""
    import mitsuba as mi

    gloss = '<bsdf type="roughplastic"> <rgb name="diffuse_reflectance" value="0.2, 0.4, 0.6"/> </bsdf>'
    scene = averaged(xml_scene(tmp_path, on_ball(gloss)))
    node = next(k for k, n in enumerate(scene.nodes.nodes) if n.props.plugin_name() == "roughplastic")
    with use_variant(SPECTRUM_VARIANT):
        bsdf = build(scene.nodes, node)
        total = np.zeros(4)
        si = mi.SurfaceInteraction3f()
        si.t, si.sh_frame, si.n = 1.0, mi.Frame3f([0, 0, 1]), [0, 0, 1]
        si.wavelengths = [360.0, 370.0, 380.0, 390.0]
        for k, u in enumerate(np.random.default_rng(0).random((4096, 5))):
            si.uv = [(k % 64 + 0.5) / 64, (k // 64 + 0.5) / 64]
            si.wi = mi.warp.square_to_cosine_hemisphere(u[:2])
            sample, weight = bsdf.sample(mi.BSDFContext(), si, u[2], u[3:])
            if sample.pdf > 0 and sample.wo.z > 0:
                total += np.array(weight)
    assert (scene.materials[0].reflectance.values[:4] == total / 4096).all()


def test_the_places_on_a_mesh_are_even_in_area(tmp_path: Path) -> None:
    (tmp_path / "two.ply").write_text(PLY)
    scene = load_scene(xml_scene(tmp_path, mesh("two.ply")))
    with use_variant(SPECTRUM_VARIANT), resolving(*scene.folders):
        shape = build(scene.nodes, scene.surfaces[0].node)
        faces, points = zip(*averages._places(shape, [[0.0, 0.0]] * 400), strict=True)
    assert np.bincount(faces).tolist() == [100, 300]
    assert (np.array(points)[:100, 0] >= 0).all()
    assert (np.array(points)[100:, 0] <= 0).all()


def test_averaged_scenes_render(tmp_path: Path) -> None:
    (tmp_path / "two.ply").write_text(PLY)
    path = xml_scene(tmp_path, mesh("two.ply", f'<bsdf type="diffuse"> {attribute("reflectance")} </bsdf>'))
    assert render(averaged(path), wavelengths="400:700:100").component("direct_reflection").values.any()
