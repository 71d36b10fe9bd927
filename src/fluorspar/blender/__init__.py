"""Blender as a process of its own: finding it, talking to it, and what is made of its scenes."""
