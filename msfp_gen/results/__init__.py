"""Results of a run: rows and events, files, the surfaces that slide, the geometry of the deformed stack."""
