"""`FittedTest`: a test beside the run of the fitted bearing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.studies.calibration.measurement import Measurement


@dataclass(frozen=True, eq=False)
class FittedTest:
    """A test beside the run of the fitted bearing.

    Attributes:
        measured: the test at the times that were compared (at most 2000).
        force: of the run, with the offset of the test, ndarray, shape (T,), [N].
    """

    measured: Measurement
    force: Array

    @property
    def residual(self) -> Array:
        """Force of the run less measured force, ndarray, shape (T,), [N]."""
        return self.force - self.measured.force

    @property
    def deviation(self) -> float:
        """Root mean square of the residual [N]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def share(self) -> float:
        """The same over the largest measured force."""
        return self.deviation / float(np.abs(self.measured.force).max())
