"""One compiled run with one model: where it begins, what it watches, and how its frame lies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.choice import UNLOADED, Choice, answer_time, inertia_limit, quasistatic, resting_load
from msfp_gen.drive import plane_of
from msfp_gen.errors import InputError
from msfp_gen.history import Array
from msfp_gen.law_choice import heating_of, softening_of
from msfp_gen.packing import load_values, seated
from msfp_gen.piecewise import ORDER
from msfp_gen.plane import (
    motion_in_plane,
    out_of_plane,
    tilt_pieces,
    tilts_into_plane,
    turned_pairs,
    wrench_in_plane,
)

if TYPE_CHECKING:
    from msfp_gen.layout import Effects
    from msfp_gen.model import Model
    from msfp_gen.motion import Motion
    from msfp_gen.scene import Scene

NOTED_HEAT = 0.05  # change of friction by heat that is worth a note, where no numbers say what heat does


@dataclass(frozen=True, eq=False)
class Begin:
    """A state from which a run goes on with another model: what `Run.state` gives, and where it was.

    q, v, f as the model before had them, `azimuth` of its frame [rad]; force (n-1, 3) through its surfaces [N].
    """

    time: float
    azimuth: float
    planar: bool
    q: Array
    v: Array
    f: Array
    force: Array
    origin: Array
    guard_heat: Array
    heat: Array | None = None

    @classmethod
    def of(cls, model: Model, run: Any, azimuth: float) -> Begin:
        """Where `run` stands now, which is recorded."""
        run.record_now()
        state = run.state
        force = model.unpack(run.rows[-1:])["force"][0]
        return cls(run.time, azimuth, model.planar, force=force, **state)


@dataclass(frozen=True, eq=False)
class Frame:
    """The drives of a scene in the frame of a model."""

    azimuth: float
    motion: Motion
    wrench: Array
    rotation: Array | None

    @classmethod
    def of(cls, scene: Scene, model: Model, wrench: Array) -> Frame:
        """A planar model's E1 lies in the vertical plane of the scene."""
        turns = None if scene.top_rotation is None else scene.top_rotation.coefficients
        azimuth = plane_of(scene)[0] if model.planar else 0.0
        if not azimuth:
            return cls(0.0, scene.motion, wrench, turns)
        tilted = None if turns is None else tilt_pieces(turns, azimuth)
        return cls(azimuth, motion_in_plane(scene.motion, azimuth), wrench_in_plane(wrench, azimuth), tilted)


def begin_run(
    scene: Scene, model: Model, choice: Choice, end: float, at: Begin | None, stops: tuple[str, ...]
) -> tuple[Any, float]:
    """A compiled run, and the azimuth of its frame. stops: the watches at which it stops; the others take notes."""
    solver, stop = scene.solver, scene.stop
    load_knots, wrench = _wrench(scene)
    frame = Frame.of(scene, model, wrench)
    q, v, f = _first(scene, model, frame.azimuth) if at is None else _taken_over(scene, model, frame.azimuth, at)
    stack = model.stack(scene.bearing, scene.top, anchor=frame.motion.displacement(0.0)[:2])
    limits = (solver.max_step, scene.motion.max_step, _resolved(scene))
    jumps = scene.motion.jumps if scene.load is None else np.union1d(scene.motion.jumps, scene.load.jumps)
    more: dict[str, Any] = {}
    if frame.rotation is not None and scene.top_rotation is not None:
        more["support_knots"], more["support_coefficients"] = _support(scene, frame.rotation)
    if at is not None:
        turns = at.planar and not model.planar
        origin = out_of_plane(at.origin, at.azimuth, "vector") if turns else at.origin
        more |= {"origin": np.ascontiguousarray(origin), "guard_heat": at.guard_heat, "start_time": at.time}
        if at.heat is not None and model.effects.law is not None and model.effects.law.heats:
            more["heat"] = at.heat
    run = model.extension.Run(
        stack,
        np.array(frame.motion.knots, dtype=float),
        np.array(frame.motion.coefficients, dtype=float),
        load_knots,
        frame.wrench,
        np.array(jumps, dtype=float),
        q,
        v,
        f,
        method=solver.method,
        rtol=solver.rtol,
        atol_angle=solver.angle_tolerance,
        max_step=min((s for s in limits if s is not None), default=0.0),
        first_step=(solver.first_step or 0.0) if at is None else 0.0,
        max_steps=float(solver.max_steps),
        duration=end,
        output_step=scene.output_step or 0.0,
        stop_displacement=(stop.displacement or 0.0) if stop else 0.0,
        stop_all_rims=bool(stop and stop.all_rims),
        stop_at_knots=_sampled(scene.motion),
        quasistatic=quasistatic(scene, model.effects),
        stop_at_loads=scene.load is not None and not np.any(scene.load.coefficients[:, :, 2:]),
        **_watches(scene, model.effects, choice, stops),
        **more,
    )
    return run, frame.azimuth


def _wrench(scene: Scene) -> tuple[Array, Array]:
    """Knots and pieces of what acts on the top plate: what the top applies, and the load."""
    knots, pieces = np.array([0.0, max(scene.end, 1.0)]), np.zeros((1, 6, ORDER))
    if scene.load is not None:
        whole = scene.load.until(scene.end)
        knots, pieces = np.array(whole.knots), np.array(whole.coefficients)
    pieces[:, :, 0] += load_values(scene.top)
    return knots, pieces


def _support(scene: Scene, coefficients: Array) -> tuple[Array, Array]:
    """Knots and pieces (k, 6, 6) of psi, theta of what holds the top plate."""
    assert scene.top_rotation is not None
    from dataclasses import replace

    whole = replace(scene.top_rotation, coefficients=coefficients).until(scene.end)
    pieces = np.zeros((len(whole.knots) - 1, 6, ORDER))
    pieces[:, :2] = whole.coefficients
    return np.array(whole.knots), pieces


def _resolved(scene: Scene) -> float | None:
    """Longest step that sees every sample of a load or a rotation [s]."""
    histories = (scene.load, scene.top_rotation)
    steps = [np.median(np.diff(each.knots)) for each in histories if each is not None and len(each.knots) > 2]
    return 2 * float(min(steps)) if steps else None


def _sampled(motion: Motion) -> bool:
    """Whether every knot is a sample, where the acceleration has a kink; a sine has many knots to a longest step."""
    return motion.max_step is not None and motion.max_step <= 2.001 * float(np.median(np.diff(motion.knots)))


def _first(scene: Scene, model: Model, azimuth: float) -> tuple[Array, Array, Array]:
    """The initial state of a scene."""
    count, state = scene.bearing.layout.surfaces, scene.initial_state
    q, v, f = (
        np.zeros((count, k)) if state is None else np.array(value, dtype=float)
        for k, value in zip((3, 3, 2), (None,) * 3 if state is None else (state.q, state.v, state.h), strict=True)
    )
    if model.planar:
        q, v, f = _flattened(q, v, f, azimuth)
    if model.effects.uplift:
        pressing = 0.0 if scene.load is None else -float(scene.load.evaluate(0.0)[2])
        q = np.hstack([q, seated(scene.bearing, scene.top, pressing)])
        v = np.hstack([v, np.zeros((count, 3))])
    return q, v, f


def _flattened(q: Array, v: Array, f: Array, azimuth: float) -> tuple[Array, Array, Array]:
    q, v = (tilts_into_plane(x, azimuth, f"initial_state.{name}") for x, name in ((q, "q"), (v, "v")))
    f = np.ascontiguousarray(turned_pairs(f, azimuth))
    if np.any(np.abs(f[:, 1]) > 1e-12):
        raise InputError("initial_state.h leaves the vertical plane of the motion: use dimension = 'spatial'")
    return q, v, f


def _taken_over(scene: Scene, model: Model, azimuth: float, at: Begin) -> tuple[Array, Array, Array]:
    """The state of the model before, as this one has it: angles, friction and rates as they are; where bodies could not
    part before, seats closed by the forces that pass (docs/effects.md).
    """
    q, v, f, force = at.q, at.v, at.f, at.force
    apart = (q[:, 3:], v[:, 3:]) if q.shape[1] > 3 else None
    q, v = q[:, :3], v[:, :3]
    if at.planar and not model.planar:
        q, v = (out_of_plane(x, at.azimuth, "angles") for x in (q, v))
        f = out_of_plane(f, at.azimuth, "pair")
        force = out_of_plane(force, at.azimuth, "vector")
        apart = None if apart is None else tuple(out_of_plane(x, at.azimuth, "vector") for x in apart)  # type: ignore[assignment]
    if model.effects.uplift:
        stiffness = np.array([surface.seat_stiffness for surface in scene.bearing.surfaces])
        d, d1 = (-force / stiffness[:, None], np.zeros_like(force)) if apart is None else apart
        q, v = np.hstack([q, d]), np.hstack([v, d1])
    return np.ascontiguousarray(q), np.ascontiguousarray(v), np.ascontiguousarray(f)


def _rise(scene: Scene, effects: Effects, choice: Choice) -> float:
    """Rise in temperature that matters [K]: by the surfaces' own numbers, else by those of Kumar et al. (2015)."""
    softening = softening_of(effects.law, scene.bearing)
    change = choice.error if effects.friction == "pv" else NOTED_HEAT
    return change / softening if softening > 0 else 0.0


def _watches(scene: Scene, effects: Effects, choice: Choice, stops: tuple[str, ...]) -> dict[str, Any]:
    """What a run watches, by the names and limits of the compiled module: all that its model leaves out."""
    heats = effects.law is not None and effects.law.heats
    left_out = {
        "rims": not effects.rims,
        "uplift": "uplift" in stops and not effects.uplift,
        "inertia": effects.sliders == "massless",
        "heat": not heats,
    }
    return {
        "guards": tuple(name for name, out in left_out.items() if out),
        "guard_stop": tuple(stops),
        "guard_normal": UNLOADED * resting_load(scene),
        "guard_inertia": inertia_limit(scene, choice.error),
        "guard_time": answer_time(scene),
        "guard_rise": _rise(scene, effects, choice),
        "guard_heating": np.array(heating_of(scene.bearing)),
    }
