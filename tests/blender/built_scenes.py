"""Runs inside Blender: builds small scenes, saves them and renders them with Cycles, for the tests of the import.

Requests are those of `fluorspar.blender.process`.
"""

from __future__ import annotations

import json
import math
import os
import sys
import traceback

import bpy

SIZE, SAMPLES = 32, 256


def build(kind: str, blend: str, out: str | None = None, samples: int = SAMPLES) -> dict:
    """Build the scene of a kind, save it, and render it if there is a name for the image."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    globals()[kind](scene)
    if scene.camera is None:
        camera(scene)
    setup(scene, samples)
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    if out is not None:
        scene.render.filepath = out
        bpy.ops.render.render(write_still=True)
    return {}


def setup(scene, samples: int) -> None:
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_x if render.resolution_x != 1920 else SIZE
    render.resolution_y = render.resolution_y if render.resolution_y != 1080 else SIZE
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.filter_size = 0.01
    render.threads_mode, render.threads = "FIXED", 2
    cycles.samples = samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0
    cycles.blur_glossy = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    for name in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(cycles, f"{name}_bounces", 64)


def link(scene, name: str, data, place=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1)):
    thing = bpy.data.objects.new(name, data)
    scene.collection.objects.link(thing)
    thing.location, thing.rotation_euler, thing.scale = place, turn, scale
    return thing


def camera(scene) -> None:
    data = bpy.data.cameras.new("camera")
    data.lens = 35
    scene.camera = link(scene, "camera", data, (0, -3, 5), (math.radians(31), 0, 0))


def matte(name: str, colour):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*colour, 1)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def mesh(scene, name: str, corners, faces, material=None, **where):
    data = bpy.data.meshes.new(name)
    data.from_pydata(corners, [], faces)
    if material is not None:
        data.materials.append(material)
    return link(scene, name, data, **where)


def floor(scene, material=None) -> None:
    """A grey floor with a white block on it."""
    square = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]
    mesh(scene, "floor", square, [(0, 1, 2, 3)], material or matte("grey", (0.5, 0.5, 0.5)))
    corners = [(x, y, z) for x in (0, 0.8) for y in (0, 0.8) for z in (0, 0.5)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (1, 5, 7, 3), (0, 2, 6, 4)]
    mesh(scene, "block", corners, faces, matte("white", (0.8, 0.8, 0.8)))


def lamp(scene, kind: str, energy: float, place=(0.5, -0.3, 2), turn=(0.3, 0.2, 0.1), **values):
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy = energy
    for name, value in values.items():
        setattr(data, name, value)
    return link(scene, kind.lower(), data, place, turn)


def square(scene) -> None:
    floor(scene)
    lamp(scene, "AREA", 60, shape="SQUARE", size=0.7)


def rectangle(scene) -> None:
    floor(scene)
    lamp(scene, "AREA", 60, shape="RECTANGLE", size=0.7, size_y=1.4)


def disk(scene) -> None:
    floor(scene)
    lamp(scene, "AREA", 60, shape="DISK", size=0.8)


def ellipse(scene) -> None:
    floor(scene)
    lamp(scene, "AREA", 60, shape="ELLIPSE", size=0.8, size_y=1.6)


def point(scene) -> None:
    floor(scene)
    lamp(scene, "POINT", 100, shadow_soft_size=0)


def ball(scene) -> None:
    floor(scene)
    lamp(scene, "POINT", 100, shadow_soft_size=0.2)


def spot(scene) -> None:
    floor(scene)
    lamp(scene, "SPOT", 300, shadow_soft_size=0, spot_size=math.radians(60), spot_blend=0.4)


def soft_spot(scene) -> None:
    floor(scene)
    lamp(scene, "SPOT", 300, shadow_soft_size=0.1, spot_size=math.radians(60), spot_blend=0.4)


def sun(scene) -> None:
    floor(scene)
    lamp(scene, "SUN", 3, angle=0)


def wide_sun(scene) -> None:
    floor(scene)
    lamp(scene, "SUN", 3, angle=math.radians(20))


def main() -> None:
    mark = sys.argv[-1]

    def answer(said: dict) -> None:
        sys.stdout.flush()
        os.write(1, f"\n{mark} {json.dumps(said)}\n".encode())

    answer({"version": list(bpy.app.version)})
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer({"build": build}[request.pop("do")](**request))
        except Exception:
            answer({"error": traceback.format_exc()})


if __name__ == "__main__":
    main()
