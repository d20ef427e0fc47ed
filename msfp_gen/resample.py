"""A run seen at chosen instants."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.errors import InputError
from msfp_gen.history import Array, History

if TYPE_CHECKING:
    from msfp_gen.result import Result


def at_times(result: Result, times: ArrayLike) -> Result:
    """`result` with rows at `times`, ndarray, shape (K,) or a number, [s]; between rows every quantity runs straight.

    Raises InputError for a time that the run does not hold.
    """
    history = result.history
    when = _checked(history.time, times)
    columns = history.arrays().items()
    rows: dict[str, Any] = {name: _interpolated(history.time, values, when) for name, values in columns}
    energy = {name: _interpolated(history.time, values, when) for name, values in history.energy.items()}
    return replace(result, history=History(**rows | {"time": when}, energy=energy))


def _checked(rows: Array, times: ArrayLike) -> Array:
    when = np.atleast_1d(np.asarray(times, dtype=float))
    inside = (when >= rows[0]) & (when <= rows[-1])
    if not np.all(inside):
        raise InputError(
            f"time = {when[~inside][0]:g} s: the run holds {rows[0]:g} to {rows[-1]:g} s; give a time in between"
        )
    return when


def _interpolated(time: Array, values: Array, when: Array) -> Array:
    columns = values.reshape(len(time), -1).T
    return np.stack([np.interp(when, time, column) for column in columns], axis=-1).reshape(-1, *values.shape[1:])
