"""Runs inside Blender: builds small scenes, saves them and renders them with Cycles, for the tests of the import.

Requests are those of `fluorspar.blender.process`, for the functions in `ANSWERS`.
"""

from __future__ import annotations

import math
import os
import sys
from unittest.mock import Mock

import addon_utils
import bpy

SIZE, SAMPLES = 32, 256


def build(kind: str, blend: str, out: str | None = None, samples: int = SAMPLES) -> dict:
    """Build the scene of a kind, save it, and render it if there is a name for the image."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    globals()[kind](scene)
    if scene.camera is None and kind != "no_camera":
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


def world(scene) -> None:
    floor(scene)
    shine(scene)


def shine(scene, colour=(1, 1, 1), strength=0.7):
    """A world of one colour; returns its node."""
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    node = scene.world.node_tree.nodes["Background"]
    node.inputs["Color"].default_value, node.inputs["Strength"].default_value = (*colour, 1), strength
    return node


def environment(scene) -> None:
    """A map that is brighter on one side and above, turned by 40 degrees."""
    floor(scene)
    node, tree = shine(scene), scene.world.node_tree
    image = bpy.data.images.new("sky", 64, 32, float_buffer=True)
    # rows from below
    image.pixels = [
        v
        for y in range(32)
        for x in range(64)
        for v in (*((3, 2, 1) if 8 <= x < 24 and y > 16 else (0.2, 0.3, 0.4)), 1)
    ]
    image.pack()
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0, 0, math.radians(40))
    place = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    tree.links.new(place, mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs[0], node.inputs["Color"])


def picture(name: str = "picture", width: int = 8, height: int = 4):
    """An image whose quarters differ, packed into the file."""
    image = bpy.data.images.new(name, width, height)
    quarters = [[(0.1, 0.1, 0.1), (0.9, 0.2, 0.2)], [(0.2, 0.9, 0.2), (0.9, 0.9, 0.9)]]
    image.pixels = [
        v
        for y in range(height)
        for x in range(width)
        for v in (*quarters[2 * y // height][2 * x // width], 1)
    ]
    image.pack()
    return image


def textured(scene) -> None:
    """A picture on the floor, moved, turned and scaled."""
    material = matte("printed", (1, 1, 1))
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = picture(), "Closest"
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0, 0, math.radians(20))
    mapping.inputs["Scale"].default_value = (2, 1.5, 1)
    mapping.inputs["Location"].default_value = (0.1, 0.3, 0)
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
    floor(scene, material)
    data = bpy.data.objects["floor"].data
    layer = data.uv_layers.new(name="UVMap")
    for loop, uv in zip(layer.data, [(0, 0), (1, 0), (1, 1), (0, 1)]):  # noqa: B905 (Blender's Python)
        loop.uv = uv
    lamp(scene, "SUN", 3, angle=0)


def cut_out(scene) -> None:
    """A leaf cut out by the alpha of its picture, one without UV map, and what is too close to the camera."""
    floor(scene)
    shine(scene)
    camera(scene)
    scene.camera.data.clip_start = 2.5
    image = bpy.data.images.new("leaf", 8, 8, alpha=True)
    image.pixels = [v for y in range(8) for x in range(8) for v in (0.9, 0.4, 0.1, float(x < 4 or y < 2))]
    image.pack()
    square = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    for name, uv, place in (("leaf", True, (-1, 0.6, 0.5)), ("leaf without place", False, (1.5, -1, 0.3))):
        material = matte(name, (1, 1, 1))
        tree = material.node_tree
        texture, mix = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeMixShader")
        texture.image, texture.interpolation = image, "Closest"
        tree.links.new(texture.outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
        tree.links.new(texture.outputs["Alpha"], mix.inputs[0])
        tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
        tree.links.new(tree.nodes["Diffuse BSDF"].outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
        thing = mesh(scene, name, square, [(0, 1, 2, 3)], material, place=place, scale=(0.7, 0.7, 1))
        if uv:
            layer = thing.data.uv_layers.new(name="UVMap")
            for loop, at in zip(layer.data, [(0, 0), (1, 0), (1, 1), (0, 1)]):  # noqa: B905
                loop.uv = at
    mesh(scene, "before the camera", square, [(0, 1, 2, 3)], place=(0, -2, 3.3), turn=(0.54, 0, 0))


def focused(scene) -> None:
    """A wide aperture, at half the size."""
    floor(scene)
    lamp(scene, "SUN", 3, angle=0)
    camera(scene)
    dof = scene.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 3, 0.05
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.render.resolution_percentage = 50


def inside_a_lamp(scene) -> None:
    """A ball around all that shines inwards too."""
    floor(scene)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=20)
    material = matte("glowing", (0, 0, 0))
    tree = material.node_tree
    tree.links.new(
        tree.nodes.new("ShaderNodeEmission").outputs[0], tree.nodes["Material Output"].inputs["Surface"]
    )
    bpy.context.object.data.materials.append(material)


def formats(scene) -> None:
    """A floor of pictures of several formats, as files and packed."""
    lamp(scene, "SUN", 3, angle=0)
    kinds = [
        ("PNG", "png"),
        ("JPEG", "jpg"),
        ("TARGA", "tga"),
        ("BMP", "bmp"),
        ("TIFF", "tif"),
        ("HDR", "hdr"),
    ]
    for number, (kind, end) in enumerate(kinds):
        for packed in (False, True):
            image = bpy.data.images.new("saved", 4, 4, float_buffer=kind == "HDR")
            image.pixels = [v for _ in range(16) for v in (0.2 + 0.1 * number, 0.5, 0.7 - 0.1 * number, 1)]
            image.filepath_raw = os.path.join(bpy.app.tempdir, f"{packed}.{end}")
            image.file_format = kind
            image.save()
            image = bpy.data.images.load(image.filepath_raw)
            if packed:
                image.pack()
            material = matte(kind, (1, 1, 1))
            tree = material.node_tree
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image = image
            tree.links.new(texture.outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
            square = [(-0.5, -1, 0), (0.5, -1, 0), (0.5, 1, 0), (-0.5, 1, 0)]
            place = (number - 2.5, 2 * packed - 1, 0)
            mesh(scene, kind, square, [(0, 1, 2, 3)], material, place=place).data.uv_layers.new(name="UVMap")


def glowing(scene) -> None:
    """A plane that shines to both sides above the floor, one that faces down."""
    floor(scene)
    material = matte("glowing", (0, 0, 0))
    tree = material.node_tree
    shader = tree.nodes.new("ShaderNodeEmission")
    shader.inputs["Color"].default_value, shader.inputs["Strength"].default_value = (1, 0.8, 0.5, 1), 12
    tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    square = [(-0.4, -0.4, 1), (0.4, -0.4, 1), (0.4, 0.4, 1), (-0.4, 0.4, 1)]
    mesh(scene, "up", square, [(0, 1, 2, 3)], material, place=(-1.5, 0, 0))
    mesh(scene, "down", square, [(3, 2, 1, 0)], material, place=(1.5, 0, 0))


def shapes(scene) -> None:
    """Smooth and flat, subdivided, instanced, mirrored, text and curves, with two slots, seen from aside."""
    floor(scene)
    lamp(scene, "SUN", 3, angle=0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.4, location=(-1.2, -0.6, 0.4))
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(matte("red", (0.8, 0.1, 0.1)))
    ball.data.materials.append(matte("blue", (0.1, 0.1, 0.8)))
    for polygon in ball.data.polygons:
        polygon.material_index = int(polygon.center[2] > 0)
    bpy.ops.mesh.primitive_cube_add(size=0.7, location=(1.6, -0.7, 0.4))
    cube = bpy.context.object
    cube.modifiers.new("rounded", "SUBSURF").render_levels = 3
    cube.modifiers["rounded"].levels = 0
    cube.data.materials.append(matte("green", (0.1, 0.7, 0.1)))
    group = bpy.data.collections.new("group")
    bpy.ops.mesh.primitive_cone_add(radius1=0.3, depth=0.6, location=(0.3, 0, 0.3))
    cone = bpy.context.object
    cone.data.materials.append(bpy.data.materials["red"])
    scene.collection.objects.unlink(cone)
    group.objects.link(cone)
    for number, scale in enumerate([(1, 1, 1), (-1, 1, 2)]):
        copy = link(scene, f"copy {number}", None, (-0.5 - number, 1.2, 0), scale=scale)
        copy.instance_type, copy.instance_collection = "COLLECTION", group
    bpy.ops.object.text_add(location=(-2, -1.8, 0.05))
    text = bpy.context.object
    text.data.body, text.data.extrude = "Übung", 0.05
    text.data.materials.append(bpy.data.materials["blue"])
    hidden = link(scene, "hidden", cube.data, (0, 0, 1.5))
    hidden.hide_render = True


def shifted(scene) -> None:
    """A wide image through a shifted lens."""
    floor(scene)
    lamp(scene, "SUN", 3, angle=0)
    camera(scene)
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.12, -0.2


def upright(scene) -> None:
    """A tall image, its lens fitted to the width."""
    floor(scene)
    lamp(scene, "SUN", 3, angle=0)
    camera(scene)
    scene.render.resolution_x, scene.render.resolution_y = 32, 48
    scene.camera.data.sensor_fit = "HORIZONTAL"
    scene.camera.scale = (2, 2, 2)


def parallel(scene) -> None:
    floor(scene)
    lamp(scene, "SUN", 3, angle=0)
    camera(scene)
    scene.render.resolution_x, scene.render.resolution_y = 32, 48
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 5
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.1, 0.15


def surfaces(scene) -> None:
    """A row of balls of all shaders that are taken over, and one that is not."""
    floor(scene)
    shine(scene, (0.6, 0.7, 0.8), 0.8)
    lamp(scene, "AREA", 200, place=(2, -2, 4), turn=(0.5, 0.4, 0), shape="SQUARE", size=1)
    camera(scene)
    scene.render.resolution_x, scene.render.resolution_y = 192, 96
    white, red, gold = (0.9, 0.9, 0.9, 1), (0.8, 0.1, 0.1, 1), (0.9, 0.6, 0.2, 1)
    recipes = [
        ("BsdfPrincipled", {"Base Color": red, "Roughness": 0.3}),
        ("BsdfPrincipled", {"Base Color": gold, "Roughness": 0.25, "Metallic": 1.0}),
        ("BsdfGlossy", {"Color": gold, "Roughness": 0.2}),
        ("BsdfGlass", {"Color": white, "Roughness": 0.0, "IOR": 1.5}),
        ("BsdfPrincipled", {"Base Color": red, "Roughness": 0.5, "Alpha": 0.4}),
        ("mix", {}),
        ("BsdfTranslucent", {"Color": red}),
        ("fluorspar:poster-red", {}),
    ]
    for number, (kind, values) in enumerate(recipes):
        place = (-2.2 + 1.4 * (number % 4), -1.2 + 1.5 * (number // 4), 0.5)
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.45, location=place)
        bpy.ops.object.shade_smooth()
        material = matte(f"{number} {kind}" if ":" not in kind else kind, red[:3])
        bpy.context.object.data.materials.append(material)
        tree = material.node_tree
        output = tree.nodes["Material Output"].inputs["Surface"]
        if kind == "mix":
            mix, glossy = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfGlossy")
            glossy.inputs["Roughness"].default_value = 0.1
            mix.inputs[0].default_value = 0.3
            tree.links.new(tree.nodes["Diffuse BSDF"].outputs[0], mix.inputs[1])
            tree.links.new(glossy.outputs[0], mix.inputs[2])
            tree.links.new(mix.outputs[0], output)
        elif ":" not in kind:
            shader = tree.nodes.new(f"ShaderNode{kind}")
            if hasattr(shader, "distribution"):
                shader.distribution = "GGX"
            for name, value in values.items():
                shader.inputs[name].default_value = value
            tree.links.new(shader.outputs[0], output)


def no_camera(scene) -> None:
    floor(scene)


def use_panel(panel: str, blend: str) -> dict:
    """Add the add-on of a file to a built scene, and save the scene with what its properties set."""
    bpy.ops.wm.open_mainfile(filepath=blend)
    sys.path.append(os.path.dirname(panel))
    addon = addon_utils.enable(os.path.basename(panel).removesuffix(".py"))
    scene, layout = bpy.context.scene, Mock()
    red, plain = matte("red", (1, 0, 0)), matte("plain", (1, 1, 1))
    for at, material in enumerate((red, plain)):
        corners = [(at, 0, 1), (at + 1, 0, 1), (at + 1, 1, 1), (at, 1, 1)]
        mesh(scene, material.name, corners, [(0, 1, 2, 3)], material)
        material.fluorescent_name, material.fluorescent_concentration = "poster-red", 0.5
    plain.fluorescent_name = ""
    addon.FluorescentPanel.draw(Mock(layout=layout), Mock(material=red))
    shown = [getattr(*call.args) for call in layout.prop.call_args_list]
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    addon_utils.disable(addon.__name__)
    return {"shown": shown, "names": addon.NAMES}


ANSWERS = {"build": build, "use_panel": use_panel}
