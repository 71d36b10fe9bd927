"""What runs inside Blender, not in Fluorspar. Its Python may lack NumPy, so arrays are those of `array`."""

from .answers import bake, load, look, render

ANSWERS = {"load": load, "render": render, "look": look, "bake": bake}
