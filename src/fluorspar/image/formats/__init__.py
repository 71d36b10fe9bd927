"""File formats of spectral images: NetCDF, EXR and ENVI, ours and those of other programs."""
