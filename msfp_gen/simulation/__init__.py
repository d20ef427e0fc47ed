"""Runs: what the runs of all systems have in common, the segments of one bearing, checkpoints, notes of a run."""
