"""A recorded ground motion: three components of acceleration on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.motion_checks import finite, positive
from msfp_gen.piecewise import Array

G = 9.80665  # standard gravity [m/s^2]; in records "g" means this, whatever gravity a bearing is given
COMPONENTS = ("E1", "E2", "E3")


@dataclass(frozen=True, eq=False)
class Record:
    """Acceleration as recorded, nothing removed but the unit.

    Attributes:
        name: a label, from the station or the file.
        time_step: sample interval [s].
        acceleration: ndarray, shape (k, 3), [m/s^2], along (E1, E2, E3): first horizontal, second horizontal, up.
        channels: what the file calls the channels behind E1, E2, E3; "" where the file has none (zeros).
        start_time: the file's own words for the time of the first sample.
        station: the file's own words.
        units: the unit in the file.
        metadata: anything else worth keeping.
        notes: what had to be decided while reading, for example channels cut to their common window.
    """

    name: str
    time_step: float
    acceleration: Array
    channels: tuple[str, str, str] = COMPONENTS
    start_time: str = ""
    station: str = ""
    units: str = "m/s^2"
    metadata: Mapping[str, str | float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        positive("time_step", self.time_step)
        values = finite("acceleration", self.acceleration)
        if values.ndim != 2 or values.shape[1] != 3 or len(values) < 4:
            raise InputError(f"acceleration: shape {values.shape}; give (k, 3), k >= 4")
        if not np.any(values):
            raise InputError(
                f"acceleration: all {len(values)} rows of {self.name or 'the record'} are zero; give a record"
            )
        object.__setattr__(self, "acceleration", values)

    @property
    def time(self) -> Array:
        """Times of the samples, from zero: ndarray, shape (k,), [s]."""
        return sample_times(len(self.acceleration), self.time_step)

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return (len(self.acceleration) - 1) * self.time_step


def sample_times(points: int, time_step: float) -> Array:
    """Times [s] of evenly spaced samples, from zero."""
    return np.arange(points, dtype=np.float64) * time_step


def common_window(columns: list[Array | None]) -> tuple[Array, tuple[str, ...]]:
    """Columns that share their first sample, side by side, cut to the shortest; a missing one is zero.

    Returns ndarray, shape (k, len(columns)), and notes that say what was cut and what is missing.
    """
    lengths = [len(c) for c in columns if c is not None]
    shortest = min(lengths)
    notes = []
    if max(lengths) > shortest:
        were = ", ".join(map(str, lengths))
        notes.append(f"channels cut to their common window of {shortest} points (were {were})")
    missing = [COMPONENTS[i] for i, c in enumerate(columns) if c is None]
    if missing:
        notes.append(f"no channel for {', '.join(missing)}: taken as zero")
    filled = [np.zeros(shortest) if c is None else c[:shortest] for c in columns]
    return np.stack(filled, axis=1), tuple(notes)


def stem(path: Path) -> str:
    """The file's name without .gz and without its format's ending."""
    return Path(path.name.removesuffix(".gz")).stem
