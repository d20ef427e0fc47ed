"""Extremes of a run over all of its accepted steps, which do not depend on the times of the rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array, parts
from msfp_gen.results.history import LABELS, History
from msfp_gen.results.sliding import separated
from msfp_gen.specification import contract

LEAST = {extreme.name for extreme in contract.EXTREMES if extreme.least}  # of all others the largest counts


@dataclass(frozen=True, eq=False)
class Extremes:
    """Extremes of a run.

    displacement [m], top_force [N]: largest magnitude along E1, E2, E3 and in the horizontal plane, shape (4,).
    Per surface, shape (n-1,): sliding, the largest, and gap, the least [m]; least_normal, most_normal [N]; slip_speed,
    the largest, while the surface is closed [m/s], None of a bearing of a building; least_friction, most_friction,
    where a friction law acts; temperature, the highest, where it heats [degC]; rim_force [N] and lift [m], the largest,
    which a bearing that is not below a building records in rows alone; contact_offset, the distance of a loaded contact
    from the axis of its slider [m], and contact_time [s], of a bearing of a building alone.
    """

    displacement: Array
    top_force: Array
    sliding: Array
    gap: Array
    least_normal: Array
    most_normal: Array
    slip_speed: Array | None = None
    least_friction: Array | None = None
    most_friction: Array | None = None
    temperature: Array | None = None
    rim_force: Array | None = None
    lift: Array | None = None
    contact_offset: Array | None = None
    contact_time: Array | None = None

    @classmethod
    def of_rows(cls, history: History) -> Extremes:
        """Extremes of the rows alone."""
        mu, temperature = history.friction_coefficient, history.temperature
        speed = np.where(separated(history), 0.0, np.hypot(*np.moveaxis(history.slip_velocity, 2, 0)))
        return cls(
            displacement=largest(history.displacement),
            top_force=largest(history.top_force),
            sliding=history.sliding.max(axis=0),
            gap=history.gap.min(axis=0),
            slip_speed=speed.max(axis=0),
            least_normal=history.normal_force.min(axis=0),
            most_normal=history.normal_force.max(axis=0),
            least_friction=None if mu is None else mu.min(axis=0),
            most_friction=None if mu is None else mu.max(axis=0),
            temperature=None if temperature is None else temperature.max(axis=0),
            rim_force=history.rim_force.max(axis=0),
            lift=history.lift.max(axis=0),
        )

    @classmethod
    def of_run(cls, numbers: Sequence[tuple[str, tuple[int, ...]]], recorded: Array, azimuth: float) -> Extremes:
        """Extremes that a compiled run recorded.

        numbers: name and shape of each, `EXTREMES` of the extension. recorded: one after the other. azimuth: of the
        frame of a planar model [rad], in which all horizontal vectors are along E1.
        """
        extremes = {name: values.ravel() for name, values in parts(recorded, numbers).items()}
        if azimuth:
            for name in ("displacement", "top_force"):
                along, _, vertical, radial = extremes[name]
                extremes[name] = np.array(
                    [along * abs(np.cos(azimuth)), along * abs(np.sin(azimuth)), vertical, radial]
                )
        return cls(**extremes)

    @classmethod
    def of_table(cls, table: dict[str, Any]) -> Extremes:
        """The inverse of `table`."""
        return cls(**{name: np.array(values, dtype=float) for name, values in table.items()})

    @property
    def table(self) -> dict[str, list[float]]:
        """As plain data; what was not recorded is left out."""
        return {name: value.tolist() for name, value in self.arrays.items()}

    @property
    def arrays(self) -> dict[str, Array]:
        """What was recorded, by name; see `Extremes` for shapes and units."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if value is not None}

    def __or__(self, other: Extremes) -> Extremes:
        """Extremes of both."""
        extremes: dict[str, Any] = {}
        for name in (f.name for f in fields(self)):
            one, two = getattr(self, name), getattr(other, name)
            known = [value for value in (one, two) if value is not None]
            extremes[name] = (np.min if name in LEAST else np.max)(known, axis=0) if known else None
        return Extremes(**extremes)


def largest(vectors: Array) -> Array:
    """Largest along time by axis and in the horizontal plane: (..., T, 3) to shape (..., 4) [unit of `vectors`]."""
    radial = np.hypot(vectors[..., 0], vectors[..., 1]).max(axis=-1)
    magnitudes: Array = np.concatenate([np.abs(vectors).max(axis=-2), radial[..., None]], axis=-1)
    return magnitudes


def by_axis(magnitudes: Array) -> dict[str, float]:
    """Largest magnitudes by axis and in the horizontal plane, shape (4,), as plain data."""
    return dict(zip((*LABELS["axis"], "radial"), magnitudes.tolist(), strict=True))
