"""Calibration: numbers of a scene for which its runs give the forces that tests have measured (docs/fit.md)."""

from msfp_gen.studies.calibration.fit_result import Estimate, Fit
from msfp_gen.studies.calibration.fitting import fit
from msfp_gen.studies.calibration.measurement import FittedTest, Measurement, read_measurement

__all__ = ["Estimate", "Fit", "FittedTest", "Measurement", "fit", "read_measurement"]
