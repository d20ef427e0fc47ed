"""Bounding analysis: lambda factors as tables, and lower, nominal and upper runs side by side (docs/bounding.md)."""

from msfp_gen.bounding.factors import Factor, FactorTable, factor_tables, factor_text, load_factors
from msfp_gen.bounding.runs import Bounds, Case, bound, bounded_scenes

__all__ = [
    "Bounds",
    "Case",
    "Factor",
    "FactorTable",
    "bound",
    "bounded_scenes",
    "factor_tables",
    "factor_text",
    "load_factors",
]
