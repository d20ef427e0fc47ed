"""Two checks of a run that share as little as possible with it: the balances of its rows, and half of its longest step.

The balances are those of PEER 2017/07 in plain vectors (tests/reference): from the angles, rates, accelerations, friction
states, normal forces and contact angles of a row follow the rate of momentum of every body and all that acts on it.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from fuzz_scenes import load_of
from reference import forces, friction_laws, kinematics, stack
from reference.kinematics import E, cross

from msfp_gen import Effects, Rotation, RunError, Scene, Top, simulate
from msfp_gen.results.history import History
from msfp_gen.results.result import Result
from msfp_gen.scene.planarity import scene_plane
from msfp_gen.scene.top import MassTop, PrescribedTop, RigTop, is_sprung
from msfp_gen.simulation.bearing_run import BearingRun
from msfp_gen.simulation.system import finish

Array = Any
ROWS = 6  # of a run that are checked
FEW = 1e-9  # [s] from a jump: the row may have the values of either side
MUCH = 0.1  # permitted relative difference of peaks between a run and one with half its longest step
TIMES = 100  # smaller tolerance of the run that decides between two that differ


# ---- both checks of one scene


def verified(scene: Scene, given: Result) -> dict[str, Any]:
    """Violations of both checks under `wrong`, and how far the run was from them. given: the result of the scene."""
    scene = replace(turned(scene), output_step=None)
    sequence = BearingRun.of(scene)
    finish(sequence, scene.end)
    whole = sequence.result()
    left = worst_row(scene, sequence, whole.history) if whole.succeeded else 0.0
    found: dict[str, Any] = {"unbalanced": left, "wrong": []}
    if left > 1e-5 + 3 * scene.solver.rtol:
        found["wrong"].append(f"balance {left:.1e}")
    if given.status != whole.status and not rings(scene, given, whole):
        found["wrong"].append(f"{given.status} with the rows given, {whole.status} with those of every step")
    elif given.succeeded and whole.succeeded and (far := apart(given, whole)) > MUCH and not jammed(given, whole):
        found["wrong"].append(f"{far:.2g} between the rows given and those of every step")
    if whole.succeeded:
        found |= halved(scene, whole)
        found["wrong"] += [f"half the longest step: {found['halved']:.2g}"] if found["verdict"] == "wrong" else []
    return found


def rings(scene: Scene, *results: Result) -> bool:
    """Whether steps were used up by an undamped vibration, which rounding starts where the tolerance hides it or not."""
    undamped = any(surface.contact_damping == 0.0 for surface in scene.bearing.surfaces)
    return undamped and any(result.status == "steps" for result in results)


def worst_row(scene: Scene, sequence: BearingRun, history: History) -> float:
    """The largest part of the balances that is left at some rows of a run.

    Left out are rows at a jump, which have the values of either side; the start of massless sliders, which come to
    their balance in the first step; and with uplift rows at open surfaces and closed rims.
    """
    jumps = (
        [scene.motion.jumps] if scene.load is None else [scene.motion.jumps, scene.load.jumps, [scene.load.duration]]
    )
    worst, begin = 0.0, 0.0
    for segment in sequence.segments:
        effects, end = segment.model.effects, segment.run.time
        inside = (history.time > begin) & (history.time <= end) | (history.time == 0.0) & (begin == 0.0 < end)
        begin = end
        for t in np.concatenate(jumps):
            inside &= np.abs(history.time - t) > FEW
        if effects.sliders == "massless":
            inside &= history.time > 0.0
        if effects.uplift:
            inside &= (history.lift.max(axis=1) == 0.0) & (history.rim_force.max(axis=1) == 0.0)
        rows = np.flatnonzero(inside)
        for row in rows[np.unique(np.linspace(0, len(rows) - 1, ROWS).astype(int))] if len(rows) else []:
            worst = max(worst, unbalanced(scene, effects, history, int(row)))
    return worst


# ---- half of the longest step


def halved(scene: Scene, whole: Result) -> dict[str, Any]:
    """The run again with half of its longest step. Where the two differ, one of a smaller tolerance decides."""
    longest = float(np.diff(whole.history.time, prepend=0.0).max())
    solver = replace(scene.solver, max_step=0.5 * longest, first_step=None)
    half = succeeded(replace(scene, solver=solver))
    if half is None:
        return {"halved": None, "verdict": "failed"}
    far = apart(whole, half)
    if far <= MUCH:
        return {"halved": far, "verdict": "agrees"}
    best = succeeded(replace(scene, solver=replace(solver, rtol=scene.solver.rtol / TIMES, max_steps=10**6)))
    if best is None or apart(half, best) > MUCH / 2:
        return {"halved": far, "verdict": "not converged"}
    return {"halved": apart(whole, best), "verdict": "noted" if whole.notes else "wrong"}


def jammed(*results: Result) -> bool:
    """Whether a model had no solution on the way: a note of the run says so, and its last forces have no bound."""
    return any(note.kind == "jammed" for result in results for note in result.notes)


def succeeded(scene: Scene) -> Result | None:
    try:
        return simulate(scene)
    except RunError:
        return None


def apart(one: Result, other: Result) -> float:
    """The largest difference of peaks and dissipated energy, each over its own scale."""
    load = load_of(one.scene.top) + float(other.extremes.most_normal.max())
    slip = max(s.yield_displacement for s in one.scene.bearing.surfaces) + float(other.extremes.sliding.max())
    work = max(float(np.abs(energy).max()) for energy in other.history.energy.values()) + 1e-6 * load
    end = min(one.history.time[-1], other.history.time[-1])  # of rows at even times the last is earlier
    values = []
    for result in (one, other):
        x, history = result.extremes, result.history
        dissipated = np.interp(end, history.time, history.energy["friction_dissipated"])
        values.append((float(x.top_force[3]), x.most_normal, x.sliding, dissipated))
    scales = (values[1][0] + 0.01 * load, load, slip, work)
    return max(float(np.abs(a - b).max()) / scale for a, b, scale in zip(*values, scales, strict=True))


# ---- balances of rows


def turned(scene: Scene) -> Scene:
    """A planar scene in the plane of E1 and E3: in others psi and theta of the rows describe a small twist."""
    plane = scene_plane(scene)[0] if scene.modelled.dimension == "planar" else None
    if not plane:
        return scene
    c, s = np.cos(plane), np.sin(plane)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    load, top = scene.load, scene.top
    if load is not None:
        load = replace(
            load,
            coefficients=np.einsum("ij,kpjo->kpio", turn, load.coefficients.reshape(-1, 2, 3, 6)).reshape(-1, 6, 6),
        )
    if isinstance(top, PrescribedTop):
        top = Top.prescribed(tuple(turn @ top.force), tuple(turn @ top.moment))
    motion = scene.motion.rotated(-plane)
    return replace(scene, motion=motion, load=load, top=top, motion_table=None)


def unbalanced(scene: Scene, effects: Effects, history: History, row: int) -> float:
    """What is left of the balances of all bodies at a row, over the sum of all forces on the stack.

    Moments count over the height of the stack. With uplift only moments are balanced: rows do not hold the acceleration
    of a separation.
    """
    t = float(history.time[row])
    base = kinematics.Base(*(scene.motion.evaluate(t, order)[part] for part in PARTS for order in range(3)))
    state = kinematics.State(
        *(x[row] for x in (history.tilt_angles, history.tilt_rates, history.tilt_accelerations)), base
    )
    bearing = scene.bearing.replace(friction=list(coefficients(scene, effects, history, row)))
    turn = kinematics.rotation(state)
    at = kinematics.points(bearing, state, turn)
    given = (history.friction_state[row], history.contact_angles[row], history.normal_force[row])
    rims = effects.rims and not effects.uplift  # a separation moves the slider away from the rim that it would press
    act = stack.interfaces(bearing, turn, at, *given, effects.spin, rims, effects.bouc_wen)
    load = on_top(scene, effects, history, row, turn, at)
    weight = sum(body.mass for body in bearing.bodies) * bearing.gravity
    size = weight + load_of(scene.top) + np.linalg.norm(load.force) + history.normal_force[row].max()
    size += history.rim_force[row].max()
    height = bearing.base_height + sum(body.height for body in bearing.bodies)
    worst = 0.0
    for k in range(2, bearing.layout.n + 1):
        force, moment = stack._applied(bearing, at, act, load, k)
        linear, angular = -force, -moment
        if effects.sliders == "inertial":
            J, w = stack.inertia(bearing, turn, k), turn.w_total[k]
            linear = bearing.bodies[k - 2].mass * at.a[f"{k}"] - force
            angular = J @ turn.dw_total[k] + cross(w, J @ w) - moment
        if effects.uplift:  # on its edge a slider receives the moment of the force by the separation
            edges = [g - 1 for g in (k - 1, k) if g < bearing.layout.n and forces.slider(bearing, g)[0] == k]
            angular = angular + sum(cross(history.separation[row, g], history.interface_force[row, g]) for g in edges)
        own = turn.t[k] @ angular
        kept = own[:2] if effects.spin == "locked" else own  # a constraint holds the spin
        worst = max(worst, float(np.abs(kept).max()) / (size * height))
        if not effects.uplift:
            worst = max(worst, float(np.abs(linear).max()) / size)
    return worst


PARTS = (slice(0, 3), slice(3, 6))


def coefficients(scene: Scene, effects: Effects, history: History, row: int) -> Array:
    """Friction coefficients of a row, of the velocity law by its formula."""
    surfaces = scene.bearing.surfaces
    if history.friction_coefficient is None or effects.friction == "constant":
        return [s.friction for s in surfaces]
    if effects.friction != "velocity":
        return history.friction_coefficient[row]
    speed = friction_laws.sliding_velocity(history.friction_state[row], history.slip_velocity[row])
    values = zip(surfaces, speed, strict=True)
    return [friction_laws.velocity(s.friction, s.friction_slow, s.velocity_rate, v) for s, v in values]


def on_top(scene: Scene, effects: Effects, history: History, row: int, turn: Any, at: Any) -> stack.Load:
    """Force and moment of top and load on the top plate at r_nn (3.28), (3.29).

    Of vertical springs, and with uplift of all tops, the force of the row is taken.
    """
    top, t, n = scene.top, float(history.time[row]), scene.bearing.layout.n
    extra = np.zeros(6) if scene.load is None else scene.load.evaluate(t)
    r, v, a = (x[kinematics.joint(scene.bearing, n)] for x in at)
    if isinstance(top, PrescribedTop):
        return stack.Load(extra[:3] + top.force, extra[3:] + top.moment)
    moment = extra[3:] + restraint(top, scene.top_rotation, t, turn, float(history.tilt_angles[row, -1, 2]))
    if isinstance(top, RigTop):
        side = -top.stiffness * (r - scene.motion.displacement(0.0)) - top.damping * v
        force = np.array([side[0], side[1], -top.axial_load])
    else:
        assert isinstance(top, MassTop)
        t3, w, dw = turn.t[n][2], turn.w[n], turn.dw[n]
        centre = a + top.height * (cross(dw, t3) + cross(w, cross(w, t3)))
        force = -top.mass * (centre + scene.bearing.gravity * E[2])
    recorded = -history.top_force[row] - extra[:3]
    if is_sprung(top):
        force[2] = recorded[2]
    if effects.uplift:
        force = recorded
    if isinstance(top, MassTop):
        total, spin = turn.w_total[n], turn.dw_total[n]
        transverse, axial = np.broadcast_to(top.inertia, 2)
        t1, t2, _ = turn.t[n]
        J = transverse * (np.outer(t1, t1) + np.outer(t2, t2)) + axial * np.outer(t3, t3)
        moment = moment - (J @ spin + cross(total, J @ total)) + top.height * cross(t3, force)
    return stack.Load(force + extra[:3], moment)


def restraint(top: Any, support: Rotation | None, t: float, turn: Any, phi: float) -> Array:
    """Moment of the rotational spring and damper, about a support that may rotate."""
    t3 = turn.t[-1][2]
    axis, rate = E[2], np.zeros(3)
    if support is not None:
        (psi, theta), (dpsi, dtheta) = (support.evaluate(t, order) for order in range(2))
        frame = kinematics.rotate(psi, theta, E)
        axis, rate = frame[2], dpsi * E[0] + dtheta * frame[1]
    spring = -top.rotational_stiffness * (cross(axis, t3) + phi * t3)
    return spring - top.rotational_damping * (turn.w_total[-1] - rate)
