"""Force against acceleration of the supported mass, in windows: the balance of momentum without differentiation.

A window is a smooth weight w over some tenths of a second. The mean of a force under w is compared with the mean of the
acceleration, or of the position x under w'': the integrals of x w'' and x'' w are the same. Both are smoothed alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from msfp_gen.auditing.histories import Histories
from msfp_gen.common.arrays import Array

WIDTH, ROWS = 0.5, 24  # of a window: [s], and its least number of rows
FEWEST = 8  # windows
ONE_MASS = 0.97  # squared correlation of force and acceleration of one mass


class Momentum(NamedTuple):
    """Force and acceleration of windows.

    Attributes:
        mass: implied, the geometric mean of both regressions [kg].
        error: of the mass, relative [-].
        correlation: of force and acceleration [-].
        force, acceleration: of the windows, shape (k,) [N], [m/s^2], of all bearings.
        row, time: the window that is farthest from the implied mass, and its time [s].
    """

    mass: float
    error: float
    correlation: float
    force: Array
    acceleration: Array
    row: int
    time: float

    @property
    def one_mass(self) -> bool:
        """Whether force and acceleration are proportional."""
        return self.correlation**2 >= ONE_MASS

    @property
    def spread(self) -> float:
        """Standard deviation of the acceleration [m/s^2]."""
        return float(np.std(self.acceleration))


def momentum(data: Histories, vertical: bool = False) -> Momentum | None:
    """Force against acceleration, of both horizontal axes or the vertical one; None: columns or windows are missing."""
    axes = (3,) if vertical else (1, 2)
    forces, accelerations, times = [], [], []
    for axis in axes:
        name = "axial" if vertical else f"force_{axis}"
        kind = next((k for k in ("acceleration", "position") if f"{k}_{axis}" in data.columns), None)
        if kind is None or name not in data.columns:
            continue
        force, motion = data.columns[name] * data.bearings, data.columns[f"{kind}_{axis}"]
        where, means = _windows(data.time, force, motion, kind == "position")
        if len(where):
            forces.append(means[0] - (means[0].mean() if vertical else 0.0))
            accelerations.append(means[1] - (means[1].mean() if vertical else 0.0))
            times.append(where)
    if not forces or sum(map(len, times)) < FEWEST:
        return None
    force, acceleration, time = map(np.concatenate, (forces, accelerations, times))
    ff, aa, fa = float(force @ force), float(acceleration @ acceleration), float(force @ acceleration)
    if not (ff and aa and fa):
        return None
    mass, correlation = np.sqrt(ff / aa), fa / np.sqrt(ff * aa)
    row = int(np.abs(force - np.sign(fa) * mass * acceleration).argmax())
    return Momentum(
        float(mass), float(1.0 - abs(correlation)), float(correlation), force, acceleration, row, float(time[row])
    )


def _windows(time: Array, force: Array, motion: Array, twice: bool) -> tuple[Array, tuple[Array, Array]]:
    """Middle times of windows, and means of force and acceleration. twice: the motion is a position."""
    width = max(WIDTH, ROWS * float(np.median(np.diff(time))))
    starts = np.arange(time[0], time[-1] - width, width / 2)
    forces, accelerations = np.zeros(len(starts)), np.zeros(len(starts))
    for k, start in enumerate(starts):
        a, b = np.searchsorted(time, [start, start + width])
        a, b = max(int(a) - 1, 0), min(int(b) + 1, len(time))
        phase = np.clip((time[a:b] - start) / width, 0.0, 1.0) * np.pi
        weight = np.sin(phase) ** 4
        area = np.trapezoid(weight, time[a:b])
        if twice:
            bend = (12.0 * np.sin(phase) ** 2 * np.cos(phase) ** 2 - 4.0 * np.sin(phase) ** 4) * (np.pi / width) ** 2
            middle = motion[(a + b) // 2]
            accelerations[k] = np.trapezoid((motion[a:b] - middle) * bend, time[a:b]) / area
        else:
            accelerations[k] = np.trapezoid(motion[a:b] * weight, time[a:b]) / area
        forces[k] = np.trapezoid(force[a:b] * weight, time[a:b]) / area
    return starts + width / 2, (forces, accelerations)
