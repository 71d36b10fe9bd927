"""The same seed gives the same image, bit for bit; components add up; the caller's variant stays.

Rationale
    A result that depends on the number of threads or on the order in which they finish cannot be checked by
    anyone else. Components that do not add up to the total exactly would make the split a matter of belief.
Expected
    `numpy.array_equal`, no tolerance.
Result
    Equal.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
import trimesh
from lab import bell, furnace, paint, write

import fluorspar
from fluorspar import COMPONENTS, SpectralImage, Wavelengths, load_scene, render
from fluorspar.errors import SceneError
from fluorspar.paths.chunks import CHUNK
from fluorspar.paths.tracing.trace_scene import build_trace_scene
from fluorspar.scene.scene import Scene
from fluorspar.scene.variants import TRACE_VARIANTS, use_variant

GRID = Wavelengths(400, 700, 20)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """S = 0.9 so that some paths need a second record, 37 x 37 pixels so that nothing divides evenly."""
    path = write(tmp_path_factory.mktemp("again"), furnace(37, 20))
    return load_scene(path, materials={"cavity": paint("dye", 0.9, bell(560, 40, 0.05), bell(500, 40))})


@pytest.fixture(scope="module")
def images(scene: Scene) -> dict[str, SpectralImage]:
    options = {"one": {"threads": 1}, "two": {"threads": 2}, "again": {"threads": 2}, "other": {"seed": 12}}
    return {
        name: render(scene, wavelengths=GRID, component_errors=True, **{"seed": 11, **chosen})  # type: ignore[arg-type]
        for name, chosen in options.items()
    }


@pytest.mark.parametrize("other", ["two", "again"])
@pytest.mark.parametrize("variable", ["radiance", "standard_error", "component_standard_error"])
def test_bit_for_bit(images: dict[str, SpectralImage], other: str, variable: str) -> None:
    assert np.array_equal(images["one"].dataset[variable].values, images[other].dataset[variable].values)


def test_another_seed_is_another_image(images: dict[str, SpectralImage]) -> None:
    assert not np.array_equal(
        images["one"].dataset["radiance"].values, images["other"].dataset["radiance"].values
    )


def test_chunks_are_the_same_for_any_number_of_threads(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CHUNK, "llvm", 5000)
    one, two = (
        render(scene, wavelengths=GRID, seed=11, threads=n).dataset["radiance"].values for n in (1, 2)
    )
    assert np.array_equal(one, two)


def test_components_add_up_exactly(images: dict[str, SpectralImage]) -> None:
    image = images["one"]
    summed = np.zeros_like(image.total().values)
    for name in COMPONENTS:
        summed += image.component(name).values
    assert np.array_equal(summed, image.total().values)
    assert np.array_equal(summed[3, 5], image.spectrum_at(5, 3)["total"].values)
    without = summed - image.component("reexcitation").values
    np.testing.assert_allclose(image.total(single_bounce=True).values, without, rtol=1e-6)


def streamed(folder: Path, scene: Scene) -> None:
    with render(scene, size=(4, 4), spp=1, wavelengths=GRID, output=folder / "a.nc") as image:
        image.load()


CALLS: dict[str, Callable[[Path, Scene], object]] = {
    "load_scene": lambda folder, scene: load_scene("furnace"),
    "render": lambda folder, scene: render(scene, size=(4, 4), spp=1, wavelengths=GRID),
    "render a name": lambda folder, scene: render("furnace", size=(4, 4), spp=1, wavelengths=GRID),
    "render to a file": streamed,
    "register_plugins": lambda folder, scene: fluorspar.register_plugins(),
    "material": lambda folder, scene: fluorspar.material("poster-red").on(GRID),
    "illuminant": lambda folder, scene: fluorspar.illuminant("D65"),
}


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
@pytest.mark.parametrize("name", CALLS)
def test_the_variant_stays(name: str, variant: str, scene: Scene, tmp_path: Path) -> None:
    """Mitsuba cannot unset a variant, so where none was set ours stays; where one was set it is set again."""
    mi.set_variant(variant)
    CALLS[name](tmp_path, scene)
    assert mi.variant() == variant


def test_the_variant_stays_after_a_failure(scene: Scene) -> None:
    mi.set_variant("scalar_rgb")
    with pytest.raises(SceneError):
        load_scene("no-such-scene.xml")
    assert mi.variant() == "scalar_rgb"

    def stop(done: int, pixels: int) -> None:
        raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        render(scene, size=(4, 4), spp=1, wavelengths=GRID, progress=stop)
    assert mi.variant() == "scalar_rgb"


def test_the_callers_threads_stay(scene: Scene) -> None:
    import drjit as dr

    before = dr.thread_count()
    render(scene, size=(4, 4), spp=1, wavelengths=GRID, threads=1)
    assert dr.thread_count() == before


def test_normals_that_a_mesh_lacks(tmp_path: Path) -> None:
    """Mitsuba computes them; with several threads the last bit of a sum was another each time."""
    trimesh.creation.icosphere(subdivisions=6).export(tmp_path / "ball.ply")
    text = furnace(9, 7).replace(
        "</scene>",
        """<shape type="ply" id="ball">
        <string name="filename" value="ball.ply"/><transform name="to_world"><scale value="0.1"/></transform>
        <bsdf type="diffuse"/></shape></scene>""",
    )
    scene = load_scene(write(tmp_path, text))
    found = set()
    for threads in (1, 2, 2, 2, 2, 2):
        with use_variant(TRACE_VARIANTS["llvm"]):
            before = dr.thread_count()
            dr.set_thread_count(threads)
            shapes = build_trace_scene(scene).mitsuba_scene.shapes()
            dr.set_thread_count(before)
            meshes = [shape for shape in shapes if shape.is_mesh() and shape.has_vertex_normals()]
            found.add(b"".join(np.array(mi.traverse(mesh)["vertex_normals"]).tobytes() for mesh in meshes))
    assert len(found) == 1
