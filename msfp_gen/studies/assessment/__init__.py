"""Evaluation of studies: IDA curves, fragility, sensitivity, Pareto fronts, with figures (docs/studies.md)."""
