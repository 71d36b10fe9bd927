"""What a scene of textures, gloss, glass and metal says of itself, in this process and in another."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import fluorspar
from fluorspar.errors import ApproximationWarning, OptionError, SceneError
from fluorspar.job import RenderJob
from fluorspar.rendering import render_job
from fluorspar.scene.loading import load_scene
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import use_variant

RENDER = """
import pickle, sys
from fluorspar.rendering import render_job
with open(sys.argv[1], "rb") as file:
    image = render_job(pickle.load(file))
image.dataset.radiance.values.tofile(sys.argv[2])
"""


def room(folder: Path, **more: Any) -> dict[str, Any]:
    """A little of everything: names of surfaces say what is on them."""
    texels = np.random.default_rng(4).integers(0, 255, (3, 5, 3), dtype=np.uint8)
    Image.fromarray(texels).save(folder / "tiles.png")
    Image.fromarray(texels[..., 0]).save(folder / "ink.png")
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        view = mi.ScalarTransform4f().look_at([0, 0, 9], [0, 0, 0], [0, 1, 0])
    sky = {"type": "rgb", "value": [0.8, 0.9, 1.0]}
    return {
        "type": "scene",
        "camera": {
            "type": "perspective",
            "to_world": view,
            "film": {"type": "hdrfilm", "width": 10, "height": 8, "filter": {"type": "box"}},
        },
        "light": {"type": "constant", "radiance": sky},
        "tiled": {
            "type": "sphere",
            "center": [2, 2, 0],
            "bsdf": {
                "type": "roughplastic",
                "id": "tiles",
                "diffuse_reflectance": {"type": "bitmap", "filename": str(folder / "tiles.png")},
            },
        },
        "printed": {
            "type": "sphere",
            "center": [2, 0, 0],
            "bsdf": {
                "type": "fluorescent",
                "id": "print",
                "material": "neon-yellow",
                "concentration": {"type": "bitmap", "filename": str(folder / "ink.png"), "raw": True},
            },
        },
        "glazed": {
            "type": "sphere",
            "center": [0, 2, 0],
            "bsdf": {"type": "fluorescent", "id": "glaze", "material": "poster-red", "int_ior": 1.5},
        },
        "can": {"type": "sphere", "center": [0, -2, 0], "bsdf": {"type": "conductor", "material": "Al"}},
        "pane": {"type": "sphere", "center": [-2, 0, 0], "bsdf": {"type": "dielectric", "id": "glass"}},
        "wall": {"type": "cube", "bsdf": {"type": "diffuse", "id": "paint"}},
        **more,
    }


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return load_scene(room(tmp_path))


def test_it_says_what_is_on_its_surfaces(scene: Scene) -> None:
    lines = [" ".join(line.split()) for line in str(scene).splitlines()]
    assert lines[1:] == [
        "light light: constant, W m-2 sr-1 nm-1",
        *("material neon-yellow (fluorescent): on printed", "material poster-red (fluorescent): on glazed"),
        *("material paint: on wall", "clear no colour of its own: on pane", "metal Al: on can"),
        "texture tiles.png: on tiled",
    ]
    assert set(RenderJob(scene).attrs["materials"]) == {
        "neon-yellow",
        "poster-red",
        "paint",
        "Al",
        "tiles.png",
    }


def test_the_staged_method_names_what_it_cannot_render(scene: Scene) -> None:
    with pytest.raises(OptionError, match="only matte surfaces") as refused:
        fluorspar.render(scene, method="staged")
    assert "got:      tiled, printed, glazed, can, pane\n" in str(refused.value)


@pytest.mark.parametrize(
    "name", ["tiled", "tiles", "printed", "print", "glazed", "glaze", "can", "pane", "glass"]
)
def test_a_material_from_outside_takes_the_place_of_any_surface(name: str, tmp_path: Path) -> None:
    scene = load_scene(room(tmp_path), materials={name: "poster-green"})
    surface = next(
        s.name for s in scene.surfaces if s.name[:4] == name[:4] or (s.name, name) == ("pane", "glass")
    )
    assert f"poster-green (fluorescent): on {surface}" in str(scene)
    assert surface not in scene.general


def test_another_process_renders_the_same(scene: Scene, tmp_path: Path) -> None:
    job = RenderJob.of(scene, spp=4, wavelengths="400:700:50")
    (tmp_path / "job").write_bytes(pickle.dumps(job))
    subprocess.run(
        [sys.executable, "-c", RENDER, str(tmp_path / "job"), str(tmp_path / "image")], check=True, cwd="/"
    )
    expected = render_job(job).dataset.radiance.values
    np.testing.assert_array_equal(np.fromfile(tmp_path / "image", np.float32), expected.ravel())


def test_a_scene_is_built_once_for_its_renders(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    from fluorspar.scene import nodes

    built = []
    monkeypatch.setattr(
        "fluorspar.scene.nodes.copy_nodes",
        lambda state, copy=nodes.copy_nodes: built.append(0) or copy(state),
    )
    first = fluorspar.render(scene, spp=2, wavelengths="400:700:50", seed=1)
    once = len(built)
    again = fluorspar.render(scene, spp=2, wavelengths="400:700:50", seed=1)
    fluorspar.render(scene, spp=5, wavelengths="400:700:100", max_depth=3)
    assert len(built) == once > 0
    np.testing.assert_array_equal(first.dataset.radiance, again.dataset.radiance)
    wider = fluorspar.render(scene, spp=2, wavelengths="400:700:100", size=(16, 8)).dataset
    assert len(built) > once
    assert wider.sizes["x"] == 16
    assert len(pickle.dumps(scene)) < 1e6


def test_kept_paths_give_the_image_and_other_wavelengths(scene: Scene) -> None:
    paths = fluorspar.trace(scene, spp=4, wavelengths="400:700:50")
    again = fluorspar.render(scene, spp=4, wavelengths="400:700:50").dataset.radiance
    np.testing.assert_array_equal(paths.image().dataset.radiance, again)
    fewer = paths.image(wavelengths="400:600:50").dataset.radiance
    np.testing.assert_allclose(fewer, again[..., :5], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", ["tiles.png", "ink.png", "sky.exr"])
def test_a_picture_that_changes_is_said(name: str, tmp_path: Path) -> None:
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        mi.Bitmap(np.ones((4, 8, 3), np.float32)).write(str(tmp_path / "sky.exr"))
    sky = {"type": "envmap", "filename": str(tmp_path / "sky.exr")}
    pickled = pickle.dumps(load_scene(room(tmp_path, light=sky)))
    with (tmp_path / name).open("ab") as file:
        file.write(b"\0")
    with pytest.raises(SceneError, match=f"{name} has changed or is gone"):
        pickle.loads(pickled).nodes  # noqa: B018 (it is read again)


@pytest.mark.filterwarnings("ignore:the aperture is 0.125 degrees")
def test_points_are_measured_where_a_ray_meets_the_scene(tmp_path: Path) -> None:
    parts = room(tmp_path)
    group = {"type": "shapegroup", "id": "group", "wall": parts.pop("wall")}
    copy = {"type": "instance", "group": {"type": "ref", "id": "group"}}
    scene = load_scene(parts | {"group": group, "copy": copy})
    (tmp_path / "points.csv").write_text("point,x,y\n1,4,3\n2,8,6\n")
    measured = fluorspar.measure(fluorspar.render(scene, spp=4), tmp_path / "points.csv", scene=scene)
    assert np.isfinite(measured.luminance()).all()


def test_a_dye_map_of_eight_bits_is_a_concentration(tmp_path: Path) -> None:
    """Expected: 51 of 255 is a concentration of 0.2."""
    Image.fromarray(np.full((4, 4), 51, np.uint8)).save(tmp_path / "fifth.png")
    picture = {"type": "bitmap", "filename": str(tmp_path / "fifth.png"), "raw": True}
    luminescence = []
    for concentration in (picture, 0.2):
        dyed = {"type": "fluorescent", "material": "neon-yellow", "concentration": concentration}
        plate = {"type": "sphere", "radius": 9.0, "flip_normals": True, "bsdf": dyed}
        scene = {name: room(tmp_path)[name] for name in ("type", "camera")}
        lamp = {"type": "point", "position": [0, 2, 1]}
        image = fluorspar.render(
            {**scene, "lamp": lamp, "plate": plate}, spp=4, wavelengths="400:700:50", max_depth=2
        )
        luminescence.append(image.dataset.radiance.sel(component="direct_luminescence").mean(("x", "y")))
    np.testing.assert_allclose(luminescence[0], luminescence[1], rtol=0.01)


@pytest.mark.parametrize(
    ("coat", "plastic"),
    [({"int_ior": 1.6}, "plastic"), ({"alpha": 0.2, "distribution": "ggx"}, "roughplastic")],
)
def test_stock_mitsuba_shows_a_coat(coat: dict[str, Any], plastic: str) -> None:
    with use_variant("scalar_rgb"):
        import mitsuba as mi

        fluorspar.register_plugins()
        colour = {"type": "rgb", "value": [0.2, 0.5, 0.4]}
        ours = mi.load_dict({"type": "fluorescent", "reflectance": colour, **coat})
        stock = mi.load_dict({"type": plastic, "diffuse_reflectance": colour, "nonlinear": True, **coat})
        si = mi.SurfaceInteraction3f()
        si.wi = [0.0, 0.6, 0.8]
        for wo in ([0.0, -0.6, 0.8], [0.3, -0.5, 0.8]):
            args = mi.BSDFContext(), si, mi.Vector3f(wo)
            assert list(ours.eval(*args)) == list(stock.eval(*args))
            assert ours.pdf(*args) == stock.pdf(*args)
        assert ours.flags() == stock.flags()


def test_a_coat_that_matte_leaves_out_is_said() -> None:
    glaze = {"type": "fluorescent", "material": "poster-red", "int_ior": 1.5}
    scene = {"type": "scene", "camera": {"type": "perspective", "film": {"type": "hdrfilm"}}}
    scene |= {"light": {"type": "constant"}, "glazed": {"type": "sphere", "bsdf": glaze}}
    with pytest.warns(ApproximationWarning, match="the coat of BSDF .* is left out"):
        assert load_scene(scene, matte=True).lobes is None
