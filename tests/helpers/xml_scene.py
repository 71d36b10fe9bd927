"""Scene files for tests of what a file may hold: a camera that looks at the origin, and parts."""

from __future__ import annotations

from pathlib import Path

SENSOR = """<sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <integer name="width" value="6"/> <integer name="height" value="4"/>
    <rfilter type="box"/> </film>
    <sampler type="independent"> <integer name="sample_count" value="4"/> </sampler> </sensor>"""
SKY = '<emitter type="constant"> <spectrum name="radiance" value="1"/> </emitter>'

QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n"
"""An OBJ file that faces the camera."""


def xml_scene(folder: Path, *parts: str, sensor: str = SENSOR, light: str = SKY) -> Path:
    """Write `scene.xml`."""
    path = folder / "scene.xml"
    path.write_text(f'<scene version="3.0.0"> {" ".join((*parts, sensor, light))} </scene>')
    return path


def mesh(filename: str, inside: str = "") -> str:
    """A shape of an OBJ or PLY file."""
    kind = Path(filename).suffix[1:]
    return f'<shape type="{kind}" id="mesh"> <string name="filename" value="{filename}"/> {inside} </shape>'


def coloured_ply(vertices: str, faces: str) -> str:
    """A PLY file whose vertices (x y z r g b, a line each) and triangles (3 a b c r g b) have colours."""
    floats = "".join(f"property float {name}\n" for name in "rgb")
    return (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices.splitlines())}\n"
        f"property float x\nproperty float y\nproperty float z\n{floats}"
        f"element face {len(faces.splitlines())}\nproperty list uchar int vertex_indices\n{floats}"
        f"end_header\n{vertices}\n{faces}\n"
    )
