"""Error against cost of methods and models, and runs to a requested error (docs/accuracy.md)."""

from msfp_gen.studies.accuracy.error_target import Within, simulate_within
from msfp_gen.studies.accuracy.study import model_errors, work_precision

__all__ = ["Within", "model_errors", "simulate_within", "work_precision"]
