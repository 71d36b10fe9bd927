"""What was found about the method, each cause by itself, with standard errors from independent seeds."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation

import fluorspar
from fluorspar.scene.camera import camera_of, seen_from
from fluorspar.staged.options import StagedOptions

from .workshop import Made, Workshop, stated, step

BANDS = "440:640:100"  # nm: neither paint emits at 440, the green one does at 540, the red one at 640
GREEN, RED = 1, 2  # of BANDS
WALLS = ("left-wall", "right-wall")
TILE = 4  # pixels
# Faces of the blocks: their corners on the floor (x, z), the block on the left, distance and field of view of a camera
FACES = {
    "front of the short block": ((130, 65), (290, 114), 300, 20),
    "front of the tall block": ((265, 296), (423, 247), 120, 45),
    "side of the tall block": ((423, 247), (472, 406), 90, 60),
}
HEIGHTS = (0, 5, 20, 50)  # mm
PARTS = {
    "red wall": ["left-wall"],
    "green wall": ["right-wall"],
    "white": ["floor", "ceiling", "back-wall"],
    "block": ["short-block", "tall-block"],
}


def component_5(image: fluorspar.SpectralImage) -> np.ndarray:
    return image.component("luminescent_reflection").values.astype(float)


def seen(work: Workshop, pixels: int, scene: str = "cornell-box") -> dict[str, np.ndarray]:
    """Pixels that show nothing but one kind of surface: that kind luminesces, in a render where nothing else does.

    The key with " in part" has also those that show others as well.
    """
    shown = {}
    parts = PARTS if scene == "cornell-box" else PARTS | {"block": ["object"]}
    fluorescent = [*WALLS, "object"] if scene == "cornell-mesh" else WALLS
    for part, shapes in parts.items():
        materials = dict.fromkeys(fluorescent, "gray-45") | dict.fromkeys(shapes, "poster-red")
        parameters = {"mesh": work.bunny} if work.bunny and scene == "cornell-mesh" else None
        room = fluorspar.load_scene(scene, materials=materials, parameters=parameters)
        image = work.render(
            room, f"where it shows {part}", size=work.square(pixels), spp=16, wavelengths=BANDS
        )
        own = image.dataset["radiance"].sel(component=["direct_luminescence", "indirect_luminescence"])
        shown[part] = own.sum("component").values[..., RED] > 0
    count = sum(each.astype(int) for each in shown.values()) + (image.component("source").values[..., 0] > 0)
    alone = {part: each & (count == 1) for part, each in shown.items()}
    return alone | {f"{part} in part": each for part, each in shown.items()}


def staged(work: Workshop, scene: Any, what: str, seed: int, pixels: int, **options: Any) -> np.ndarray:
    """Component 5 by the paper's procedure."""
    image = work.render(
        scene,
        what,
        method="staged",
        size=work.square(pixels),
        spp=work.sizes.finding_samples,
        wavelengths=BANDS,
        seed=seed,
        staged=StagedOptions(patches=work.sizes.patches, repeats=1, **options),
    )
    return component_5(image)


def one_pass(work: Workshop, scene: Any, pixels: int) -> np.ndarray:
    """Component 5 by the one-pass method, with little noise beside that of the other."""
    spp = 32 * work.sizes.finding_samples
    return component_5(
        work.render(
            scene, "the one-pass reference", size=work.square(pixels), spp=spp, seed=99, wavelengths=BANDS
        )
    )


def change(images: Sequence[np.ndarray], of: Sequence[np.ndarray], where: np.ndarray, band: int) -> str:
    """Mean change over some pixels, seed by seed."""
    pairs = zip(images, of, strict=True)
    return stated([a[where, band].mean() / b[where, band].mean() - 1 for a, b in pairs])


@step("left-out", "Leaving out the emitting wall")
def left_out(work: Workshop) -> Made:
    """Component 5 when a fluorescent wall is left out of the render of its own emitters, as in the paper, against the
    same with the wall in its place: black emitters stand there then, and the wall reflects none of their light. The
    red wall emits at 640 nm, the green one at 540 nm. Both renders have the same seed; errors are from several."""
    pixels = work.sizes.finding_pixels // 2
    where = seen(work, pixels)
    kinds: dict[str, Any] = {
        "kept": False,
        "red wall": ["left-wall"],
        "green wall": ["right-wall"],
        "both": True,
    }
    found = {
        kind: [
            staged(
                work,
                "cornell-box",
                f"left out: {kind}, seed {seed}",
                seed,
                pixels,
                exclude_emitter_geometry=out,
            )
            for seed in range(work.sizes.seeds)
        ]
        for kind, out in kinds.items()
    }
    numbers = {}
    for kind in ("red wall", "green wall", "both"):
        for nm, band in (("540 nm", GREEN), ("640 nm", RED)):
            for part in ("white", "block", "red wall", "green wall"):
                numbers[f"{kind} left out, {nm}, on {part}"] = change(
                    found[kind], found["kept"], where[part], band
                )
    return Made(numbers=numbers)


@step("edges", "White pixels beside a fluorescent wall")
def edges(work: Workshop) -> Made:
    """Component 5 of white pixels by their distance from the pixels that show a fluorescent wall, also in part, 8 x 8
    emitters a wall, against the one-pass method: an emitter shines evenly, while the wall itself is darker towards
    its edges."""
    pixels = work.sizes.finding_pixels
    where, reference = seen(work, pixels), one_pass(work, "cornell-box", pixels)
    found = [staged(work, "cornell-box", f"seed {seed}", seed, pixels) for seed in range(work.sizes.seeds)]
    numbers = {}
    for wall, band, nm in (("red wall", RED, "640 nm"), ("green wall", GREEN, "540 nm")):
        before = where[f"{wall} in part"]
        for distance in (1, 2, 3):
            near = binary_dilation(before, np.ones((3, 3)))
            ring = near & ~before & where["white"]
            numbers[f"{wall}, {nm}, pixel {distance} beside it"] = change(
                found, [reference] * len(found), ring, band
            )
            before = near
    return Made(numbers=numbers)


@step("foot", "Emitters that are partly under an object")
def foot(work: Workshop) -> Made:
    """Component 5 of the blocks just above a floor that fluoresces, by the height above it, with 8 x 8 emitters (at
    full size also 32 x 32), against the one-pass method; the camera stands close to each face. An emitter that lies
    partly under a block shines evenly all the same, with the mean of what it receives in the open, while the floor
    around a block is lit unevenly."""
    pixels = work.sizes.finding_pixels // 2
    materials = dict.fromkeys(WALLS, "white-85") | {"floor": "poster-red"}
    scene = fluorspar.load_scene("cornell-box", materials=materials)
    numbers = {}
    for face, (begin, end, distance, fov) in FACES.items():
        camera, heights = close_up(scene, begin, end, distance, fov, pixels)
        options: dict[str, Any] = {"size": work.square(pixels), "wavelengths": BANDS, "camera": camera}
        spp = 32 * work.sizes.finding_samples
        reference = component_5(work.render(scene, f"{face}, reference", spp=spp, seed=99, **options))
        for count in work.sizes.foot_emitters:
            staged_options = StagedOptions(emitters=count, repeats=1, patch_samples=4 * 1024)
            found = [
                component_5(
                    work.render(
                        scene,
                        f"{face}, {count} x {count}, seed {seed}",
                        method="staged",
                        spp=4 * work.sizes.finding_samples,
                        seed=seed,
                        staged=staged_options,
                        **options,
                    )
                )
                for seed in range(work.sizes.seeds)
            ]
            for low, high in pairwise(HEIGHTS):
                where = (heights >= low) & (heights < high)
                if where.any():
                    name = f"{face}, {low} to {high} mm above the floor, {count} x {count}"
                    numbers[name] = change(found, [reference] * len(found), where, RED)
    return Made(numbers=numbers)


def close_up(
    scene: fluorspar.Scene,
    begin: tuple[int, int],
    end: tuple[int, int],
    distance: float,
    fov: float,
    pixels: int,
) -> tuple[str, np.ndarray]:
    """A camera before the foot of a face between two corners (x, z), and the heights that its pixels show, in mm.

    NaN where a pixel shows something else than the middle of the face, in part or as a whole.
    """
    a, b = (np.array([x, 0.0, z]) for x, z in (begin, end))
    middle, along = (a + b) / 2, (b - a) / np.linalg.norm(b - a)
    outwards = np.array([along[2], 0.0, -along[0]])
    up = np.array([0.0, 1.0, 0.0])
    origin, target = middle + distance * outwards + 30 * up, middle + 25 * up
    camera = f"origin={','.join(map(str, origin))} target={','.join(map(str, target))} fov={fov}"
    matrix = camera_of(seen_from(scene, camera).with_settings(width=pixels, height=pixels)).matrix
    y, x = np.mgrid[:pixels, :pixels] + 0.5
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(matrix[:, :3]).T
    places = origin + rays * ((middle - origin) @ outwards / (rays @ outwards))[..., np.newaxis]
    size = 2 * distance * np.tan(np.radians(fov / 2)) / pixels
    shown = (abs((places - middle) @ along) < 45) & (places[..., 1] > 0.6 * size)
    return camera, np.where(shown, places[..., 1], np.nan)


@step("second", "Light that luminesces twice")
def second(work: Workshop) -> Made:
    """How much of the light is component 6, which the paper leaves out: of all light, the lamp seen directly aside,
    and on the walls."""
    size, shares = work.square(work.sizes.finding_pixels), {}
    where = seen(work, work.sizes.finding_pixels)
    for seed in range(4 * work.sizes.seeds):
        image = work.render(
            "cornell-box",
            f"seed {seed}",
            size=size,
            spp=work.sizes.finding_samples,
            seed=seed,
            wavelengths="360:700:10",
        )
        twice = image.component("reexcitation").values.astype(float)
        total = (image.total() - image.component("source")).values.astype(float)
        nm = image.wavelengths.values
        of = {"all pixels, 360 to 700 nm": (slice(None), slice(None))}
        for wall in ("red wall", "green wall"):
            for at in (560, 620):
                of[f"{wall}, {at} nm"] = (where[wall], int(np.argmin(abs(nm - at))))
        of["white, 620 nm"] = (where["white"], int(np.argmin(abs(nm - 620))))
        for name, (mask, band) in of.items():
            share = twice[mask][..., band].sum() / total[mask][..., band].sum()
            shares.setdefault(name, []).append(share)
    return Made(numbers={name: stated(values) for name, values in shares.items()})


@step("stokes", "Excitation at the emission wavelength itself")
def stokes(work: Workshop) -> Made:
    """Luminescence with full weight where excitation and emission wavelength are equal (Eq. 4 as printed, j up to and
    including i) and with none (Eq. 1), against half weight, the trapezoid rule. Components 2, 4 and 5 are linear in
    the matrix, so full weight is twice half weight less none. All from the same light paths."""
    paths = fluorspar.trace(
        "cornell-box",
        size=work.square(work.sizes.finding_pixels),
        spp=work.sizes.finding_samples,
        wavelengths="360:700:5",
    )
    numbers = {}
    for step_nm in (5, 10):
        half, strict = (
            paths.image(wavelengths=f"360:700:{step_nm}", stokes=rule) for rule in ("half", "strict")
        )
        for number, name in ((2, "direct_luminescence"), (5, "luminescent_reflection")):
            one, none = (float(image.component(name).sum(dtype=float)) for image in (half, strict))
            numbers[f"component {number}, {step_nm} nm, full weight (Eq. 4)"] = f"{1 - none / one:+.2%}"
            numbers[f"component {number}, {step_nm} nm, no weight (Eq. 1)"] = f"{none / one - 1:+.2%}"
    return Made(numbers=numbers)


@step("mesh", "Coarse meshes and left-out objects apart")
def mesh(work: Workshop) -> Made:
    """Component 5 at 640 nm on white surfaces of the scene with a fluorescent object: with its own patches and with
    the faces of a decimated copy, and with the object, the walls, both or none left out of the renders of their own
    emitters, against the one-pass method."""
    pixels = work.sizes.finding_pixels // 2
    where, reference = seen(work, pixels, "cornell-mesh"), one_pass(work, work.mesh_scene, pixels)
    back = where["white"] & ~binary_dilation(~where["white"], iterations=2)
    kinds: dict[str, dict[str, Any]] = {
        "patches": {},
        "patches, object left out": {"exclude_emitter_geometry": ["object"]},
        "patches, walls left out": {"exclude_emitter_geometry": list(WALLS)},
        "patches, all left out": {"exclude_emitter_geometry": True},
        "decimated": {"mode": "decimated"},
        "decimated, object left out": {"mode": "decimated", "exclude_emitter_geometry": ["object"]},
        "decimated, all left out (the paper's way)": {"mode": "decimated", "exclude_emitter_geometry": True},
    }
    numbers = {}
    for kind, options in kinds.items():
        found = [
            staged(work, work.mesh_scene, f"{kind}, seed {seed}", seed, pixels, **options)
            for seed in range(work.sizes.seeds)
        ]
        numbers[kind] = change(found, [reference] * len(found), back, RED)
    return Made(numbers=numbers)


@step("emitters", "RMSE between 8 x 8 and 16 x 16 emitters of one wall")
def emitters(work: Workshop) -> Made:
    """What the green wall alone adds to the white surfaces and the blocks at 540 nm, with 8 x 8 and with 16 x 16
    emitters: the root mean square difference over blocks of 4 x 4 pixels, over the mean. Noise is taken out: the
    product of two independent differences has none on average. The error is from parts of the image, 16 if it is
    large. In parentheses what one pair of renders shows, noise included, over blocks and over pixels."""
    pixels = work.sizes.finding_pixels // 2
    scene = fluorspar.load_scene("cornell-box", materials={"left-wall": "cornell-red"})
    where = seen(work, pixels)
    rest = where["white"] | where["block"]
    few, many = (
        np.stack(
            [
                staged(
                    work, scene, f"{count} x {count}, seed {seed}", 100 * count + seed, pixels, emitters=count
                )
                for seed in range(work.sizes.seeds)
            ]
        )[..., GREEN]
        for count in (8, 16)
    )
    mean = many[:, rest].mean()
    by_pixel = (few - many) / mean
    tiles = rest.reshape(pixels // TILE, TILE, pixels // TILE, TILE).all(axis=(1, 3))
    by_tile = by_pixel.reshape(-1, pixels // TILE, TILE, pixels // TILE, TILE).mean(axis=(2, 4))[:, tiles]
    pairs = [a * b for i, a in enumerate(by_tile) for b in by_tile[i + 1 :]]
    squares = np.mean(pairs, axis=0)
    parts = np.array([part.mean() for part in np.array_split(squares, min(16, len(squares)))])
    square, error = float(squares.mean()), float(parts.std(ddof=1) / np.sqrt(len(parts)))
    value = np.sqrt(max(square, 0.0))
    found = (
        f"{value:.4f} ± {error / (2 * value):.4f}" if square > error else f"below {np.sqrt(2 * error):.3f}"
    )
    noisy = [float(np.sqrt(np.mean(each**2))) for each in (by_tile, by_pixel[:, rest])]
    return Made(numbers={"RMSE over the mean": f"{found} (with noise {noisy[0]:.3f}, {noisy[1]:.3f})"})
