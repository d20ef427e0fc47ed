"""Estimates of a study from cheap and exact runs together (docs/fidelity.md)."""
