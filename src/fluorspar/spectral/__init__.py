"""Spectra, materials and colour: everything that knows wavelengths and no renderer."""
