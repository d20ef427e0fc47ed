"""A result at given times."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.files import ResultFiles

R = TypeVar("R", bound=ResultFiles)


def at_times(result: R, times: ArrayLike) -> R:
    """`result`, of one bearing or of a building, at other times, by linear interpolation between its own rows.

    times: ndarray, shape (K,), or a number [s]. Raises InputError for a time outside the run.
    """
    rows: Any = getattr(result, "history", result)  # that of a building has its rows itself
    new_times = checked_times(rows.time, times)

    def at(values: Any) -> Any:
        if isinstance(values, dict):
            return {name: at(column) for name, column in values.items()}
        return interpolated(rows.time, values, new_times) if isinstance(values, np.ndarray) else values

    changed = replace(
        rows, **{field.name: at(getattr(rows, field.name)) for field in fields(rows)} | {"time": new_times}
    )
    return changed if rows is result else replace(result, history=changed)  # type: ignore[type-var]


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
