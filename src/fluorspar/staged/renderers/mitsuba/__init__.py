"""Stock Mitsuba as the renderer of the staged method."""
