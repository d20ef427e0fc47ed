"""Analysis of one run: summary, sliding regimes, effective properties and demands."""
