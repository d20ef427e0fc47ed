"""Studies of 10^3 to 10^7 runs: a definition, chunks that are kept as they end, engines (docs/studies.md)."""
