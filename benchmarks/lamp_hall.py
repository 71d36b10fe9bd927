"""A hall with many lamps of very different power, or with one lamp: scene files for the benchmarks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

__all__ = ["write_hall"]


def _number(name: str, value: float) -> str:
    return f'<float name="{name}" value="{value:.6g}"/>'


def _light(plugin: str, quantity: str, value: float, *parts: str) -> str:
    spectrum = f'<spectrum name="{quantity}" value="{value:.6g}"/>'
    return f'<emitter type="{plugin}">{spectrum}{"".join(parts)}</emitter>'


def _panel(x: float, z: float, half: float, watts: float) -> str:
    """A square below the ceiling that shines downwards."""
    place = (
        f'<scale value="{half:.4g}"/><rotate x="1" angle="90"/><translate x="{x:.4g}" y="2.95" z="{z:.4g}"/>'
    )
    lamp = _light("area", "radiance", watts / (np.pi * 4 * half**2))
    return f'<shape type="rectangle"><transform name="to_world">{place}</transform>{lamp}</shape>'


def _bulb(x: float, y: float, z: float, watts: float) -> str:
    place = f'<point name="position" x="{x:.4g}" y="{y:.4g}" z="{z:.4g}"/>'
    return _light("point", "intensity", watts / (4 * np.pi), place)


def _spot(x: float, z: float, watts: float) -> str:
    place = f'<lookat origin="{x:.4g}, 2.9, {z:.4g}" target="{x:.4g}, 0, {z + 0.5:.4g}" up="1, 0, 0"/>'
    turned = f'<transform name="to_world">{place}</transform>'
    return _light("spot", "intensity", watts / 0.5, turned, _number("cutoff_angle", 25))


def _shape(plugin: str, place: str, bsdf: str, flipped: bool = False) -> str:
    flip = f'<boolean name="flip_normals" value="{str(flipped).lower()}"/>' if flipped else ""
    return f'<shape type="{plugin}">{flip}<transform name="to_world">{place}</transform>{bsdf}</shape>'


def _matte(value: str) -> str:
    return f'<bsdf type="diffuse"><rgb name="reflectance" value="{value}"/></bsdf>'


_GLOSSY = '<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.4 0.3 0.2"/></bsdf>'
_SKY = (
    '<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate y="1" angle="90"/>'
    '<translate x="-4.9" y="1.5"/></transform><emitter type="area"><texture type="bitmap" name="radiance">'
    '<string name="filename" value="{picture}"/></texture></emitter></shape>'
)


def write_hall(file: Path, lamps: int, *, general: bool = False, seed: int = 1) -> Path:
    """Write a hall of 10 x 3 x 10 m with matte boxes in it.

    Parameters
    ----------
    file : Path
        An XML file.
    lamps : int
        Three fifths of them panels, three tenths bulbs, one tenth spots, of powers that spread by a factor of e^1.5
        (standard deviation); 1: one panel at the middle of the ceiling. All give 1000 W together.
    general : bool
        A glossy floor, a luminous picture on a wall, and an open ceiling under a sky.
    seed : int

    Returns
    -------
    Path
        The file.
    """
    rng = np.random.default_rng(seed)
    lines = []
    if lamps == 1:
        lines.append(_panel(0, 0, 0.3, 1000))
    else:
        watts = rng.lognormal(0, 1.5, lamps)
        watts *= 1000 / watts.sum()
        for number, power in enumerate(watts):
            x, z = rng.uniform(-4.7, 4.7, 2)
            if number < 0.6 * lamps:
                lines.append(_panel(x, z, rng.uniform(0.03, 0.2), power))
            elif number < 0.9 * lamps:
                lines.append(_bulb(x, rng.uniform(1.8, 2.8), z, power))
            else:
                lines.append(_spot(x, z, power))
    walls = [
        ('<rotate x="1" angle="-90"/>', _GLOSSY if general else _matte("0.4 0.4 0.4")),
        ('<rotate x="1" angle="90"/><translate y="3"/>', _matte("0.8 0.8 0.8")),
        ('<translate z="-5"/>', _matte("0.7 0.7 0.7")),
        ('<rotate y="1" angle="180"/><translate z="5"/>', _matte("0.7 0.7 0.7")),
        ('<rotate y="1" angle="90"/><translate x="-5"/>', _matte("0.7 0.2 0.2")),
        ('<rotate y="1" angle="-90"/><translate x="5"/>', _matte("0.2 0.6 0.2")),
    ]
    if general:
        del walls[1]
        picture = file.with_suffix(".png")
        _write_picture(picture)
        lines += [_SKY.format(picture=picture.name), _light("constant", "radiance", 0.3)]
    lines += [_shape("rectangle", f'<scale value="5"/>{place}', bsdf) for place, bsdf in walls]
    for _ in range(12):
        x, z = rng.uniform(-4, 3, 2)
        high, angle = rng.uniform(0.2, 1.0), rng.uniform(0, 90)
        place = f'<scale x="0.3" y="{high:.4g}" z="0.3"/><rotate y="1" angle="{angle:.4g}"/>'
        place += f'<translate x="{x:.4g}" y="{high:.4g}" z="{z:.4g}"/>'
        lines.append(_shape("cube", place, _matte("0.6 0.6 0.6")))
    body = "\n".join(lines)
    file.write_text(
        f"""<scene version="3.0.0"> <integrator type="path"> <integer name="max_depth" value="-1"/> </integrator>
        <sensor type="perspective"> <float name="fov" value="75"/> <transform name="to_world">
        <lookat origin="4.6, 1.6, 4.6" target="-1, 1.1, -1" up="0, 1, 0"/> </transform>
        <film type="hdrfilm"> <integer name="width" value="64"/> <integer name="height" value="64"/>
        <rfilter type="box"/> </film> <sampler type="independent"> <integer name="sample_count" value="64"/>
        </sampler> </sensor>\n{body}\n</scene>"""
    )
    return file


def _write_picture(file: Path) -> None:
    from PIL import Image

    ramp = np.linspace(0, 255, 16, dtype=np.uint8)
    Image.fromarray(
        np.stack([np.tile(ramp, (16, 1)), np.full((16, 16), 90, np.uint8), ramp[:, None].repeat(16, 1)], 2)
    ).save(file)
