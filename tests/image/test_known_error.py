"""The standard error of a sum of components: exact, an upper limit, or none, and what is said of it."""

from __future__ import annotations

import numpy as np
import pytest

import fluorspar
from fluorspar.image.components import COMPONENTS, SINGLE_BOUNCE, select
from fluorspar.image.dataset import add_up
from fluorspar.image.known_error import known_error
from fluorspar.image.spectral_image import SpectralImage
from fluorspar.measuring.measure import measure
from fluorspar.measuring.points import Point
from fluorspar.spectral.wavelengths import Wavelengths

GRID = Wavelengths(500, 600, 50)
SUM = "direct_luminescence+indirect_luminescence"
POINT = (Point("1", (1, 1)),)


def image_of(*, components=COMPONENTS, each=False, **attrs):
    """Every component has radiance 1, the total the error 5, component k the error k."""
    ones = np.ones((len(components), 3, 3, len(GRID)))
    errors = ones * np.arange(len(components))[:, np.newaxis, np.newaxis, np.newaxis] if each else None
    return SpectralImage.from_arrays(
        ones, GRID, 5 * ones[0], attrs, component_standard_error=errors, components=components
    )


def test_errors_of_a_sum_are_the_spread_over_seeds_or_more():
    """Rationale: components of a pixel are of the same light paths. Expected: the stated error of a sum is no less
    than the spread of independent renders, and no more than the square root of the number of its terms above it,
    which it would be for equal, uncorrelated terms. 12 renders of 16 x 16 pixels without the lamp know the spread to
    3 % (224 pixels, 11 degrees of freedom each: 1.4 %, the pooled errors of as many batches as much again)."""
    images = [
        fluorspar.render(
            "cornell-box", size=(16, 16), spp=16, wavelengths="450:650:100", seed=seed, component_errors=True
        )
        for seed in range(12)
    ]
    lit = images[0].component("source").values.max(axis=-1) == 0
    for image in images:
        lit &= image.component("source").values.max(axis=-1) == 0
    for choice in (SUM, "luminescent", "reflected", "direct_reflection"):
        names = select(choice)
        values, errors = (
            np.stack([each[lit][:, 1:].astype(float) for each in of])
            for of in (
                [add_up(image.dataset, names) for image in images],
                [known_error(image, choice).rows() for image in images],
            )
        )
        ratio = np.sqrt(np.mean(errors**2) / values.var(axis=0, ddof=1).mean())
        assert 0.97 < ratio < 1.03 * np.sqrt(len(names)), (choice, ratio)


def test_of_all_components_it_is_that_of_the_total():
    image = image_of(each=True)
    assert known_error(image, "+".join(COMPONENTS)).rows().max() == 5
    assert known_error(image, "+".join(COMPONENTS)).note == ""


@pytest.mark.parametrize(
    ("component", "error"), [(SUM, 2 + 4), ("luminescent", 2 + 4 + 5), ("reexcitation", 6)]
)
def test_a_measured_sum_has_the_sum_of_the_errors_of_its_components_and_says_so(component, error):
    found = measure(image_of(each=True), POINT, aperture="1px", component=component)
    assert found.standard_error[0].tolist() == [error] * 3
    said = any("upper limits" in note for note in found.notes)
    assert said == (component != "reexcitation")


@pytest.mark.parametrize(
    ("image", "how"),
    [
        (image_of(method="paths"), "--component-errors"),
        (
            image_of(method="staged", components=SINGLE_BOUNCE),
            "the staged method estimates them for the total only",
        ),
        (image_of(denoised="Open Image Denoise"), "a denoised image has errors of the total only"),
        (image_of(), "the image holds none of components"),
    ],
)
@pytest.mark.parametrize("component", [SUM, "direct_luminescence"])
def test_it_says_why_there_is_none(image, how, component):
    found = measure(image, POINT, aperture="1px", component=component)
    assert found.standard_error is None
    assert f"no standard errors of {component}: " in found.notes[-1]
    assert how in found.notes[-1]
    notes = fluorspar.compare(image, image, component=component, points=POINT, aperture="1px").notes
    assert sum(how in note for note in notes) == 2  # A and B, each once


def test_a_comparison_of_sums_says_that_their_errors_are_upper_limits():
    image = image_of(each=True, seed=1, method="paths")
    notes = fluorspar.compare(image, image, component=SUM).notes
    assert [note[:2] for note in notes if "upper limits" in note] == ["A:", "B:"]
