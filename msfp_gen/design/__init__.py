"""Arithmetic of a design by hand: effective properties of a data sheet and the equivalent lateral procedure.

It needs no run, and nothing of the core needs it.
"""
