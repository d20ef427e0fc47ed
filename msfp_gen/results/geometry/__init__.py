"""Geometry of the deformed stack: positions of its bodies, their outlines, and vertical sections."""
