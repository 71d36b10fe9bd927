"""A scene file as the add-on mitsuba-blender writes them: names, nesting and defaults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from fluorspar.blender.importing.meshes import Mesh, write_ply
from fluorspar.rendering import render
from fluorspar.scene.loading import load_scene

SCENE = """<scene version="3.0.0">
    <default name="spp" value="4"/>
    <default name="resx" value="8"/>
    <default name="resy" value="6"/>
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <sensor type="perspective" id="elm__1">
        <string name="fov_axis" value="x"/>
        <float name="fov" value="39.597755"/>
        <float name="principal_point_offset_x" value="0.000000"/>
        <float name="principal_point_offset_y" value="-0.000000"/>
        <float name="near_clip" value="0.100000"/>
        <float name="far_clip" value="1000.000000"/>
        <transform name="to_world">
            <rotate y="1" angle="180"/>
            <translate value="0.000000 0.000000 4.000000"/>
        </transform>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="$resx"/>
            <integer name="height" value="$resy"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <bsdf type="twosided" id="mat-Material" name="mat-Material">
        <bsdf type="principled" name="bsdf">
            <texture type="bitmap" name="base_color">
                <string name="filename" value="textures/wood.png"/>
                <string name="filter_type" value="bilinear"/>
                <string name="wrap_mode" value="repeat"/>
            </texture>
            <float name="metallic" value="0.000000"/>
            <float name="roughness" value="0.400000"/>
            <float name="anisotropic" value="0.000000"/>
            <float name="spec_trans" value="0.000000"/>
            <float name="eta" value="1.450000"/>
            <float name="spec_tint" value="0.000000"/>
            <float name="sheen" value="0.000000"/>
            <float name="sheen_tint" value="0.500000"/>
            <float name="flatness" value="0.000000"/>
            <float name="clearcoat" value="0.000000"/>
            <float name="clearcoat_gloss" value="0.969970"/>
        </bsdf>
    </bsdf>
    <shape type="ply" id="elm__2" name="elm__2">
        <string name="filename" value="meshes/Cube.ply"/>
        <boolean name="face_normals" value="true"/>
        <ref id="mat-Material" name="bsdf"/>
    </shape>
    <emitter type="envmap" id="World">
        <string name="filename" value="textures/sky.exr"/>
        <transform name="to_world"><rotate x="1" angle="90"/></transform>
    </emitter>
    <emitter type="point" id="elm__3">
        <point name="position" x="1.0" y="0.5" z="2.0"/>
        <rgb name="intensity" value="4.0 4.0 4.0"/>
    </emitter>
    <shape type="rectangle" id="elm__4">
        <transform name="to_world"><rotate x="1" angle="180"/><translate z="3"/></transform>
        <emitter type="area" name="emitter"><rgb name="radiance" value="12.0 10.0 8.0"/></emitter>
        <bsdf type="null" name="bsdf"/>
    </shape>
</scene>
"""


def test_it_renders(tmp_path: Path) -> None:
    """Rationale: such files are to work as they are. Expected: no word, sizes and
    samples of its parameters, all that it has, the wood through the back of the
    lamp, which lets rays pass, and light in the whole image."""
    import OpenEXR

    for folder in ("meshes", "textures"):
        (tmp_path / folder).mkdir()
    points = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    normals, uv = np.tile(np.float32([0, 0, 1]), (4, 1)), (points[:, :2] + 1) / 2
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    write_ply(Mesh(points, normals, uv, faces), tmp_path / "meshes" / "Cube.ply")
    Image.new("RGB", (4, 4), (180, 120, 60)).save(tmp_path / "textures" / "wood.png")
    sky = np.full((8, 16, 3), 0.5, np.float32)
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": sky}) as out:
        out.write(str(tmp_path / "textures" / "sky.exr"))
    (tmp_path / "scene.xml").write_text(SCENE, encoding="utf-8")
    scene = load_scene(tmp_path / "scene.xml")
    assert (scene.settings.spp, scene.settings.max_depth) == (4, 3)
    assert [surface.name for surface in scene.surfaces] == ["elm__2", "elm__4"]
    assert len(scene.lights) == 3
    image = render(scene, wavelengths=[450, 550, 650]).total()
    assert dict(image.sizes) == {"y": 6, "x": 8, "wavelength": 3}
    assert np.isfinite(image.values).all()
    assert float(image.min()) > 0
    wood = image.isel(x=slice(3, 5), y=slice(2, 4)).mean(dim=("x", "y"))
    assert wood.sel(wavelength=650) > 2 * wood.sel(wavelength=450)  # it is brown, behind the back of the lamp
