"""Denoising: clean pictures of few samples, spectra kept, with an error that is estimated for them."""
