"""Figures and reports of spectra, materials and comparisons."""
