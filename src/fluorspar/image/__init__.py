"""Spectral images and their file formats."""
