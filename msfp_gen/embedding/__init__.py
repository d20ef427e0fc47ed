"""The bearing in other programs (docs/embedding.md): two-ports, a server, the C library of `export`, units (FMU)."""
