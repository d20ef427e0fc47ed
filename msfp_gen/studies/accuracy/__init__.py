"""Error against cost of methods and models, and runs to a requested error (docs/accuracy.md).

A scene -> timed runs (`timed_run`) by several methods (`methods`, `series`) -> errors against a reference run -> a
study (`study`), or the cheapest run that meets a target (`error_target`).
"""

from msfp_gen.studies.accuracy.error_target import Within, simulate_within
from msfp_gen.studies.accuracy.study import model_errors, work_precision

__all__ = ["Within", "model_errors", "simulate_within", "work_precision"]
