"""From a Mitsuba scene to surfaces, lights and a camera; every touch of Mitsuba's loading code is here."""
