"""What rows in full sliding say about the bearing: curvature, friction, heat, coupling and damping, by least squares.

Where both outermost surfaces slide along one direction d, F . d = N u . d/L + N mu, so that the force of a program is a
sum of few parts with known shapes. Factors on them, one where the data of the bearing hold, follow from a linear fit;
errors take every stroke as two independent observations, since the residuals of its rows are not independent.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.stated import Coefficients, Stated
from msfp_gen.common.arrays import Array, Flags, Indices

STRAIGHT = 0.99  # chord over arc of a path that is straight, and cosine of the velocity along it
CLOSED = 0.2  # axial force over that at rest, below which a bearing may be opening
NEAR_RIM = 0.95  # displacement over that at which a rim may be met
SLOW = 0.02  # velocity over the largest: slower rows may be sticking
FEWEST_STROKES, FEWEST_ROWS = 3, 30
DISTINCT = 1e-3  # variation of a part of the force over the force, from which on its factor is fitted
AS_WELL = 1.5  # residual over the least one, up to which another theory is possible as well
THEORY = 0.01  # of friction: what rigid links leave out of the force of a sound program
ERRORS = 3.0  # standard errors within which two values agree


class FittedFactor(NamedTuple):
    """A fitted factor, its standard error, and the factor of the other theory where that fits as well.

    There are two theories: small angles, which most programs have, and links that turn by any angle.
    """

    value: float
    error: float
    other: float

    def agrees(self, expected: float, floor: float) -> bool:
        """Whether an expected value lies between the theories, within errors and a floor."""
        low, high = sorted((self.value, self.other))
        reach = floor + ERRORS * self.error
        return low - reach <= expected <= high + reach


@dataclass(frozen=True)
class SlidingFit:
    """Factors of the parts of the force: `radius` (1/L), `friction`, `heat`, `coupling`, `damping` [N s/m]."""

    factors: dict[str, FittedFactor]
    residual: float  # root mean square over the friction force [-]


@dataclass(frozen=True)
class Sliding:
    """The rows in which a bearing slides fully along a straight path.

    Attributes:
        histories, stated: the histories, and the data of the bearing.
    """

    histories: Histories
    stated: Stated

    @cached_property
    def _strokes(self) -> tuple[Array, Array]:
        """Direction of the path in every row, (T, 2), zero where it is not straight; and number of the stroke, (T,)."""
        data, stated = self.histories, self.stated
        u, v = data.displacement, data.velocity
        size = np.hypot(*np.diff(u, axis=0, prepend=u[:1]).T)
        arc = np.cumsum(size)
        before = np.searchsorted(arc, arc - stated.turning, side="right") - 1
        chord = u - u[np.maximum(before, 0)]
        length = np.hypot(*chord.T)
        direction = chord / np.maximum(length, 1e-300)[:, None]
        speed = np.hypot(*v.T)
        along = (v * direction).sum(axis=1)
        far = arc - arc[np.maximum(before, 0)]
        good = (before >= 0) & (length >= STRAIGHT * far) & (along >= STRAIGHT * speed) & (speed > SLOW * speed.max())
        good &= self.settled
        # Strokes end where the path is not straight, or turns.
        starts = good & ~np.append(False, good[:-1])
        return np.where(good[:, None], direction, 0.0), np.where(good, np.cumsum(starts), 0)

    @cached_property
    def closed(self) -> Flags:
        """Rows with closed surfaces, after a path in which links that parted find their places, ndarray, shape (T,)."""
        data = self.histories
        if "axial" not in data.columns:
            return np.ones(len(data.time), dtype=bool)
        return self._after(data.below(CLOSED)) & (data.axial > CLOSED * data.at_rest)

    @cached_property
    def settled(self) -> Flags:
        """The closed rows that are not near a rim, and after a path in which links leave it, ndarray, shape (T,)."""
        near: Flags = np.hypot(*self.histories.displacement.T) > NEAR_RIM * self.stated.first_rim
        return self.closed & self._after(near)

    def _after(self, loose: Flags) -> Flags:
        """Rows in whose path, as long as links need to find their places, no row is loose, (T,)."""
        u = self.histories.displacement
        arc = np.cumsum(np.hypot(*np.diff(u, axis=0, prepend=u[:1]).T))
        latest = np.maximum.accumulate(np.where(loose, arc, -np.inf))
        after: Flags = arc - latest > 2.0 * self.stated.turning
        return after

    @cached_property
    def rows(self) -> Indices:
        """Row numbers, ndarray of int, shape (k,)."""
        return np.flatnonzero(self._strokes[1])

    @property
    def strokes(self) -> int:
        """Number of strokes."""
        return len(np.unique(self._strokes[1][self.rows]))

    @property
    def enough(self) -> bool:
        """Whether a fit has enough rows and strokes."""
        return len(self.rows) >= FEWEST_ROWS and self.strokes >= FEWEST_STROKES

    @property
    def lack(self) -> str:
        """Why a fit is not possible, as the end of a sentence."""
        travel, found = 1e3 * self.stated.turning, f"{self.strokes} strokes and {len(self.rows)} rows"
        return (
            f"the outermost surfaces slide after {travel:.3g} mm of a straight path; of that there are {found}; "
            f"{FEWEST_STROKES} strokes and {FEWEST_ROWS} rows would decide"
        )

    @cached_property
    def law(self) -> Coefficients:
        """Friction by the law over all rows."""
        data = self.histories
        speed, travel = np.hypot(*data.velocity.T), np.hypot(*data.displacement.T)
        return self.stated.coefficients(data.time, speed, travel, data.axial)

    def along(self, vectors: Array) -> Array:
        """Component of vectors, (T, 2), along the path in the rows, ndarray, shape (k,) [unit of `vectors`]."""
        component: Array = (vectors * self._strokes[0]).sum(axis=1)[self.rows]
        return component

    @cached_property
    def implied(self) -> Array:
        """Friction over axial force that the data imply in the rows, F . d/N - u . d/L, ndarray, shape (k,) [-]."""
        data = self.histories
        friction: Array = (
            self.along(data.force) / data.axial[self.rows] - self.along(data.displacement) / self.stated.radius
        )
        return friction

    @cached_property
    def fit(self) -> SlidingFit:
        """The fitted factors. Needs `enough`."""
        better, other = sorted((self._fitted(large=False), self._fitted(large=True)), key=lambda fitted: fitted[1])
        open_ = other[1] < AS_WELL * better[1]
        factors = {
            name: FittedFactor(value, error, other[0].get(name, (value, 0.0))[0] if open_ else value)
            for name, (value, error) in better[0].items()
        }
        return SlidingFit(factors, better[1])

    def _fitted(self, large: bool) -> tuple[dict[str, tuple[float, float]], float]:
        data, rows, law, radius = self.histories, self.rows, self.law, self.stated.radius
        force, u, speed = self.along(data.force), self.along(data.displacement), self.along(data.velocity)
        axial, rest = data.axial[rows], data.at_rest
        restoring, arm = u / radius, np.ones_like(u)
        if large:  # the links turn by asin(u/L), and friction acts on the whole of the transmitted force
            tilt = np.arcsin(np.clip(np.hypot(*data.displacement.T)[rows] / radius, 0.0, 0.9))
            restoring, arm = restoring / np.cos(tilt), np.hypot(1.0, force / axial) / np.cos(tilt)
        heat = law.heated[rows] - law.cold[rows]
        parts = {
            "radius": rest * restoring,
            "friction": rest * law.cold[rows] * arm,
            "heat": rest * heat * arm,
            "coupling": (axial - rest) * force / axial,  # of the friction that acts, whatever it is
            "damping": speed,
        }
        scale = float(np.abs(force).max())
        base = [name for name in ("radius", "friction") if np.ptp(parts[name]) or np.abs(parts[name]).max() > 0]
        chosen = base + [n for n in ("heat", "coupling") if np.std(parts[n]) > DISTINCT * scale]
        chosen += ["damping"] if np.std(speed) > 0.02 * np.abs(speed).max() else []
        matrix = np.column_stack([parts[name] for name in chosen])
        norms = np.linalg.norm(matrix, axis=0)
        # Parts that the fit does not have act as the law has them.
        left = force - sum(parts[name] for name in ("heat", "coupling") if name not in chosen)
        values, *_ = np.linalg.lstsq(matrix / norms, left, rcond=None)
        residual = left - matrix / norms @ values
        deviation = float(np.sqrt(np.mean(residual**2)))
        friction = float(np.mean(np.abs(parts["friction"]))) or scale
        # A model is off by more than its residuals where parts of the force are alike.
        scatter = float(np.hypot(deviation, THEORY * friction))
        inverse = np.linalg.pinv(matrix.T @ matrix / np.outer(norms, norms))
        errors = scatter * np.sqrt(np.diag(inverse) * len(rows) / (2 * self.strokes)) / norms
        return dict(
            zip(chosen, zip((values / norms).tolist(), errors.tolist(), strict=True), strict=True)
        ), deviation / friction
