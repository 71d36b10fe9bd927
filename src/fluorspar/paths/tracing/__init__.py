"""From a scene to light paths; every touch of Mitsuba while paths are traced is here."""
