"""Calibration: values of a scene for which its runs give the measured forces of laboratory tests (docs/properties.md).

Measurements -> residuals of runs -> least squares (`fitting`) -> intervals -> `Fit`.
"""

from msfp_gen.studies.calibration.fit_result import Fit, FittedValue
from msfp_gen.studies.calibration.fitting import fit
from msfp_gen.studies.calibration.measurement import FittedTest, Measurement, read_measurement

__all__ = ["Fit", "FittedTest", "FittedValue", "Measurement", "fit", "read_measurement"]
