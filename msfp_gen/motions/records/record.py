"""A recorded ground motion of three components at common times, and the units in files of records."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.elementary import cos, sin
from msfp_gen.common.errors import InputError
from msfp_gen.motions.checks import finite, positive

G = 9.80665  # standard gravity [m/s^2], the unit g of records, independent of the gravity of a bearing
COMPONENTS = ("E1", "E2", "E3")
# Unit in the header of a record -> quantity and factor to SI. Case, blanks and a final full stop are ignored.
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
    """A ground motion as recorded, converted to SI; for K-NET also with its arbitrary zero removed.

    Attributes:
        name: a label, from the station or the file.
        time_step: sample interval [s].
        acceleration: ndarray, shape (k, 3), [m/s^2], along (E1, E2, E3): first horizontal, second horizontal, up.
        channels: labels in the file of the channels along E1, E2, E3; "" for a missing one, whose values are zero.
        start_time: text of the file for the time of the first sample.
        station: text of the file for the station.
        units: unit in the file.
        metadata: further information on the record.
        notes: decisions made while reading, for example that channels were cut to their common window.
        quantity: quantity in the file: "acceleration", or "velocity" or "displacement", whose spline is differentiated.
        velocity: ndarray, shape (k, 3), [m/s], if the file gives velocity or displacement; else None.
        displacement: ndarray, shape (k, 3), [m], if the file gives it; else None.

    Raises:
        InputError: a shape is wrong, a number is not finite, or all accelerations are zero.
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
            array = getattr(self, name)
            if array is not None and finite(name, array).shape != values.shape:
                raise InputError(f"{name}: shape {array.shape}; give that of the acceleration, {values.shape}")

    @property
    def time(self) -> Array:
        """Times of the samples, beginning at zero: ndarray, shape (k,), [s]."""
        return sample_times(len(self.acceleration), self.time_step)

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return (len(self.acceleration) - 1) * self.time_step

    def with_components(self, components: Collection[str]) -> Record:
        """The record with these components (E1, E2, E3) as they are, and zero along the others.

        Raises InputError for other names, and where nothing is left.
        """
        if not components or set(components) - set(COMPONENTS):
            raise InputError(f"components = {list(components)!r}: give one or more of {', '.join(COMPONENTS)}")
        kept = np.array([name in components for name in COMPONENTS])
        if not np.any(self.acceleration[:, kept]):
            raise InputError(f"components = {list(components)!r}: {self.name or 'the record'} has nothing along them")
        labels = [
            "" if name not in components else label for name, label in zip(COMPONENTS, self.channels, strict=True)
        ]
        left_out = ", ".join(name for name in COMPONENTS if name not in components)
        note = f"components left out: {left_out}" if left_out else ""
        return self._changed(lambda values: values * kept, (labels[0], labels[1], labels[2]), note)

    def rotated(self, angle: float) -> Record:
        """The record with its horizontal components rotated by `angle` [rad] about E3, from E1 towards E2."""
        c, s = cos(angle), sin(angle)

        def turn(values: Array) -> Array:
            one, two, three = values.T
            return np.stack([c * one - s * two, s * one + c * two, three], axis=1)

        first, second, up = self.channels
        turned = f"{' and '.join(filter(None, (first, second)))} rotated"
        note = f"horizontal components rotated by {np.degrees(angle):.6g} degrees from E1 towards E2"
        return self._changed(turn, (turned, turned, up), note)

    def _changed(self, change: Callable[[Array], Array], channels: tuple[str, str, str], note: str) -> Record:
        """The record with a linear `change` of the rows of all its quantities."""
        arrays: dict[str, Any] = {name: getattr(self, name) for name in ("acceleration", "velocity", "displacement")}
        values: dict[str, Any] = {name: None if rows is None else change(rows) for name, rows in arrays.items()}
        return replace(self, **values, channels=channels, notes=(*self.notes, *filter(None, [note])))


def sample_times(points: int, time_step: float) -> Array:
    """Times of evenly spaced samples, beginning at zero: ndarray, shape (points,), [s]."""
    return np.arange(points, dtype=np.float64) * time_step


def differentiated(quantity: str, values: Array, time_step: float) -> dict[str, Any]:
    """Acceleration of a record that gives only velocity or displacement: the derivatives of their cubic spline.

    The spline through the velocity has a continuous acceleration whose exact integral is that velocity; the spline
    through the displacement likewise.

    Args:
        quantity: "acceleration" (returned as it is), "velocity" or "displacement".
        values: shape (k, 3), in SI.
        time_step: sample interval [s].

    Returns:
        Field of `Record` -> ndarray, shape (k, 3).

    Raises:
        InputError: there are fewer than 4 samples.
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
    """Note for a record whose acceleration is a derivative; empty where the file gives the acceleration."""
    return () if quantity == "acceleration" else (f"acceleration: derivative of the {quantity} in the file",)


def common_window(columns: list[Array | None]) -> tuple[Array, tuple[str, ...]]:
    """Columns with a common first sample, cut to the length of the shortest; a missing one (None) is zero.

    Returns an ndarray, shape (k, len(columns)), [unit of `columns`], and notes on cut and missing columns.
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
    """Name of the file without .gz and without the suffix of its format."""
    return Path(path.name.removesuffix(".gz")).stem
