"""Evaluation of the rows of a study: IDA curves, fragility, sensitivity, Pareto fronts, figures (docs/studies.md)."""
