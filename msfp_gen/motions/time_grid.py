"""Times at which steps of a run must end, and longest steps, determined from the prescribed histories of a scene.

The error estimate of a step assumes smooth histories, and a step much longer than a pulse may pass over it without any
evaluation inside it. Therefore steps end at every knot at which a history is not smooth to the order of the method.
Between such knots no step is longer than a quarter of the time over which one polynomial approximates the history to a
hundredth of its magnitude.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import factorial
from typing import Protocol

import numpy as np

from msfp_gen.common.arrays import Array, Flags, Indices, distinct
from msfp_gen.motions.piecewise import ORDER, polynomial, powers

# A knot is smooth if the polynomial before it, continued over the shorter of the two neighbouring pieces, deviates from
# the history by at most this share of the largest value; by order of derivative. Quintic pieces through a sampled sine
# deviate by a hundredth of it, the end of a smooth start by 20 times as much.
SMOOTH_DEVIATION = {0: 1e-6, 1: 1e-5, 2: 1e-4}
FIT_DEVIATION = 1e-2  # largest relative deviation at which the polynomial of a piece still approximates later pieces
STEP_SHARE = 0.25  # longest step over the time that one polynomial approximates
TIME_TOLERANCE = 1e-9
"""Times that differ by less than TIME_TOLERANCE max(1, t) [s] are equal: no step is shorter (same value in run.c)."""


class PrescribedHistory(Protocol):
    """A prescribed history, such as a motion, a load or a rotation: piecewise polynomials in time."""

    @property
    def knots(self) -> Array:
        """Ends of the pieces: ndarray, shape (k+1,), [s]."""

    @property
    def coefficients(self) -> Array:
        """Ascending powers of (t - knots[piece]): ndarray, shape (k, channels, 6), [SI]."""

    @property
    def jumps(self) -> Array:
        """Times at which it jumps: ndarray, shape (j,), [s]."""

    @property
    def resolution(self) -> Resolution:
        """Its requirements on the steps of a run."""


@dataclass(frozen=True, eq=False)
class Resolution:
    """Requirements of one history on the steps of a run.

    Attributes:
        knots: ends of its pieces, ndarray, shape (k+1,), [s].
        kinks: knots at which a step must end, ndarray, shape (j,), [s].
        steps: longest step in each piece, ndarray, shape (k,), [s]; inf where it is not limited.
    """

    knots: Array
    kinks: Array
    steps: Array

    @classmethod
    def of(cls, history: PrescribedHistory, orders: Sequence[int], longest: float | None = None) -> Resolution:
        """Requirements of a history.

        Args:
            history: the piecewise polynomials.
            orders: orders of the derivatives on which forces depend.
            longest: step that is known to resolve the history [s]; None: determined from the pieces.
        """
        knots, pieces = history.knots, _in_vectors(history.coefficients)
        sizes = {order: _sizes(knots, pieces, order) for order in orders}
        kinked = np.zeros(len(knots) - 2, dtype=bool)
        for order, size in sizes.items():
            kinked |= _deviations(knots, pieces, order, size) > SMOOTH_DEVIATION[order]
        known = longest is not None
        steps = np.full(len(pieces), longest) if known else _longest_steps(knots, pieces, kinked, sizes)
        return cls(knots, knots[1:-1][kinked], steps)

    @classmethod
    def sampled(cls, knots: Array) -> Resolution:
        """Requirements of a sampled history, with a kink at every knot: steps end at all knots and are not limited."""
        return cls(knots, knots[1:-1], np.full(len(knots) - 1, np.inf))


@dataclass(frozen=True, eq=False)
class TimeGrid:
    """Requirements of all histories of a scene on the steps of a run.

    Attributes:
        stops: times at which a step must end, ndarray, shape (s,), increasing, [s].
        jumps: times at which an acceleration or a load jumps, ndarray, shape (j,), [s].
        ends: ends of intervals of one longest step, ndarray, shape (i,), [s].
        steps: longest step in each interval, ndarray, shape (i,), [s]; inf where it is not limited.
    """

    stops: Array
    jumps: Array
    ends: Array
    steps: Array

    @classmethod
    def of_histories(
        cls, histories: Sequence[PrescribedHistory], end: float, steps: Iterable[float | None]
    ) -> TimeGrid:
        """The grid of histories with their jumps; what changes in a piece shorter than any step is one too.

        end: of the run [s]. steps: longest that are permitted [s]; None: not limited.
        """
        jumps = np.concatenate(
            [times for history in histories for times in (history.jumps, short_pieces(history.knots))]
        )
        longest = min((step for step in steps if step is not None), default=np.inf)
        return cls.of([history.resolution for history in histories], jumps, end, longest)

    @classmethod
    def of(cls, parts: Sequence[Resolution], jumps: Array, end: float, max_step: float) -> TimeGrid:
        """The grid of several histories.

        Args:
            parts: requirements of each history.
            jumps: times of jumps of an acceleration or a load, shape (j,), [s].
            end: end of the run [s].
            max_step: longest step permitted anywhere [s]; inf: not limited.
        """
        stops = distinct_times(np.concatenate([jumps, *(part.kinks for part in parts)]))
        jumps = matched(distinct_times(jumps), stops)
        stops = stops[(stops > 0) & (stops < end - TIME_TOLERANCE * max(1.0, end))]
        ends = distinct(np.concatenate([*(part.knots[1:] for part in parts), [end]]))
        middle = (np.append(0.0, ends[:-1]) + ends) / 2
        steps = np.full(len(ends), max_step)
        for part in parts:
            piece = np.searchsorted(part.knots, middle, side="right") - 1
            inside = piece < len(part.steps)
            steps[inside] = np.minimum(steps[inside], part.steps[piece[inside]])
        last = np.append(steps[1:] != steps[:-1], True)  # adjacent intervals with equal longest steps are merged
        return cls(stops, jumps, ends[last], steps[last])


def distinct_times(times: Array) -> Array:
    """Times, shape (k,) [s], in increasing order; of times that are equal to `TIME_TOLERANCE` only the first."""
    ordered = distinct(times)
    apart = np.append(True, np.diff(ordered) > TIME_TOLERANCE * np.maximum(1.0, ordered[1:]))
    kept: Array = ordered[apart[: len(ordered)]]
    return kept


def short_pieces(knots: Array) -> Array:
    """Starts, shape (k,) [s], of the pieces shorter than any step: what changes in them is a jump for a run."""
    return knots[:-1][np.diff(knots) <= TIME_TOLERANCE * np.maximum(1.0, knots[1:])]


def matched(values: Array, times: Array) -> Array:
    """Times, shape (k,) [s], each replaced by the element of the increasing `times` that equals it, if any.

    Equal: to `TIME_TOLERANCE`.
    """
    if not len(times):
        return values
    after = np.minimum(np.searchsorted(times, values), len(times) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(values - times[before] < times[after] - values, times[before], times[after])
    moved: Array = np.where(np.abs(values - nearest) <= TIME_TOLERANCE * np.maximum(1.0, values), nearest, values)
    return moved


def snapped(knots: Array, coefficients: Array, times: Array) -> tuple[Array, Array]:
    """Knots, shape (k+1,) [s], matched to `times`, and coefficients, (k, channels, 6).

    Pieces whose ends become equal are left out.
    """
    moved = matched(knots, times)
    kept = np.diff(moved) > 0
    return np.append(moved[:-1][kept], moved[-1]), np.ascontiguousarray(coefficients[kept])


def _in_vectors(coefficients: Array) -> Array:
    """Coefficients, shape (k, channels, 6), grouped by vectors of three channels: (k, vectors, components, 6)."""
    count, channels, _ = coefficients.shape
    pieces = coefficients.reshape(count, max(channels // 3, 1), -1, ORDER)
    # Vectors and components that are always zero ask for nothing and are left out; one remains.
    used = (pieces != 0).any(axis=(0, 3))
    return pieces[:, used.any(axis=1)][:, :, used.any(axis=0)] if used.any() else pieces[:, :1, :1]


def _sizes(knots: Array, pieces: Array, order: int) -> Array:
    """Largest magnitude of a derivative of each vector, shape (vectors,); 1 where the derivative is zero."""
    width = np.diff(knots)
    sizes = [np.abs(_at(pieces, share * width, order)).max(axis=(0, 2)) for share in (0.0, 0.5, 1.0)]
    size: Array = np.max(sizes, axis=0)
    size[size == 0] = 1.0
    return size


def _at(pieces: Array, local: Array, order: int) -> Array:
    """Derivative of each piece at the time `local`, shape (k,), [s], after its knot: shape (k, vectors, components)."""
    return polynomial(pieces, local[:, None, None], order)


def _deviations(knots: Array, pieces: Array, order: int, size: Array) -> Array:
    """Relative deviation of a derivative at each inner knot, shape (k-1,)."""
    # It bounds the difference between the polynomials before and after the knot over the shorter of the two pieces,
    # by the jumps of all higher derivatives (Taylor), relative to `size`.
    width = np.diff(knots)
    shorter, deviations = np.minimum(width[:-1], width[1:])[:, None, None], np.zeros(pieces[1:, ..., 0].shape)
    for d in range(order, ORDER):
        jump = np.abs(factorial(d) * pieces[1:, ..., d] - _at(pieces[:-1], width[:-1], d))
        deviations += jump * shorter ** (d - order) / factorial(d - order)
    deviation: Array = (deviations.max(axis=2) / size).max(axis=1, initial=0.0)
    return deviation


def _longest_steps(knots: Array, pieces: Array, kinked: Flags, sizes: Mapping[int, Array]) -> Array:
    """Longest step in every piece, shape (k,), [s]; inf where a method integrates its polynomial exactly."""
    width, index, exact = np.diff(knots), np.arange(len(pieces)), max(sizes)
    degree = _degrees(pieces, width, sizes[min(sizes)])
    first = index - _pieces_approximated(knots, pieces, kinked, sizes, -1)
    last = index + _pieces_approximated(knots, pieces, kinked, sizes, 1)
    steps = STEP_SHARE * (knots[last + 1] - knots[first])
    steps = np.where(degree <= exact + 1, np.maximum(width, steps), steps)
    return np.where(degree <= exact, np.inf, steps)


def _degrees(pieces: Array, width: Array, size: Array) -> Indices:
    """Degree of every piece, shape (k,): the highest power with a term above the rounding error."""
    terms = np.abs(pieces) * powers(width[:, None, None])
    used = np.any(terms > SMOOTH_DEVIATION[0] * size[:, None, None], axis=(1, 2))
    degree: Indices = (used * np.arange(ORDER)).max(axis=1)
    return degree


def _pieces_approximated(
    knots: Array, pieces: Array, kinked: Flags, sizes: Mapping[int, Array], direction: int
) -> Indices:
    """Number of neighbouring pieces that the polynomial of each piece approximates: 0, 1, 2, 4 and so on."""
    # It counts later pieces (direction 1) or earlier ones (-1). A piece approximates 2 s neighbours only if it
    # approximates s of them, the piece s further on approximates its s neighbours, and no kink lies between.
    count = len(pieces)
    blocked = np.append(kinked, True) if direction > 0 else np.append(True, kinked)  # by a kink or the end
    approximated, candidate, stride = np.zeros(count, dtype=np.intp), ~blocked, 1
    while stride < count and candidate.any():
        index = np.flatnonzero(candidate)
        index = index[(index + direction * stride >= 0) & (index + direction * stride < count)]
        index = index[_approximates(knots, pieces, index, direction * stride, sizes)]
        approximated[index] = stride
        candidate = np.zeros(count, dtype=bool)
        candidate[index[approximated[index + direction * stride] == stride]] = True
        stride *= 2
    return approximated


def _approximates(knots: Array, pieces: Array, index: Indices, stride: int, sizes: Mapping[int, Array]) -> Flags:
    """Whether each piece of `index` approximates the piece `stride` further on at its middle and its far end."""
    other, result = index + stride, np.ones(len(index), dtype=bool)
    width = knots[other + 1] - knots[other]
    for order in {min(sizes), max(sizes)}:
        for share in (0.5, 1.0 if stride > 0 else 0.0):
            local = knots[other] + share * width - knots[index]
            difference = np.abs(_at(pieces[index], local, order) - _at(pieces[other], share * width, order))
            result &= np.all(difference.max(axis=2) <= FIT_DEVIATION * sizes[order], axis=1)
    return result
