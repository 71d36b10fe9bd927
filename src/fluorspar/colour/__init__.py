"""What spectra look like: XYZ, CIELAB, sRGB, chromatic adaptation, whiteness, colour differences."""
