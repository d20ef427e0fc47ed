"""Compiled models: one evaluation of the equations, arrays for C, planar models, the adapter for SciPy."""
