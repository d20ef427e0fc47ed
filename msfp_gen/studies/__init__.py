"""Studies that take several runs: accuracy and bounding analysis."""
