"""Estimates of a statistic of a study from cheap and exact runs (docs/studies.md)."""
