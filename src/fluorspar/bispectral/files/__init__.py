"""Files that hold a material or a measured matrix."""
