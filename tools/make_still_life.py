"""Make the meshes, textures and the environment map of the built-in scene still-life.

    python tools/make_still_life.py            # into src/fluorspar/data/scenes/still-life
    python tools/make_still_life.py FOLDER

The same files each time, byte for byte, with the same versions of numpy, Pillow and OpenEXR. Lengths in cm, y up.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter, ImageFont

FOLDER = Path(__file__).parents[1] / "src" / "fluorspar" / "data" / "scenes" / "still-life"
PAGE = (14.8, 21.0)  # cm, A5
LINES = (
    *("Fluorspar is calcium fluoride. Its crystals are", "cubes or octahedra, violet, green or clear."),
    *(
        "",
        "In 1852 Stokes held one into the violet end of",
        "a spectrum, where the eye sees next to nothing,",
    ),
    *("and it shone blue: it returned the light at a", "longer wavelength. He named this after it,"),
    *("fluorescence.", "", "Paper, paint and inks of markers do the same."),
    *("What they return depends on what they get,", "wavelength by wavelength, so red, green and blue"),
    *("cannot tell it. A table with a row for each", "wavelength that comes in can, and a column for"),
    *("each one that goes out: a Donaldson matrix.",),
)
MARKED = (
    (3, 0.28, 0.62),
    (5, 0.13, 0.86),
    (7, 0.1, 0.36),
    (14, 0.44, 0.87),
)  # line, from, to (widths of the page)
POINTS = 1400  # the page is drawn this high


def write_ply(path: Path, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
    """Write triangles as binary PLY."""
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar ushort vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), dtype=[("count", "u1"), ("corner", "<u2", 3)])
    rows["count"], rows["corner"] = 3, faces
    path.write_bytes(header.encode() + vertices.astype("<f4").tobytes() + rows.tobytes())


def grid_faces(rows: int, columns: int, *, closed: bool) -> NDArray[np.int64]:
    """Triangles between the rows of a grid of vertices; each row is a ring, `closed` joins the last to the first."""
    i, j = np.meshgrid(np.arange(rows if closed else rows - 1), np.arange(columns), indexing="ij")
    below, right = (i + 1) % rows, (j + 1) % columns
    a, b, c, d = (x * columns + y for x, y in ((i, j), (i, right), (below, right), (below, j)))
    return np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])


def rounded(corners: Sequence[tuple[float, float, float]], steps: int = 4) -> NDArray[np.float64]:
    """A polyline with round corners: radius, height and how far before the corner the rounding begins."""
    points = [corners[0][:2]]
    for before, (x, y, size), after in zip(corners, corners[1:], corners[2:], strict=False):
        here = np.array([x, y])
        start, end = (
            here + size * (np.array(c[:2]) - here) / np.linalg.norm(np.array(c[:2]) - here)
            for c in (before, after)
        )
        for t in np.linspace(0, 1, steps) if size else [0.0]:
            points.append(tuple((1 - t) ** 2 * start + 2 * t * (1 - t) * here + t * t * end))
    points.append(corners[-1][:2])
    return np.array(points)


def revolved(profile: NDArray[np.float64], around: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Turn a profile (radius, height) around the y axis; its outside is to the right of the way along it."""
    angle = 2 * np.pi * np.arange(around) / around
    radius, height = profile.T[..., np.newaxis]
    vertices = np.stack([radius * np.cos(angle), height + 0 * angle, radius * np.sin(angle)], -1)
    return vertices.reshape(-1, 3), grid_faces(len(profile), around, closed=False)


def handle(
    bend: NDArray[np.float64], radius: float, around: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A tube along a curve (x, y) in the plane z = 0."""
    along = np.gradient(bend, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal = np.stack([-along[:, 1], along[:, 0]], -1)
    angle = 2 * np.pi * np.arange(around) / around
    # flat towards the hand, wider than thick
    out = bend[:, np.newaxis] + 0.75 * radius * np.cos(angle)[:, np.newaxis] * normal[:, np.newaxis]
    z = np.broadcast_to(1.25 * radius * np.sin(angle), out.shape[:2])
    return np.concatenate([out, z[..., np.newaxis]], -1).reshape(-1, 3), grid_faces(
        len(bend), around, closed=False
    )


def mug() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A mug with a handle; the handle's ends lie inside its wall."""
    height = np.linspace(0.9, 9.2, 18)
    belly = 4.5 - 0.024 * (height - 3.0) ** 2
    foot = rounded(
        [(0, 0.35, 0), (2.9, 0.35, 0.15), (3.1, 0, 0.1), (4.1, 0, 0.8), (belly[0], height[0], 0)], steps=5
    )
    top = belly[-1]
    rim = rounded(
        [(top, 9.2, 0), (top - 0.02, 9.4, 0.14), (top - 0.3, 9.4, 0.14), (top - 0.3, 9.2, 0)], steps=5
    )
    inside = np.stack([belly[::-1] - 0.35, height[::-1]], -1)[1:]
    profile = np.concatenate([foot, np.stack([belly, height], -1)[1:-1], rim, inside, [[2.5, 0.7], [0, 0.7]]])
    profile[profile[:, 0] == 0, 0] = 1e-3
    body, faces = revolved(profile, 56)
    t = np.linspace(0, 1, 26)[:, np.newaxis]
    ends = np.array([[3.75, 7.9], [8.6, 9.0], [8.0, 1.6], [4.2, 2.0]])
    bend = (
        (1 - t) ** 3 * ends[0]
        + 3 * (1 - t) ** 2 * t * ends[1]
        + 3 * (1 - t) * t**2 * ends[2]
        + t**3 * ends[3]
    )
    tube, more = handle(bend, 0.62, 14)
    return np.concatenate([body, tube]), np.concatenate([faces, more[:, ::-1] + len(body)])


def tumbler() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A drinking glass with a thick bottom: one closed surface between glass and air."""
    profile = rounded(
        [
            *(
                (0, 0, 0),
                (2.75, 0, 0.3),
                (3.45, 10.5, 0.12),
                (3.2, 10.5, 0.12),
                (2.55, 1.3, 0.5),
                (0, 1.2, 0),
            ),
        ],
        steps=5,
    )
    profile[profile[:, 0] == 0, 0] = 1e-3
    return revolved(profile, 64)


def crystal() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """An octahedron, as fluorite cleaves, on one of its faces."""
    corners = np.concatenate([np.eye(3), -np.eye(3)]) * np.array([1.0, 1.08, 0.94])
    faces = []
    for signs in np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).T.reshape(-1, 3):
        a, b, c = (axis + (0 if signs[axis] > 0 else 3) for axis in range(3))
        faces.append((a, b, c) if signs.prod() > 0 else (a, c, b))
    down = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    y = -down / np.linalg.norm(down)
    x = (corners[1] - corners[0]) / np.linalg.norm(corners[1] - corners[0])
    turned = corners @ np.stack([x, y, np.cross(x, y)], -1)
    turned[:, 1] -= turned[:, 1].min()
    # every face its own corners, so that its edges are sharp
    split = np.concatenate([turned[list(face)] for face in faces])
    return 3.0 * split, np.arange(len(split)).reshape(-1, 3)


def page_picture() -> NDArray[np.bool_]:
    """The printed text of the page, True where there is ink."""
    width = round(POINTS * PAGE[0] / PAGE[1])
    picture = Image.new("L", (width, POINTS), 0)
    draw = ImageDraw.Draw(picture)
    draw.text((width * 0.1, POINTS * 0.07), "Fluorspar", fill=255, font=ImageFont.load_default(110))
    for number, line in enumerate(LINES):
        draw.text((width * 0.1, line_top(number)), line, fill=255, font=ImageFont.load_default(35))
    small = picture.resize((width // 5, POINTS // 5), Image.Resampling.BOX)
    return np.asarray(small) > 110


def line_top(number: int) -> float:
    return POINTS * (0.2 + 0.05 * number)


def print_of(ink: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Ink as rectangles in the plane of the page, each as wide and high as it can be."""
    left = ink.copy()
    rectangles = []
    for y, x in np.argwhere(ink):
        if not left[y, x]:
            continue
        wide = int(np.argmin(np.append(left[y, x:], False)))
        high = 1
        while y + high < len(left) and left[y + high, x : x + wide].all():
            high += 1
        left[y : y + high, x : x + wide] = False
        rectangles.append((x, y, x + wide, y + high))
    height, width = ink.shape
    x0, y0, x1, y1 = np.array(rectangles, dtype=np.float64).T / np.array([[width], [height]] * 2)
    quads = np.stack([np.stack([x, y], -1) for x, y in ((x0, y0), (x0, y1), (x1, y1), (x1, y0))], 1)
    vertices = np.zeros((len(rectangles) * 4, 3))
    vertices[:, [0, 2]] = (quads.reshape(-1, 2) - 0.5) * PAGE
    first = 4 * np.arange(len(rectangles))[:, np.newaxis]
    return vertices, np.concatenate([first + np.array(corners) for corners in ((0, 1, 2), (0, 2, 3))])


def marks() -> tuple[Image.Image, Image.Image]:
    """Where the marker has been, and how much dye it left there."""
    rng = np.random.default_rng(3)
    width = round(POINTS * PAGE[0] / PAGE[1])
    where = Image.new("L", (width, POINTS), 0)
    dye = Image.new("L", (width, POINTS), 150)
    for number, start, end in MARKED:
        top, bottom = line_top(number) - 8, line_top(number) + 50
        tilt = rng.uniform(-5, 5)
        x0, x1 = start * width - 10, end * width + 10
        corners = [(x0, top), (x1, top + tilt), (x1 + 6, bottom + tilt), (x0 + 8, bottom)]
        ImageDraw.Draw(where).polygon(corners, fill=255)
        draw = ImageDraw.Draw(dye)
        for x in (x0, x1 - 14):  # the pen rests where a stroke begins and ends
            draw.rectangle((x, top - 10, x + 22, bottom + 14), fill=255)
        for y in np.arange(top, bottom, 9):
            draw.line((x0, y, x1, y + tilt), fill=int(rng.integers(130, 215)), width=9)
    small = (width // 3, POINTS // 3)
    return (
        where.filter(ImageFilter.GaussianBlur(3)).resize(small, Image.Resampling.BOX),
        dye.filter(ImageFilter.GaussianBlur(4)).resize(small, Image.Resampling.BOX),
    )


def noise(rng: np.random.Generator, shape: tuple[int, int], cells: tuple[int, int]) -> NDArray[np.float64]:
    """Smooth random numbers that repeat at the edges."""
    spectrum = np.fft.fft2(rng.normal(size=shape))
    fy, fx = np.fft.fftfreq(shape[0], 1 / shape[0])[:, np.newaxis], np.fft.fftfreq(shape[1], 1 / shape[1])
    spectrum *= np.exp(-((fy / cells[0]) ** 2) - (fx / cells[1]) ** 2)
    values = np.fft.ifft2(spectrum).real
    return np.asarray(values / values.std())


def wood() -> Image.Image:
    """Three planks with grain along x."""
    rng = np.random.default_rng(11)
    height, width = 256, 512
    picture = np.zeros((height, width, 3))
    for plank in range(4):
        rows = slice(plank * height // 4, (plank + 1) * height // 4)
        shape = (height // 4, width)
        bend = noise(rng, (height, width), (2, 2))[: shape[0]]
        rings = 0.5 + 0.5 * np.sin(2 * np.pi * (np.arange(shape[0])[:, np.newaxis] / 13 + 1.1 * bend))
        fibre = noise(rng, (height, width), (90, 5))[: shape[0]]
        dark = 0.42 * rings**2 + 0.11 * fibre + 0.12 * rng.normal() + 0.25
        light, deep = np.array([0.80, 0.62, 0.42]), np.array([0.44, 0.27, 0.14])
        picture[rows] = light + np.clip(dark, 0, 1)[..., np.newaxis] * (deep - light)
        picture[rows.start] *= 0.45
    levels = np.round(np.clip(picture, 0, 1) * 40) / 40
    return Image.fromarray(np.round(levels * 255).astype(np.uint8))


def sky() -> NDArray[np.float32]:
    """A room at dusk as an environment map: a window to the left, a dim one behind, walls, floor and ceiling."""
    height, width = 32, 64
    theta = (np.arange(height)[:, np.newaxis] + 0.5) / height
    up = np.cos(np.pi * theta) + np.zeros((1, width))
    room = np.where(up[..., np.newaxis] > 0, [0.014, 0.014, 0.016], [0.007, 0.007, 0.009]) * np.ones(
        (1, 1, 3)
    )
    room *= (1 + 0.5 * np.clip(up, -1, 1))[..., np.newaxis]
    dusk = np.array([0.72, 0.95, 1.4])

    def window(column: int, across: int, top: int, bottom: int, brightness: float) -> None:
        """Straight ahead is column 0, to the right 16, to the left 48."""
        for x in range(across):
            for y in range(top, bottom):
                if x % 5 == 4 or (y - top) % 4 == 3:
                    continue  # bars
                room[y, (column + x) % width] = brightness * dusk

    window(40, 6, 9, 16, 2.4)
    window(17, 4, 9, 14, 0.3)
    return room.astype(np.float32)


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, mesh in {
        "mug": mug(),
        "tumbler": tumbler(),
        "crystal": crystal(),
        "print": print_of(page_picture()),
    }.items():
        write_ply(folder / f"{name}.ply", *mesh)
    where, dye = marks()
    for name, picture in {"marked": where, "ink": dye, "wood": wood()}.items():
        picture.save(folder / f"{name}.png", optimize=True)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": sky().astype(np.float16)}).write(str(folder / "dusk.exr"))
    for path in sorted(folder.iterdir()):
        print(f"{path.stat().st_size:8d}  {path.name}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
