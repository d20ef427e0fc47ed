"""Scene files: validation, reading and writing; presets; parameter sweeps."""
