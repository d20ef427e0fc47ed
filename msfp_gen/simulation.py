"""Simulate: a scene in, a result out. The loop runs in compiled C; this packs what goes in and names what comes out."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.build import build_model
from msfp_gen.checkpoint import EVERY, Checkpoint, Identity
from msfp_gen.errors import InputError, RunError
from msfp_gen.history import Array, Counters, Event, History
from msfp_gen.packing import load_values, seated
from msfp_gen.plane import out_of_plane, tilts_into_plane, turned, turned_pairs
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.model import Model
    from msfp_gen.motion import Motion
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene

Progress = Callable[[float, float], None]
CHUNK = 4000  # steps between two looks at Ctrl-C and at the progress

EVENT_KINDS = ("rim_contact", "rim_release", "stop", "lift_off", "landing")
FAILURES = {
    "newton": "Newton's method did not converge at the smallest step: the bearing may have jammed (docs/model.md); "
    "lower the friction or the motion",
    "step": "the error control asks for a step below the smallest; loosen solver.rtol or check the motion for spikes",
    "irregular": "the equations lost regularity (the determinant changed sign): "
    "friction is too high for a unique motion here",
    "uplift": "the interface would have to pull; uplift is not modelled: increase the axial load or reduce the motion",
    "angle": "a tilt nears 90 degrees, where the Euler angles are singular; check the capacity and the rims",
    "steps": "the allowed number of steps is used up; raise solver.max_steps",
    "finite": "a value is not finite",
    "memory": "no memory for more rows; give output_step",
    "interrupted": "interrupted",
}


def simulate(
    scene: Scene,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = EVERY,
    resume: bool = False,
) -> Result:
    """Integrate a scene.

    Parameters
    ----------
    scene
        Bearing, motion, top, effects, solver; see `Scene`.
    progress
        Called now and then with the time reached and the end [s].
    checkpoint
        A file that keeps the run: written every so many seconds, when the run is interrupted and when it ends. It
        must not exist unless `resume` is given, and stays until its owner removes it.
    every
        Seconds of wall time between two checkpoints.
    resume
        Go on with what `checkpoint` holds, to the same rows, bit by bit.

    Raises
    ------
    InputError
        The parts of the scene do not go together; the checkpoint is damaged, or of another scene or build.
    RunError
        The run could not go on: the message says when, where and why, `.result` holds what was computed.

    """
    _check(scene)
    begin = time.perf_counter()
    model = build_model(scene.bearing.layout, scene.effects)
    kept = None if checkpoint is None else Checkpoint(checkpoint, Identity.of(scene, model), every, resume)
    run, azimuth = _start(scene, model)
    if kept is not None:
        kept.restore(run)
    ready = time.perf_counter()
    status = _advance(run, scene.end, progress, kept)
    if status is None:
        status = run.status[0]
    wall = time.perf_counter() - ready + (kept.wall if kept is not None else 0.0)
    if not len(run.rows):
        raise RunError(_message(scene, run, status), status=status)
    result = _result(scene, model, run, azimuth, status, wall, ready - begin)
    if not result.succeeded:
        raise RunError(result.message, status=status, result=result)
    return result


def _check(scene: Scene) -> None:
    if scene.effects.sliders == "massless" and scene.solver.method == "dopri5":
        raise InputError(
            "solver.method = 'dopri5': massless sliders have no accelerations to integrate; use 'implicit'"
        )
    if scene.effects.uplift and scene.solver.method == "dopri5":
        raise InputError(
            "solver.method = 'dopri5': the report's equations keep all surfaces closed; use 'implicit' with uplift"
        )


def _advance(run: Any, end: float, progress: Progress | None, kept: Checkpoint | None) -> str | None:
    """Take all steps; the name of an interruption, or None."""
    status = None
    try:
        while run.advance(CHUNK):
            if kept is not None:
                kept.offer(run)
            if progress is not None:
                progress(run.time, end)
    except KeyboardInterrupt:
        status = "interrupted"
    # A failure is met again from the same point: the last checkpoint stands.
    if kept is not None and run.status[0] in ("ok", "stopped"):
        kept.save(run)
    return status


def _start(scene: Scene, model: Model) -> tuple[Any, float]:
    """A compiled run at its start, and the azimuth of its frame."""
    count, solver = scene.bearing.layout.surfaces, scene.solver
    motion, load, azimuth = scene.motion, load_values(scene.top), 0.0
    state = scene.initial_state
    q, v, h = (
        np.zeros((count, k)) if state is None else np.array(value, dtype=float)
        for k, value in zip((3, 3, 2), (None,) * 3 if state is None else (state.q, state.v, state.h), strict=True)
    )
    if model.planar:
        azimuth = float(motion.plane() or 0.0)
        if azimuth:
            motion, load = (
                motion.rotated(-azimuth),
                np.concatenate([turned(load[:3], azimuth), turned(load[3:], azimuth)]),
            )
        q, v = (tilts_into_plane(x, azimuth, f"initial_state.{name}") for x, name in ((q, "q"), (v, "v")))
        h = np.ascontiguousarray(turned_pairs(h, azimuth))
        if np.any(np.abs(h[:, 1]) > 1e-12):
            raise InputError("initial_state.h leaves the vertical plane of the motion: use dimension = 'spatial'")
    if model.effects.uplift:
        q, v = np.hstack([q, seated(scene.bearing, scene.top)]), np.hstack([v, np.zeros((count, 3))])
    pieces = np.zeros((1, 6, 6))
    pieces[0, :, 0] = load
    stack = model.stack(scene.bearing, scene.top, anchor=motion.displacement(0.0)[:2])
    max_step = min((s for s in (solver.max_step, motion.max_step) if s is not None), default=0.0)
    stop = scene.stop
    run = model.extension.Run(
        stack,
        np.array(motion.knots, dtype=float),
        np.array(motion.coefficients, dtype=float),
        np.array([0.0, 1.0]),
        pieces,
        np.array(motion.jumps, dtype=float),
        q,
        v,
        h,
        method=solver.method,
        rtol=solver.rtol,
        atol_angle=solver.angle_tolerance,
        max_step=max_step,
        first_step=solver.first_step or 0.0,
        max_steps=float(solver.max_steps),
        duration=scene.end,
        output_step=scene.output_step or 0.0,
        stop_displacement=(stop.displacement or 0.0) if stop else 0.0,
        stop_all_rims=bool(stop and stop.all_rims),
        stop_at_knots=_sampled(motion),
    )
    return run, azimuth


def _sampled(motion: Motion) -> bool:
    """Whether every knot is a sample, where the acceleration has a kink; a sine has many knots to a longest step."""
    return motion.max_step is not None and motion.max_step <= 2.001 * float(np.median(np.diff(motion.knots)))


def _history(model: Model, rows: Array, azimuth: float) -> History:
    """Named arrays in the user's frame."""
    finite = np.isfinite(rows).all(axis=1)
    f = model.unpack(rows if finite.all() else rows[: int(finite.argmin())])
    turn = azimuth
    parted = f["q"][..., 3:] if model.effects.uplift else np.zeros_like(f["force"])
    lift = np.maximum(0.0, -f["compression"]) if model.effects.uplift else np.zeros_like(f["normal"])
    base, top = out_of_plane(f["base"], turn, "vector"), out_of_plane(f["top"], turn, "vector")
    across = base - top
    work = f["work"]
    energy = {
        "input": work[:, 0],
        "kinetic": f["kinetic"],
        "potential": f["potential"] - f["potential"][0],
        "restraint": f["restraint"] - f["restraint"][0],
        "friction_stored": work[:, 1],
        "friction_dissipated": work[:, 2],
        "rim_stored": f["rim_stored"] - f["rim_stored"][0],
        "rim_dissipated": work[:, 3] - (f["rim_stored"] - f["rim_stored"][0]),
        "top_dissipated": work[:, 4],
        "seat_stored": f["seat_stored"] - f["seat_stored"][0],
        "seat_dissipated": work[:, 5],
    }
    energy["kinetic"] = energy["kinetic"] - energy["kinetic"][0]
    energy["numerical"] = energy["input"] - np.sum([v for k, v in energy.items() if k != "input"], axis=0)
    return History(
        time=f["time"],
        tilt_angles=out_of_plane(f["q"][..., :3], turn, "angles"),
        tilt_rates=out_of_plane(f["v"][..., :3], turn, "angles"),
        tilt_accelerations=out_of_plane(f["a"][..., :3], turn, "angles"),
        friction_state=out_of_plane(f["f"], turn, "pair"),
        normal_force=f["normal"],
        contact_angles=out_of_plane(f["angles"], turn, "pair_angles"),
        sliding=f["sliding"],
        gap=f["gap"],
        rim_force=f["rim"],
        separation=out_of_plane(parted, turn, "vector"),
        lift=lift,
        interface_force=out_of_plane(f["force"], turn, "vector"),
        slip_velocity=out_of_plane(f["slip"], turn, "pair"),
        base_displacement=base,
        top_displacement=top,
        displacement=across - across[0],
        top_force=out_of_plane(f["top_force"], turn, "vector"),
        top_moment=out_of_plane(f["top_moment"], turn, "axial"),
        energy=energy,
        friction_coefficient=f.get("mu"),
        temperature=f.get("temperature"),
    )


def _events(model: Model, run: Any, azimuth: float) -> tuple[Event, ...]:
    return tuple(
        Event(
            time=t,
            surface=surface,
            kind=EVENT_KINDS[kind],  # type: ignore[arg-type]
            displacement=out_of_plane(np.array(u), azimuth, "vector"),
            top_force=out_of_plane(np.array(force), azimuth, "vector"),
        )
        for t, surface, kind, u, force in run.events
    )


# What the number beside a failure is.
QUANTITIES = {"newton": "residual", "irregular": "residual", "uplift": "P.t3 [N]", "angle": "angle [rad]"}


def _message(scene: Scene, run: Any, status: str) -> str:
    """One line: when, where, why, and the quantity."""
    _, surface, value = run.status
    known = surface and status in QUANTITIES
    where = (
        f", surface {surface}, {QUANTITIES[status]} = {value:.4g}"
        if known
        else f", surface {surface}"
        if surface
        else ""
    )
    return f"stopped at t = {run.time:.6g} s of {scene.end:.6g} s{where}: {FAILURES.get(status, status)}"


def _result(scene: Scene, model: Model, run: Any, azimuth: float, status: str, wall: float, setup: float) -> Result:
    from msfp_gen.result import Result

    message = "" if status in ("ok", "stopped") else _message(scene, run, status)
    counts = {k: int(n) for k, n in run.counts.items()}
    provenance = {
        "msfp_gen": __version__,
        "model": model.spec.key,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "method": scene.solver.method,
        "rtol": f"{scene.solver.rtol:g}",
        "build_seconds": f"{setup:.3g}",
    }
    return Result(
        scene=scene,
        history=_history(model, run.rows, azimuth),
        events=_events(model, run, azimuth),
        counters=replace(Counters(**counts), wall_time=wall),
        status=status,
        message=message,
        provenance=provenance,
    )
