"""Measuring spectra at points of images and scenes, and their tables."""
