"""Prescribed functions of time: base motions, loads and rotations."""
