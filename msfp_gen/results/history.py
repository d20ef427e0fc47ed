"""The rows of a run as NumPy arrays, its events and counters, and its extremes, which do not depend on the rows.

The annotations of `BearingRows` and `History` give dimensions, unit and meaning of every quantity. The check of shapes
here and the dataset in `dataset.py` are based on them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array, parts
from msfp_gen.common.errors import InputError
from msfp_gen.specification import contract

# Labels of the dimensions of fixed length. The length of `body` and `surface` is the number of surfaces, n - 1.
LABELS: dict[str, tuple[str, ...]] = {
    "axis": ("E1", "E2", "E3"),
    "angle": ("psi", "theta", "phi"),
    "contact_angle": ("psi~", "theta~"),
    "direction": ("t~1", "t~2"),
}
STACK = ("body", "surface")

ENERGY_BELOW: dict[str, str] = {  # of a bearing of a building
    "dissipated": "energy dissipated in the bearing",
    "interface_dissipated": "energy dissipated by the dampers of its interface",
    "stored": "energy stored in the bearing and its interface",
}
ENERGY: dict[str, str] = {
    "input": "work done on the bearing and its top by the base motion and the loads",
    "kinetic": "kinetic energy relative to the base",
    "potential": "potential energy of weights and vertical loads",
    "restraint": "energy stored in the springs of the top",
    "friction_stored": "recoverable energy stored in friction while stuck",
    "friction_dissipated": "energy dissipated by friction",
    "contact_dissipated": "energy dissipated by the damping of sheared contacts",
    "rim_stored": "energy stored in the rims",
    "rim_dissipated": "energy dissipated at the rims",
    "top_dissipated": "energy dissipated by the dampers of the top",
    "seat_stored": "energy stored in the unilateral contacts of the surfaces, with uplift",
    "seat_dissipated": "energy dissipated in the unilateral contacts, impacts at landing included",
    "numerical": "input less all other terms: the error of the integration",
}


EQUAL_PEAKS = 1e-3
"""Relative difference of two peaks up to which they are equal: rounding may then decide which is larger."""


def first_peak(size: Array) -> int:
    """Row of the largest of `size`, shape (T,); of peaks that differ by less than `EQUAL_PEAKS`, the first."""
    near = size >= (1.0 - EQUAL_PEAKS) * size.max()
    first = int(near.argmax())
    last = len(size) if near[first:].all() else first + int((~near[first:]).argmax())
    return first + int(size[first:last].argmax())


@dataclass(frozen=True)
class RowField:
    """A field of the rows: dimensions after time, unit, meaning ({} stands for the name), names in the dataset.

    names: none for the name of the field itself; several for the components of the last dimension.
    """

    dims: tuple[str, ...]
    unit: str
    meaning: str
    names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class BearingRows:
    """The T rows of any bearing, alone or below a building.

    Every quantity has T entries along its first dimension. The dimensions `body` (bodies 2..n) and `surface` have n - 1
    entries each, bottom first; `LABELS` gives the others. energy: by the names in `ENERGIES`, shape (T,) [J]. Raises
    InputError where an array has another shape or an entry that is not finite, or where the time does not increase.
    """

    ENERGIES: ClassVar[Mapping[str, str]] = ENERGY_BELOW

    time: Annotated[Array, RowField((), "s", "time t")]
    normal_force: Annotated[Array, RowField(("surface",), "N", "normal force N on the surface")]
    sliding: Annotated[Array, RowField(("surface",), "m", "distance s from the centre of the surface (3.20)")]
    gap: Annotated[Array, RowField(("surface",), "m", "gap g to the rim (3.21)")]
    rim_force: Annotated[Array, RowField(("surface",), "N", "force F_c of the rim (2.103)")]
    lift: Annotated[Array, RowField(("surface",), "m", "clearance between separated faces; 0 while in contact")]
    base_displacement: Annotated[Array, RowField(("axis",), "m", "displacement u_g of the base")]
    displacement: Annotated[
        Array, RowField(("axis",), "m", "displacement u across the bearing, r_01 - r_nn less its start")
    ]
    top_force: Annotated[Array, RowField(("axis",), "N", "force F_top of the bearing on the top support")]
    top_moment: Annotated[Array, RowField(("axis",), "N m", "moment of the bearing on the top support at r_nn")]
    # None where the friction does not depend on it.
    temperature: Annotated[Array | None, RowField(("surface",), "degC", "temperature at the centre of the surface")] = (
        None
    )
    memory: Annotated[
        Array | None, RowField(("surface",), "", "other state of the surface on which its friction law depends")
    ] = None
    energy: dict[str, Array]

    def __post_init__(self) -> None:
        if not len(self.time):
            raise InputError("history.time has no rows: give at least the start of the run")
        if np.any(late := np.diff(self.time) <= 0):
            row = int(np.argmax(late)) + 1
            before, here = self.time[row - 1 : row + 1]
            raise InputError(f"history.time[{row}] = {here:g} s follows {before:g} s: give rows in rising time")
        for name, values in self.arrays().items():
            self._check(name, values, self._shape(row_fields()[name].dims, self.surfaces))
        if set(self.energy) != set(self.ENERGIES):
            raise InputError(f"history.energy has {sorted(self.energy)}: give {sorted(self.ENERGIES)}")
        for name, values in self.energy.items():
            self._check(f"energy[{name!r}]", values, (len(self.time),))

    @property
    def surfaces(self) -> int:
        """Number of surfaces, n - 1."""
        return int(self.normal_force.shape[1])

    @property
    def separated(self) -> NDArray[np.bool_]:
        """Whether each surface is separated in each row, ndarray of bool, shape (T, n-1); never without `uplift`."""
        return self.lift > 0

    @property
    def dissipated(self) -> Array:
        """Energy dissipated since the start, ndarray, shape (T,) [J]."""
        lost: Array = np.sum([values for name, values in self.energy.items() if name.endswith("dissipated")], axis=0)
        return lost

    def arrays(self) -> dict[str, Array]:
        """The arrays of this run by field, without those that are None; see `row_fields` for shapes and units."""
        own = [field.name for field in fields(self) if field.name in row_fields()]
        return {name: values for name in own if (values := getattr(self, name)) is not None}

    @property
    def horizontal(self) -> Array:
        """Horizontal displacement across the bearing, ndarray, shape (T,), [m]."""
        return np.hypot(self.displacement[:, 0], self.displacement[:, 1])

    @property
    def peak_row(self) -> int:
        """Row of the largest horizontal displacement; see `first_peak`."""
        return first_peak(self.horizontal)

    @property
    def direction(self) -> Array:
        """Unit vector of the largest horizontal displacement, shape (2,) [-]; E1 if the bearing did not move."""
        peak: Array = self.displacement[self.peak_row, :2]
        size = float(np.hypot(*peak))
        return peak / size if size else np.array([1.0, 0.0])

    @property
    def path(self) -> tuple[Array, Array]:
        """Horizontal displacement along and transverse to this direction, shape (T,) each [m]."""
        e1, e2 = self.direction
        along, across = (self.displacement[:, :2] @ np.array(axis) for axis in ([e1, e2], [-e2, e1]))
        return along, across

    def _shape(self, dims: tuple[str, ...], surfaces: int) -> tuple[int, ...]:
        return (len(self.time), *(surfaces if dim in STACK else len(LABELS[dim]) for dim in dims))

    @staticmethod
    def _check(name: str, values: Array, shape: tuple[int, ...]) -> None:
        if values.shape != shape:
            raise InputError(f"history.{name} has shape {values.shape}: give {shape}")
        if not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0, 0])
            raise InputError(f"history.{name} is not finite in row {row}: leave out rows that were not computed")


@dataclass(frozen=True, eq=False, kw_only=True)
class History(BearingRows):
    """The T rows of the run of one bearing."""

    ENERGIES: ClassVar[Mapping[str, str]] = ENERGY

    tilt_angles: Annotated[Array, RowField(("body", "angle"), "rad", "psi, theta, phi of body k (2.27)", ("tilt",))]
    tilt_rates: Annotated[Array, RowField(("body", "angle"), "rad/s", "rates of psi, theta, phi", ("tilt_rate",))]
    tilt_accelerations: Annotated[
        Array, RowField(("body", "angle"), "rad/s^2", "second derivatives of psi, theta, phi", ("tilt_acceleration",))
    ]
    friction_state: Annotated[Array, RowField(("surface", "direction"), "1", "Bouc-Wen variable {} (2.94)", ("Y", "Z"))]
    contact_angles: Annotated[
        Array, RowField(("surface", "contact_angle"), "rad", "psi~, theta~ of the contact (2.86)")
    ]
    separation: Annotated[
        Array, RowField(("surface", "axis"), "m", "separation delta of the two sphere centres of the surface")
    ]
    interface_force: Annotated[Array, RowField(("surface", "axis"), "N", "force P through the surface")]
    slip_velocity: Annotated[Array, RowField(("surface", "direction"), "m/s", "slip velocity u~, v~ (2.98)")]
    top_displacement: Annotated[Array, RowField(("axis",), "m", "position r_nn of the top plate in space")]
    # None unless the model has a friction law.
    friction_coefficient: Annotated[Array | None, RowField(("surface",), "1", "friction coefficient mu by its law")] = (
        None
    )
    # None unless the top has a vertical stiffness or damping.
    top_settlement: Annotated[
        Array | None, RowField((), "m", "compression of the vertical spring of the top, settlement of a supported mass")
    ] = None


@cache
def row_fields() -> dict[str, RowField]:
    """The description of each array of `History`, by field."""
    hints = get_type_hints(History, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items() if get_origin(hint) is Annotated}


@dataclass(frozen=True, eq=False)
class Event:
    """An instant located inside a step: rim contact or release, lift-off or landing, the stop condition (surface 0)."""

    time: float  # [s]
    surface: int  # 1..n-1, bottom first
    kind: Literal["rim_contact", "rim_release", "stop", "lift_off", "landing"]
    displacement: Array  # shape (3,), [m]
    top_force: Array  # shape (3,), [N]


@dataclass(frozen=True)
class Counters:
    """Counters of the work of one run; wall_time [s]."""

    steps: int = 0
    rejected_steps: int = 0
    newton_iterations: int = 0
    evaluations: int = 0
    factorisations: int = 0
    newton_failures: int = 0
    events: int = 0
    halved_newton_steps: int = 0
    fresh_tangents: int = 0
    other_starts: int = 0
    quasistatic_starts: int = 0
    wall_time: float = 0.0


LEAST = {extreme.name for extreme in contract.EXTREMES if extreme.least}  # of all others the largest counts
# Extreme -> field of `History` from which it is taken, and whether it is a magnitude: along each axis, or of the
# vector.
SERIES = {
    "displacement": ("displacement", "axes"),
    "top_force": ("top_force", "axes"),
    "sliding": ("sliding", ""),
    "gap": ("gap", ""),
    "rim_force": ("rim_force", ""),
    "slip_speed": ("slip_velocity", "length"),
    "least_normal": ("normal_force", ""),
    "most_normal": ("normal_force", ""),
    "temperature": ("temperature", ""),
    "least_friction": ("friction_coefficient", ""),
    "most_friction": ("friction_coefficient", ""),
    "lift": ("lift", ""),
}


def series(name: str, history: History) -> Array | None:
    """The values from which an extreme is taken, shape (T, m) [SI]; None where the rows do not have them."""
    field, kind = SERIES[name]
    values: Array | None = getattr(history, field)
    if values is None or not kind:
        return values
    size = np.hypot(values[..., 0], values[..., 1])
    if kind == "length":
        return np.where(history.separated, 0.0, size)
    return np.concatenate([np.abs(values), size[..., None]], axis=-1)


@dataclass(frozen=True, eq=False)
class Extremes:
    """Extremes of a run.

    displacement [m], top_force [N]: largest magnitude along E1, E2, E3 and in the horizontal plane, shape (4,).
    Per surface, shape (n-1,): sliding, the largest, and gap, the least [m]; least_normal, most_normal [N]; slip_speed,
    the largest, while the surface is closed [m/s], None of a bearing of a building; least_friction, most_friction,
    where a friction law acts; temperature, the highest, where it heats [degC]; rim_force [N] and lift [m], the largest.
    Of a bearing of a building alone: contact_offset, the distance of a loaded contact from the axis of its slider [m],
    and rims_met, the number of surfaces whose rims are met at one time, shape (1,).

    times: name of each -> when every number was reached first [s], in its shape; empty of derivatives.
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
    rims_met: Array | None = None
    times: Mapping[str, Array] = field(default_factory=dict)

    @classmethod
    def of_rows(cls, history: History) -> Extremes:
        """Extremes of the rows alone."""
        extremes, times = dict[str, Any](), dict[str, Array]()
        for name in SERIES:
            if (values := series(name, history)) is not None:
                rows = (values.argmin if name in LEAST else values.argmax)(axis=0)
                extremes[name] = values[rows, np.arange(len(rows))]
                times[name] = history.time[rows]
        return cls(**extremes, times=times)

    @classmethod
    def of_run(cls, numbers: Sequence[tuple[str, tuple[int, ...]]], recorded: Array, azimuth: float) -> Extremes:
        """Extremes that a compiled run recorded, or their derivatives.

        numbers: name and shape of each, `EXTREMES` of the extension. recorded: one after the other, and their times,
        shape (2, size); derivatives without times, shape (size,). azimuth: of the frame of a planar model [rad], in
        which all horizontal vectors are along E1.
        """
        extremes, *times = (
            {name: values.ravel() for name, values in parts(each, numbers).items()} for each in np.atleast_2d(recorded)
        )
        if azimuth:
            for name in ("displacement", "top_force"):
                along, _, vertical, radial = extremes[name]
                extremes[name] = np.array(
                    [along * abs(np.cos(azimuth)), along * abs(np.sin(azimuth)), vertical, radial]
                )
                for each in times:
                    each[name] = each[name][[0, 0, 2, 3]]
        return cls(**extremes, times=times[0] if times else {})

    @classmethod
    def of_table(cls, table: dict[str, Any]) -> Extremes:
        """The inverse of `table`."""
        values: dict[str, Any] = {name: np.array(each, dtype=float) for name, each in table.items() if name != "times"}
        times = {name: np.array(each, dtype=float) for name, each in table.get("times", {}).items()}
        return cls(**values, times=times)

    @property
    def table(self) -> dict[str, Any]:
        """As plain data; what was not recorded is left out."""
        values: dict[str, Any] = {name: value.tolist() for name, value in self.arrays.items()}
        times = {name: value.tolist() for name, value in self.times.items()}
        return values | ({"times": times} if times else {})

    @property
    def arrays(self) -> dict[str, Array]:
        """What was recorded, by name, without its times; see `Extremes` for shapes and units."""
        return {name: value for name, value in vars(self).items() if value is not None and name != "times"}

    def __or__(self, other: Extremes) -> Extremes:
        """Extremes of both; where they are equal the earlier time counts."""
        ours, theirs = self.arrays, other.arrays
        extremes, times = theirs | ours, {**other.times, **self.times}
        for name in ours.keys() & theirs.keys():
            one, two, at, later = ours[name], theirs[name], self.times[name], other.times[name]
            beyond = two < one if name in LEAST else two > one
            extremes[name] = np.where(beyond, two, one)
            times[name] = np.where(beyond | ((two == one) & (later < at)), later, at)
        return Extremes(**extremes, times=times)


def by_axis(magnitudes: Array) -> dict[str, float]:
    """Largest magnitudes by axis and in the horizontal plane, shape (4,), as plain data."""
    return dict(zip((*LABELS["axis"], "radial"), magnitudes.tolist(), strict=True))
