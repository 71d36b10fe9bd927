"""`fluorspar denoise` and `--denoise`: what they write is what the Python functions give."""

from __future__ import annotations

import numpy as np
import pytest
from command_line import QUICK, CommandLine, ball

import fluorspar as package
from fluorspar import SpectralImage

DYED = ball('<bsdf type="fluorescent" id="paint"> <string name="material" value="poster-red"/> </bsdf>')
GUIDED = "guided by colours and normals"


@pytest.fixture
def scene(fluorspar: CommandLine) -> str:
    (fluorspar.folder / "ball.xml").write_text(DYED)
    return "ball.xml"


def test_an_image_is_denoised_with_its_scene_and_without(fluorspar: CommandLine, scene: str) -> None:
    assert fluorspar("render", scene, *QUICK, "-o", "noisy.nc").code == 0
    said = fluorspar("denoise", "noisy.nc", "--scene", scene, "-o", "clean.nc", "-o", "clean.png")
    assert said.code == 0
    assert GUIDED in " ".join(said.out.split())
    assert (fluorspar.folder / "clean.png").exists()
    said = fluorspar("denoise", "noisy.nc", "-o", "alone.exr")
    assert "without the scene" in " ".join(said.out.split())
    assert fluorspar("render", scene, *QUICK, "--denoise", "-o", "at-once.nc").code == 0
    with (
        SpectralImage.open(fluorspar.folder / "clean.nc") as first,
        SpectralImage.open(fluorspar.folder / "at-once.nc") as second,
    ):
        np.testing.assert_array_equal(first.dataset["radiance"], second.dataset["radiance"])
    assert fluorspar("denoise", "clean.nc", "-o", "twice.nc").says("denoised already")


def test_light_paths_are_denoised(fluorspar: CommandLine, scene: str) -> None:
    assert fluorspar("trace", scene, *QUICK, "-o", "ball.paths").code == 0
    relit = ("--material", "ball=poster-green", "--denoise", "--scene", scene)
    assert fluorspar("relight", "ball.paths", *relit, "-o", "green.nc").code == 0
    with SpectralImage.open(fluorspar.folder / "green.nc") as image:
        assert GUIDED in image.attrs["denoised"]
    said = fluorspar("info", "green.nc")
    assert GUIDED in " ".join(said.out.split())
    assert "estimated error:" in said.out
    said = fluorspar(
        "sheet", "ball.paths", "--concentration", "ball=0,1", "--denoise", "--scene", scene, "-o", "sheet.csv"
    )
    assert said.code == 0
    assert GUIDED in " ".join(said.out.split())
    paths = package.load_paths(fluorspar.folder / "ball.paths")
    with_noise, without = (
        package.sheet(paths, concentration={"ball": [0, 1]}, denoise=denoise) for denoise in (False, True)
    )
    assert not np.array_equal(with_noise.rgb, without.rgb)
    np.testing.assert_allclose(without.XYZ, with_noise.XYZ, rtol=0.1)
