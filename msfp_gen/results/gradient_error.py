"""Errors of the derivatives of a run, measured by the same run at a smaller tolerance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.gradient import Gradients, gradients_of_extremes

if TYPE_CHECKING:
    from msfp_gen.results.run_data import RunData

FACTOR = 3.0
"""Of the difference of the two runs: the error of the finer one is hardly smaller where sliders ring."""


def measured_errors(result: RunData, finer: RunData) -> Gradients:
    """Errors of the derivatives of `result`, all positive: `FACTOR` times their differences from those of `finer`.

    That of a row is the largest from there to the next event, because errors oscillate. Of an event that `finer` has
    not, and between two instants of the same event, the error is as large as the derivative itself.
    """
    ours, theirs = result.gradients, finer.gradients
    assert ours is not None
    assert theirs is not None
    at, times = result.history.time, finer.history.time
    passed = [np.searchsorted([event.time for event in each.events], at) for each in (result, finer)]
    spans = np.split(np.arange(len(at)), np.flatnonzero(np.any(np.diff(passed) != 0, axis=0)) + 1)
    above = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    share = np.clip((at - times[above - 1]) / (times[above] - times[above - 1]), 0.0, 1.0)

    def of_rows(values: Array, other: Array) -> Array:
        weight = share.reshape(-1, *[1] * (values.ndim - 2))
        error = FACTOR * np.abs(values - (1 - weight) * other[:, above - 1] - weight * other[:, above])
        for span in spans:
            error[:, span] = np.maximum.accumulate(error[:, span[::-1]], axis=1)[:, ::-1]
        return error

    same = [(e.kind, e.surface) for e in result.events] == [(e.kind, e.surface) for e in finer.events]

    def of_events(values: Array, other: Array) -> Array:
        return FACTOR * np.abs(values - other) if same else np.abs(values)

    return Gradients(
        ours.parameters,
        {name: of_rows(values, theirs.rows[name]) for name, values in ours.rows.items()},
        {name: of_rows(values, theirs.energy[name]) for name, values in ours.energy.items()},
        of_events(ours.event_time, theirs.event_time),
        of_events(ours.event_displacement, theirs.event_displacement),
        of_events(ours.event_top_force, theirs.event_top_force),
        _of_extremes(result, finer),
    )


def _of_extremes(result: RunData, finer: RunData) -> tuple[Extremes, ...]:
    """Errors of the derivatives of the extremes that the summary states, by parameter."""
    ours, theirs = _slopes(result), _slopes(finer)
    count = len(next(iter(ours.values())))
    errors = {name: FACTOR * np.abs(values - theirs[name]) for name, values in ours.items()}
    return tuple(Extremes(**{name: values[i] for name, values in errors.items()}) for i in range(count))


def _slopes(result: RunData) -> dict[str, Array]:
    assert result.gradients is not None
    assert result.recorded_extremes is not None
    return gradients_of_extremes(result.gradients, result.history, result.recorded_extremes)
