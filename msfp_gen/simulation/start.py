"""The start of a segment, computed by one model: state, frame and monitors of the compiled run.

The first begins with the initial state of the scene, another with the `RestartState` of the one before it. Where plates
are tilted at the start, the initial state is reached by a bearing in level position that is tilted slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.later import kept
from msfp_gen.model.compiled import CompiledBearingRun, Port, bodies_and_surfaces, separations_at_rest, top_values
from msfp_gen.model.model import Model, stack_values
from msfp_gen.model.plane import (
    motion_in_plane,
    out_of_plane,
    rotated_pairs,
    tilt_pieces,
    tilts_into_plane,
    tilts_out_of_plane,
    wrench_in_plane,
)
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.piecewise import ORDER, derivatives
from msfp_gen.motions.prescribed import Load, Rotation
from msfp_gen.motions.time_grid import TimeGrid, snapped
from msfp_gen.results.geometry import rim_forces
from msfp_gen.results.gradients import Gradients
from msfp_gen.results.history import History
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.effect_selection import EffectSelection, quasistatic
from msfp_gen.scene.effect_switching import monitor_options
from msfp_gen.scene.parameters import Parameter
from msfp_gen.scene.planarity import scene_plane
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import InitialState
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.standing import seat_stiffness
from msfp_gen.scene.top import Top, load_values, sprung_mass
from msfp_gen.simulation import seats
from msfp_gen.specification.friction_laws import SPIN, Law
from msfp_gen.specification.layout import Auto, ModelSpec


@dataclass(frozen=True, eq=False)
class RestartState:
    """The state in which a segment ended, from which the next one starts with another model.

    time [s]. azimuth: of the frame of the earlier model [rad]. planar: whether it was planar. q, v, f: its angles and
    separations, their rates, and its friction state. foot: height of the foot of the supported mass and its rate, shape
    (2,) [m], [m/s]. force: interface forces, shape (n-1, 3) [N]; rim_force: size of the rim forces, shape (n-1,) [N].
    base_angles: shape (3,) [rad]. origin: displacement across the bearing at the start, shape (3,) [m]. monitor_heat:
    parts of the temperature rise that the monitor of heat follows, shape (n-1, 14) [K]. memory: parts of what the
    surfaces remember for the friction law, shape (n-1, parts). All but azimuth and planar come from a snapshot.
    """

    time: float
    azimuth: float
    planar: bool
    q: Array
    v: Array
    f: Array
    foot: Array
    force: Array
    rim_force: Array
    base_angles: Array
    origin: Array
    monitor_heat: Array
    memory: Array | None = None

    @classmethod
    def of(cls, model: Model, run: CompiledBearingRun, azimuth: float) -> RestartState:
        """The current state of `run`; a row of it is recorded."""
        run.record_now()
        return cls(azimuth=azimuth, planar=model.planar, **model.extension.read_state(run.snapshot(rows=1)))

    @classmethod
    def of_port(cls, port: Port) -> RestartState:
        """The committed state of a two-port, whose ends move in space."""
        return cls(azimuth=0.0, planar=False, **port.state())

    def memory_of(self, law: Law | None) -> Array | None:
        """Parts of what the surfaces remember for a law, shape (n-1, parts) [SI]; None where it needs none.

        A law of temperature takes the temperatures of the monitor of heat where the earlier model had no temperatures.
        """
        if law is None or law.memory is None:
            return None
        return self.monitor_heat if self.memory is None and law.depends_on_temperature else self.memory

    def contact_force(self, bearing: Bearing) -> Array:
        """Interface forces without the forces of the rims, shape (n-1, 3) [N]."""
        angles = np.vstack([self.base_angles, self.q[:, :3]])
        force: Array = self.force - rim_forces(bearing, angles[None], self.rim_force[None])[0]
        return force


def transferred_state(bearing: Bearing, top: Top, model: Model, at: RestartState) -> tuple[Array, Array, Array]:
    """The state q, v, f of the earlier model for the next one (docs/effects.md).

    Shapes (n-1, 3), (n-1, 3), or 6 in place of 3 with separations, and (n-1, 2) [rad], [m], [rad/s], [m/s].

    Angles, rates and friction states describe the same stack. Where the earlier model had no separations, they follow
    from the interface forces without the forces of the rims: the unilateral contacts are compressed by them.
    """
    q, v, f, force = at.q, at.v, at.f, at.contact_force(bearing)
    separations = (q[:, 3:], v[:, 3:]) if q.shape[1] > 3 else None
    q, v = q[:, :3], v[:, :3]
    if at.planar and not model.planar:
        # Not E1-E3 nor E2-E3, whose tilts are theta or psi alone: to order tilt squared only, plates would jump against
        # stiff springs.
        if min(abs(at.azimuth), abs(at.azimuth - np.pi / 2)) > 1e-9:
            q, v, twist = tilts_out_of_plane(q, v, at.azimuth)
            f = np.concatenate([rotated_pairs(pair[None], t - at.azimuth) for pair, t in zip(f, twist, strict=True)])
        else:
            q, v = (out_of_plane(x, at.azimuth, "angles") for x in (q, v))
            f = out_of_plane(f, at.azimuth, "pair")
        force = out_of_plane(force, at.azimuth, "vector")
        if separations is not None:
            separations = (
                out_of_plane(separations[0], at.azimuth, "vector"),
                out_of_plane(separations[1], at.azimuth, "vector"),
            )
    if model.effects.uplift:
        if separations is None:
            separations = (-force / seat_stiffness(bearing, top)[:, None], np.zeros_like(force))
        q, v = np.hstack([q, separations[0]]), np.hstack([v, separations[1]])
    return np.ascontiguousarray(q), np.ascontiguousarray(v), np.ascontiguousarray(f)


def transferred_heights(
    bearing: Bearing, top: Top, model: Model, at: RestartState, added_load: float = 0.0
) -> tuple[Array, Array]:
    """Origin, shape (3,) [m], and foot, shape (2,) [m], [m/s], of the earlier model for the next: see `RestartState`.

    Separations that the earlier model did not have lower the top plate at rest and change the length of a spring below
    a mass, whose compliance they take over: the next model goes on as if it had been there from the start. added_load:
    at the start; see `separations_at_rest`.
    """
    if at.q.shape[1] > 3 or not model.effects.uplift:
        return at.origin, at.foot
    lowered = separations_at_rest(bearing, top, added_load)[:, 2].sum()
    below_mass = sprung_mass(top) * bearing.gravity * (1.0 / seat_stiffness(bearing, top)).sum()
    return at.origin - np.array([0.0, 0.0, lowered]), at.foot + np.array([lowered + below_mass, 0.0])


@dataclass(frozen=True, eq=False)
class Frame:
    """Base motion, load and top rotation of a scene in the frame of a model.

    azimuth: of the E1 axis of the frame [rad]. load_knots: times between the polynomials of the wrench, shape (k+1,)
    [s]. wrench, rotation: coefficients of polynomials, shape (k, channels, 6).
    """

    azimuth: float
    motion: Motion
    load_knots: Array
    wrench: Array
    rotation: Array | None

    @classmethod
    def of(cls, scene: Scene, model: Model | ModelSpec) -> Frame:
        """The frame of a model: E1 of a planar model lies in the vertical plane of the scene."""
        knots, wrench = wrench_pieces(scene)
        rotation = None if scene.top_rotation is None else scene.top_rotation.coefficients
        azimuth = scene_plane(scene)[0] if model.planar else 0.0
        if not azimuth:
            return cls(0.0, scene.motion, knots, wrench, rotation)
        planar_rotation = None if rotation is None else tilt_pieces(rotation, azimuth)
        motion, wrench = kept(scene.motion, motion_in_plane, azimuth), wrench_in_plane(wrench, azimuth)
        return cls(azimuth, motion, knots, wrench, planar_rotation)


class RunArguments(NamedTuple):
    """Arguments of a compiled run: of its stack, its arrays by position, and by name."""

    stack: tuple[Any, ...]
    arrays: tuple[Any, ...]
    options: dict[str, Any]


def start_compiled_run(
    scene: Scene, model: Model, selection: EffectSelection, end: float, at: RestartState | None, stops: tuple[str, ...]
) -> tuple[CompiledBearingRun, float]:
    """A compiled run before its first step, and the azimuth of its frame [rad].

    end: time at which the run ends [s]. at: state of the segment before; None: the initial state of the scene. stops:
    the monitors that stop the run; the others only write notes.
    """
    frame = Frame.of(scene, model)
    if at is None:
        state = _initial_state(scene, model, frame)
    else:
        state = transferred_state(scene.bearing, scene.top, model, at)
    options = monitor_options(scene, model.effects, selection, stops)
    if at is not None:
        becomes_spatial = at.planar and not model.planar
        origin, options["foot"] = transferred_heights(scene.bearing, scene.top, model, at, first_load(scene))
        origin = out_of_plane(origin, at.azimuth, "vector") if becomes_spatial else origin
        options |= {"origin": np.ascontiguousarray(origin), "monitor_heat": at.monitor_heat, "start_time": at.time}
        options["first_step"] = 0.0
        if (memory := at.memory_of(model.effects.law)) is not None:
            options["memory"] = memory
    arguments = run_arguments(scene, model.spec, frame, state, end)
    run: CompiledBearingRun = model.extension.Run(
        model.extension.Stack(*arguments.stack), *arguments.arrays, **arguments.options | options
    )
    return run, frame.azimuth


def first_arguments(scene: Scene, spec: ModelSpec) -> tuple[RunArguments, float]:
    """The arguments with which a model without uplift starts, and the azimuth of its frame [rad]; nothing is built."""
    frame = Frame.of(scene, spec)
    arguments = run_arguments(scene, spec, frame, given_state(scene, spec, frame), scene.end)
    monitors = monitor_options(scene, spec.effects, scene.effect_selection, ())
    return arguments._replace(options=arguments.options | monitors), frame.azimuth


def run_arguments(
    scene: Scene, spec: ModelSpec, frame: Frame, state: tuple[Array, Array, Array], end: float
) -> RunArguments:
    """The arguments of a compiled run from a state, without monitors. end: see `start_compiled_run`."""
    solver, stop, grid = scene.solver, scene.stop, time_grid(scene)
    arrays = (
        *kept(frame.motion, _snapped, grid),
        *snapped(frame.load_knots, frame.wrench, grid.stops),
        grid.jumps,
        *state,
    )
    options: dict[str, Any] = {
        "method": solver.method,
        "rtol": solver.rtol,
        "atol_angle": solver.angle_tolerance,
        "stops": grid.stops,
        "span_ends": grid.ends,
        "span_steps": grid.steps,
        "first_step": solver.first_step or 0.0,
        "max_steps": float(solver.max_steps),
        "duration": end,
        "output_step": scene.output_step or 0.0,
        "stop_displacement": (stop.displacement or 0.0) if stop else 0.0,
        "stop_all_rims": bool(stop and stop.all_rims),
        "sampled": scene.motion.sampled,
        "quasistatic": quasistatic(scene, spec.effects),
    }
    if frame.rotation is not None and scene.top_rotation is not None:
        support = snapped(*_support_rotation(scene, frame.rotation), grid.stops)
        options["support_knots"], options["support_coefficients"] = support
    return RunArguments(stack_values(spec, scene.bearing, scene.top, frame.motion.start[:2]), arrays, options)


def wrench_pieces(scene: Scene) -> tuple[Array, Array]:
    """Knots, shape (k+1,) [s], and polynomials, (k, 6, 6), of force and moment on the top plate [N], [N m].

    They are the loads of the top and of the load history.
    """
    knots, pieces = np.array([0.0, max(scene.end, 1.0)]), np.zeros((1, 6, ORDER))
    if scene.load is not None:
        load = scene.load.until(scene.end)
        knots, pieces = np.array(load.knots), np.array(load.coefficients)
    pieces[:, :, 0] += load_values(scene.top)
    return knots, pieces


def _support_rotation(scene: Scene, coefficients: Array) -> tuple[Array, Array]:
    """Knots and polynomials, shape (k, 6, 6), of psi, theta of the support of the top plate."""
    assert scene.top_rotation is not None
    rotation = replace(scene.top_rotation, coefficients=coefficients).until(scene.end)
    pieces = np.zeros((len(rotation.knots) - 1, 6, ORDER))
    pieces[:, :2] = rotation.coefficients
    return np.array(rotation.knots), pieces


def time_grid(scene: Scene) -> TimeGrid:
    """Times at which steps of a run of `scene` must end, and limits of the step."""
    return kept(scene.motion, _time_grid, scene.load, scene.top_rotation, scene.end, scene.solver.max_step)


def _time_grid(
    motion: Motion, load: Load | None, rotation: Rotation | None, end: float, max_step: float | None
) -> TimeGrid:
    histories = [history for history in (motion, load, rotation) if history is not None]
    return TimeGrid.of_histories(histories, end, (max_step, motion.max_step))


def _snapped(motion: Motion, grid: TimeGrid) -> tuple[Array, Array]:
    return snapped(motion.knots, motion.coefficients, grid.stops)


def _initial_state(scene: Scene, model: Model, frame: Frame) -> tuple[Array, Array, Array]:
    """The initial state q, v, f of a scene in the frame of a model."""
    q, v, f = given_state(scene, model, frame)
    if model.effects.uplift:
        q = np.hstack([q, seats.separations(model, seats_at_start(scene, model, frame, (q, v, f)))])
        v = np.hstack([v, np.zeros_like(v)])
    return q, v, f


def seats_at_start(scene: Scene, model: Model, frame: Frame, state: tuple[Array, Array, Array]) -> seats.Start:
    """What the separations at the start depend on; state: q, v, f in the frame of the model."""
    support = np.zeros((2, 6))
    if frame.rotation is not None:
        support[:, :2] = values_at_start(_support_rotation(scene, frame.rotation)[1])[:2, :2]
    return seats.Start(
        scene.bearing.gravity,
        *bodies_and_surfaces(scene.bearing, model.effects, scene.top),
        top_values(scene.top, anchor=frame.motion.start[:2]),
        *state,
        base=values_at_start(frame.motion.coefficients),
        load=frame.wrench[0, :, 0].copy(),
        support=support.ravel(),
    )


def values_at_start(coefficients: Array) -> Array:
    """Values and two derivatives at time zero of the first of some polynomials, shape (3, channels) [SI]."""
    return np.ascontiguousarray(derivatives(0.0) @ coefficients[0].T)


def given_state(scene: Scene, model: Model | ModelSpec, frame: Frame) -> tuple[Array, Array, Array]:
    """Angles, rates and friction state at the start, without separations, shape (n-1, k) each [rad], [rad/s], [-]."""
    count, state = scene.bearing.layout.surfaces, scene.initial_state
    q, v, f = (
        np.zeros((count, k)) if state is None else np.array(value, dtype=float)
        for k, value in zip((3, 3, 2), (None,) * 3 if state is None else (state.q, state.v, state.h), strict=True)
    )
    if model.planar:
        q, v, f = state_in_plane(q, v, f, frame.azimuth)
    return q, v, f


def first_load(scene: Scene) -> float:
    """Load at the start beside the load of the top, downward positive [N]."""
    return 0.0 if scene.load is None else -float(scene.load.evaluate(0.0)[2])


def state_in_plane(q: Array, v: Array, f: Array, azimuth: float) -> tuple[Array, Array, Array]:
    """An initial state, shapes (n-1, 3), (n-1, 3), (n-1, 2) [rad], [rad/s], [1], in the frame of a planar model.

    Raises InputError where it leaves the plane.
    """
    q, v = (tilts_into_plane(x, azimuth, f"initial_state.{name}") for x, name in ((q, "q"), (v, "v")))
    f = np.ascontiguousarray(rotated_pairs(f, azimuth))
    if np.any(np.abs(f[:, 1]) > 1e-12):
        raise InputError("initial_state.h leaves the vertical plane of the motion: use dimension = 'spatial'")
    return q, v, f


TILTING, RESTING = 10.0, 2.0  # duration of the tilting of the plates, and of the rest after it [s]


def needs_settling(scene: Scene) -> bool:
    """Whether base or support of the top are tilted at the start, and no initial state is given."""
    base = np.any(scene.motion.start[3:5])
    support = scene.top_rotation is not None and np.any(scene.top_rotation.evaluate(0.0))
    return scene.initial_state is None and bool(base or support)


def settling_scene(scene: Scene) -> Scene:
    """The run before a run: the plates are tilted from level to their rotation at time zero, under the load at zero."""
    psi, theta = (float(x) for x in scene.motion.start[3:5])
    position = np.zeros((1, 6, ORDER))
    position[0, :3, 0] = scene.motion.start[:3]
    motion = Motion(np.array([0.0, TILTING + RESTING]), position).rocking(Rotation.ramp(psi, theta, duration=TILTING))
    rotation = scene.top_rotation
    if rotation is not None:
        rotation = Rotation.ramp(*(float(x) for x in rotation.evaluate(0.0)), duration=TILTING)
    load = None if scene.load is None else Load.constant(*np.split(scene.load.evaluate(0.0), 2))
    return replace(
        scene,
        motion=motion,
        motion_table=None,
        top_rotation=rotation,
        load=load,
        duration=None,
        stop=None,
        output_step=None,
        effects=_settling_effects(scene),
        solver=Solver(rtol=min(1e-4, scene.solver.rtol)),
    )


def _settling_effects(scene: Scene) -> Auto:
    """Rims and friction law as given in the scene; the other effects are selected for the slow tilting."""
    effects = scene.effects
    spin = effects.spin if SPIN[effects.spin].moment else "locked"
    return Auto(
        rims=effects.rims,
        spin=spin,
        bouc_wen=effects.bouc_wen,
        friction=effects.friction,
        friction_law=effects.friction_law,
    )


def moves_settling(parameter: Parameter, settling: Scene) -> bool:
    """Whether the state after settling may depend on a parameter.

    Not on how the base moves afterwards, nor on contacts that the slow tilting does not model.
    """
    if parameter.field.startswith("seat_"):
        return settling.effect_selection.effects.uplift
    return parameter.part != "motion"


def start_slopes(history: History, gradients: Gradients | None, parameters: Sequence[Parameter]) -> tuple[Array, Array]:
    """The derivatives of the state in which settling ended, by k parameters; zero by those that do not move it.

    Of the angles, shape (k, n-1, 3) [rad per unit of the parameter], and of the friction state, shape (k, n-1, 2) [per
    unit of the parameter].
    """
    surfaces = history.tilt_angles.shape[1]
    dq, dh = np.zeros((len(parameters), surfaces, 3)), np.zeros((len(parameters), surfaces, 2))
    if gradients is None:
        return dq, dh
    known = {parameter.path for parameter in gradients.parameters}
    moving = [parameter.path in known for parameter in parameters]
    dq[moving] = gradients.arrays["tilt_angles"][:, -1]
    h, slope = history.friction_state[-1], gradients.arrays["friction_state"][:, -1]
    size = np.linalg.norm(h, axis=1, keepdims=True)
    along = (h * slope).sum(axis=2, keepdims=True) / np.maximum(1.0, size**2)
    # `state_at_rest` limits the size of h to 1.
    dh[moving] = np.where(size > 1.0, (slope - h * along) / np.maximum(1.0, size), slope)
    return dq, dh


def state_at_rest(q: Array, h: Array) -> InitialState:
    """Initial state with angles q, shape (n-1, 3) [rad], friction state h, shape (n-1, 2), and zero rates."""
    norm = np.maximum(1.0, np.linalg.norm(h, axis=1, keepdims=True))
    return InitialState(q.tolist(), np.zeros_like(q).tolist(), (h / norm).tolist())
