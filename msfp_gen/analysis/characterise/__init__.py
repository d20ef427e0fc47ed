"""Effective properties of the loops, sliding regimes, and demands on the surfaces of a run (docs/characterise.md)."""

from msfp_gen.analysis.characterise.characterisation import Characterisation, Range
from msfp_gen.analysis.characterise.report import characterise

__all__ = ["Characterisation", "Range", "characterise"]
