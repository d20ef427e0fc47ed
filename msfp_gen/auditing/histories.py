"""Time histories of a bearing by any program, in SI units and one sign: what an audit reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array, Flags
from msfp_gen.common.errors import InputError
from msfp_gen.motions.checks import finite
from msfp_gen.results.geometry import body_bases

# Column -> unit and meaning; the number is the axis: 1, 2 horizontal, 3 upwards.
QUANTITIES: dict[str, tuple[str, str]] = {
    "time": ("s", "time"),
    **{f"displacement_{i}": ("m", "horizontal displacement across the bearing, of either sign") for i in (1, 2)},
    **{f"force_{i}": ("N", "horizontal force of one bearing, of the sign of the displacement") for i in (1, 2)},
    "axial": ("N", "axial force of one bearing, compression positive"),
    "rise": ("m", "vertical displacement of the upper plate against the lower one, upwards"),
    **{f"acceleration_{i}": ("m/s^2", "absolute acceleration of the supported mass") for i in (1, 2, 3)},
    **{f"position_{i}": ("m", "absolute displacement of the supported mass") for i in (1, 2, 3)},
    **{f"base_acceleration_{i}": ("m/s^2", "acceleration of the base") for i in (1, 2, 3)},
    **{f"lower_{i}": ("m", "displacement of the lower plate in space") for i in (1, 2, 3)},
    **{f"upper_{i}": ("m", "displacement of the upper plate in space") for i in (1, 2, 3)},
    **{f"lower_rotation_{i}": ("rad", "rotation of the lower plate") for i in (1, 2)},
    **{f"upper_rotation_{i}": ("rad", "rotation of the upper plate") for i in (1, 2)},
    **{f"sliding_{i}": ("m", "distance from the centre of surface i, bottom first") for i in range(1, 10)},
    **{f"slip_speed_{i}": ("m/s", "slip velocity of surface i, its size") for i in range(1, 10)},
    **{f"temperature_{i}": ("degC", "temperature of surface i at its centre") for i in range(1, 10)},
}  # fmt: skip
LEAST_ROWS = 20
NO_WEIGHT = 0.05  # axial force at rest over its RMS, below which the column does not have the weight


@dataclass(frozen=True, eq=False)
class Histories:
    """Time histories of one bearing.

    Attributes:
        name: of the file or run, for tables and pages.
        columns: by the names of `QUANTITIES`, ndarray, shape (T,) each, [SI]; `time` is one of them.
        mass: supported by all bearings together, as the source states it [kg]; None: it is not stated.
        bearings: number of bearings that share the mass equally.

    Raises:
        InputError: fewer than 20 rows, numbers that are not finite, or times that do not increase.
    """

    name: str
    columns: Mapping[str, Array]
    mass: float | None = None
    bearings: float = 1.0

    def __post_init__(self) -> None:
        if "time" not in self.columns:
            raise InputError(f"{self.name}: no column time; name it in the map (docs/audit.md)")
        columns = {name: finite(f"{self.name}: {name}", values) for name, values in self.columns.items()}
        object.__setattr__(self, "columns", columns)
        if unknown := sorted(columns.keys() - QUANTITIES.keys()):
            raise InputError(f"{self.name}: {unknown[0]!r} is no quantity; give {', '.join(QUANTITIES)}")
        if len(self.time) < LEAST_ROWS:
            raise InputError(f"{self.name}: {len(self.time)} rows; give at least {LEAST_ROWS}")
        if len(back := np.flatnonzero(np.diff(self.time) <= 0)):
            row = int(back[0]) + 2
            raise InputError(
                f"{self.name}, row {row}: time = {self.time[row - 1]:g} s does not increase; sort or cut it"
            )
        for name, values in columns.items():
            if values.shape != self.time.shape:
                raise InputError(f"{self.name}: {name} has shape {values.shape}; give one number for each time")
        if self.missing("displacement") and not self.missing("lower", "upper"):
            across = self.vector("lower") - self.vector("upper")
            own = {f"displacement_{axis + 1}": across[:, axis] - across[0, axis] for axis in range(2)}
            object.__setattr__(self, "columns", columns | own)

    @property
    def time(self) -> Array:
        """Times of the rows, ndarray, shape (T,) [s]."""
        return self.columns["time"]

    def missing(self, *names: str) -> list[str]:
        """The names that have no column; a vector such as `force` needs a column of one horizontal axis at least."""
        return [name for name in names if name not in self.columns and f"{name}_1" not in self.columns and
                f"{name}_2" not in self.columns]  # fmt: skip

    def vector(self, name: str, axes: int = 2) -> Array:
        """The columns of a quantity along every axis, zero where one is not given, ndarray, shape (T, axes) [SI]."""
        zero = np.zeros_like(self.time)
        return np.column_stack([self.columns.get(f"{name}_{i + 1}", zero) for i in range(axes)])

    @cached_property
    def displacement(self) -> Array:
        """Horizontal displacement across the bearing, ndarray, shape (T, 2) [m]."""
        return self.vector("displacement")

    @cached_property
    def force(self) -> Array:
        """Horizontal force, ndarray, shape (T, 2) [N]."""
        return self.vector("force")

    @cached_property
    def velocity(self) -> Array:
        """Rate of the displacement by central differences, ndarray, shape (T, 2) [m/s]."""
        rate: Array = np.gradient(self.displacement, self.time, axis=0)
        return rate

    @property
    def axial(self) -> Array:
        """Axial force, compression positive, ndarray, shape (T,) [N]."""
        return self.columns["axial"]

    @cached_property
    def at_rest(self) -> float:
        """Axial force at rest [N]: its mean over time from the first motion on, since the mass ends where it began."""
        time, axial = self.time[self.moved_at() :], self.axial[self.moved_at() :]
        return float(np.trapezoid(axial, time) / (time[-1] - time[0])) if len(time) > 1 else float(axial[0])

    @property
    def before(self) -> float:
        """Axial force before the first motion, the median of these rows [N]."""
        return float(np.median(self.axial[: self.moved_at() + 1]))

    @property
    def weightless(self) -> bool:
        """Whether an axial force is given that is nearly zero at rest, as a variation about the weight is."""
        if "axial" not in self.columns:
            return False
        return abs(self.at_rest) <= NO_WEIGHT * float(np.sqrt(np.mean(self.axial**2)))

    def below(self, share: float) -> Flags:
        """Rows after the first motion with an axial force below a share of its value at rest, ndarray, shape (T,)."""
        low: Flags = self.axial < share * self.at_rest
        low[: self.moved_at()] = False
        return low

    @property
    def step(self) -> float:
        """Median time between two rows [s]."""
        return float(np.median(np.diff(self.time)))

    def scaled(self, factors: Mapping[str, float]) -> Histories:
        """Histories with some columns multiplied."""
        return replace(self, columns={name: values * factors.get(name, 1.0) for name, values in self.columns.items()})

    def moved_at(self) -> int:
        """First row at which the displacement has reached a hundredth of its largest."""
        size = np.hypot(*self.displacement.T)
        return int(np.argmax(size >= 0.01 * size.max()))


def histories_of(result: Any) -> Histories:
    """The histories of a result of this package: of one bearing, with its ends and surfaces.

    Raises InputError for results of several bearings, and for one of them.
    """
    if not result.is_alone:
        raise InputError(
            "result: this is no run of one bearing alone; give the columns of one of its .bearings as a table"
        )
    rows, top = result.history, result.scene.top
    force = rows.interface_force[:, -1]  # without inertia of the upper plate, which hangs on the mass at lift-off
    columns = {"time": rows.time, "axial": force[:, 2], "rise": -rows.displacement[:, 2]}
    for axis in range(2):
        columns |= {
            f"displacement_{axis + 1}": rows.displacement[:, axis],
            f"force_{axis + 1}": force[:, axis],
        }
    base = result.scene.motion.rotation(np.clip(rows.time, 0.0, result.scene.motion.duration))
    ends = {"lower": rows.base_displacement, "upper": rows.top_displacement - rows.top_displacement[0]}
    columns |= {f"{end}_{axis + 1}": values[:, axis] for end, values in ends.items() for axis in range(3)}
    axes = body_bases(np.concatenate([base[:, None], rows.tilt_angles], axis=1))[..., 2, :]
    for end, normal in (("lower", axes[:, 0]), ("upper", axes[:, -1])):
        columns |= {f"{end}_rotation_1": -np.arcsin(normal[:, 1]), f"{end}_rotation_2": np.arcsin(normal[:, 0])}
    slip = np.linalg.norm(rows.slip_velocity, axis=2)
    surfaces = {"sliding": rows.sliding, "slip_speed": slip, "temperature": rows.temperature}
    for name, values in surfaces.items():
        if values is not None:
            columns |= {f"{name}_{surface + 1}": values[:, surface] for surface in range(rows.surfaces)}
    free = top.kind == "mass" and not top.height
    if free:
        columns |= {f"position_{axis + 1}": rows.top_displacement[:, axis] for axis in range(3)}
        if rows.top_settlement is not None:
            columns["position_3"] = rows.top_displacement[:, 2] - rows.top_settlement
    return Histories(result.title, columns, mass=top.mass if top.kind == "mass" else None)
