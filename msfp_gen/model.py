"""A compiled model: one evaluation of the equations, the report's balances, the named vectors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.errors import InputError, RunError
from msfp_gen.law_numbers import check_bearing, numbers
from msfp_gen.layout import ModelSpec
from msfp_gen.packing import Array, bodies_and_surfaces, top_values, vector
from msfp_gen.plane import State, into_plane, out_of_plane

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing
    from msfp_gen.build import BuildInfo
    from msfp_gen.motion import Motion
    from msfp_gen.top import Top

Triple = tuple[float, float, float]
Rotation = tuple[ArrayLike, ArrayLike, ArrayLike]
ZERO: Triple = (0.0, 0.0, 0.0)

FAILURES = {
    "newton": "Newton's method found no accelerations; the state may be beyond what the bearing can carry",
    "irregular": "the equations have lost regularity: friction and inertia admit no unique acceleration",
    "uplift": "an interface would have to pull; uplift is not modelled: increase the load on the top",
    "finite": "a value is not finite; check the state and the load",
}


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One evaluation of the equations of motion.

    acceleration: ndarray, shape (n-1, 3), second derivatives of psi, theta, phi [rad/s^2]; None in a massless model,
    whose sliders have no acceleration of their own. normal_force (n-1,) [N]; contact_angles (n-1, 2) psi~, theta~
    [rad]; friction_rate (n-1, 2) dY/dt, dZ/dt [1/s]; interface_force (n-1, 3) on the body above [N]; slip_velocity
    (n-1, 2) u~, v~ [m/s]; friction_coefficient (n-1,), None where it is constant; sliding, gap (n-1,) [m].
    residual_norm: largest balance relative to its natural size
    (massless: moment over the largest normal force [m], how far the state is from equilibrium);
    determinant: sign of the determinant of the equations solved.
    """

    acceleration: Array | None
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

    @property
    def unknowns(self) -> Array:
        """The unknowns in the order of (2.119): accelerations, position angles, normal forces; shape (6(n-1),)."""
        if self.acceleration is None:
            raise InputError("unknowns: a massless model has no accelerations; build it with sliders = 'inertial'")
        return np.concatenate([self.acceleration.ravel(), self.contact_angles.ravel(), self.normal_force])


class Model:
    """Compiled equations of one layout with one set of effects; made by `build_model`.

    A planar model takes and gives the same shapes as a spatial one, for states in the E1-E3 or the E2-E3 plane.
    """

    def __init__(self, spec: ModelSpec, extension: ModuleType, info: BuildInfo) -> None:
        self.spec = spec
        self.layout = spec.layout
        self.effects = spec.effects
        self.extension = extension
        self.info = info

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as what it is a model of: found in the cache, or built, where it is loaded."""
        from msfp_gen.build import build_model

        return build_model, (self.layout, self.effects)

    def __repr__(self) -> str:
        return f"Model({self.spec.key})"

    @property
    def planar(self) -> bool:
        """Whether the model is planar."""
        return self.effects.dimension == "planar"

    def stack(self, bearing: Bearing, top: Top | None = None, anchor: ArrayLike = (0.0, 0.0)) -> Any:
        """The compiled stack (`Stack` of the extension) for one bearing and top."""
        if bearing.layout != self.layout:
            raise InputError(f"bearing.layout = {bearing.layout.name}: this model is for {self.layout.name}")
        check_bearing(self.effects.law, self.effects.friction, bearing)
        values = bodies_and_surfaces(bearing, self.effects)
        return self.extension.Stack(bearing.gravity, *values, top_values(top, anchor))

    def evaluate(
        self,
        bearing: Bearing,
        q: ArrayLike,
        v: ArrayLike,
        h: ArrayLike,
        *,
        base_acceleration: ArrayLike = ZERO,
        top_force: ArrayLike = ZERO,
        top_moment: ArrayLike = ZERO,
        base_rotation: Rotation | None = None,
        temperature: ArrayLike | None = None,
        formulation: str = "condensed",
    ) -> Evaluation:
        """Accelerations, normal forces and friction rates at a state.

        q, v: angles psi, theta, phi of bodies 2..n and rates, shape (n-1, 3) [rad], [rad/s]. h: Y, Z, shape (n-1, 2).
        base_acceleration (3,) [m/s^2]; top_force, top_moment (3,): what the outside applies to the top plate at r_nn
        [N], [N m]; base_rotation: (angles, rates, accelerations) of psi_1, theta_1, phi_1, each (3,).
        temperature (n-1,) [degC], where friction depends on it; None: as at the start.
        formulation: "condensed" (contact in closed form), or "report" (Newton on all 6(n-1) unknowns).
        Raises InputError for bad shapes; RunError where no acceleration exists or none is found.
        """
        if formulation not in ("condensed", "report"):
            raise InputError(f"formulation = {formulation!r}: give 'condensed' or 'report'")
        state = self._state(q, v, h, base_acceleration, base_rotation, top_force, top_moment)
        stack, heat = self.stack(bearing), self._heat(bearing, temperature)
        if self.effects.sliders == "massless":
            return self._quasistatic(stack, state, heat)
        status, a, row, rates, residual, iterations, sign, _ = stack.accelerations(
            state.q, state.v, state.f, state.base, state.load, report=formulation == "report", **heat
        )
        if status != "ok":
            raise RunError(
                f"evaluate: {FAILURES.get(status, status)} ({iterations} iterations, residual {residual:.3g})",
                status=status,
            )
        return self._evaluation(state, a, row, rates, residual, iterations, sign)

    def _heat(self, bearing: Bearing, temperature: ArrayLike | None) -> dict[str, Array]:
        """Temperature above the start, as the stack takes it."""
        law = self.effects.law
        if temperature is None:
            return {}
        if law is None or not law.heats:
            raise InputError(f"temperature: effects.friction = {self.effects.friction!r} depends on none; leave it out")
        count = self.layout.surfaces
        start = [numbers(law, bearing, index)["start_temperature"] for index in range(count)]
        return {"rise": vector(temperature, "temperature", (count,), "degC") - start}

    def _quasistatic(self, stack: Any, state: State, heat: dict[str, Array]) -> Evaluation:
        zero = np.zeros_like(state.q)
        status, residual, _, _ = stack.condensed(
            state.q, state.v, zero, state.f, state.base, state.load, 0.0, 0.0, 0.0, 0.0, **heat
        )
        if status != "ok":
            raise RunError(f"evaluate: {FAILURES.get(status, status)}", status=status)
        row, _, rates, pulling = stack.observe(state.q, state.v, zero, state.f, state.base, state.load, **heat)
        if pulling:
            raise RunError(f"evaluate, surface {pulling}: {FAILURES['uplift']}", status="uplift")
        fields = self.unpack(row)
        size = float(np.max(np.abs(residual)) / max(float(np.max(fields["normal"])), 1e-12))
        return self._evaluation(state, None, row, rates, size, 0, 0)

    def _evaluation(
        self, state: State, a: Array | None, row: Array, rates: Array, residual: float, iterations: int, sign: int
    ) -> Evaluation:
        fields = self.unpack(row)
        turn = state.azimuth
        return Evaluation(
            acceleration=None if a is None else out_of_plane(a, turn, "angles"),
            normal_force=fields["normal"],
            contact_angles=out_of_plane(fields["angles"], turn, "pair_angles"),
            friction_rate=out_of_plane(rates, turn, "pair"),
            interface_force=out_of_plane(fields["force"], turn, "vector"),
            slip_velocity=out_of_plane(fields["slip"], turn, "pair"),
            friction_coefficient=fields.get("mu"),
            sliding=fields["sliding"],
            gap=fields["gap"],
            residual_norm=float(residual),
            newton_iterations=int(iterations),
            determinant=int(sign),
        )

    def unpack(self, rows: Array) -> dict[str, Array]:
        """Recorded rows, shape (..., row size), as named arrays (names and shapes: `ROW` of the extension)."""
        out, start = {}, 0
        for name, shape in self.extension.ROW:
            size = int(np.prod(shape, dtype=int))
            out[name] = rows[..., start : start + size].reshape(rows.shape[:-1] + shape)
            start += size
        return out

    def residual(
        self,
        bearing: Bearing,
        q: ArrayLike,
        v: ArrayLike,
        h: ArrayLike,
        unknowns: ArrayLike,
        *,
        base_acceleration: ArrayLike = ZERO,
        top_force: ArrayLike = ZERO,
        top_moment: ArrayLike = ZERO,
        base_rotation: Rotation | None = None,
    ) -> Array:
        """The report's balances (3.26)-(3.29) at given unknowns: left side less right side.

        unknowns: shape (6(n-1),) in the order of (2.119): accelerations psi'', theta'', phi'' body by body, psi~,
        theta~ surface by surface, N. Returns shape (6(n-1),): per body the linear balance along E1, E2, E3 [N], then
        the angular one along t_1, t_2, t_3 of the body [N m]; with locked spin phi'' in place of its axial part. A
        planar model has 3(n-1) of each: theta'', theta~, N; and E1, E3, t_2. Other inputs as in `evaluate`.
        """
        state = self._state(q, v, h, base_acceleration, base_rotation, top_force, top_moment)
        values = vector(unknowns, "unknowns", (self.extension.UNKNOWNS,), "rad/s^2, rad, N")
        residual: Array = self.stack(bearing).report(state.q, state.v, state.f, state.base, state.load, values)[0]
        return residual

    def jacobian(
        self,
        bearing: Bearing,
        q: ArrayLike,
        v: ArrayLike,
        h: ArrayLike,
        unknowns: ArrayLike,
        *,
        wrt: str = "unknowns",
        base_acceleration: ArrayLike = ZERO,
        top_force: ArrayLike = ZERO,
        top_moment: ArrayLike = ZERO,
        base_rotation: Rotation | None = None,
    ) -> Array:
        """Jacobian of `residual`, shape (6(n-1), k).

        wrt: "unknowns" (k = 6(n-1), their order); "state" (k = 8(n-1): q, v, h, each flattened); "inputs" (k = 24: base
        displacement, velocity, acceleration; psi_1, theta_1, phi_1, rates, accelerations; top force; top moment).
        """
        columns = self._columns(wrt)
        state = self._state(q, v, h, base_acceleration, base_rotation, top_force, top_moment)
        values = vector(unknowns, "unknowns", (self.extension.UNKNOWNS,), "rad/s^2, rad, N")
        jacobian: Array = self.stack(bearing).report(
            state.q, state.v, state.f, state.base, state.load, values, columns
        )[1]
        return jacobian

    def kinematics(
        self, bearing: Bearing, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, base: ArrayLike | None = None
    ) -> dict[str, Array]:
        """Every named vector of (3.1)-(3.12) with velocity and acceleration.

        q, v, a: shape (n-1, 3). base: shape (3, 6): u_g1..3, psi_1, theta_1, phi_1 and first and second derivatives.
        Returns {"r_01", "r_1", "r_11", "r_1c", "r_12", ...} [m], "v_..." [m/s], "a_..." [m/s^2], "omega_k" and
        "omega'_k" [rad/s], "alpha_k" and "alpha'_k" [rad/s^2], "t_k" (3, 3): rows t_1, t_2, t_3. E components.
        """
        if self.planar:
            raise InputError("kinematics: a planar model has no third dimension; build it with dimension = 'spatial'")
        shape = (self.layout.surfaces, 3)
        values = [vector(x, name, shape, "rad") for x, name in ((q, "q"), (v, "v"), (a, "a"))]
        motion = vector(np.zeros((3, 6)) if base is None else base, "base", (3, 6), "m, rad")
        points, rotations, bases = self.stack(bearing).vectors(*values, motion)
        return _named(self.layout.n, points, rotations, bases)

    def as_ode(self, bearing: Bearing, motion: Motion, top: Top) -> Any:
        """The model as y' = fun(t, y) with its Jacobian, for `scipy.integrate.solve_ivp` and friends; see `ode.Ode`."""
        from msfp_gen.ode import Ode

        return Ode(self, bearing, motion, top)

    def _state(
        self,
        q: ArrayLike,
        v: ArrayLike,
        h: ArrayLike,
        acceleration: ArrayLike,
        rotation: Rotation | None,
        force: ArrayLike,
        moment: ArrayLike,
    ) -> State:
        count = self.layout.surfaces
        base = np.zeros((3, 6))
        base[2, :3] = vector(acceleration, "base_acceleration", (3,), "m/s^2")
        if rotation is not None:
            base[:, 3:] = vector(np.asarray(rotation, dtype=float), "base_rotation", (3, 3), "rad, rad/s, rad/s^2")
        load = np.concatenate([vector(force, "top_force", (3,), "N"), vector(moment, "top_moment", (3,), "N m")])
        state = State(
            vector(q, "q", (count, 3), "rad"),
            vector(v, "v", (count, 3), "rad/s"),
            vector(h, "h", (count, 2), "-"),
            base,
            load,
        )
        return into_plane(state) if self.planar else state

    def _columns(self, wrt: str) -> list[tuple[int, int, int]]:
        makers: dict[str, Callable[[], list[tuple[int, int, int]]]] = {
            "unknowns": self._unknown_columns,
            "state": self._state_columns,
            "inputs": _input_columns,
        }
        if wrt not in makers:
            raise InputError(f"wrt = {wrt!r}: give one of {', '.join(makers)}")
        return makers[wrt]()

    def _unknown_columns(self) -> list[tuple[int, int, int]]:
        bodies, angles, contact = (
            range(self.layout.surfaces),
            (1,) if self.planar else (0, 1, 2),
            (1,) if self.planar else (0, 1),
        )
        return [
            *((0, k + 1, 6 + i) for k in bodies for i in angles),
            *((1, k, i) for k in bodies for i in contact),
            *((1, k, 2) for k in bodies),
        ]

    def _state_columns(self) -> list[tuple[int, int, int]]:
        bodies = range(self.layout.surfaces)
        return [
            *((0, k + 1, 3 * order + i) for order in (0, 1) for k in bodies for i in range(3)),
            *((2, k, i) for k in bodies for i in range(2)),
        ]


def _input_columns() -> list[tuple[int, int, int]]:
    return [*((3, 0, i) for i in range(9)), *((0, 0, i) for i in range(9)), *((4, 0, i) for i in range(6))]


def _named(n: int, points: Array, rotations: Array, bases: Array) -> dict[str, Array]:
    """Named vectors from the arrays of the extension."""
    out: dict[str, Array] = {}
    for k in range(1, n + 1):
        bottom = "01" if k == 1 else f"{k - 1}{k}"
        names = (bottom, str(k), f"{k}{k}") if k == n else (bottom, str(k), f"{k}{k}", f"{k}c")
        for i, name in enumerate(names):
            for j, kind in enumerate("rva"):
                out[f"{kind}_{name}"] = points[k - 1, i, j]
        for i, kind in enumerate(("omega_{}", "omega'_{}", "alpha_{}", "alpha'_{}")):
            out[kind.format(k)] = rotations[k - 1, i]
        out[f"t_{k}"] = bases[k - 1]
    return out
