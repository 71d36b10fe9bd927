"""Comparing images and measurements: what is compared, on which scale, and whether noise explains the difference."""
