"""Types of the classes `Stack`, `Run` and `Port` of a compiled module (`templates/msfp_module.pyx.jinja`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from msfp_gen.common.arrays import Array

EventRow = tuple[float, int, int, tuple[float, ...], tuple[float, ...]]


class Stack(Protocol):
    """One bearing with its top. Arrays are contiguous float64 in SI units.

    Shapes, with b = n - 1 bodies and c coordinates each, 3, or 6 with uplift: q, v, a (b, c); f and friction rates
    (b, 2); base (3, 6); load (6,); row (row size,), of the fields of `specification.rows`; powers (works,); u unknowns.

    state: keywords `memory`, what surfaces remember above its start, such as a rise in temperature [K], of laws with
    it; and `foot`, height of the foot of a mass on a vertical spring and its rate [m], [m/s]; left out: at rest.
    """

    def accelerations(
        self, q: Array, v: Array, f: Array, base: Array, load: Array, *, report: bool = False, **state: Array
    ) -> tuple[str, Array, Array, Array, float, int, int, Array | None]:
        """Status, accelerations, row, friction rates, residual, iterations, sign of the determinant, unknowns, (u,).

        All [SI]; the friction rates are those of Y and Z [1/s].
        """

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
        """Residual of the balances (3.26)-(3.29), (u,), its Jacobian, (u, k), and that of the friction rates, (2 b, k).

        k: number of variables, u where none is given. All [SI].
        """

    def vectors(self, q: Array, v: Array, a: Array, base: Array) -> tuple[Array, Array, Array]:
        """Named points, rotations and bases (3.1)-(3.12), in shapes as of `evaluation.named_vectors`."""


class AnyRun(Protocol):
    """A run of a bearing or of a building, in progress or ended."""

    @property
    def time(self) -> float:
        """Time reached [s]."""

    @property
    def counts(self) -> dict[str, int]:
        """Counters."""

    @property
    def row_count(self) -> int:
        """Number of rows held: those recorded, less those dropped."""

    @property
    def rows(self) -> Array:
        """Rows held, shape (T, row size) [SI]."""

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot of a run of the same scene and build. Raises ValueError."""


class Run(AnyRun, Protocol):
    """A run of the compiled integrator of a bearing."""

    @property
    def status(self) -> tuple[str, int, float]:
        """Name, surface (from 1, 0: none) and value."""

    @property
    def trips(self) -> dict[str, tuple[float, int, float]]:
        """Monitors that tripped: name -> time, surface, value."""

    @property
    def extremes(self) -> Array:
        """Extremes over all accepted steps, one number after the other, shape (extremes size,) [SI]."""

    @property
    def dropped_rows(self) -> int:
        """Number of rows dropped."""

    @property
    def events(self) -> list[EventRow]:
        """Time, surface, kind, displacement and top force of every event."""

    def advance(self, steps: int = 2000, rows: int = 0) -> bool:
        """Take at most `steps` steps, fewer once so many `rows` are held (0: any); False where the run has ended."""

    def drop_rows(self) -> None:
        """Forget all rows but the last, which the caller has stored elsewhere."""

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
        """Status, and derivatives of the wrenches, shape (12, 12); direction: as of `Response`."""

    def commit(self) -> None:
        """Accept the last trial. Raises ValueError."""

    def revert(self) -> None:
        """Return to the committed state."""

    def snapshot(self) -> bytes:
        """The committed state."""

    def restore(self, snapshot: bytes) -> None:
        """Return to the state of a snapshot. Raises ValueError."""

    @property
    def trips(self) -> dict[str, tuple[float, int, float]]:
        """First detections of the monitors in steps by stages: name -> (time, surface, value)."""

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
