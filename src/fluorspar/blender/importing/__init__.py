"""A Blender scene as a scene for Fluorspar: what Blender tells of it, and what is written of that."""
