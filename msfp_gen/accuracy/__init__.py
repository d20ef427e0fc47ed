"""What accuracy costs: methods and models against a confirmed reference; a run to a wanted error (docs/accuracy.md)."""

from msfp_gen.accuracy.models import model_errors
from msfp_gen.accuracy.study import work_precision
from msfp_gen.accuracy.within import Within, simulate_within

__all__ = ["Within", "model_errors", "simulate_within", "work_precision"]
