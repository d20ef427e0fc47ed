"""Bounding analysis: lambda factors -> scenes at lower bound, nominal and upper bound -> runs (docs/properties.md)."""

from msfp_gen.studies.bounding.factors import SHEET, Factor, FactorTable, factor_tables, factor_text, load_factors
from msfp_gen.studies.bounding.runs import CASES, Bounds, Case, bound, bounded_scene, bounded_scenes, factors_of
from msfp_gen.studies.bounding.suite import SuiteBounds, bound_suite, load_suite_bounds, suite_peaks, suite_study

__all__ = [
    "CASES", "SHEET", "Bounds", "Case", "Factor", "FactorTable", "SuiteBounds", "bound", "bound_suite", "bounded_scene",
    "bounded_scenes", "factor_tables", "factor_text", "factors_of", "load_factors", "load_suite_bounds", "suite_peaks",
    "suite_study",
]  # fmt: skip
