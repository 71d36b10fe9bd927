"""Cycles, the renderer of Blender, for the staged method."""
