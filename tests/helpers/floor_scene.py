"""A small fluorescent scene for the tests of the staged method."""

from __future__ import annotations

from fluorspar.bispectral.material import Fluorophore, Material
from fluorspar.scene.loading import load_scene
from fluorspar.spectral.spectrum import Spectrum
from fluorspar.spectral.wavelengths import Wavelengths
from fluorspar.staged.options import StagedOptions

GRID = Wavelengths(400, 600, 50)
DYE = Material(
    "dye",
    Spectrum.constant(0.5),
    (Fluorophore(Spectrum([400, 450, 500, 600], [0, 0, 0.24, 0.12]), Spectrum([400, 450, 500], [1, 1, 0])),),
)
QUICK = StagedOptions(emitters=2, repeats=1, patch_samples=32)


def floor_under(light: dict, size: int = 8, spp: int = 4, materials: dict | None = None, **more):
    """A square fluorescent floor, 2 x 2, seen from above."""
    import mitsuba as mi

    from fluorspar.scene.variants import use_variant

    with use_variant("scalar_rgb"):
        T = mi.ScalarTransform4f
        return load_scene(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": -1, "rr_depth": 10},
                "camera": {
                    "type": "perspective",
                    "fov": 45.0,
                    "to_world": T().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                    "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
                    "sampler": {"type": "independent", "sample_count": spp},
                },
                "light": light,
                "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
            }
            | more,
            materials={"floor": DYE} | (materials or {}),
        )
