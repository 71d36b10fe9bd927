"""From light paths to the spectra of all components of pixels."""
