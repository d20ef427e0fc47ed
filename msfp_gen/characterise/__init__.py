"""What engineers sign off: loops, stages, damping, heat and capacity of a run; formulas in docs/characterise.md."""

from msfp_gen.characterise.report import Characterisation, Range, characterise

__all__ = ["Characterisation", "Range", "characterise"]
