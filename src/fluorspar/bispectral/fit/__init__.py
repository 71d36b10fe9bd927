"""From a measured matrix to the few spectra that a material is made of."""
