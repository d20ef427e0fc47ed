"""Scaling of a suite of ground motions, so that the mean of their spectra meets a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.motions.records.scaling import ScaleTo
from msfp_gen.motions.records.spectrum import ContinuousMotion, Progress, measure_index, response_spectrum


@dataclass(frozen=True, eq=False)
class ScaledSuite:
    """Factors of a suite, and the spectra that they give.

    Attributes:
        factors: one for each motion, ndarray, shape (r,).
        period: periods of the target, ndarray, shape (p,), [s].
        spectra: pseudo-acceleration of each scaled motion, ndarray, shape (r, p), [m/s^2].
        target: ndarray, shape (p,), [m/s^2].
    """

    factors: Array
    period: Array
    spectra: Array
    target: Array

    @property
    def mean(self) -> Array:
        """Arithmetic mean of the scaled spectra, ndarray, shape (p,), [m/s^2]."""
        return np.asarray(self.spectra.mean(axis=0))

    @property
    def least_share(self) -> float:
        """Least ratio of the mean to the target [-]."""
        return float((self.mean / self.target).min())


def scaled_suite(
    motions: Sequence[ContinuousMotion],
    target: ScaleTo,
    least_share: float | None = None,
    progress: Progress | None = None,
) -> ScaledSuite:
    """Factors of motions for a target of their mean spectrum.

    Each motion is first scaled to the target by itself, by least squares of the logarithms (`ScaleTo.factor`), so that
    none dominates the mean. One more factor, the same for all, then makes the mean meet the target: the least one for
    which the mean is nowhere below `least_share` times the target, or, without it, that of least squares of the
    logarithms.

    Args:
        motions: of at least one record, corrected.
        target: a spectrum (sds, sd1 and between) or an ordinate (sa and period); `component` is the measure averaged.
        least_share: of the target that the mean must reach at every period [-]; ASCE 7-16 requires 1 in 17.3.3.
        progress: called with the number of completed motions and of all.

    Raises:
        InputError: the target is a peak acceleration, or a motion has nothing along the component.
    """
    if target.pga is not None:
        raise InputError("scale_to.pga: a mean spectrum has no peak; give sds, sd1 and between, or sa and period")
    if not motions:
        raise InputError("suite: there are no motions; give at least one")
    period, wanted = target.ordinates()
    column, found = measure_index(target.component), []
    for done, motion in enumerate(motions, start=1):
        found.append(response_spectrum(motion, period, damping=target.damping).psa[:, column])
        if progress is not None:
            progress(done, len(motions))
    single = np.array([target.ratio(wanted, psa) for psa in found])
    mean = (single[:, None] * np.array(found)).mean(axis=0)
    common = target.ratio(wanted, mean) if least_share is None else least_share * float((wanted / mean).max())
    factors = common * single
    return ScaledSuite(factors, period, factors[:, None] * np.array(found), wanted)
