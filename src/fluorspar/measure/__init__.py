"""Measuring in spectral images, and comparing them with measurements and with each other."""
