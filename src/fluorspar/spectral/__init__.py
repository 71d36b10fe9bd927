"""Spectra on wavelengths: grids, tables, bands of instruments, illuminants."""
