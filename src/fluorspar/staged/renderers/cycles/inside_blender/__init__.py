"""What runs inside Blender, not in Fluorspar. Its Python may lack NumPy, so arrays are those of `array`."""
