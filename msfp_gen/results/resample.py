"""A result at given times."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.history import History
from msfp_gen.results.run_data import RunData

R = TypeVar("R", bound=RunData)


def at_times(result: R, times: ArrayLike) -> R:
    """`result` with rows at other times, by linear interpolation between its own rows.

    times: ndarray, shape (K,), or a number [s]. Raises InputError for a time outside the run.
    """
    history = result.history
    new_times = checked_times(history.time, times)
    columns = history.arrays().items()
    rows: dict[str, Any] = {name: interpolated(history.time, values, new_times) for name, values in columns}
    energy = {name: interpolated(history.time, values, new_times) for name, values in history.energy.items()}
    return replace(result, history=History(**rows | {"time": new_times}, energy=energy))


def checked_times(rows: Array, times: ArrayLike) -> Array:
    """`times` as an array. Raises InputError for one outside of `rows`, the times of a run, increasing."""
    new_times = np.atleast_1d(np.asarray(times, dtype=float))
    inside = (new_times >= rows[0]) & (new_times <= rows[-1])
    if not np.all(inside):
        raise InputError(
            f"time = {new_times[~inside][0]:g} s: the run holds {rows[0]:g} to {rows[-1]:g} s; give a time in between"
        )
    return new_times


def interpolated(time: Array, values: Array, new_times: Array) -> Array:
    """Rows of `values`, shape (k, ...) at `time`, at other times by linear interpolation."""
    columns = values.reshape(len(time), -1).T
    return np.stack([np.interp(new_times, time, column) for column in columns], axis=-1).reshape(-1, *values.shape[1:])
