"""Projections estimated from correspondences, and correspondences that do not determine one."""

from __future__ import annotations

import numpy as np
import pytest
from seen_room import POINTS, scene

from fluorspar.errors import OptionError
from fluorspar.scene.camera import camera_of
from fluorspar.scene.photograph import estimate_projection


def test_a_perspective_is_found_again_from_its_own_projections():
    """Expected: exact, up to rounding, and new points land where the camera puts them."""
    camera = camera_of(scene())
    estimate = estimate_projection(POINTS, camera.project(POINTS))
    assert estimate.model == "perspective"
    assert estimate.rms < 1e-6
    assert estimate.project([[200.0, 100.0, 300.0]]) == pytest.approx(
        camera.project([[200.0, 100.0, 300.0]]), abs=1e-6
    )
    assert estimate.matrix == pytest.approx(camera.matrix, rel=1e-6, abs=1e-3)


def test_noise_of_a_pixel_moves_projections_by_about_a_pixel():
    """Rationale: correspondences are clicked by hand. With noise of standard deviation s in n points and 11
    unknowns, the residuals have a variance of s^2 (2 n - 11) per 2 n. Expected: that, within the spread of
    200 trials."""
    rng = np.random.default_rng(3)
    points = rng.random((20, 3)) * [550, 540, 560]
    camera = camera_of(scene())
    exact = camera.project(points)
    squares = [
        np.mean(estimate_projection(points, exact + 0.5 * rng.standard_normal(exact.shape)).residuals ** 2)
        for _ in range(200)
    ]
    # the algebraic error is not quite the geometric one: 10 % more than the optimum is allowed
    assert np.mean(squares) == pytest.approx(0.25 * (40 - 11) / 40, rel=0.1)


@pytest.mark.parametrize(("model", "columns"), [("linear", 3), ("affine", 4)])
def test_linear_and_affine_projections_are_found_again(model, columns):
    """Eq. 16. Expected: exact from noise-free points, least squares from more."""
    rng = np.random.default_rng(5)
    matrix = rng.standard_normal((2, columns))
    pixels = POINTS @ matrix[:, :3].T + (matrix[:, 3] if columns == 4 else 0)
    estimate = estimate_projection(POINTS, pixels, model)
    assert estimate.matrix == pytest.approx(matrix)
    assert estimate.residuals.shape == (8, 2)
    least = estimate_projection(
        POINTS[3:6] if columns == 3 else POINTS[:4], pixels[3:6] if columns == 3 else pixels[:4]
    )
    assert least.model == model
    assert least.matrix == pytest.approx(matrix)


@pytest.mark.parametrize(
    ("points", "model", "match"),
    [
        (POINTS[:2], None, "too few"),
        (POINTS[:5], "perspective", "too few"),
        (POINTS * [1, 1, 0], "perspective", "one plane"),
        (POINTS * [1, 1, 0], "affine", "one plane"),
        (POINTS * [1, 1, 0] + [0, 0, 559], None, "one plane"),
        (POINTS[:, :1] * [1.0, 2.0, 3.0], "linear", "one plane"),
        (np.ones((8, 3)), "affine", "too few"),
        (POINTS, "cubic", "linear, affine, perspective"),
        (POINTS * np.nan, None, "finite"),
    ],
)
def test_correspondences_that_do_not_determine_a_projection_are_refused(points, model, match):
    with pytest.raises(OptionError, match=match):
        estimate_projection(points, np.arange(2.0 * len(points)).reshape(-1, 2), model)


# A camera at the origin that looks along z at points around (0, 0, 5), and turned copies of a cube there.
MATRIX = np.array([[500.0, 0, 256, 0], [0, 500, 256, 0], [0, 0, 1, 0]])
CENTRE = np.array([0, 0, 5.0])
CUBE = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1, 1) for z in (-1, 1)])


def seen(points: np.ndarray, matrix: np.ndarray = MATRIX) -> np.ndarray:
    image = points @ matrix[:, :3].T + matrix[:, 3]
    return image[:, :2] / image[:, 2:]


def turned(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return points @ np.linalg.qr(rng.standard_normal((3, 3)))[0] + CENTRE


def one_off_a_plane(rng, n):
    return turned(np.vstack([rng.uniform(-1, 1, (n, 3)) * [1, 1, 0], [0.2, 0.3, 0.8]]), rng)


def repeated(rng, n):
    points = rng.uniform(-1, 1, (5, 3))
    return turned(np.vstack([points, points[rng.integers(0, 5, n)]]), rng)


def twisted_cubic(rng, n):
    """Through the camera, and as long in all three directions."""
    t = rng.uniform(1, 3, n)
    return np.stack([t, t**2 / 3 - t, t**3 / 9 - t**2 / 2 + t], axis=1) @ turned(np.eye(3), rng)


def slab(rng, n, thickness=1e-3):
    return turned(rng.uniform(-1, 1, (n, 3)) * [1, 1, thickness], rng)


@pytest.mark.parametrize("noise", [0, 0.1, 0.5, 3])
@pytest.mark.parametrize(
    ("points", "n"),
    [(one_off_a_plane, n) for n in (5, 10, 30)]
    + [(repeated, n) for n in (2, 20)]
    + [(twisted_cubic, n) for n in (8, 20, 100)],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_noise_does_not_hide_that_a_perspective_is_not_determined(points, n, noise):
    """Rationale: any noise makes the linear system regular; what is found then fits the noise, so that its
    residuals are small and new points are off by as much as the image. Expected: refused in each of 40 draws."""
    rng = np.random.default_rng(8)
    for _ in range(40):
        x = points(rng, n)
        u = seen(x) + noise * rng.standard_normal((len(x), 2))
        with pytest.raises(OptionError, match=r"one plane|determine|too few points|one line"):
            estimate_projection(x, u, "perspective")


@pytest.mark.parametrize("model", ["affine", "perspective"])
@pytest.mark.parametrize("thickness", [1e-2, 1e-3, 1e-5, 1e-6])
@pytest.mark.parametrize("n", [6, 12])
def test_a_slab_seen_with_noise_is_refused(n, thickness, model):
    rng = np.random.default_rng(9)
    for _ in range(40):
        x = slab(rng, n, thickness)
        with pytest.raises(OptionError, match=r"one plane|determine|one line"):
            estimate_projection(x, seen(x) + 0.5 * rng.standard_normal((n, 2)), model)


def test_repeated_points_are_not_counted():
    """Expected: five points and a repetition are enough for an affine projection only."""
    x = turned(CUBE[[0, 1, 2, 4, 7, 7]], np.random.default_rng(1))
    assert estimate_projection(x, seen(x)).model == "affine"
    with pytest.raises(OptionError, match="5 distinct points, 6 in all"):
        estimate_projection(x, seen(x), "perspective")


def test_the_error_at_new_points_is_what_the_noise_allows():
    """Rationale: by first order, the estimate has the covariance s^2 (J^T J)^-1, J the derivatives of the given
    pixels by the matrix, in the 11 dimensions that matter. Expected: the corners of a cube at 0.5 pixels of noise
    are accepted in each of 400 draws, and errors at new points have the variance that follows, within the spread
    of 800 numbers. The algebraic error is not quite the geometric one: 10 % more is allowed."""
    rng = np.random.default_rng(10)
    squares = []
    for _ in range(400):
        x, new = turned(CUBE, rng), turned(rng.uniform(-0.6, 0.6, (1, 3)), rng)
        estimate = estimate_projection(x, seen(x) + 0.5 * rng.standard_normal((8, 2)))
        assert estimate.model == "perspective"
        steps = 1e-6 * np.eye(12).reshape(12, 3, 4)
        at_given, at_new = (
            np.stack([(seen(y, MATRIX + d) - seen(y, MATRIX - d)).ravel() / 2e-6 for d in steps], axis=1)
            for y in (x, new)
        )
        covariance = 0.25 * at_new @ np.linalg.pinv(at_given.T @ at_given, rcond=1e-10) @ at_new.T
        squares.append((estimate.project(new) - seen(new))[0] ** 2 / np.diag(covariance))
    assert 1 - 3 * np.sqrt(2 / 800) < np.mean(squares) < 1.1 + 3 * np.sqrt(2 / 800)


@pytest.mark.parametrize("n", [6, 7, 12])
def test_computed_pixels_need_no_margin(n):
    """Expected: with the limit lifted, also points that would magnify noise are enough (a slab, six points)."""
    rng = np.random.default_rng(11)
    for _ in range(20):
        x = slab(rng, n, 0.01)
        new = turned(rng.uniform(-1, 1, (5, 3)), rng)
        assert estimate_projection(x, seen(x), largest_condition=1e7).project(new) == pytest.approx(
            seen(new), abs=1e-3
        )


@pytest.mark.parametrize("model", ["linear", "affine", "perspective"])
@pytest.mark.parametrize("noise", [0, 0.5])
def test_pixels_that_coincide_are_refused(model, noise):
    rng = np.random.default_rng(12)
    x = turned(np.vstack([CUBE, CUBE / 2]), rng)
    with pytest.raises(OptionError, match=r"coincide|determine"):
        estimate_projection(x, np.full((16, 2), 7.0) + noise * rng.standard_normal((16, 2)), model)


def test_points_behind_the_camera_are_refused():
    """Expected: a perspective that would need them is refused, with their number."""
    x = turned(CUBE, np.random.default_rng(13))
    x[:3] -= [0, 0, 10]
    with pytest.raises(OptionError, match="3 of 8 points behind"):
        estimate_projection(x, seen(x), largest_condition=1e7)


def test_the_condition_number_is_told():
    """Expected: of an affine projection, length over thickness of the points; in the error too."""
    x = CUBE * [1, 1, 0.1]
    assert estimate_projection(x, x[:, :2] + x[:, 2:], "affine").condition == pytest.approx(10)
    with pytest.raises(OptionError, match=r"(?s)condition number of 100.*at most 50"):
        estimate_projection(x * [1, 1, 0.1], x[:, :2] + x[:, 2:], "affine")


def test_points_and_pixels_must_correspond():
    with pytest.raises(OptionError, match="correspond"):
        estimate_projection(POINTS, np.zeros((3, 2)))
