"""`Model`: evaluation of the equations, the balances (3.26)-(3.29), the named vectors, an ODE; `build_model`."""

from __future__ import annotations

import threading
from time import perf_counter
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.aliases import BuildProgress
from msfp_gen.common.arrays import Array, parts
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.jit.build import BuildInfo, load
from msfp_gen.model.compiled import (
    FAILURES,
    Evaluation,
    Stack,
    bodies_and_surfaces,
    free_coordinates,
    jacobian_columns,
    many,
    named_vectors,
    separations_at_rest,
    state_columns,
    top_values,
    unknown_columns,
    vector,
)
from msfp_gen.model.plane import State, coordinates_out_of_plane, into_plane, out_of_plane
from msfp_gen.motions.piecewise import derivatives
from msfp_gen.scene.friction_parameters import check_bearing, law_parameters
from msfp_gen.scene.top import is_sprung, load_values
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.top import Top


class Ode:
    """y' = fun(t, y) with y = (q, v, h) flattened, shape (8(n-1),): angles [rad], rates [rad/s], Y and Z.

    With uplift q and v are of shape (n-1, 6), angles and separations [m] with their rates [m/s], and y (14(n-1),).
    `jac(t, y)` is exact: it follows from the balances (3.26)-(3.29) by the implicit function theorem. `y0`: centred and
    at rest, with uplift on contacts that carry the weights and the load of the top. An instance unpacks as `fun, jac,
    y0`. Raises InputError for massless models, friction laws with a memory of the surface, a top on a vertical spring,
    and a planar model with a motion outside the E1-E3 plane.
    """

    def __init__(self, model: Model, bearing: Bearing, motion: Motion, top: Top) -> None:
        if model.effects.sliders == "massless":
            raise InputError("as_ode: a massless model is no ordinary differential equation; use sliders = 'inertial'")
        if model.effects.law is not None and model.effects.law.memory is not None:
            raise InputError(
                f"as_ode: effects.friction = {model.effects.friction!r} has temperatures or paths, which y does not "
                "contain; use simulate, or a law without them"
            )
        if is_sprung(top):
            raise InputError(
                f"as_ode: top.vertical_stiffness = {top.vertical_stiffness!r}: y does not contain the height of the "
                "foot; use simulate, or leave the vertical spring out"
            )
        if model.planar and motion.plane() != 0.0:
            raise InputError(
                "as_ode: a planar model needs a motion in the E1-E3 plane; rotate it with motion.rotated(angle)"
            )
        self.model, self.motion = model, motion
        self.count = model.layout.surfaces
        self.stack = model.stack(bearing, top, anchor=motion.displacement(0.0)[:2])
        self.load = load_values(top)
        self.coordinates: int = model.extension.COORDINATES
        q = np.zeros((self.count, self.coordinates))
        if model.effects.uplift:
            q[:, 3:] = separations_at_rest(bearing, top)
        self.y0: Array = np.concatenate([q.ravel(), np.zeros(q.size + 2 * self.count)])

    def __iter__(self):  # type: ignore[no-untyped-def]
        return iter((self.fun, self.jac, self.y0))

    def _split(self, y: Array) -> tuple[Array, Array, Array]:
        c = self.coordinates
        k = c * self.count
        q, v, h = y[:k].reshape(-1, c), y[k : 2 * k].reshape(-1, c), y[2 * k :].reshape(-1, 2)
        return np.ascontiguousarray(q, float), np.ascontiguousarray(v, float), np.ascontiguousarray(h, float)

    def _base(self, t: float) -> Array:
        """Displacement, velocity and acceleration of the base, shape (3, 6)."""
        # Equal to `Motion.evaluate`, but faster at a single time: integrators call `fun` tens of thousands of times.
        knots, coefficients = self.motion.knots, self.motion.coefficients
        if not 0 <= t <= knots[-1]:
            self.motion.evaluate(t)  # raises the InputError for this time
        piece = min(int(np.searchsorted(knots, t, side="right")) - 1, len(knots) - 2)
        return np.ascontiguousarray(derivatives(float(t - knots[piece])) @ coefficients[piece].T)

    def _accelerations(self, t: float, y: Array) -> tuple[Array, Array, Array, int]:
        """Accelerations, the row of this state, friction rates and Newton iterations. Raises RunError on failure."""
        q, v, h = self._split(np.asarray(y))
        status, a, row, rates, _, iterations, *_ = self.stack.accelerations(q, v, h, self._base(t), self.load)
        if status != "ok":
            raise RunError(f"as_ode: {status} at t = {t:.6g} s", status=status)
        return a, row, rates, iterations

    def fun(self, t: float, y: Array) -> Array:
        """State derivative, ndarray, shape of y, [rad/s, rad/s^2, 1/s] and of separations [m/s, m/s^2].

        Raises RunError: no acceleration.
        """
        return self.rates(t, y)[0]

    def rates(self, t: float, y: Array) -> tuple[Array, int]:
        """The value of `fun`, ndarray, shape of y [SI], and the number of Newton iterations."""
        a, _, rates, iterations = self._accelerations(t, y)
        return np.concatenate([self._split(np.asarray(y))[1].ravel(), a.ravel(), rates.ravel()]), iterations

    def observe(self, t: float, y: Array) -> dict[str, Array]:
        """The row that a run would record of this state, as arrays by name; shapes and units of `History` less time.

        Raises RunError as `fun` does.
        """
        return self.model.unpack(self._accelerations(t, y)[1])

    def jac(self, t: float, y: Array) -> Array:
        """Jacobian d fun/d y, ndarray, shape (size of y, size of y), [SI]. Raises RunError as `fun` does."""
        q, v, h = self._split(np.asarray(y))
        base = self._base(t)
        a, row, *_ = self._accelerations(t, y)
        # The unknowns of `fun` are used here: solving the balances again could converge to another root.
        effects = self.model.effects
        unknowns, free = self.model.unknowns(a, row), free_coordinates(effects)
        inner, outer = unknown_columns(self.count, effects), state_columns(self.count, effects)
        _, jacobian, rates = self.stack.report(q, v, h, base, self.load, unknowns, [*inner, *outer])
        split = len(inner)
        sensitivity = -np.linalg.solve(jacobian[:, :split], jacobian[:, split:])  # d unknowns / d y
        k = self.coordinates * self.count
        out = np.zeros((len(outer), len(outer)))
        out[:k, k : 2 * k] = np.eye(k)
        moving = (k + np.arange(k).reshape(self.count, -1)[:, free]).ravel()
        out[moving] = sensitivity[: len(moving)]
        out[2 * k :] = rates[:, split:] + rates[:, :split] @ sensitivity
        return out


Triple = tuple[float, float, float]
RotationState = tuple[ArrayLike, ArrayLike, ArrayLike]
ZERO: Triple = (0.0, 0.0, 0.0)


def stack_values(spec: ModelSpec, bearing: Bearing, top: Top | None, anchor: ArrayLike) -> tuple[Any, ...]:
    """The arguments of a compiled stack, gravity and arrays; arguments and errors as in `Model.stack`."""
    effects = spec.effects
    if bearing.layout != spec.layout:
        raise InputError(f"bearing.layout = {bearing.layout.name}: this model is for {spec.layout.name}")
    check_bearing(effects.law, effects.friction, effects.spin, bearing)
    return bearing.gravity, *bodies_and_surfaces(bearing, effects, top), top_values(top, anchor)


_models: dict[ModelSpec, Model] = {}
_models_lock = threading.Lock()
_build_seconds = 0.0  # wall time that this process has spent on builds of models


class Model:
    """Compiled equations of one layout with one set of effects; made by `build_model`.

    A planar model has the same array shapes as a spatial one. It accepts states in the E1-E3 or the E2-E3 plane. With
    uplift q, v and accelerations have shape (n-1, 6): after the angles of a body the separation delta of the surface
    below it along E1, E2, E3 [m] (docs/uplift.md) and its derivatives.
    """

    def __init__(self, spec: ModelSpec, extension: ModuleType, info: BuildInfo) -> None:
        self.spec = spec
        self.layout = spec.layout
        self.effects = spec.effects
        self.extension = extension
        self.info = info

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle layout and effects alone: the model is loaded from the cache, or built, where it is unpickled."""
        return build_model, (self.layout, self.effects, self.spec.gradients)

    def __repr__(self) -> str:
        return f"Model({self.spec.key})"

    @property
    def planar(self) -> bool:
        """Whether the model is planar."""
        return self.spec.planar

    def stack(self, bearing: Bearing, top: Top | None = None, anchor: ArrayLike = (0.0, 0.0)) -> Stack:
        """The compiled stack of one bearing and top.

        anchor: horizontal position of the fixed end of the springs of a rig, shape (2,) [m]. Raises InputError where
        the bearing does not belong to this model.
        """
        stack: Stack = self.extension.Stack(*stack_values(self.spec, bearing, top, anchor))
        return stack

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
        base_rotation: RotationState | None = None,
        temperature: ArrayLike | None = None,
        formulation: str = "condensed",
    ) -> Evaluation:
        """Accelerations, normal forces and friction rates at a state.

        q, v: angles psi, theta, phi of bodies 2..n and rates, shape (n-1, 3) [rad], [rad/s], with uplift (n-1, 6), see
        `Model`. h: Y, Z, shape (n-1, 2) [-]. base_acceleration: shape (3,) [m/s^2]. top_force, top_moment: external
        load on the top plate at r_nn, shape (3,) [N], [N m]. base_rotation: (angles, rates, accelerations) of psi_1,
        theta_1, phi_1, each of shape (3,) [rad], [rad/s], [rad/s^2]. temperature: shape (n-1,) [degC], for a friction
        law with temperature; None: start temperatures. formulation: "condensed" (contact in closed form), or "report"
        (Newton's method on all unknowns of `residual`). Raises InputError for wrong shapes; RunError where no
        acceleration exists or is found.
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

    def accelerations(
        self,
        bearing: Bearing,
        q: ArrayLike,
        v: ArrayLike,
        h: ArrayLike,
        *,
        base: ArrayLike | None = None,
        load: ArrayLike | None = None,
        top: Top | None = None,
    ) -> dict[str, Array]:
        """Accelerations of many states at once, at the cost of the C code.

        q, v, h: see `evaluate`, with a leading axis, (k, ...). base: displacements with rotations, rates and
        accelerations, shape (3, 6) or (k, 3, 6) [SI]; load: force and moment on the top plate at r_nn, (6,) or (k, 6)
        [N], [N m]; None: zero. top: springs and mass above, None: none. Returns "acceleration" of the shape of q
        [rad/s^2] (separations [m/s^2]), "friction_rate" (k, n-1, 2) [1/s], and the row of every state as by `unpack`.
        A planar model takes states in the E1-E3 plane. Raises InputError for wrong shapes and massless models,
        RunError where a state has no acceleration.
        """
        if self.effects.sliders == "massless":
            raise InputError("accelerations: a massless model does not determine them; use sliders = 'inertial'")
        shape, count = self._shape, len(np.asarray(q))
        shapes = {"q": shape, "v": shape, "h": (shape[0], 2), "base": (3, 6), "load": (6,)}
        state = {"q": q, "v": v, "h": h, "base": np.zeros((3, 6)) if base is None else base}
        arrays = {
            name: many(value, name, shapes[name], count)
            for name, value in (state | {"load": np.zeros(6) if load is None else load}).items()
        }
        if self.planar:
            coordinates = [0, 2, *range(4, shape[1], 3)]  # psi, phi, and with uplift the separation along E2
            across = {"q": coordinates, "v": coordinates, "h": [1], "base": [1, 3, 5], "load": [1, 3, 5]}
            for name, axes in across.items():
                if np.any(arrays[name][..., axes]):
                    raise InputError(f"{name} leaves the E1-E3 plane: give states in it, or dimension = 'spatial'")
        status, a, rows, rates = self.stack(bearing, top).many_accelerations(*arrays.values())
        if (failed := np.flatnonzero(status != self.extension.OK)).size:
            raise RunError(
                f"accelerations: none were found for state {failed[0]}; check its angles, rates and load",
                status="failed",
            )
        return {"acceleration": a, "friction_rate": rates, **self.unpack(rows)}

    def _heat(self, bearing: Bearing, temperature: ArrayLike | None) -> dict[str, Array]:
        """Keyword `memory` of the stack: temperature above its start value, shape (n-1,) [K]."""
        law = self.effects.law
        if temperature is None:
            return {}
        if law is None or not law.depends_on_temperature:
            raise InputError(f"temperature: effects.friction = {self.effects.friction!r} depends on none; leave it out")
        count = self.layout.surfaces
        start = [law_parameters(law, bearing, index)["start_temperature"] for index in range(count)]
        return {"memory": vector(temperature, "temperature", (count,), "degC") - start}

    def _quasistatic(self, stack: Stack, state: State, heat: dict[str, Array]) -> Evaluation:
        """Evaluation of a massless model: the residual moments measure the distance from equilibrium."""
        zero = np.zeros_like(state.q)
        status, residual, _, _ = stack.condensed(
            state.q, state.v, zero, state.f, state.base, state.load, 0.0, 0.0, 0.0, 0.0, **heat
        )
        if status != "ok":
            raise RunError(f"evaluate: {FAILURES.get(status, status)}", status=status)
        row, _, rates, in_tension = stack.observe(state.q, state.v, zero, state.f, state.base, state.load, **heat)
        if in_tension:
            raise RunError(f"evaluate, surface {in_tension}: {FAILURES['uplift']}", status="uplift")
        fields = self.unpack(row)
        size = float(np.max(np.abs(residual)) / max(float(np.max(fields["normal"])), 1e-12))
        return self._evaluation(state, None, row, rates, size, 0, 0)

    def _evaluation(
        self, state: State, a: Array | None, row: Array, rates: Array, residual: float, iterations: int, sign: int
    ) -> Evaluation:
        fields = self.unpack(row)
        turn = state.azimuth
        return Evaluation(
            acceleration=None if a is None else coordinates_out_of_plane(a, turn),
            unknowns=None if a is None else self.unknowns(a, row),
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

    def unknowns(self, a: Array, row: Array) -> Array:
        """The unknowns, as in `residual` [SI], from accelerations and a row, of a planar model in its plane."""
        fields = self.unpack(row)
        angles = fields["angles"][:, 1:] if self.planar else fields["angles"]
        return np.concatenate([a[:, free_coordinates(self.effects)].ravel(), angles.ravel(), fields["normal"]])

    def unpack(self, rows: Array) -> dict[str, Array]:
        """Recorded rows, shape (..., row size) [SI], as arrays by name; `ROW` of the extension has names and shapes."""
        return parts(rows, self.extension.ROW)

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
        base_rotation: RotationState | None = None,
    ) -> Array:
        """Residual of the momentum balances (3.26)-(3.29) at given unknowns: left side less right side.

        unknowns: shape (6(n-1),) in the order of (2.119): accelerations psi'', theta'', phi'' body by body [rad/s^2],
        psi~, theta~ surface by surface [rad], N [N]. Returns ndarray, shape (6(n-1),): for each body the linear balance
        along E1, E2, E3 [N], then the angular one along t_1, t_2, t_3 of the body [N m]; with locked spin, phi'' takes
        the place of the axial component. A planar model has 3(n-1) unknowns (theta'', theta~, N) and balances (E1, E3,
        t_2). With uplift there are 9(n-1), in the plane 5(n-1): after the accelerations of a body follow the
        accelerations of the separation [m/s^2], and after the balances come, surface by surface, the components of the
        force (3.15)-(3.17) less the force of the unilateral contact [N]. `Evaluation.unknowns` has this order. Other
        inputs and errors as in `evaluate`.
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
        base_rotation: RotationState | None = None,
    ) -> Array:
        """Jacobian of `residual`, ndarray, shape (unknowns, k).

        wrt: "unknowns" (their order); "state" (k = 8(n-1), with uplift 14(n-1): q, v, h, each flattened, of a planar
        model in its plane); "inputs" (k = 24: base displacement, velocity, acceleration; psi_1, theta_1, phi_1, rates,
        accelerations; top force; top moment). Other inputs and errors as in `residual`.
        """
        variables = jacobian_columns(wrt, self.layout.surfaces, self.effects)
        state = self._state(q, v, h, base_acceleration, base_rotation, top_force, top_moment)
        values = vector(unknowns, "unknowns", (self.extension.UNKNOWNS,), "rad/s^2, rad, N")
        stack = self.stack(bearing)
        jacobian: Array = stack.report(state.q, state.v, state.f, state.base, state.load, values, variables)[1]
        return jacobian

    def kinematics(
        self, bearing: Bearing, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, base: ArrayLike | None = None
    ) -> dict[str, Array]:
        """Every named vector of (3.1)-(3.12) with velocity and acceleration.

        q, v, a: angles of bodies 2..n, rates and accelerations, shape (n-1, 3) [rad], [rad/s], [rad/s^2], with uplift
        (n-1, 6), separations last [m], [m/s], [m/s^2]. base: shape (3, 6): u_g1, u_g2, u_g3 [m], psi_1, theta_1, phi_1
        [rad], and their first and second derivatives; None: zero.
        Returns {"r_01", "r_1", "r_11", "r_1c", "r_12", ...} [m], rates of names with v for r [m/s] and with a [m/s^2],
        "omega_k" and "omega'_k" [rad/s], "alpha_k" and "alpha'_k" [rad/s^2], "t_k" (3, 3): rows t_1, t_2, t_3. In
        stacks of ten and more bodies an underscore separates the numbers of a pair, "r_1_2", since "r_12" is the centre
        of body 12. Components along E1, E2, E3. Raises InputError for wrong shapes and planar models.
        """
        if self.planar:
            raise InputError("kinematics: not available for a planar model; build it with dimension = 'spatial'")
        units = self._units("rad", "m"), self._units("rad/s", "m/s"), self._units("rad/s^2", "m/s^2")
        q, v, a = (vector(x, name, self._shape, unit) for x, name, unit in zip((q, v, a), "qva", units, strict=True))
        motion = vector(np.zeros((3, 6)) if base is None else base, "base", (3, 6), "m, rad")
        points, rotations, bases = self.stack(bearing).vectors(q, v, a, motion)
        return named_vectors(self.layout.n, points, rotations, bases)

    def as_ode(self, bearing: Bearing, motion: Motion, top: Top) -> Ode:
        """The model as y' = fun(t, y) with its Jacobian, for library integrators such as SciPy's; see `Ode`."""
        return Ode(self, bearing, motion, top)

    @property
    def _shape(self) -> tuple[int, int]:
        """Shape of coordinates and of their derivatives."""
        return self.layout.surfaces, 6 if self.effects.uplift else 3

    def _units(self, angle: str, separation: str) -> str:
        """Units of coordinates for messages."""
        return f"{angle}; separation along E1, E2, E3: {separation}" if self.effects.uplift else angle

    def _state(
        self,
        q: ArrayLike,
        v: ArrayLike,
        h: ArrayLike,
        acceleration: ArrayLike,
        rotation: RotationState | None,
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
            vector(q, "q", self._shape, self._units("rad", "m")),
            vector(v, "v", self._shape, self._units("rad/s", "m/s")),
            vector(h, "h", (count, 2), "-"),
            base,
            load,
        )
        return into_plane(state) if self.planar else state


def build_model(
    layout: Layout, effects: Effects | None = None, gradients: bool = False, *, progress: BuildProgress | None = None
) -> Model:
    """The compiled model of a layout: derived, emitted and compiled once, then imported from the cache.

    Parameters
    ----------
    layout, effects
        They determine the equations; `effects=None` means `Effects()`.
    gradients
        Whether runs of the model can compute derivatives with respect to parameters (docs/gradients.md).
    progress
        Called with the name of the current step of the build and the completed share, 0 to 1; None: no calls.

    Raises
    ------
    CompileError
        If there is no C compiler or it refuses the emitted sources.
    InputError
        If the cache cannot be written, or the effects have no gradients.

    """
    spec = ModelSpec(layout, Effects() if effects is None else effects, gradients)
    if (model := _models.get(spec)) is not None:  # read without the lock, which another thread may hold during a build
        return model
    global _build_seconds
    with _models_lock:
        if spec not in _models:
            begin = perf_counter()
            _models[spec] = Model(spec, *load(spec, progress))
            _build_seconds += perf_counter() - begin
        return _models[spec]


def working_time() -> float:
    """A clock [s] without the time in which this process built models, for limits of the wall time of runs."""
    return perf_counter() - _build_seconds
