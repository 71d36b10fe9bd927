"""Fluorescent surfaces as arrays of emitters: meshes, patches and grid cells."""
