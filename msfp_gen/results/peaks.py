"""Derivatives of the extremes of a run: those of its steps, or of a row where that is larger."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.extremes import LEAST, Extremes

if TYPE_CHECKING:
    from msfp_gen.results.gradient import Gradients
    from msfp_gen.results.history import History

# Extreme -> field of `History`, and whether it is the magnitude of a vector, by axis or not.
SERIES = {
    "displacement": ("displacement", "axes"),
    "top_force": ("top_force", "axes"),
    "sliding": ("sliding", ""),
    "gap": ("gap", ""),
    "slip_speed": ("slip_velocity", "length"),
    "least_normal": ("normal_force", ""),
    "most_normal": ("normal_force", ""),
    "least_friction": ("friction_coefficient", ""),
    "most_friction": ("friction_coefficient", ""),
}


def gradients_of_extremes(gradients: Gradients, history: History, recorded: Extremes) -> dict[str, Array]:
    """Derivatives of `RunData.extremes` by name, each of shape (k, number of values)."""
    found = {}
    for name in (f.name for f in fields(Extremes) if f.name in SERIES):
        values = getattr(recorded, name)
        if values is None:
            continue
        steps = np.array([getattr(each, name) for each in gradients.extremes])
        series, slopes = _series(name, gradients, history)
        sign = -1.0 if name in LEAST else 1.0
        row = (sign * series).argmax(axis=0)
        columns = np.arange(series.shape[1])
        beyond = sign * (series[row, columns] - values) > 0
        found[name] = np.where(beyond, slopes[:, row, columns], steps)
    return found


def _series(name: str, gradients: Gradients, history: History) -> tuple[Array, Array]:
    """The values of which an extreme is taken, shape (T, m), and their derivatives, (k, T, m)."""
    field, kind = SERIES[name]
    values, slopes = getattr(history, field), gradients.rows[field]
    if not kind:
        return values, slopes
    size = np.hypot(values[..., 0], values[..., 1])
    safe = np.where(size > 0, size, 1.0)
    length = (values[..., 0] * slopes[..., 0] + values[..., 1] * slopes[..., 1]) / safe
    if kind == "length":
        return size, length
    axes = np.concatenate([np.abs(values), size[..., None]], axis=-1)
    return axes, np.concatenate([np.sign(values) * slopes, length[..., None]], axis=-1)
