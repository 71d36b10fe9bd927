"""A quick look at light paths: only the first samples of each pixel are swept."""

from __future__ import annotations

import numpy as np
import pytest

import fluorspar


@pytest.mark.parametrize(("scene", "step"), [("cornell-box", 50), ("still-life", 5)])
def test_few_samples_are_unbiased(scene: str, step: int) -> None:
    """Their mean is that of all, within five standard errors of the mean over pixels and bands, lamps left out."""
    means, variances = np.zeros(2), np.zeros(2)
    for seed in range(3):  # of the bright spots behind glass one image may hold a few, and another none
        paths = fluorspar.trace(scene, size=(24, 24), spp=32, wavelengths=f"400:700:{step}", seed=seed)
        few, whole = paths.image(samples=8), paths.image()
        assert (few.attrs["spp"], whole.attrs["spp"]) == (8, 32)
        for n, image in enumerate((few, whole)):
            lit = image.total() - image.component("source")
            means[n] += float(lit.mean())
            pixels = np.square(image.standard_error().mean("wavelength"))
            variances[n] += float(pixels.sum()) / pixels.size**2
    errors = np.sqrt(variances)
    assert abs(means[0] - means[1]) < 5 * errors[0]
    assert errors[0] == pytest.approx(2 * errors[1], rel=0.3)


def test_all_samples_are_the_image() -> None:
    paths = fluorspar.trace("cornell-box", size=(8, 8), spp=4, wavelengths="400:700:50")
    assert paths.image(samples=4).dataset.drop_attrs().identical(paths.image().dataset.drop_attrs())
    assert paths.image(samples=1000).attrs["spp"] == 4


@pytest.mark.parametrize(
    ("scene", "spp", "few"), [("cornell-box", 16, 3), ("still-life", 8, 2), ("cornell-box", 256, 9)]
)
def test_what_is_cut_out_is_what_is_swept(
    scene: str, spp: int, few: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the samples come from paths that are held as a whole, or are cut out of them."""
    paths = fluorspar.trace(scene, size=(12, 9), spp=spp)
    paths.image()
    whole = paths.image(samples=few)
    paths._held.clear()
    cut = paths.image(samples=few)
    assert list(paths._held) == [cut.attrs["spp"]] == [few]
    again = paths.image(samples=few)
    for name in ("radiance", "standard_error"):
        assert np.array_equal(cut.dataset[name], whole.dataset[name])
        assert np.array_equal(cut.dataset[name], again.dataset[name])


def test_every_lane_is_swept() -> None:
    """A pixel of many samples is traced by several lanes, of which each has to give one at least."""
    paths = fluorspar.trace("cornell-box", size=(4, 4), spp=256, wavelengths="400:700:50")
    image = paths.image(samples=1)
    assert image.attrs["spp"] == 4
    assert np.isfinite(image.dataset["radiance"]).all()
