"""Types of the classes of a compiled module (`templates/msfp_module.pyx.jinja`), and what `Stack` takes and returns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.scene.friction_parameters import surface_numbers
from msfp_gen.scene.standing import seat_stiffness
from msfp_gen.scene.top import MassTop, Top, load_values
from msfp_gen.specification import contract
from msfp_gen.specification.contract import STATUSES
from msfp_gen.specification.layout import point_names

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.specification.layout import Effects


EventRow = tuple[float, int, int, tuple[float, ...], tuple[float, ...]]


class Stack(Protocol):
    """One bearing with its top. Arrays are contiguous float64 in SI units.

    Shapes, with b = n - 1 bodies and c coordinates each, 3, or 6 with uplift: q, v, a (b, c); f and friction rates
    (b, 2); base (3, 6); load (6,); row (row size,), of the fields of `contract.row`; powers (works,); u unknowns.

    state: keywords `memory`, what surfaces remember above its start, such as a rise in temperature [K], of laws with
    it; and `foot`, height of the foot of a mass on a vertical spring and its rate [m], [m/s]; left out: at rest.
    """

    def accelerations(
        self, q: Array, v: Array, f: Array, base: Array, load: Array, *, report: bool = False, **state: Array
    ) -> tuple[str, Array, Array, Array, float, int, int, Array | None]:
        """Status, accelerations, row, friction rates, residual, iterations, sign of the determinant, unknowns, (u,).

        All [SI]; the friction rates are the rates of Y and Z [1/s].
        """

    def many_accelerations(
        self, q: Array, v: Array, f: Array, base: Array, load: Array
    ) -> tuple[Any, Array, Array, Array]:
        """Of k states, each array with a leading axis: statuses (k,), accelerations, rows, friction rates [SI]."""

    def observe(
        self, q: Array, v: Array, a: Array, f: Array, base: Array, load: Array, **state: Array
    ) -> tuple[Array, Array, Array, int]:
        """Row, powers, friction rates, see `Stack`, and the surface that would have to transmit tension (0: none)."""

    def condensed(
        self,
        q: Array,
        v: Array,
        a: Array,
        f: Array,
        base: Array,
        load: Array,
        q_weight: float,
        v_weight: float,
        a_weight: float,
        beta: float,
        **state: Array,
    ) -> tuple[str, Array, Array, Array]:
        """Status, residual, shape (b c,), tangent, (b c, b c) [SI], Y, Z, (b, 2) [-], of the condensed equations."""

    def report(
        self,
        q: Array,
        v: Array,
        f: Array,
        base: Array,
        load: Array,
        unknowns: Array,
        variables: Sequence[tuple[int, int, int]] = (),
    ) -> tuple[Array, Array, Array]:
        """Residual of the balances (3.26)-(3.29), (u,), its Jacobian, (u, k), and the Jacobian of the friction rates,
        (2 b, k).

        k: number of variables, u where none is given. All [SI].
        """

    def vectors(self, q: Array, v: Array, a: Array, base: Array) -> tuple[Array, Array, Array]:
        """Named points, rotations and bases (3.1)-(3.12), in shapes as in `named_vectors`."""


class CompiledRun(Protocol):
    """A run of a bearing or of a building, in progress or ended."""

    @property
    def time(self) -> float:
        """Time reached [s]."""

    @property
    def counts(self) -> dict[str, int]:
        """Counters."""

    @property
    def row_count(self) -> int:
        """Number of rows recorded."""

    @property
    def rows(self) -> Array:
        """Rows, shape (T, row size) [SI]."""

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot of a run of the same scene and build. Raises ValueError."""


class CompiledBearingRun(CompiledRun, Protocol):
    """A run of the compiled integrator of a bearing."""

    @property
    def status(self) -> tuple[str, int, float]:
        """Name, surface (from 1, 0: none) and value."""

    @property
    def trips(self) -> dict[str, tuple[float, int, float, float]]:
        """Monitors that tripped: name -> time, surface, value, time of the value."""

    @property
    def extremes(self) -> Array:
        """Extremes over all accepted steps [SI] and their times [s], one number after the other, shape (2, size)."""

    @property
    def events(self) -> list[EventRow]:
        """Time, surface, kind, displacement and top force of every event."""

    def advance(self, steps: int = 2000) -> bool:
        """Take at most `steps` steps; False where the run has ended."""

    def record_now(self) -> None:
        """Record a row of the current state, unless there is one."""

    def snapshot(self, rows: int = -1) -> bytes:
        """State, with so many of the last rows and no events; negative: with all rows and events."""

    def start_gradients(self, *, steps: Sequence[float] = (), energies: bool = False, **derivatives: Array) -> None:
        """Begin derivatives with respect to parameters; of everything that the run is given (the wrapper names it)."""

    def gradient_rows(self, count: int) -> Array:
        """Derivatives of `rows` with respect to `count` parameters, shape (T, count, row size) [SI]."""

    def gradient_events(self, count: int) -> Array:
        """Derivatives of time, displacement and top force of the events, shape (events, count, 7) [SI]."""

    def gradient_extremes(self, count: int) -> Array:
        """Derivatives of `extremes`, shape (count, size) [SI]."""


class Port(Protocol):
    """A compiled two-port: a committed state and a trial. Arrays are contiguous float64 in SI units."""

    @property
    def capsule(self) -> object:
        """The two-port for other compiled code, valid as long as this object."""

    @property
    def time(self) -> float:
        """Time of the committed state [s]."""

    @property
    def status(self) -> tuple[str, int, float, float]:
        """Name, surface (from 1, 0: none), value and time reached [s], of the last trial."""

    @property
    def wrench(self) -> Array:
        """Wrenches of the ends on the bearing, shape (2, 6) [N, N m], of the last trial or of the committed state."""

    @property
    def row(self) -> Array:
        """The row of that state, shape (row size,) [SI]."""

    @property
    def counts(self) -> dict[str, int]:
        """Counters of the last trial."""

    def trial(self, time: float, ends: Array) -> tuple[str, int, float, float]:
        """Go from the committed state to `time`, with the ends at `ends`, shape (2, 3, 6); returns `status`."""

    def derivative(self, direction: Array) -> tuple[str, Array]:
        """Status, and derivatives of the wrenches, shape (12, 12); direction: see `Response`."""

    def commit(self) -> None:
        """Accept the last trial. Raises ValueError."""

    def revert(self) -> None:
        """Return to the committed state."""

    def snapshot(self) -> bytes:
        """The committed state."""

    def restore(self, snapshot: bytes) -> None:
        """Return to the state of a snapshot. Raises ValueError."""

    @property
    def trips(self) -> dict[str, tuple[float, int, float, float]]:
        """Detections of the monitors in steps by stages: name -> (time, surface, value, time of the value)."""

    def state(self) -> dict[str, Any]:
        """The committed state, as `RestartState` has it."""

    def enter(self, time: float, q: Array, v: Array, f: Array, ends: Array, **state: Array | None) -> str:
        """Continue, in a two-port at rest, from the state of another model; status."""

    def step_begin(self, step: float, expected: Array) -> str:
        """Begin a step by stages; status. The next methods: see `port_stage` and others of `msfp.h`."""

    def stage(self, stage: int, ends: Array) -> tuple[str, Array]:
        """Status, and wrenches in a stage with the ends at `ends`, shapes (2, 6) [N, N m] and (2, 3, 6) [SI]."""

    def stage_derivative(self) -> tuple[str, Array]:
        """Status, and derivatives of the wrench of the upper end in the stage by its rates, shape (6, 6) [SI]."""

    def step_end(self) -> tuple[str, float, float]:
        """Status, error of the step over its tolerance, share of the step at which the first event lies."""

    def step_commit(self, time: float) -> str:
        """Accept the step; status."""


ColumnIndex = tuple[int, int, int]


def jacobian_columns(wrt: str, count: int, effects: Effects) -> list[ColumnIndex]:
    """The columns of `Model.jacobian` for wrt = "unknowns", "state" or "inputs" of a stack with `count` surfaces.

    Raises InputError for another `wrt`.
    """
    makers: dict[str, Callable[[], list[ColumnIndex]]] = {
        "unknowns": lambda: unknown_columns(count, effects),
        "state": lambda: state_columns(count, effects),
        "inputs": input_columns,
    }
    if wrt not in makers:
        raise InputError(f"wrt = {wrt!r}: give one of {', '.join(makers)}")
    return makers[wrt]()


def coordinate_fields(order: int, effects: Effects) -> list[int]:
    """Fields of the coordinates of a body or of a derivative: angles, and with uplift separations."""
    return [3 * order + i for i in range(3)] + [9 + 3 * order + i for i in range(3 if effects.uplift else 0)]


def free_coordinates(effects: Effects) -> list[int]:
    """The coordinates of a body that move: of a planar model the tilt in the plane, and the separation in it."""
    every = [1, 3, 5] if effects.dimension == "planar" else [0, 1, 2, 3, 4, 5]
    return [i for i in every if i < 3 or effects.uplift]


def unknown_columns(count: int, effects: Effects) -> list[ColumnIndex]:
    """The unknowns in the order of (2.119): accelerations, contact positions, normal forces."""
    bodies, contact = range(count), (1,) if effects.dimension == "planar" else (0, 1)
    fields = coordinate_fields(2, effects)
    return [
        *((0, k + 1, fields[i]) for k in bodies for i in free_coordinates(effects)),
        *((1, k, i) for k in bodies for i in contact),
        *((1, k, 2) for k in bodies),
    ]


def state_columns(count: int, effects: Effects) -> list[ColumnIndex]:
    """The state q, v and h, each flattened."""
    bodies = range(count)
    return [
        *((0, k + 1, field) for order in (0, 1) for k in bodies for field in coordinate_fields(order, effects)),
        *((2, k, i) for k in bodies for i in range(2)),
    ]


def input_columns() -> list[ColumnIndex]:
    """Base translations and rotations with first and second derivatives, then the load on the top plate."""
    return [*((3, 0, i) for i in range(9)), *((0, 0, i) for i in range(9)), *((4, 0, i) for i in range(6))]


def vector(value: ArrayLike, name: str, shape: tuple[int, ...], unit: str) -> Array:
    """`value` as a finite, contiguous float64 array of the given shape, [its unit], or an InputError that names it."""
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} = {value!r}: give numbers [{unit}], shape {shape}") from error
    if array.shape != shape:
        raise InputError(f"{name} has shape {array.shape}: give shape {shape} [{unit}]")
    if not np.isfinite(array).all():
        raise InputError(f"{name} has an entry that is not finite: give finite numbers [{unit}]")
    return array


def many(value: ArrayLike, name: str, shape: tuple[int, ...], count: int) -> Array:
    """As `vector`, with a leading axis of `count` [SI]; one array of the given shape serves all."""
    if np.ndim(value) == len(shape):
        value = np.broadcast_to(vector(value, name, shape, "SI"), (count, *shape))
    return vector(value, name, (count, *shape), "SI")


def bodies_and_surfaces(bearing: Bearing, effects: Effects, top: Top | None = None) -> tuple[Array, Array]:
    """Arrays of bodies, shape (n, values of a body), and surfaces, (n-1, values of a surface) [SI], in contract order.

    top: on which the stiffness of unilateral contacts depends where it is not given. Raises InputError as it does.
    """
    arrays = bearing.arrays()
    if effects.uplift:
        arrays["seat_stiffness"] = seat_stiffness(bearing, top)
    rows = [surface_numbers(effects, bearing, index) for index in range(bearing.layout.surfaces)]
    arrays |= {name: np.array([row[name] for row in rows]) for name in effects.surface_numbers}
    bodies, surfaces = (
        np.ascontiguousarray(np.column_stack([arrays[name] for name in columns]))
        for columns in (contract.names(contract.BODY), contract.surface_values(effects))
    )
    return bodies, surfaces


def top_values(top: Top | None, anchor: ArrayLike = (0.0, 0.0)) -> Array:
    """Parameters of the top in contract order, ndarray, shape (values,), SI units.

    anchor: horizontal position of the fixed end of its springs, shape (2,) [m].
    """
    values = dict.fromkeys(contract.names(contract.TOP), 0.0)
    values["anchor_x"], values["anchor_y"] = np.asarray(anchor, dtype=float)
    numbers = {} if top is None else vars(top)
    if isinstance(top, MassTop):
        inertia = top.inertia if isinstance(top.inertia, tuple) else (top.inertia, top.inertia)
        numbers = {**numbers, "inertia_transverse": inertia[0], "inertia_axial": inertia[1]}
    values |= {name: value for name, value in numbers.items() if name in values and value is not None}
    return np.array([float(value) for value in values.values()])


def separations_at_rest(bearing: Bearing, top: Top | None, added_load: float = 0.0) -> Array:
    """Separations at which the unilateral contacts carry all weights and loads, ndarray, shape (n-1, 3) [m].

    added_load: vertical load in addition to the load of the top, downward positive [N].
    """
    load = added_load + (0.0 if top is None else -float(load_values(top)[2]))
    mass = top.mass if isinstance(top, MassTop) else 0.0
    masses = np.array([body.mass for body in bearing.bodies])
    masses[-1] += mass
    return separations_under(np.array([0.0, 0.0, -load]), bearing.gravity, masses, seat_stiffness(bearing, top))


def separations_under(force: Array, gravity: float, masses: Array, stiffness: Array) -> Array:
    """Separations at which the contacts of all surfaces carry the weights and a force, ndarray, shape (n-1, 3) [m].

    force: on the top plate, shape (3,) [N]. masses: of bodies 2..n with what they carry, shape (n-1,) [kg]. stiffness:
    of the contacts, shape (n-1,) [N/m].
    """
    out = np.tile(np.asarray(force, dtype=float), (len(masses), 1))
    out[:, 2] -= gravity * np.cumsum(masses[::-1])[::-1]
    return out / stiffness[:, None]


FAILURES = {status.name: status.evaluation for status in STATUSES if status.evaluation is not None}
"""Why there are no accelerations, by status."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One evaluation of the equations of motion.

    acceleration: ndarray, shape (n-1, 3), second derivatives of psi, theta, phi [rad/s^2], with uplift (n-1, 6), the
    accelerations of the separation [m/s^2] last; None in a massless model, which does not determine accelerations.
    unknowns: as `Model.residual` takes them; None likewise. normal_force (n-1,) [N]; contact_angles (n-1, 2) psi~,
    theta~ [rad]; friction_rate (n-1, 2) dY/dt, dZ/dt [1/s]; interface_force (n-1, 3) P on the body above [N];
    slip_velocity (n-1, 2) u~, v~ [m/s]; friction_coefficient (n-1,), None where it is constant; sliding, gap (n-1,)
    [m].
    residual_norm: largest residual of a balance over its scale [-]; massless: largest moment over the largest normal
    force, a measure of the distance from equilibrium [m]. determinant: sign of the determinant of the equations.
    """

    acceleration: Array | None
    unknowns: Array | None
    normal_force: Array
    contact_angles: Array
    friction_rate: Array
    interface_force: Array
    slip_velocity: Array
    friction_coefficient: Array | None
    sliding: Array
    gap: Array
    residual_norm: float
    newton_iterations: int
    determinant: int


def named_vectors(n: int, points: Array, rotations: Array, bases: Array) -> dict[str, Array]:
    """Vectors by their names in `Model.kinematics`, from the arrays of the extension.

    Each is an ndarray, shape (3,) or (3, 3). points: of each body and named point position, velocity and acceleration
    [m], [m/s], [m/s^2]. rotations: omega, omega', alpha, alpha' of each body [rad/s], [rad/s^2]. bases: rows t_1, t_2,
    t_3 of each body.
    """
    out: dict[str, Array] = {}
    order = ("lo", "cm", "up", "sc")
    for body, point, name in point_names(n):
        out |= {f"{kind}_{name}": points[body, order.index(point), j] for j, kind in enumerate("rva")}
    for k in range(1, n + 1):
        for i, kind in enumerate(("omega_{}", "omega'_{}", "alpha_{}", "alpha'_{}")):
            out[kind.format(k)] = rotations[k - 1, i]
        out[f"t_{k}"] = bases[k - 1]
    return out
