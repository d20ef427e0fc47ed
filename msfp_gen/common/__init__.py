"""Helpers that every package may import: rules of input fields, units, output files, text tables, array type."""
