"""Renderers that the staged method can use."""
