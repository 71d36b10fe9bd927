"""General surfaces: how a BSDF of Mitsuba is taken apart into lobes, each with one spectrum."""
