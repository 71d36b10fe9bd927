"""Damaged inputs for tools/fuzz.py: small scenes, tables, images and light paths, and what is done to them."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random

GRID = "400:700:50"

SENSOR = """<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, 0, 5" target="0, 0.1, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="3"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
<integrator type="path"><integer name="max_depth" value="5"/><integer name="rr_depth" value="3"/></integrator>"""
SCENES = (
    f"""<scene version="3.0.0">{SENSOR}
<shape type="sphere" id="ball"><point name="center" x="0.1" y="0.2" z="0.3"/><float name="radius" value="0.8"/>
<bsdf type="fluorescent" id="dye"><spectrum name="reflectance" value="300:0.3, 600:0.6, 780:0.7"/>
<spectrum name="emission" value="440:0, 520:0.6, 680:0"/>
<spectrum name="excitation" value="300:0.2, 470:1, 540:0"/></bsdf></shape>
<shape type="rectangle" id="wall"><transform name="to_world"><scale x="2" y="3" z="1"/>
<rotate y="1" angle="10"/><translate z="-1"/></transform>
<bsdf type="diffuse"><spectrum name="reflectance" value="0.5"/></bsdf></shape>
<emitter type="point"><point name="position" x="1" y="2" z="3"/><spectrum name="intensity" value="12.5"/></emitter>
<emitter type="constant"><spectrum name="radiance" value="400:1, 700:2"/></emitter></scene>""",
    f"""<scene version="3.0.0">{SENSOR}
<bsdf type="diffuse" id="paint"><spectrum name="reflectance" type="uniform"><float name="value" value="0.4"/>
</spectrum></bsdf>
<shape type="obj" id="tile"><string name="filename" value="tile.obj"/><ref id="paint"/></shape>
<shape type="cube" id="box"><transform name="to_world"><scale value="0.4"/>
<matrix value="1 0 0 0.2 0 1 0 0.3 0 0 1 0.4 0 0 0 1"/></transform>
<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.5, 0.7"/></bsdf></bsdf></shape>
<emitter type="directional"><vector name="direction" x="0.2" y="-1" z="-1"/>
<spectrum name="irradiance" type="blackbody"><float name="temperature" value="5000"/></spectrum></emitter>
<emitter type="spot"><float name="intensity" value="9"/><float name="cutoff_angle" value="30"/>
<float name="beam_width" value="20"/>
<transform name="to_world"><lookat origin="0, 2, 3" target="0, 0, 0" up="0, 1, 0"/></transform></emitter></scene>""",
)
TILE = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n"
WAVELENGTHS = range(300, 781, 40)
LAMP = "# name: lamp\nwavelength,value\n" + "".join(f"{w},{w / 500:g}\n" for w in WAVELENGTHS)
DYE_EXCITATION = "# units: photon\n" + "".join(
    f"{w},{max(0, 1 - abs(w - 420) / 80):g}\n" for w in WAVELENGTHS
)
DYE_EMISSION = "# units: photon\n" + "".join(f"{w},{max(0, 1 - abs(w - 540) / 80):g}\n" for w in WAVELENGTHS)
MATERIAL = "# fluorspar-material: 1\n# name: paint\nwavelength,reflectance,emission,excitation\n" + "".join(
    f"{w},0.5,{0.01 if 460 < w < 600 else 0:g},{0.3 if w < 500 else 0:g}\n" for w in WAVELENGTHS
)
MATRIX = (
    "nm," + ",".join(map(str, WAVELENGTHS)) + "\n" + "".join(
        f"{m}," + ",".join("0.5" if m == x else "0.002" if x < 480 < m else "0" for x in WAVELENGTHS) + "\n"
        for m in WAVELENGTHS
    )
)  # fmt: skip

NUMBER = re.compile(r"(?<![\w.#-])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.-])")
STRANGE = ("nan", "inf", "-inf", "1e38", "-1e38", "0", "-1")
WORDS = (*STRANGE, "", "1e-45", "1e400", "99999999999999999999", "0x10", "1,5", "NaN", "\x1b[31mred", "$$", "\u00b5",
         "-0", "None", "\ufeff", "%s", "../..", "a" * 300)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """Files to write, and the commands to run on them in turn; `checked` is an image that must then be finite."""

    files: dict[str, bytes]
    commands: list[list[str]]
    checked: str = "out.nc"
    what: str = ""


def _scene_case(text: bytes, what: str = "") -> Case:
    render = ["render", "scene.xml", "--wavelengths", GRID, "-o", "out.nc"]
    return Case({"scene.xml": text, "tile.obj": TILE.encode()}, [render], what=what)


def number_case(number: int, random: Random, base: Path) -> Case:
    """One number of a scene is something else; all of them after another, in an order that is mixed."""
    text, start, end, value = _numbers()[number % len(_numbers())]
    line = text.count("\n", 0, start) + 1
    return _scene_case(
        f"{text[:start]}{value}{text[end:]}".encode(), f"{text[start:end]} -> {value}, line {line}"
    )


def _numbers() -> list[tuple[str, int, int, str]]:
    places = [
        (text, found.start() + value.start(), found.start() + value.end(), strange)
        for text in SCENES
        for found in re.finditer(r'(?:value|[xyz]|angle|origin|target|up)="[^"]*"', text)
        for value in NUMBER.finditer(found.group())
        for strange in STRANGE
    ]
    Random(1).shuffle(places)
    return places


def scene_case(number: int, random: Random, base: Path) -> Case:
    """The text of a scene is damaged."""
    return _scene_case(damaged_text(random.choice(SCENES), random))


def table_case(number: int, random: Random, base: Path) -> Case:
    """A table is damaged: a material, a measured matrix, a lamp, the spectra of a dye, points."""
    files = {
        "lamp.csv": LAMP, "ex.csv": DYE_EXCITATION, "em.csv": DYE_EMISSION, "paint.csv": MATERIAL,
        "matrix.csv": MATRIX, "points.csv": "point,x,y\n1,0.5,0.5\n2,2,1\n",
    }  # fmt: skip
    uses: dict[str, list[list[str]]] = {
        "lamp.csv": [["materials", "colour", "dye-stilbene", "--illuminant", "lamp.csv"]],
        "paint.csv": [["info", "paint.csv"], ["materials", "colour", "paint.csv", "-o", "factors.csv"]],
        "matrix.csv": [["materials", "inspect", "matrix.csv", "--yields", "yields.csv"],
                       ["materials", "fit", "matrix.csv", "--rank", "1", "-o", "fitted.csv"]],
        "points.csv": [["measure", str(base / "base.nc"), "points.csv", "-o", "spectra.csv"]],
    }  # fmt: skip
    dye = [
        "materials",
        "dye",
        "ex.csv",
        "em.csv",
        "--quantum-yield",
        "0.9",
        "--strength",
        "0.5",
        "-o",
        "dyed.csv",
    ]
    uses["ex.csv"] = uses["em.csv"] = [dye]
    name = random.choice(sorted(files))
    written = {other: text.encode() for other, text in files.items()}
    written[name] = damaged_text(files[name], random)
    return Case(written, uses[name], what=name)


def _image_case(files: dict[str, bytes], name: str, random: Random, base: Path) -> Case:
    uses = (
        ["convert", name, "out.nc"],
        ["convert", name, "out.png"],
        ["compare", str(base / "base.nc"), name],
    )
    return Case(files, [["info", name], random.choice(uses)], checked="")


def netcdf_case(number: int, random: Random, base: Path) -> Case:
    """Bytes of a NetCDF file are damaged, or its parts renamed, removed and made another kind."""
    data = (base / "base.nc").read_bytes()
    if random.random() < 0.5:
        return _image_case({"image.nc": damaged_bytes(data, random)}, "image.nc", random, base)
    import h5py
    import numpy as np

    buffer = io.BytesIO(data)
    with h5py.File(buffer, "r+") as file, suppress(KeyError, RuntimeError, ValueError, OSError):
        places = [file, *(file[name] for name in sorted(file))]
        place = random.choice(places)
        names = sorted(place.attrs)
        values = (
            random.choice(WORDS).replace("\0", ""),
            float("nan"),
            -1,
            2**62,
            [1.0, 2.0],
            np.void(b"\xff\0"),
        )
        action = random.choice(("attribute", "attribute", "delete", "rename", "replace", "remove"))
        if action == "attribute" and names:
            place.attrs[random.choice(names)] = random.choice(values)
        elif action == "remove" and names:
            del place.attrs[random.choice(names)]
        elif place is not file:
            if action == "rename":
                file.move(place.name, random.choice(("/other", "/wavelength", "/radiance", "/x")))
            else:
                shape = random.choice(((), (0,), (1,), place.shape[::-1], (2**20, 2**20)))
                name = place.name
                del file[name]
                if action == "replace":
                    file.create_dataset(name, shape, random.choice(("f4", "i2", "S3", "c8")))
    return _image_case({"image.nc": buffer.getvalue()}, "image.nc", random, base)


def paths_case(number: int, random: Random, base: Path) -> Case:
    """Bytes of a file of light paths are damaged."""
    data = damaged_bytes((base / "base.paths").read_bytes(), random)
    relight = ["relight", "kept.paths", "--concentration", "ball=0.5", "--wavelengths", GRID, "-o", "out.nc"]
    return Case({"kept.paths": data}, [relight])


def exr_case(number: int, random: Random, base: Path) -> Case:
    """Bytes of an OpenEXR file are damaged, those of its header as often as the others."""
    data = (base / "base.exr").read_bytes()
    head = random.choice((len(data), 3000))
    damaged = damaged_bytes(data[:head], random)
    return _image_case(
        {"image.exr": damaged + data[head:] if head < len(data) else damaged}, "image.exr", random, base
    )


def envi_case(number: int, random: Random, base: Path) -> Case:
    """The header of an ENVI file is damaged, or its data."""
    header, name = (base / "base.hdr").read_text(), _envi_data(base).name
    data = _envi_data(base).read_bytes()
    changed = random.random() < 0.8
    files = {
        "image.hdr": damaged_text(header, random) if changed else header.encode(),
        name.replace("base", "image"): data if changed else damaged_bytes(data, random),
    }
    return _image_case(files, "image.hdr", random, base)


def _envi_data(base: Path) -> Path:
    return next(
        path for path in sorted(base.glob("base*")) if path.suffix not in (".nc", ".exr", ".hdr", ".xml")
    )


KINDS: dict[str, Callable[[int, Random, Path], Case]] = {
    "number": number_case,
    "scene": scene_case,
    "table": table_case,
    "netcdf": netcdf_case,
    "exr": exr_case,
    "envi": envi_case,
    "paths": paths_case,
}


def damaged_text(text: str, random: Random) -> bytes:
    """Change numbers, words, lines or bytes of a text."""
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        lines = text.split("\n")
        at = random.randrange(len(lines))
        words = list(re.finditer(r"[\w.+-]+", text))
        action = random.choice(("number", "number", "word", "swap", "drop", "double", "cut", "move"))
        if action == "number" and (numbers := list(NUMBER.finditer(text))):
            found = random.choice(numbers)
            text = text[: found.start()] + random.choice(WORDS) + text[found.end() :]
        elif action in ("word", "swap") and words:
            found = random.choice(words)
            other = random.choice(words).group() if action == "swap" else random.choice(WORDS)
            text = text[: found.start()] + other + text[found.end() :]
        elif action == "drop":
            text = "\n".join(lines[:at] + lines[at + 1 :])
        elif action == "double":
            text = "\n".join(lines[: at + 1] + lines[at:])
        elif action == "move":
            text = "\n".join(lines[:at] + lines[at + 1 :] + [lines[at]])
        elif action == "cut":
            text = text[: random.randrange(len(text) + 1)]
    data = text.encode()
    return damaged_bytes(data, random) if random.random() < 0.15 else data


def damaged_bytes(data: bytes, random: Random) -> bytes:
    """Flip bits, overwrite, cut, repeat or insert bytes."""
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8))):
        if not out:
            break
        at, length = random.randrange(len(out)), random.choice((1, 2, 4, 8, 64))
        action = random.choice(("bit", "bit", "zero", "ones", "noise", "cut", "repeat", "insert"))
        if action == "bit":
            out[at] ^= 1 << random.randrange(8)
        elif action == "cut":
            del out[at : random.choice((at + length, len(out)))]
        elif action == "repeat":
            out[at:at] = out[at : at + length]
        elif action == "insert":
            out[at:at] = random.choice((b"\0", b"\xff", b"\x1b[2J", b"\n", b"\xe9")) * random.choice((1, 8))
        else:
            filling = {"zero": bytes(length), "ones": b"\xff" * length, "noise": random.randbytes(length)}[
                action
            ]
            out[at : at + length] = filling[: len(out) - at]
    return bytes(out)
