"""A recorded ground motion: three components on one clock, and the units that records come in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.motion_checks import finite, positive
from msfp_gen.piecewise import Array

G = 9.80665  # standard gravity [m/s^2]; in records "g" means this, whatever gravity a bearing is given
COMPONENTS = ("E1", "E2", "E3")
# Spellings of units in the headers of records -> quantity and factor to SI. Case, blanks and a full stop do not count.
UNITS: dict[str, tuple[str, float]] = {
    **dict.fromkeys(("g", "g's"), ("acceleration", G)),
    **dict.fromkeys(("cm/sec2", "cm/sec/sec", "cm/sec^2", "cm/s2", "cm/s/s", "cm/s^2", "gal"), ("acceleration", 0.01)),
    **dict.fromkeys(("m/sec2", "m/sec/sec", "m/sec^2", "m/s2", "m/s/s", "m/s^2"), ("acceleration", 1.0)),
    **dict.fromkeys(("cm/sec", "cm/s"), ("velocity", 0.01)),
    **dict.fromkeys(("m/sec", "m/s"), ("velocity", 1.0)),
    "cm": ("displacement", 0.01),
    "m": ("displacement", 1.0),
}


@dataclass(frozen=True, eq=False)
class Record:
    """Acceleration as recorded, nothing removed but the unit (and K-NET's arbitrary zero).

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
        quantity: what the file gives: "acceleration", or "velocity" or "displacement", whose spline was differentiated.
        velocity: ndarray, shape (k, 3), [m/s], where the file gives it or the displacement; else None.
        displacement: ndarray, shape (k, 3), [m], where the file gives it; else None.

    Raises:
        InputError: a shape, a number that is not finite, or nothing but zeros.
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
    quantity: str = "acceleration"
    velocity: Array | None = None
    displacement: Array | None = None

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
        for name in ("velocity", "displacement"):
            given = getattr(self, name)
            if given is not None and finite(name, given).shape != values.shape:
                raise InputError(f"{name}: shape {given.shape}; give that of the acceleration, {values.shape}")

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


def differentiated(quantity: str, values: Array, time_step: float) -> dict[str, Any]:
    """What a record holds where only velocity or displacement, shape (k, 3), is given: the derivatives of its spline.

    The cubic spline through velocity has a continuous acceleration that integrates back to it exactly; the one through
    displacement likewise. Keys are fields of `Record`.
    """
    if quantity == "acceleration":
        return {"acceleration": values}
    from scipy.interpolate import CubicSpline

    if len(values) < 4:
        raise InputError(f"{quantity}: {len(values)} samples; give at least 4")
    times = sample_times(len(values), time_step)
    spline = CubicSpline(times, values)
    if quantity == "velocity":
        return {"acceleration": spline(times, 1), "velocity": values}
    return {"acceleration": spline(times, 2), "velocity": spline(times, 1), "displacement": values}


def derived_note(quantity: str) -> tuple[str, ...]:
    """What the notes of a record say about an acceleration that the file does not give."""
    return () if quantity == "acceleration" else (f"acceleration: derivative of the {quantity} in the file",)


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
