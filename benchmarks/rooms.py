"""A room with two balls, all of them glossy, textured, mixed or `principled`: scene files for the benchmarks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

__all__ = ["KINDS", "write_room"]

WHITE, RED, GREEN, BLUE, YELLOW = "0.7 0.7 0.7", "0.7 0.1 0.1", "0.1 0.6 0.1", "0.1 0.2 0.7", "0.5 0.5 0.1"


def rgb(name: str, value: str) -> str:
    return f'<rgb name="{name}" value="{value}"/>'


def number(name: str, value: float) -> str:
    return f'<float name="{name}" value="{value}"/>'


def bsdf(plugin: str, *parts: str) -> str:
    return f'<bsdf type="{plugin}">{"".join(parts)}</bsdf>'


def matte(colour: str) -> str:
    return bsdf("diffuse", rgb("reflectance", colour))


def textured() -> str:
    return bsdf(
        "diffuse",
        '<texture type="bitmap" name="reflectance"><string name="filename" value="texture.png"/></texture>',
    )


def glossy(colour: str, alpha: float) -> str:
    return bsdf("roughplastic", rgb("diffuse_reflectance", colour), number("alpha", alpha))


def principled(colour: str, metallic: float, roughness: float, clearcoat: float = 0.0) -> str:
    numbers = {"metallic": metallic, "roughness": roughness, "clearcoat": clearcoat}
    return bsdf("principled", rgb("base_color", colour), *(number(*pair) for pair in numbers.items()))


def gold() -> str:
    return bsdf("roughconductor", '<string name="material" value="Au"/>', number("alpha", 0.2))


# Floor, ceiling, back, left and right wall, and the two balls.
KINDS = {
    "textured diffuse": [textured() for _ in range(7)],
    "roughplastic": [
        *(glossy(WHITE, alpha) for alpha in (0.3, 0.1, 0.2)),
        *(glossy(RED, 0.1), glossy(GREEN, 0.1), glossy(BLUE, 0.05), glossy(YELLOW, 0.3)),
    ],
    "mixed": [
        textured(),
        matte(WHITE),
        matte(WHITE),
        glossy(RED, 0.1),
        matte(GREEN),
        bsdf("dielectric"),
        gold(),
    ],
    "principled": [
        *(principled(WHITE, 0, 0.5), principled(WHITE, 0.2, 0.4), principled(WHITE, 0, 0.6)),
        *(principled(RED, 0, 0.3, 0.5), principled(GREEN, 0.4, 0.3)),
        *(principled(BLUE, 0.9, 0.2), principled(YELLOW, 0, 0.4, 1)),
    ],
}
PLACES = [
    '<rotate x="1" angle="-90"/><translate y="-1"/>',
    '<rotate x="1" angle="90"/><translate y="1"/>',
    '<translate z="-1"/>',
    '<rotate y="1" angle="90"/><translate x="-1"/>',
    '<rotate y="1" angle="-90"/><translate x="1"/>',
    '<scale value="0.4"/><translate x="-0.4" y="-0.6" z="-0.3"/>',
    '<scale value="0.35"/><translate x="0.45" y="-0.65" z="0.3"/>',
]


def shape(place: str, of: str, plugin: str = "rectangle") -> str:
    return f'<shape type="{plugin}"><transform name="to_world">{place}</transform>{of}</shape>'


def write_room(kind: str, folder: Path, size: int, spp: int) -> Path:
    """Write the scene file of a room, and the texture it may need, into a folder."""
    import mitsuba as mi

    texels = np.random.default_rng(1).integers(25, 230, size=(64, 64, 3), dtype=np.uint8)
    mi.Bitmap(texels).write(str(folder / "texture.png"))
    plugins = ["rectangle"] * 5 + ["sphere"] * 2
    shapes = [shape(*parts) for parts in zip(PLACES, KINDS[kind], plugins, strict=True)]
    lamp = '<emitter type="area"><spectrum name="radiance" value="8"/></emitter>'
    shapes.append(shape('<rotate x="1" angle="90"/><scale value="0.3"/><translate y="0.99"/>', lamp))
    path = folder / "room.xml"
    path.write_text(
        f"""<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="8"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,0,3.9" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
      <rfilter type="box"/></film>
    <sampler type="independent"><integer name="sample_count" value="{spp}"/></sampler>
  </sensor>
  {"".join(shapes)}
</scene>"""
    )
    return path
