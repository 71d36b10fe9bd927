"""The one-pass method: trace light paths once, do the spectra afterwards."""
