"""Evaluation of the rows of a study: IDA curves, fragility, tornado, figures (docs/studies.md)."""
