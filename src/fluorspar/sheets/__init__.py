"""Contact sheets: combinations of lights and materials, side by side."""
