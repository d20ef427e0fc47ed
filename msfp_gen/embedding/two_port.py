"""`TwoPort`: a bearing whose ends both move as another program says (docs/embedding.md)."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.fields import require_type
from msfp_gen.model.compiled import bodies_and_surfaces, separations_at_rest, top_values, vector
from msfp_gen.model.model import Model, build_model
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Rotation
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.friction_parameters import select_friction
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import NodeTop, RigTop
from msfp_gen.specification.contract import STATUSES, WORKS, names
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Port

DISSIPATED = ("friction_dissipated", "contact_dissipated", "rim_dissipated", "seat_dissipated")


@dataclass(frozen=True, eq=False)
class Response:
    """Wrenches of a two-port at the end of a trial; rows are the lower and the upper end.

    time: of the end of the trial [s]. wrench: force along E1, E2, E3 and moment about the present position of the end,
    which each end exerts on the bearing: ndarray, shape (2, 6), [N], [N m].
    """

    time: float
    wrench: Array
    _row: Array
    _port: TwoPort
    _number: int

    @property
    def sliding(self) -> Array:
        """Sliding displacements (3.20), shape (n-1,) [m]."""
        return self._values["sliding"]

    @property
    def normal_force(self) -> Array:
        """Normal forces, shape (n-1,) [N]."""
        return self._values["normal"]

    @property
    def dissipated(self) -> float:
        """Energy dissipated in the bearing since the start [J]."""
        works = dict(zip(names(WORKS), self._values["work"], strict=True))
        return sum(float(works[name]) for name in DISSIPATED)

    @cached_property
    def _values(self) -> dict[str, Array]:
        return self._port.unpacked(self._row)

    @cached_property
    def tangent(self) -> Array:
        """Derivatives of the 12 numbers of `wrench` with respect to displacements and rotation vectors of both ends.

        ndarray, shape (12, 12), [N/m], [N/rad], [N m/m], [N m/rad], at given rates and accelerations of the ends; it
        is consistent with the steps of the trial. Like `damping` and `inertia` it is computed when it is first read, as
        long as the trial is the latest one, before `commit` and `revert`. Raises InputError afterwards, RunError.
        """
        return self._port.derivative(self._number, "tangent", (1.0, 0.0, 0.0))

    @cached_property
    def damping(self) -> Array:
        """Derivatives of `wrench` with respect to the rates of both ends, shape (12, 12) [SI], as `tangent`."""
        return self._port.derivative(self._number, "damping", (0.0, 1.0, 0.0))

    @cached_property
    def inertia(self) -> Array:
        """Derivatives of `wrench` with respect to the accelerations of both ends, shape (12, 12) [SI], as `tangent`."""
        return self._port.derivative(self._number, "inertia", (0.0, 0.0, 1.0))

    def effective_stiffness(self, rate: float, acceleration: float) -> Array:
        """`tangent` + `rate` * `damping` + `acceleration` * `inertia`, shape (12, 12), at a third of the cost.

        It is the matrix of an iteration of an implicit method whose rates [1/s] and accelerations [1/s^2] change with
        the displacements by these factors: gamma/(beta h) and 1/(beta h^2) of Newmark's method. Errors as `tangent`.
        """
        for name, factor in (("rate", rate), ("acceleration", acceleration)):
            if not isfinite(factor):
                raise InputError(f"{name} = {factor!r}: give a finite number")
        return self._port.derivative(self._number, "effective_stiffness", (1.0, float(rate), float(acceleration)))


MAGIC = b"msfp-gen two-port 1\n"
LARGEST_ROTATION = 1.5  # of an end [rad]: a run ends at this tilt, next to the singularity of the Euler angles
SHORTEST = 1e-8  # time of a trial [s], or its share of the time: a shorter one holds no step
REST = (np.array([0.0, 1.0]), np.zeros((1, 6, 6)))  # knots and coefficients of a base at rest
_FAILURES = {status.name: status for status in STATUSES}


class TwoPort:
    """A bearing between two moving ends: it takes the motions of both ends and gives the wrenches on them.

    The lower end holds the base. The upper end holds the far side of the interface, the springs and dampers of
    `Top.node` on the top plate; it is at r_nn at the start. `trial` integrates the bearing from the committed state,
    with steps of its own; `commit` accepts the trial. The wrenches are a function of committed state and trial alone,
    bit by bit. One two-port is for one thread at a time.

    Parameters
    ----------
    bearing
        The bearing; it starts centred and at rest, at time 0.
    interface
        `Top.node(...)`: stiffness and damping between top plate and upper end.
    axial_load
        Compression of the bearing while both ends are where they start [N]: the weight that it carries in the
        structure at rest. None: no load, which only a model with uplift permits.
    effects
        `Effects` of the model, spatial with locked spin; `top_rotation` is added. None: the default ones, with the
        friction law whose parameters the surfaces have.
    solver
        Tolerances and steps; an implicit method. `first_step` is the first step after the start, `max_steps` the
        limit of one trial.

    Raises
    ------
    InputError
        Parts of the wrong type, or inconsistent ones.
    CompileError
        If the model cannot be built.
    RunError
        If the bearing at rest has no state of equilibrium.

    """

    def __init__(
        self,
        bearing: Bearing,
        interface: NodeTop,
        axial_load: float | None = None,
        effects: Effects | None = None,
        solver: Solver | None = None,
    ) -> None:
        require_type(bearing, Bearing, "bearing")
        require_type(interface, NodeTop, "interface")
        self.bearing, self.interface = bearing, interface
        scene = scene_at_rest(bearing, interface, axial_load, effects, Solver() if solver is None else solver)
        self.axial_load = 0.0 if axial_load is None else axial_load
        self.model: Model = build_model(bearing.layout, scene.modelled)
        self._port: Port = compiled_port(scene, self.model, self.axial_load)
        self._identity = _identity(scene, self.model, self.axial_load)
        self._ends = np.zeros((2, 3, 6))
        self._trial: tuple[float, Array] | None = None
        self._number = 0  # of the latest trial
        self._check(self._port.status, 0.0)

    @classmethod
    def of_scene(cls, scene: Scene) -> Self:
        """The two-port of a scene with a rig, with its springs, dampers and axial load; the far ends of the springs
        move.

        The motion and the duration of the scene are not used. `Auto` effects suit any motion of the ends: spatial,
        inertial sliders, with rims. Raises InputError as the class, and where the top is no rig with horizontal,
        vertical and rotational stiffness, or the scene has parts that a two-port does not have.
        """
        require_type(scene, Scene, "scene")
        return cls(scene.bearing, *parts_of_rig(scene), scene.solver)

    @property
    def time(self) -> float:
        """Time of the committed state [s]."""
        return self._port.time

    @property
    def compiled(self) -> Port:
        """The compiled two-port, for other compiled code, which then takes its steps."""
        return self._port

    def trial(self, time: float, lower: ArrayLike, upper: ArrayLike) -> Response:
        """Integrate from the committed state to `time`, and return the wrenches there.

        time [s]: later than the committed time, or the same time with the committed motion of the ends. lower, upper:
        motion of the ends at `time`, each of shape (3, 6): displacements along E1, E2, E3 since the start [m] and
        rotation vector [rad]; their rates; their accelerations. Between the two times each of the six numbers (of the
        rotation: the angles psi, theta, phi (2.1)) follows the polynomial of degree five through both ends. Raises
        InputError; RunError where the bearing cannot follow: its committed state remains.
        """
        motions = {"lower": lower, "upper": upper}
        ends = np.stack([vector(motion, name, (3, 6), "m, rad") for name, motion in motions.items()])
        for name, end in zip(motions, ends, strict=True):
            if (turn := float(np.linalg.norm(end[0, 3:]))) > LARGEST_ROTATION:
                raise InputError(f"{name}[0, 3:]: a rotation of {turn:.4g}; give at most {LARGEST_ROTATION} [rad]")
        self._check_time(time, ends)
        self._trial = None
        self._number += 1
        self._check(self._port.trial(time, ends), time)
        self._trial = (float(time), ends)
        return Response(float(time), self._port.wrench, self._port.row, self, self._number)

    def commit(self) -> None:
        """Accept the latest trial as the state from which the next ones start. Raises InputError: there is none."""
        if self._trial is None:
            raise InputError("commit: no trial has succeeded since the last commit or revert; call trial first")
        self._port.commit()
        self._ends = self._trial[1]
        self.revert()

    def revert(self) -> None:
        """Return to the committed state."""
        self._port.revert()
        self._trial = None
        self._number += 1

    def snapshot(self) -> bytes:
        """The committed state as bytes, from which a two-port of the same values goes on bit by bit."""
        state = self._port.snapshot()
        return MAGIC + self._identity + hashlib.sha256(state).digest() + state

    def restore(self, snapshot: bytes) -> None:
        """Return to the committed state of a snapshot, of this or of another process.

        Raises InputError: the snapshot is damaged, or of a two-port with other values or of another build.
        """
        if not isinstance(snapshot, bytes) or not snapshot.startswith(MAGIC):
            raise InputError("snapshot: these are no bytes of TwoPort.snapshot(); give such bytes")
        rest = snapshot[len(MAGIC) :]
        identity, digest, state = rest[:32], rest[32:64], rest[64:]
        if identity != self._identity:
            raise InputError(
                "snapshot: it is of a two-port with other values or another build; make this one with the same "
                "bearing, interface, axial_load, effects and solver"
            )
        if hashlib.sha256(state).digest() != digest:
            raise InputError("snapshot: the bytes are damaged; give them as TwoPort.snapshot() returned them")
        self._port.restore(state)
        self._ends = np.frombuffer(state, count=36).reshape(2, 3, 6).copy()
        self.revert()

    def unpacked(self, row: Array) -> dict[str, Array]:
        """The values of a row by their names, shapes and units as in `Model.unpack`, for `Response`."""
        return self.model.unpack(row)

    def derivative(self, number: int, word: str, direction: tuple[float, float, float]) -> Array:
        """Derivatives of the wrenches of trial `number`, shape (12, 12) [SI], for its `Response`; word: their name."""
        if number != self._number or self._trial is None:
            raise InputError(f"{word}: this trial is not the latest; read it before the next trial, commit or revert")
        if self._trial[0] == self.time:
            raise InputError(f"{word}: no time has passed since the committed state; make a trial at a later time")
        status, derivative = self._port.derivative(np.array(direction))
        if status != "ok":
            where = f"two-port, {word} at t = {self._trial[0]:.6g} s"
            raise RunError(f"{where}: {_FAILURES[status].failure}", status=status)
        return derivative

    def _check_time(self, time: float, ends: Array) -> None:
        if not isinstance(time, int | float | np.floating) or not np.isfinite(time):
            raise InputError(f"time = {time!r}: give a finite number [s]")
        start = self.time
        if time == start and not np.array_equal(ends, self._ends):
            raise InputError(
                f"time = {time:.12g}: the committed state has this time, with its ends elsewhere; give a later one [s]"
            )
        if time != start and time - start < SHORTEST * max(1.0, abs(start)):
            raise InputError(f"time = {time:.12g}: the committed state is at {start:.12g}; give a later time [s]")

    def _check(self, status: tuple[str, int, float, float], end: float) -> None:
        name, surface, value, reached = status
        if name == "ok":
            return
        failure = _FAILURES[name]
        where = f", surface {surface}" if surface else ""
        where += f", {failure.quantity} = {value:.4g}" if surface and failure.quantity else ""
        reason = f"stopped at t = {reached:.6g} s of {end:.6g} s{where}: {failure.failure}"
        raise RunError(f"two-port: {reason}", status=name)


BEARING_STIFFNESS = 600.0  # vertical, of steel and liner, per newton of load [1/m] (docs/model.md)
USUAL_RATIO = 0.1  # of critical damping


def check_parts(scene: Scene) -> None:
    """Raise InputError where a scene has parts that a two-port has not."""
    for name in ("load", "top_rotation", "initial_state", "stop"):
        if getattr(scene, name) is not None:
            raise InputError(f"{name}: the ends of a two-port give motion and load; leave it out of the scene")


def parts_of_rig(scene: Scene) -> tuple[NodeTop, float, Effects]:
    """Interface, axial load and effects of the two-port of a scene; raises InputError as `TwoPort.of_scene`."""
    check_parts(scene)
    top = scene.top
    if not isinstance(top, RigTop):
        raise InputError(f"top.kind = {top.kind!r}: a two-port needs the interface of a rig; give kind = 'rig'")
    if not top.vertical_stiffness:
        stiffness = BEARING_STIFFNESS * top.axial_load
        damping = 2 * USUAL_RATIO * np.sqrt(stiffness * top.axial_load / scene.bearing.gravity)
        usual = f": vertical_stiffness = {stiffness:.2g}, vertical_damping = {damping:.2g}" if stiffness > 0 else ""
        raise InputError(
            "top.vertical_stiffness = 0: both ends of a two-port move vertically, and this rig leaves its height free; "
            "give the [top] of a scene file the spring of steel and liner, about 600 N/m per newton of load, with a "
            f"tenth of the critical damping{usual}"
        )
    interface = NodeTop(**{field.name: getattr(top, field.name) for field in fields(NodeTop)})
    effects = scene.effects
    if isinstance(effects, Auto):
        effects = effects.resolve(friction=scene.law[0])
    return interface, top.axial_load, effects


def scene_at_rest(
    bearing: Bearing, interface: NodeTop, axial_load: float | None, effects: Effects | None, solver: Solver
) -> Scene:
    """A scene of the bearing at rest between its ends, which makes all checks of a scene."""
    if effects is None:
        effects = Effects(friction=select_friction(bearing, None))
    require_type(effects, Effects, "effects")
    require_type(solver, Solver, "solver")
    if effects.dimension != "spatial":
        raise InputError("effects.dimension = 'planar': the ends of a two-port move in space; give 'spatial'")
    if effects.spin != "locked":
        raise InputError(f"effects.spin = {effects.spin!r}: the interface transmits no torsion; give 'locked'")
    if solver.method == "dopri5":
        raise InputError("solver.method = 'dopri5': the steps of a two-port are implicit; give 'implicit' or 'esdirk4'")
    if axial_load is None and not effects.uplift:
        raise InputError(
            "axial_load = None: without load the surfaces transmit nothing; give the weight on the bearing at rest "
            "[N], or effects with uplift"
        )
    restraint = {field.name: getattr(interface, field.name) for field in fields(interface)}
    top = RigTop(axial_load=0.0 if axial_load is None else axial_load, **restraint)
    rotation = Rotation.of(REST[0], REST[1][:, :2])
    effects = replace(effects, top_rotation=True)
    return Scene(bearing, Motion(*REST), top, effects=effects, solver=solver, top_rotation=rotation)


def compiled_port(scene: Scene, model: Model, axial_load: float, **monitors: Any) -> Port:
    """The compiled two-port of such a scene; monitors: see `monitor_options`, for steps by stages."""
    count = scene.bearing.layout.surfaces
    q = np.zeros((count, 3))
    if model.effects.uplift:
        q = np.hstack([q, separations_at_rest(scene.bearing, scene.top)])
    solver = scene.solver
    port: Port = model.extension.Port(
        model.stack(scene.bearing, scene.top),
        axial_load,
        q,
        method=solver.method,
        rtol=solver.rtol,
        atol_angle=solver.angle_tolerance,
        max_step=solver.max_step or 0.0,
        first_step=solver.first_step or 0.0,
        max_steps=float(solver.max_steps),
        **monitors,
    )
    return port


def _identity(scene: Scene, model: Model, axial_load: float) -> bytes:
    """Digest of everything that determines the wrenches beside the motion of the ends."""
    values = bodies_and_surfaces(scene.bearing, model.effects, scene.top)
    arrays = (*values, top_values(scene.top), np.array([axial_load]))
    digest = hashlib.sha256(f"{model.info.key} {scene.bearing.gravity!r} {scene.solver!r}".encode())
    for array in arrays:
        digest.update(array.tobytes())
    return digest.digest()
