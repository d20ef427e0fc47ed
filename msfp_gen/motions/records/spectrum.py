"""Response spectra of a ground motion: each component, their geometric mean, RotD50 and RotD100."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.output import check_output, replacing
from msfp_gen.motions.checks import finite
from msfp_gen.motions.records.correction import Corrected
from msfp_gen.motions.records.record import COMPONENTS, Record

MEASURES = (*COMPONENTS, "geomean", "rotd50", "rotd100")
DAMPING = 0.05
_RESOLUTION = 50  # points in a period: the largest value at them is less than 1 - cos(pi/50) = 0.2 % below the peak
ROUNDING = 1e-9  # of the number of sample intervals in a motion
_ANGLES = np.radians(np.arange(180.0))  # directions of RotDnn, Boore (2010)


class ContinuousMotion(Protocol):
    """A ground motion as a function of time, such as `msfp_gen.Motion`."""

    @property
    def max_step(self) -> float | None:
        """Longest step that resolves its samples [s]; None for a motion without samples."""

    @property
    def duration(self) -> float:
        """Duration [s]."""

    def acceleration(self, t: ArrayLike) -> Array:
        """Acceleration at `t` [s]: ndarray, shape (..., 3), [m/s^2]."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Response spectrum: peak response of linear oscillators of one damping ratio.

    Attributes:
        period: ndarray, shape (p,), [s].
        damping: ratio to the critical damping [-].
        sd: ndarray, shape (p, 6), [m]: peak relative displacement, columns in the order of `MEASURES`.
        pga: ndarray, shape (6,), [m/s^2]: peak ground acceleration, in the order of `MEASURES`.
    """

    period: Array
    damping: float
    sd: Array
    pga: Array

    @property
    def psv(self) -> Array:
        """Pseudo-velocity 2 pi/T SD: ndarray, shape (p, 6), [m/s]."""
        return self.sd * (2 * np.pi / self.period[:, None])

    @property
    def psa(self) -> Array:
        """Pseudo-acceleration (2 pi/T)^2 SD: ndarray, shape (p, 6), [m/s^2]."""
        return self.sd * (2 * np.pi / self.period[:, None]) ** 2

    def to_csv(self, path: str | PathLike[str]) -> Path:
        """Write periods, PSA, PSV and SD of every measure, with units in the header.

        Raises InputError for a path that cannot be written.
        """
        target = check_output(Path(path), (".csv",))
        blocks = (("PSA", "m/s^2", self.psa), ("PSV", "m/s", self.psv), ("SD", "m", self.sd))
        names = [f"{name}_{measure} [{unit}]" for name, unit, _ in blocks for measure in MEASURES]
        lines = [f"# response spectrum, damping {self.damping:g}", ", ".join(["period [s]", *names])]
        rows = np.column_stack([self.period, *(values for *_, values in blocks)]).tolist()
        lines += [", ".join(map(repr, row)) for row in rows]
        with replacing(target) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return target


def response_spectrum(
    source: Record | Corrected | ContinuousMotion,
    periods: ArrayLike | None = None,
    *,
    damping: float = DAMPING,
    progress: Progress | None = None,
) -> Spectrum:
    """Response spectrum of a motion whose acceleration is linear between its samples.

    The response to a piecewise linear acceleration is exact (Nigam and Jennings, 1969). For short periods it is
    evaluated between the samples too. After the end of the motion it is continued for one period of free vibration. The
    geometric mean is taken over E1 and E2; RotD50 and RotD100 are the median and the maximum of the peaks in 180
    horizontal directions (Boore, 2010).

    Args:
        source: a record (its mean acceleration is subtracted), a corrected record, or a motion.
        periods: shape (p,), [s]; None: 100 from 0.05 s to 10 s.
        damping: ratio to the critical damping, in (0, 1).
        progress: called with the number of completed periods and the number of all.

    Raises:
        InputError: a period is not positive, or the damping is not in (0, 1).
    """
    period = finite("periods", np.geomspace(0.05, 10, 100) if periods is None else periods)
    if period.ndim != 1 or not len(period) or np.any(period <= 0):
        raise InputError(f"periods: {period.tolist()!r:.60}; give a list of positive numbers [s]")
    if not 0 < damping < 1:
        raise InputError(f"damping = {damping!r}: give a ratio above 0 and below 1")
    step, acceleration = _sampled(source)
    sd = []
    for value in period:
        sd.append(_peak_measures(displacements(acceleration, step, value, damping)))
        if progress is not None:
            progress(len(sd), len(period))
    return Spectrum(period, damping, np.array(sd), _peak_measures(acceleration))


def _sampled(source: Record | Corrected | ContinuousMotion) -> tuple[float, Array]:
    """Time step [s] and acceleration, ndarray, shape (k, 3), [m/s^2]."""
    if not isinstance(source, (Record, Corrected)):
        # The longest step of a motion is two sample intervals; one without samples has few pieces.
        step = (source.max_step or source.duration / 1000) / 2
        count = int(np.ceil(source.duration / step * (1 - ROUNDING)))
        return step, source.acceleration(np.minimum(step * np.arange(count + 1), source.duration))
    values = source.acceleration
    offset = values.mean(axis=0) if isinstance(source, Record) else 0.0
    return float(source.time[1] - source.time[0]), values - offset


def displacements(acceleration: Array, step: float, period: float, damping: float) -> Array:
    """Relative displacement of an oscillator under each component of a motion at rest before: shape (m, c) [m].

    The response to a piecewise linear acceleration is exact (Nigam and Jennings, 1969), m - 1 intervals of one length
    through one period of free vibration after the end. acceleration: shape (k, c) [m/s^2]. step: between samples [s].
    period: [s]. damping: ratio to the critical damping [-].
    """
    from scipy.signal import lfilter

    finer = max(1, int(np.ceil(_RESOLUTION * step / period)))
    times = np.arange(len(acceleration)) * float(finer)
    fine = np.arange(times[-1] + 1)
    load = -np.column_stack([np.interp(fine, times, column) for column in acceleration.T])
    rest = np.zeros((int(np.ceil(period / (step / finer))) + 1, acceleration.shape[1]))
    load = np.concatenate([load, rest])
    b, a, first = _recursion(step / finer, 2 * np.pi / period, damping)
    # Initial state of the filter for an oscillator at rest: the first displacement is zero, the second is `first` p[0]
    # + b[0] p[1].
    start = np.stack([-b[0] * load[0], (first - b[1]) * load[0]])
    return lfilter(b, a, load, axis=0, zi=start)[0]  # type: ignore[no-any-return]


def _recursion(step: float, frequency: float, damping: float) -> tuple[Array, Array, float]:
    """Coefficients of the recursion of an oscillator, exact for a load p that is linear over each step."""
    # The recursion is u[n] + a1 u[n-1] + a2 u[n-2] = b0 p[n] + b1 p[n-1] + b2 p[n-2]. One matrix exponential gives
    # the state x = (u, u') after a step as Phi x + G0 p[n] + G1 p[n+1]; the theorem of Cayley and Hamilton eliminates
    # u'.
    # step: [s].
    # frequency: natural angular frequency [rad/s].
    # damping: ratio to the critical damping.
    # Returns b, a, and the factor of p[0] in u[1] from rest.
    from scipy.linalg import expm

    system = np.zeros((4, 4))  # of u, u', p and the increment of p over the step
    system[0, 1] = 1.0
    system[1] = [-(frequency**2), -2 * damping * frequency, 1.0, 0.0]
    system[2, 3] = 1 / step
    transition = expm(system * step)
    phi, g1 = transition[:2, :2], transition[:2, 3]
    g0 = transition[:2, 2] - g1
    trace, determinant = float(np.trace(phi)), float(np.linalg.det(phi))
    reduced = phi - trace * np.eye(2)
    b = np.array([g1[0], g0[0] + (reduced @ g1)[0], (reduced @ g0)[0]])
    return b, np.array([1.0, -trace, determinant]), float(g0[0])


def _peak_measures(values: Array) -> Array:
    """Peaks of a history, shape (m, 3), in the order of `MEASURES`: ndarray, shape (6,)."""
    peaks = np.abs(values).max(axis=0)
    rotated = np.abs(_convex_hull(values[:, :2]) @ np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])).max(axis=0)
    return np.array([*peaks, np.sqrt(peaks[0] * peaks[1]), np.median(rotated), rotated.max()])


def _convex_hull(points: Array) -> Array:
    """Vertices of the convex hull of a plane orbit; the peak in any direction is at one of them."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return points[ConvexHull(points).vertices]  # type: ignore[no-any-return]
    except QhullError:  # all points lie on one line
        return points[[*points.argmin(axis=0), *points.argmax(axis=0)]]


def measure_index(name: str) -> int:
    """Index of a measure in `MEASURES`. Raises InputError for an unknown one."""
    if name not in MEASURES:
        raise InputError(f"component = {name!r}: give one of {', '.join(MEASURES)}")
    return MEASURES.index(name)
