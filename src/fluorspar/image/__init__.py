"""Spectral images, their components and units."""
