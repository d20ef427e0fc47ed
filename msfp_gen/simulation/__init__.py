"""Runs: the segments of one scene, checkpoints, notes of monitors, batches of scenes."""
