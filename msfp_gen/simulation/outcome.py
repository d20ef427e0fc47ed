"""The end of a run: message of a failure, extremes of all segments, versions, and notes that follow from the rows."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from functools import reduce
from operator import or_

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array
from msfp_gen.common.version import __version__
from msfp_gen.model.compiled import CompiledBearingRun
from msfp_gen.model.model import Model
from msfp_gen.results.history import Event, Extremes, History
from msfp_gen.results.note import Note, monitor_notes
from msfp_gen.results.sliding import intervals, sliding_surfaces
from msfp_gen.scene.effect_selection import load_at_rest, rigid_mass_limit
from msfp_gen.scene.effect_switching import JAM_STATUSES
from msfp_gen.scene.fidelity import UNSEEN
from msfp_gen.scene.plausibility import scene_doubts, shear_doubts
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.standing import MARGIN, seat_stiffness, standing_of
from msfp_gen.scene.top import MassTop, RigTop
from msfp_gen.simulation.rows import Segment
from msfp_gen.specification.contract import STATUSES
from msfp_gen.specification.friction_laws import is_plastic
from msfp_gen.specification.layout import Auto, Effects


def extremes_of(segments: Sequence[Segment]) -> Extremes | None:
    """Extremes of all segments in the frame of the user; None where none of them could start.

    Of segments that took no step only the last counts, where no other did: see `Joint`.
    """
    started = [s for s in segments if s.run.row_count]
    counted = [s for s in started if s.run.counts["steps"]] or started[-1:]
    extremes = [Extremes.of_run(s.model.extension.EXTREMES, s.run.extremes, s.azimuth) for s in counted]
    return reduce(or_, extremes) if extremes else None


def provenance_of(solver: Solver, models: str) -> dict[str, str]:
    """Versions, names of the models, and options of the solver with which a run was computed."""
    return {
        "msfp_gen": __version__,
        "model": models,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "method": solver.method,
        "rtol": f"{solver.rtol:g}",
    }


_STATUSES = {status.name: status for status in STATUSES}
MASSLESS = (  # docs/model.md, choice 10
    "; the sliders are massless: where forces depend on rates, only inertia determines how the surfaces share the "
    "motion; give effects.sliders = 'inertial'"
)
PULLED = (
    "; the springs of the rig are anchored above the base and pull the displaced top at once: lower top.stiffness, or "
    "leave out initial_state"
)
FLIPPED = (
    "; nothing holds the top plate level while it flies: give the top a rotational_stiffness [N m/rad], or take a "
    "layout with an articulated slider, such as (3, 1, 1)"
)
AT_ONCE = 1e-3  # [s]; a failure before is one of the initial state
OVERTURNED = 0.1  # tilt of the top plate above which the stack is considered to overturn [rad]


def message_of(scene: Scene, segment: Segment) -> str:
    """One line about a segment that failed: time, surface, cause, remedy and last state.

    The cause is the meaning of the status, or after a monitor stopped the run the texts of its notes.
    """
    model, run, status, cause = segment.model, segment.run, segment.status, ""
    if status == "monitor":
        cause = "; ".join(note.text for note in monitor_notes(segment.ending, None))
    text = stopped(run.time, scene.end, status, *run.status[1:], cause)
    text += _state(scene, model, run) if _STATUSES[status].motion and run.row_count else ""
    text += PULLED if _pulled(scene, run) else ""
    text += FLIPPED if _flipped(scene, status) else ""
    return text + (MASSLESS if _inertia_missing(scene, model, status) else "")


def stopped(time: float, end: float, status: str, surface: int, value: float, cause: str = "") -> str:
    """Time reached and end of a run [s], surface (0: none), value and cause; "": the meaning of the status."""
    known = _STATUSES[status]
    where = f", surface {surface}" if surface else ""
    where += f", {known.quantity} = {value:.4g}" if surface and known.quantity else ""
    return f"stopped at t = {time:.6g} s of {end:.6g} s{where}: {cause or known.failure}"


def _pulled(scene: Scene, run: CompiledBearingRun) -> bool:
    """Whether a run failed at once from a displaced state under a rig, whose springs are anchored above the base."""
    state, top = scene.initial_state, scene.top
    anchored = isinstance(top, RigTop) and top.stiffness > 0
    return anchored and run.time < AT_ONCE and state is not None and bool(np.any(state.q))


def _flipped(scene: Scene, status: str) -> bool:
    """Whether the stack came apart below a plate that may turn freely once no surface carries."""
    return status == "separated" and not scene.top.rotational_stiffness


def _inertia_missing(scene: Scene, model: Model, status: str) -> bool:
    """Whether a run ended because massless sliders had no unique motion, as far as its end tells."""
    massless, carried = model.effects.sliders == "massless", isinstance(scene.top, MassTop)
    return massless and (status in JAM_STATUSES or (carried and status == "uplift"))


def _state(scene: Scene, model: Model, run: CompiledBearingRun) -> str:
    """Summary of the last row, with a remedy where the top plate has overturned."""
    row = model.unpack(run.rows[-1])
    angles = row["q"][:, :2]
    tilt, top = float(np.abs(angles).max()), float(np.abs(angles.sum(axis=0)).max())
    low, high = float(row["normal"].min()), float(row["normal"].max())
    text = (
        f" (last state: tilts up to {tilt:.3g} rad, N {low:.3g} to {high:.3g} N, rims up to {row['rim'].max():.3g} N)"
    )
    standing = standing_of(scene)
    if top > OVERTURNED and standing and standing[1] < MARGIN * standing[2]:
        text += f"; the top plate has tilted by {top:.2g} rad: give it a rotational_stiffness of several times "
        text += f"{standing[2]:.4g} N m/rad, with which it stands at rest"
    return text


ENERGY_LIMIT = 0.02  # error of the energy closure, over the largest term, above which a note is written
DAMPING_LIMIT = 0.01  # energy dissipated by contact damping, over that dissipated by friction, likewise
LANDINGS, LANDING_TIME = 20, 0.1  # landings of a surface within a time [s] above which a note is written
TOLERANCE_LIMIT = 0.05  # force of the top's spring at the tolerance of angles, over the peak force, likewise
VIBRATION_LIMIT = 0.001  # estimated error by vibrations of a stuck mass, over the peak force, likewise
PHASE_ERROR = 0.0404  # phase by which a step h of TR-BDF2 is late, over (omega h)^3 (Hosea and Shampine 1996)
UNEVEN = 2.0  # mean cube of the steps over the cube of their mean, where rows do not show the steps
LARGEST_PHASE = 1.4  # error of the phase [rad] at which two vibrations differ as much as ones of any phase: sqrt(2)
ROWS_LIMIT = 0.005  # peak force of rows less that at the ends of steps, over friction, likewise; as `Auto.error`
REMEMBERED = 20.0  # sliding displacement after which a vibration is forgotten, over the sum of yield displacements
CREEP_TIME = 10.0  # time stuck off the centre [s] after which creep is looked for
LOADING = 1.0  # slip less elastic slip of a Bouc-Wen law on the way to |(Y, Z)| = 0.96, over d_y: artanh(Y) - Y
CREEP_SHARE = 0.01  # creep over the peak displacement above which a note is written
TEXTS = {
    "peak": "the normal force of surface {surface} rises to {value:.4g} N: mass and contacts are rigid, such peaks do "
    "not converge; give vertical_stiffness",
    "energy": "the energy closure has an error of {value:.1%} of the largest energy: vibrations are not resolved; "
    "give a smaller solver.rtol",
    "tolerance": "the tolerance of angles is {value:.3g} N in the spring of the top, {share:.2g} of the peak force: "
    "vibrations after a change of the load may be filtered; give a smaller solver.rtol",
    "vibration": "the mass vibrates on its stuck bearing at {rate:.2g} Hz, hardly damped, and the errors of the steps "
    "add up: the force is off by some {value:.1%} RMS of its peak, an order of magnitude; give a smaller "
    "solver.rtol, or run with --error 0.5%",
    "seats": "the bearing hardly slides: its {slid:.3g} m are the elastic part of friction, {value:.1%} of them the "
    "compression of contacts, which only a model with uplift tells apart; forces and displacements across the bearing "
    "do not change",
    "rows": "the peak force of the rows is {value:.3g} N above the {stated:.4g} N at the ends of steps, {share:.1%} of "
    "friction: rows between steps are interpolated; give a smaller solver.rtol, or leave out output_step",
    "damping": "contact damping dissipates {value:.1%} of what friction does: it changes sliding itself; "
    "give a smaller contact_damping",
    "creep": "the displacement that remains may be wrong by {value:.3g} m or more, by which surfaces moved while none "
    "slid: Bouc-Wen friction creeps under small cycles; give effects.bouc_wen = 'plastic'",
    "rattle": "surface {surface} landed {value:d} times: loose sliders rattle, and their path depends on every "
    "disturbance; compare a smaller solver.rtol, or give the seat_damping of the device",
}


def _note(kind: str, time: float, value: float, surface: int = 0, **more: float) -> Note:
    """The note of this kind. more: numbers of its text beside value and surface."""
    text = TEXTS[kind].format(value=value, surface=surface, **more)
    return Note(float(time), kind, surface, float(value), text)


def history_notes(
    scene: Scene, effects: Effects, history: History, steps: int, extremes: Extremes | None
) -> tuple[Note, ...]:
    """The notes of a whole run of so many steps, by its rows and its extremes; `effects`: of its last segment."""
    unseen = (Note(0.0, "fidelity", 0, 0.0, UNSEEN[scene.fidelity]),) if scene.fidelity in UNSEEN else ()
    stack = scene.fidelity != "equivalent"
    doubts = unseen + tuple(Note(0.0, "value", *doubt) for doubt in scene_doubts(scene) if stack)
    doubts += shear_notes(scene, history, extremes)
    physics = creep_notes(scene, effects, history)
    physics += peak_notes(scene, effects, history)
    numerics = energy_notes(scene, history) + tolerance_notes(scene, effects, history)
    numerics += vibration_notes(scene, effects, history, steps) + seat_notes(scene, effects, history)
    numerics += row_notes(scene, effects, history, extremes)
    return doubts + numerics + damping_notes(scene, history) + physics


def shear_notes(scene: Scene, history: History, extremes: Extremes | None) -> tuple[Note, ...]:
    """A note where the largest horizontal force over all steps exceeds the load at rest."""
    peaks = Extremes.of_rows(history) if extremes is None else extremes
    force, time = float(peaks.top_force[3]), float(peaks.times["top_force"][3])
    doubts = shear_doubts(force, load_at_rest(scene), "horizontal force", "load at rest")
    return tuple(Note(time, "value", *doubt) for doubt in doubts)


def damping_notes(scene: Scene, history: History) -> tuple[Note, ...]:
    """A note where contact damping dissipates more than `DAMPING_LIMIT` of what friction dissipates.

    A run that hardly slides, by less than ten times the yield displacements, gets none.
    """
    damped, lost = (float(history.energy[f"{name}_dissipated"][-1]) for name in ("contact", "friction"))
    normal = np.median(history.normal_force, axis=0)
    elastic = [s.friction * s.yield_displacement for s in scene.bearing.surfaces]
    if lost < 10 * float(normal @ np.array(elastic)) or not damped > DAMPING_LIMIT * lost:
        return ()
    return (_note("damping", history.time[-1], damped / lost),)


def tolerance_notes(scene: Scene, effects: Effects, history: History) -> tuple[Note, ...]:
    """A note where a lateral load excites vibrations through a spring so stiff that the tolerance hides their force.

    An L-stable method filters vibrations that are smaller than its tolerance. Massless sliders do not vibrate.
    """
    filtered = scene.solver.method != "dopri5" and effects.sliders == "inertial"
    if scene.load is None or not filtered or not scene.load.coefficients[:, :2].any():
        return ()
    radius = max(surface.radius for surface in scene.bearing.surfaces)
    force = scene.top.stiffness * scene.solver.angle_tolerance * radius
    across = np.hypot(history.top_force[:, 0], history.top_force[:, 1])
    row = int(across.argmax())
    if not force > TOLERANCE_LIMIT * across[row] > 0:
        return ()
    return (_note("tolerance", history.time[row], force, share=force / across[row]),)


def vibration_notes(scene: Scene, effects: Effects, history: History, steps: int) -> tuple[Note, ...]:
    """A note where a mass vibrates on stuck surfaces so long that the errors of the steps add up to `VIBRATION_LIMIT`.

    Step control bounds the error of each step. A motion that slides forgets it after `REMEMBERED`; a vibration that
    only contact damping damps does not, and its phase falls behind by `PHASE_ERROR` (omega h)^3 in each step. The force
    of the vibration is mass x omega x rate, without the rate with which the deformation follows a smooth motion of
    the ground, and its error is that force times the error of the phase.
    """
    top, surfaces = scene.top, scene.bearing.surfaces
    flexibility = sum(s.yield_displacement / s.friction if s.friction > 0 else np.inf for s in surfaces)
    rest, duration = load_at_rest(scene), float(history.time[-1] - history.time[0])
    implicit = scene.solver.method == "implicit" and effects.sliders == "inertial"
    if not (isinstance(top, MassTop) and implicit and 0 < flexibility < np.inf and rest > 0 and duration > 0):
        return ()
    turn = float(np.sqrt(rest / (flexibility * top.mass)))
    stuck = ~sliding_surfaces(history).any(axis=1)
    between = np.gradient(history.time)
    rows_of_steps = scene.output_step is None and len(between) > steps
    squares = between**2 if rows_of_steps else UNEVEN * (duration / max(steps, 1)) ** 2
    rate = np.linalg.norm(history.slip_velocity, axis=-1).sum(axis=1)
    free = rate
    if not scene.motion.sampled:  # a record has all frequencies
        times = np.minimum(history.time, scene.motion.duration)
        free = np.maximum(rate - np.linalg.norm(scene.motion.evaluate(times, 3)[:, :2], axis=1) / turn**2, 0.0)
    slid = np.cumsum(rate * between * ~stuck)
    phase = np.cumsum(PHASE_ERROR * turn**3 * squares * between * stuck)
    since = np.searchsorted(slid, slid - REMEMBERED * sum(s.yield_displacement for s in surfaces))
    late = np.minimum(phase - phase[since], LARGEST_PHASE)
    peak = float(np.hypot(*history.top_force[:, :2].T).max())
    error = top.mass * turn * float(np.sqrt(np.sum(between * stuck * (late * free) ** 2) / duration))
    if not error > VIBRATION_LIMIT * peak > 0:
        return ()
    row = int(stuck.argmax())
    return (_note("vibration", history.time[row], error / peak, rate=turn / (2 * np.pi)),)


def row_notes(scene: Scene, effects: Effects, history: History, extremes: Extremes | None) -> tuple[Note, ...]:
    """A note where rows between the steps exceed the peak force at their ends by `ROWS_LIMIT` of friction.

    They are interpolated, and a stiff spring of the top makes force of a micrometre. Quasi-static rows are solved for.
    """
    if extremes is None or scene.output_step is None or effects.sliders != "inertial":
        return ()
    friction = max(surface.friction for surface in scene.bearing.surfaces) * load_at_rest(scene)
    across = np.hypot(history.top_force[:, 0], history.top_force[:, 1])
    row, stated = int(across.argmax()), float(extremes.top_force[3])
    excess = float(across[row]) - stated
    if not excess > ROWS_LIMIT * friction > 0:
        return ()
    return (_note("rows", history.time[row], excess, share=excess / friction, stated=stated),)


def seat_notes(scene: Scene, effects: Effects, history: History) -> tuple[Note, ...]:
    """A note where `Auto` left out uplift, and its contacts would take more than `Auto.error` of the sliding.

    A contact takes mu N/k of the elastic part of friction, d_y (Y, Z), which is most of what a stuck bearing slides.
    """
    if not isinstance(scene.effects, Auto) or scene.effects.uplift is not None or effects.uplift:
        return ()
    friction = np.array([surface.friction for surface in scene.bearing.surfaces])
    mobilised = np.linalg.norm(history.friction_state, axis=-1).max(axis=0)
    in_contacts = friction * load_at_rest(scene) * mobilised / seat_stiffness(scene.bearing, scene.top)
    most, slid = float(in_contacts.max()), float(history.sliding.max())
    if not most > scene.effects.error * slid > 0:
        return ()
    row, surface = np.unravel_index(int(history.sliding.argmax()), history.sliding.shape)
    return (_note("seats", history.time[row], most / slid, int(surface) + 1, slid=slid),)


def peak_notes(scene: Scene, effects: Effects, history: History) -> tuple[Note, ...]:
    """A note where N under a rigid mass exceeds `rigid_mass_limit`."""
    limit = rigid_mass_limit(scene)
    row, surface = np.unravel_index(int(history.normal_force.argmax()), history.normal_force.shape)
    peak = float(history.normal_force[row, surface])
    if effects.uplift or not 0 < limit < peak:
        return ()
    return (_note("peak", history.time[row], peak, int(surface) + 1),)


def landing_notes(events: tuple[Event, ...]) -> tuple[Note, ...]:
    """A note for each surface that landed more than `LANDINGS` times within `LANDING_TIME`: it rattles."""
    notes = []
    for surface in sorted({event.surface for event in events if event.kind == "landing"}):
        times = np.array([event.time for event in events if event.kind == "landing" and event.surface == surface])
        if (times[LANDINGS:] - times[:-LANDINGS] < LANDING_TIME).any():
            notes.append(_note("rattle", times[0], len(times), surface))
    return tuple(notes)


def creep_notes(scene: Scene, effects: Effects, history: History) -> tuple[Note, ...]:
    """A note where a bearing with a Bouc-Wen law was stuck off its centre for long and moved nevertheless.

    Creep is slip less the elastic part d_y (Y, Z), summed over the surfaces and the times for which all are stuck. Less
    than `LOADING` d_y at one time is what friction takes to grow, and does not count.
    """
    across = np.linalg.norm(history.displacement[:, :2], axis=1)
    off_centre = across > max(CREEP_SHARE * float(across.max()), 1e-12)
    yields = np.array([surface.yield_displacement for surface in scene.bearing.surfaces])
    stuck = intervals(history.time, off_centre & ~_slides(history, yields))
    long = [(start, start + length) for start, length in stuck if length > 1.0]
    if is_plastic(effects.bouc_wen) or sum(end - start for start, end in long) < CREEP_TIME:
        return ()
    moved = 0.0
    for first, last in (np.searchsorted(history.time, pair).clip(max=len(history.time) - 1) for pair in long):
        elastic = yields * np.linalg.norm(history.friction_state[last] - history.friction_state[first], axis=-1)
        crept = np.abs(history.sliding[last] - history.sliding[first]) - elastic
        moved += float(crept[crept > LOADING * yields].sum())
    if moved <= CREEP_SHARE * float(across.max()):
        return ()
    return (_note("creep", long[0][0], moved),)


def _slides(history: History, yields: Array) -> NDArray[np.bool_]:
    """Whether the bearing slides in each row: a surface that slides by less than its d_y at a time only creeps."""
    # From `MOBILISED` friction grows to 99 % by then, where Coulomb friction would hold.
    slides = np.zeros(len(history.time), dtype=bool)
    for flags, slid, d_y in zip(sliding_surfaces(history).T, history.sliding.T, yields, strict=True):
        changes = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
        for first, last in changes.reshape(-1, 2):
            spell = slice(max(first - 1, 0), last + 1)
            slides[first:last] |= np.ptp(slid[spell]) >= d_y
    return slides


def energy_notes(scene: Scene, history: History) -> tuple[Note, ...]:
    """A note where the error of the energy closure exceeds `ENERGY_LIMIT` of the largest term.

    One of the terms is the work of the vertical load along the spherical surfaces, which the input contains only as a
    difference. The limit is raised by the work of friction over the tolerance of angles, which no run can resolve.
    """
    energy, surfaces = history.energy, scene.bearing.surfaces
    terms = [float(np.abs(values).max()) for name, values in energy.items() if name != "numerical"]
    height = sum(float(s.max()) ** 2 / (2 * x.radius) for s, x in zip(history.sliding.T, surfaces, strict=True))
    unresolved_slip = 3 * scene.solver.angle_tolerance * max(x.friction * x.radius for x in surfaces)
    unresolved = float(history.normal_force.max()) * unresolved_slip
    scale = max(*terms, float(np.median(history.normal_force)) * height) + unresolved / ENERGY_LIMIT
    row = int(np.abs(energy["numerical"]).argmax())
    error = abs(float(energy["numerical"][row])) / scale if scale else 0.0
    if not error > ENERGY_LIMIT:
        return ()
    return (_note("energy", history.time[row], error),)
