"""Response spectra of a ground motion: each component, their geometric mean, RotD50 and RotD100."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.errors import InputError
from msfp_gen.motion_checks import finite
from msfp_gen.output import check_output, replacing
from msfp_gen.piecewise import Array
from msfp_gen.records.record import COMPONENTS

if TYPE_CHECKING:
    from msfp_gen.motion import Motion
    from msfp_gen.records.correction import Corrected
    from msfp_gen.records.record import Record

MEASURES = (*COMPONENTS, "geomean", "rotd50", "rotd100")
DAMPING = 0.05
Progress = Callable[[float, float], None]
_RESOLUTION = 50  # points a period: a peak between two of them is missed by less than 1 - cos(pi/50), 0.2 %
_ANGLES = np.radians(np.arange(180.0))  # of RotDnn, Boore (2010)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Peak response of oscillators of one damping ratio.

    Attributes:
        period: ndarray, shape (p,), [s].
        damping: ratio to the critical one.
        sd: ndarray, shape (p, 6), [m]: peak relative displacement, along `MEASURES`.
        pga: ndarray, shape (6,), [m/s^2]: peak ground acceleration, along `MEASURES`.
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
        """Write periods, PSA, PSV and SD of every measure, units in the header; whole or not at all."""
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
    source: Record | Corrected | Motion,
    periods: ArrayLike | None = None,
    *,
    damping: float = DAMPING,
    progress: Progress | None = None,
) -> Spectrum:
    """The response spectrum of a motion, whose acceleration is taken as linear between its samples.

    The response to a piecewise linear acceleration is exact (Nigam and Jennings, 1969); short periods are computed at
    points between the samples, and after its end the motion is followed for one period of free vibration. The
    geometric mean is that of E1 and E2; RotD50 and RotD100 are the median and the greatest of the peaks in 180
    horizontal directions (Boore, 2010).

    Args:
        source: a record (its mean acceleration is removed), a corrected record, or a motion.
        periods: shape (p,), [s]; None: 100 from 0.05 s to 10 s.
        damping: ratio to the critical one, in (0, 1).
        progress: takes periods done and periods in all.

    Raises:
        InputError: a period is not positive, or the damping is not in (0, 1).
    """
    wanted = finite("periods", np.geomspace(0.05, 10, 100) if periods is None else periods)
    if wanted.ndim != 1 or not len(wanted) or np.any(wanted <= 0):
        raise InputError(f"periods: {wanted.tolist()!r:.60}; give a list of positive numbers [s]")
    if not 0 < damping < 1:
        raise InputError(f"damping = {damping!r}: give a ratio above 0 and below 1")
    step, acceleration = _sampled(source)
    sd = []
    for period in wanted:
        sd.append(_measured(_displacements(acceleration, step, period, damping)))
        if progress is not None:
            progress(len(sd), len(wanted))
    return Spectrum(wanted, damping, np.array(sd), _measured(acceleration))


def _sampled(source: Record | Corrected | Motion) -> tuple[float, Array]:
    """Time step [s] and acceleration, ndarray, shape (k, 3), [m/s^2]."""
    from msfp_gen.motion import Motion
    from msfp_gen.records.record import Record

    if isinstance(source, Motion):
        # A motion's longest step is two of its samples; one without samples is a polynomial or two.
        points = 2 + int(source.duration / ((source.max_step or source.duration / 1000) / 2))
        time = np.linspace(0, source.duration, points)
        return float(time[1]), source.acceleration(time)
    values = source.acceleration
    offset = values.mean(axis=0) if isinstance(source, Record) else 0.0
    return float(source.time[1] - source.time[0]), values - offset


def _displacements(acceleration: Array, step: float, period: float, damping: float) -> Array:
    """Relative displacement of an oscillator over each component: ndarray, shape (m, 3), [m]."""
    from scipy.signal import lfilter

    finer = max(1, int(np.ceil(_RESOLUTION * step / period)))
    times = np.arange(len(acceleration)) * float(finer)
    fine = np.arange(times[-1] + 1)
    load = -np.column_stack([np.interp(fine, times, column) for column in acceleration.T])
    rest = np.zeros((int(np.ceil(period / (step / finer))) + 1, 3))
    load = np.concatenate([load, rest])
    b, a, first = _recursion(step / finer, 2 * np.pi / period, damping)
    # From rest: the first value is zero, the second owes nothing to what was before.
    start = np.stack([-b[0] * load[0], (first - b[1]) * load[0]])
    return lfilter(b, a, load, axis=0, zi=start)[0]  # type: ignore[no-any-return]


def _recursion(step: float, frequency: float, damping: float) -> tuple[Array, Array, float]:
    """Coefficients b, a of u[n] + a1 u[n-1] + a2 u[n-2] = b0 p[n] + b1 p[n-1] + b2 p[n-2], exact for linear p.

    Also the share of p[0] in u[1] from rest. The state (u, u') over a step is Phi x + G0 p[n] + G1 p[n+1], from one
    matrix exponential; Cayley and Hamilton turn it into a recursion for u alone.
    """
    from scipy.linalg import expm

    system = np.zeros((4, 4))  # u, u', p and its rate over the step
    system[0, 1] = 1.0
    system[1] = [-(frequency**2), -2 * damping * frequency, 1.0, 0.0]
    system[2, 3] = 1 / step
    over = expm(system * step)
    phi, later = over[:2, :2], over[:2, 3]
    now = over[:2, 2] - later
    trace, determinant = float(np.trace(phi)), float(np.linalg.det(phi))
    back = phi - trace * np.eye(2)
    b = np.array([later[0], now[0] + (back @ later)[0], (back @ now)[0]])
    return b, np.array([1.0, -trace, determinant]), float(now[0])


def _measured(values: Array) -> Array:
    """Peaks of a history, shape (m, 3), along `MEASURES`: ndarray, shape (6,)."""
    peaks = np.abs(values).max(axis=0)
    turned = np.abs(_outline(values[:, :2]) @ np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])).max(axis=0)
    return np.array([*peaks, np.sqrt(peaks[0] * peaks[1]), np.median(turned), turned.max()])


def _outline(points: Array) -> Array:
    """The points of a plane orbit that can be a peak in any direction: its convex hull."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return points[ConvexHull(points).vertices]  # type: ignore[no-any-return]
    except QhullError:  # all on one line
        return points[[*points.argmin(axis=0), *points.argmax(axis=0)]]


def measure_index(name: str) -> int:
    """The column of a measure. Raises InputError for an unknown one."""
    if name not in MEASURES:
        raise InputError(f"component = {name!r}: give one of {', '.join(MEASURES)}")
    return MEASURES.index(name)

