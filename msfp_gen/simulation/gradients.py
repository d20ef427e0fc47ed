"""Gradients of a run: which runs have them, the derivatives of their inputs, what was computed, and its errors.

The errors are measured by a run of smaller tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.model.compiled import CompiledBearingRun
from msfp_gen.model.model import Model
from msfp_gen.model.plane import motion_in_plane, out_of_plane, wrench_in_plane
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.time_grid import snapped
from msfp_gen.results.gradients import EVENTS, Gradients, energy_terms, gradients_of_extremes
from msfp_gen.results.history import Event, Extremes
from msfp_gen.results.note import Note
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_selection import load_at_rest, quasistatic, slider_period
from msfp_gen.scene.friction_parameters import derived_slopes, law_parameters
from msfp_gen.scene.parameters import Parameter, parameters_of
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.standing import SPRINGS, stiffness_slopes
from msfp_gen.scene.top import is_sprung
from msfp_gen.simulation import seats
from msfp_gen.simulation.rows import Segment, unpacked
from msfp_gen.simulation.start import (
    Frame,
    given_state,
    needs_settling,
    seats_at_start,
    state_in_plane,
    time_grid,
    values_at_start,
    wrench_pieces,
)
from msfp_gen.specification import contract
from msfp_gen.specification.layout import Effects

_STATE = ("q", "v", "h")
_MOMENTS = ("inertia_transverse", "inertia_axial")
_BASE_FIELDS = {"base_height": "height", "base_rim_radius": "rim_radius", "base_rim_offset": "rim_offset"}


def start_gradients(
    run: CompiledBearingRun,
    scene: Scene,
    model: Model,
    parameters: Sequence[Parameter],
    steps: Sequence[float] = (),
    energies: bool = False,
    start: tuple[Array, Array] | None = None,
) -> None:
    """Begin the derivatives of a run that has taken no step.

    steps: ends of all steps [s], in place of the step control, for differences with the same steps. energies: also of
    the energies that are integrals over the run. start: derivatives of the initial state, as in `start_slopes`; None:
    it is constant. Raises InputError where a parameter leads out of the plane of a planar model.
    """
    inputs = [
        _Inputs(scene, model, parameter, None if start is None else (start[0][i], start[1][i])).arrays
        for i, parameter in enumerate(parameters)
    ]
    histories = {
        name: [arrays_of[name] for arrays_of in inputs if arrays_of[name] is not None] for name in ("motion", "load")
    }
    stacked: dict[str, Any] = {
        name: np.array([arrays_of[name] for arrays_of in inputs])
        for name in ("gravity", "bodies", "surfaces", "top", *_STATE)
    }
    for name, arrays in histories.items():
        present = np.array([arrays_of[name] is not None for arrays_of in inputs], dtype=bool)
        stacked[name] = np.where(present, np.cumsum(present) - 1.0, -1.0)
        stacked[f"{name}s"] = np.array(arrays) if arrays else np.zeros(0)
    stacked["f"] = stacked.pop("h")
    contiguous = {name: np.ascontiguousarray(array, float) for name, array in stacked.items()}
    run.start_gradients(**contiguous, steps=steps, energies=energies)


class _Inputs:
    """The derivatives with respect to one parameter, in `arrays`, by the names of `start_gradients` of a run."""

    def __init__(
        self, scene: Scene, model: Model, parameter: Parameter, start: tuple[Array, Array] | None = None
    ) -> None:
        self.scene, self.model, self.parameter = scene, model, parameter
        self.bodies, self.surfaces = contract.names(contract.BODY), contract.surface_values(model.effects)
        self.top = contract.names(contract.TOP)
        self.seat = self.surfaces.index("seat_stiffness") if model.effects.uplift else None
        count = model.layout.surfaces
        self.frame = Frame.of(scene, model)
        self.arrays: dict[str, Any] = {
            "gravity": 0.0,
            "bodies": np.zeros((count + 1, len(self.bodies))),
            "surfaces": np.zeros((count, len(self.surfaces))),
            "top": np.zeros(len(self.top)),
            "q": np.zeros((count, 3)),
            "v": np.zeros((count, 3)),
            "h": np.zeros((count, 2)),
            "motion": None,
            "load": None,
        }
        getattr(self, f"_{parameter.part}")()
        if start is not None:
            self.arrays["q"], self.arrays["h"] = start
            self._state_in_plane()
        if model.effects.uplift:
            self._separations()

    def _bearing(self) -> None:
        name = self.parameter.field
        if name == "gravity":
            self.arrays["gravity"] = 1.0
        else:
            self.arrays["bodies"][0, self.bodies.index(_BASE_FIELDS[name])] = 1.0
            if name == "base_rim_radius":
                self._patch_of_slider(0)

    def _bodies(self) -> None:
        row, *component = self.parameter.index
        name = _MOMENTS[component[0]] if component else self.parameter.field
        self.arrays["bodies"][row + 1, self.bodies.index(name)] = 1.0
        if name == "rim_radius":
            self._patch_of_slider(row + 1)

    def _patch_of_slider(self, body: int) -> None:
        """The contact patch of a surface has the radius of its slider's rim unless it is given."""
        bearing = self.scene.bearing
        for index, surface in enumerate(bearing.surfaces):
            if surface.patch_radius is None and bearing.slider(index) == body:
                self._surface_values(index, "patch_radius")

    def _surfaces(self) -> None:
        (row,), name = self.parameter.index, self.parameter.field
        if name in self.surfaces:
            self.arrays["surfaces"][row, self.surfaces.index(name)] = 1.0
        self._surface_values(row, name)

    def _surface_values(self, row: int, name: str) -> None:
        """The values of a surface that a parameter of its friction law determines; none without a law that needs it."""
        law = self.model.effects.law
        values = {} if law is None else law_parameters(law, self.scene.bearing, row)
        for derived, slope in derived_slopes(values, name).items() if name in values else ():
            if derived in self.surfaces:
                self.arrays["surfaces"][row, self.surfaces.index(derived)] = slope

    def _top(self) -> None:
        name, component = self.parameter.field, self.parameter.index
        if name in ("axial_load", "force", "moment"):
            wrench = np.zeros(6)
            wrench[{"axial_load": 2, "force": 0, "moment": 3}[name] + (component[0] if component else 0)] = (
                -1.0 if name == "axial_load" else 1.0
            )
            self._wrench(np.zeros_like(wrench_pieces(self.scene)[1]), wrench)
        else:
            self.arrays["top"][self.top.index(_MOMENTS[component[0]] if component else name)] = 1.0
        if name in SPRINGS and self.seat is not None:
            self.arrays["surfaces"][:, self.seat] = stiffness_slopes(self.scene.bearing, self.scene.top, name)

    def _load(self) -> None:
        load = self.scene.load
        assert load is not None
        self._wrench(load.until(self.scene.end).coefficients / self.parameter.value, np.zeros(6))

    def _wrench(self, pieces: Array, constant: Array) -> None:
        pieces = np.array(pieces)
        pieces[:, :, 0] += constant
        turned = wrench_in_plane(pieces, self.frame.azimuth)
        if self.model.planar and np.any(np.abs(turned[:, [1, 3, 5]]) > 1e-12 * np.abs(turned).max()):
            raise self._leaves_plane()
        knots = wrench_pieces(self.scene)[0]
        self.arrays["load"] = snapped(knots, turned, time_grid(self.scene).stops)[1]

    def _motion(self) -> None:
        motion = self.scene.motion
        if self.parameter.field == "direction":
            if self.model.planar:
                raise self._leaves_plane()
            coefficients = np.zeros_like(motion.coefficients)
            coefficients[:, 0], coefficients[:, 1] = -motion.coefficients[:, 1], motion.coefficients[:, 0]
        else:
            coefficients = motion.coefficients / self.parameter.value
            coefficients[:, 3:] = 0.0
        turned = _in_plane(motion, coefficients, self.frame.azimuth)
        knots, stops = self.frame.motion.knots, time_grid(self.scene).stops
        self.arrays["motion"] = snapped(knots, turned, stops)[1]
        first = self.top.index("anchor_x")  # the springs of a rig are fixed where the base is at the start
        self.arrays["top"][first : first + 2] = turned[0, :2, 0]

    def _initial_state(self) -> None:
        self.arrays[self.parameter.field][self.parameter.index] = 1.0
        self._state_in_plane()

    def _state_in_plane(self) -> None:
        if self.model.planar:
            try:
                q, v, h = (self.arrays[name] for name in _STATE)
                values = state_in_plane(q, v, h, self.frame.azimuth)
            except InputError:
                raise self._leaves_plane() from None
            self.arrays |= dict(zip(_STATE, values, strict=True))

    def _separations(self) -> None:
        """The separations with which a run starts."""
        arrays = self.arrays
        start = seats_at_start(self.scene, self.model, self.frame, given_state(self.scene, self.model, self.frame))
        motion, load = arrays["motion"], arrays["load"]
        direction = seats.Start(
            **{name: arrays[name] for name in ("gravity", "bodies", "surfaces", "top", "q", "v")},
            f=arrays["h"],
            base=np.zeros((3, 6)) if motion is None else values_at_start(motion),
            load=np.zeros(6) if load is None else load[0, :, 0],
            support=np.zeros(12),
        )
        apart = seats.slopes(self.model, start, direction)
        arrays["q"], arrays["v"] = np.hstack([arrays["q"], apart]), np.hstack([arrays["v"], np.zeros_like(apart)])

    def _leaves_plane(self) -> InputError:
        return InputError(
            f"gradients = {self.parameter.path!r}: it leads out of the vertical plane of this planar model; give "
            "effects.dimension = 'spatial'"
        )


def _in_plane(motion: Motion, coefficients: Array, azimuth: float) -> Array:
    """Coefficients on the knots of `motion` in the frame of a vertical plane."""
    return motion_in_plane(replace(motion, coefficients=coefficients), azimuth).coefficients


ERROR_FACTOR = 3.0  # of the difference of two runs: the error of the finer one is hardly smaller where sliders ring
ADVICE = "leave out the gradients"
RESOLVED_SHARE = 0.5  # of the period of a stuck slider: shorter mean steps resolve its ringing
DAMPING = "give contact_damping = 1e-4 to the surfaces"
RINGING = (
    "the run resolves the undamped ringing of stuck sliders, so that the response is chaotic and has no derivative; "
    f"{DAMPING}, or longer steps (a larger solver.rtol)"
)
UNDAMPED = f"surface {{surface}} has no contact damping, and ringing of its slider disturbs the gradients; {DAMPING}"
RINGS_AT_RIM = (
    "surface {surface} met its rim, and sliders ring after it: contact_damping = {damping:.3g} s is below their "
    "critical damping ({critical:.2g} s), so that gradients contain the phase of the ringing and may not converge as "
    "solver.rtol falls; give contact_damping = {advised:.2g}"
)

INEXACT = {"rim_contact": "met its rim", "lift_off": "lifted off"}  # events after which derivatives are less exact
LARGEST_ERROR = 0.05  # without a note
PEAKS = ("displacement", "top_force", "sliding")
LARGE_ERROR = (
    "surface {surface} {what}, and derivatives of peaks with respect to {path} have errors of up to {share:.0%}: "
    "gradient_summary[path]['error'] and the variables ..._error of the gradient state them; a smaller solver.rtol "
    "reduces them"
)
NOT_MEASURED = "the errors of the gradients are not known, since the run at a tenth of the tolerance failed: {failure}"

CONTACT_IN_LONG_STEP = (
    "energy_gradients = True: at {time:.4g} s surface {surface} meets or leaves its rim in quasi-static steps, whose "
    "input work is then too inaccurate to be differentiated; give solver.method = 'esdirk4', or leave out "
    "energy_gradients"
)


def gradient_parameters(scene: Scene, paths: Sequence[str], energies: bool = False) -> tuple[Parameter, ...]:
    """The parameters at some paths. Raises InputError for an unknown one, and for a run that has no gradients."""
    parameters = parameters_of(scene, paths)
    if energies and not parameters:
        raise InputError(
            "energy_gradients = True: gradients names no parameter; give one, or leave energy_gradients out"
        )
    if not parameters:
        return ()
    if scene.solver.method == "dopri5":
        raise InputError(
            "solver.method = 'dopri5': gradients differentiate implicit steps; give 'implicit' or 'esdirk4', or "
            + ADVICE
        )
    if scene.stop is not None:
        raise InputError(f"stop: gradients need a run of fixed duration; give a duration instead, or {ADVICE}")
    if needs_settling(scene) and (states := [p.path for p in parameters if p.part == "initial_state"]):
        raise InputError(
            f"gradients = {states[0]!r}: tilted plates start in the state after a slow tilting; give an initial_state"
        )
    return parameters


def switching_error(segment: Segment, notes: Sequence[Note]) -> InputError:
    """The error of a run with gradients that would continue with other effects. notes: of the segment."""
    action = next((note.action for note in notes if note.action), "other effects")
    return InputError(
        f"effects: at {segment.run.time:.6g} s the run continues with {action}, and gradients need one model for the "
        f"whole run; give these effects in the scene, or {ADVICE}"
    )


def run_gradients(
    scene: Scene,
    segment: Segment,
    parameters: tuple[Parameter, ...],
    energies: bool,
    rows: int,
    events: Sequence[Event],
) -> Gradients:
    """The derivatives that a run computed. rows: number of its rows that are kept. events: of the run.

    energies: whether those that are integrals over the run are differentiated. Raises InputError where undamped ringing
    was resolved: the response is chaotic, and a derivative has no meaning; and for energies through a rim contact in
    quasi-static steps, see `CONTACT_IN_LONG_STEP`.
    """
    effects = segment.model.effects
    if energies and events and quasistatic(scene, effects):
        raise InputError(CONTACT_IN_LONG_STEP.format(time=events[0].time, surface=events[0].surface))
    terms = energy_terms(energies, effects.uplift)
    gradients = _computed(segment, parameters, terms, rows, is_sprung(scene.top))
    steps, undamped = segment.run.counts["steps"], undamped_surfaces(scene, effects)
    resolved = undamped and segment.run.time < steps * RESOLVED_SHARE * slider_period(
        scene.bearing, load_at_rest(scene)
    )
    for index, parameter in enumerate(parameters):
        if resolved or not all(np.isfinite(values[index]).all() for values in gradients.arrays.values()):
            raise InputError(f"gradients = {parameter.path!r}: {RINGING}")
    return gradients


def _computed(
    segment: Segment, parameters: tuple[Parameter, ...], energies: Sequence[str], count: int, sprung: bool
) -> Gradients:
    """The derivatives of a segment. energies: of `energy_terms`. count: number of its rows that are kept."""
    model, run, azimuth = segment.model, segment.run, segment.azimuth
    rows, events = run.gradient_rows(len(parameters))[:count], run.gradient_events(len(parameters))
    by_parameter = [unpacked(model, rows[:, i], azimuth, sprung) for i in range(len(parameters))]
    constant = {"time", "energy"} | (set() if model.effects.uplift else {"lift", "separation"})
    names = [name for name, values in by_parameter[0].items() if name not in constant and values is not None]
    if model.effects.uplift:
        is_open = model.unpack(run.rows[:count])["compression"] < 0
        for values, slopes in zip(by_parameter, np.moveaxis(rows, 1, 0), strict=True):
            values["lift"] = np.where(is_open, -model.unpack(slopes)["compression"], 0.0)
    vectors = (out_of_plane(events[:, :, 1 + 3 * i : 4 + 3 * i], azimuth, "vector") for i in range(2))
    displacement, force = (np.moveaxis(vector, 1, 0) for vector in vectors)
    arrays = {name: np.array([values[name] for values in by_parameter]) for name in names}
    arrays |= {f"energy_{name}": np.array([values["energy"][name] for values in by_parameter]) for name in energies}
    arrays |= dict(zip(EVENTS, (events[:, :, 0].T, displacement, force), strict=True))
    recorded = run.gradient_extremes(len(parameters))
    extremes = tuple(Extremes.of_run(model.extension.EXTREMES, numbers, azimuth) for numbers in recorded)
    return Gradients(parameters, arrays, extremes)


def with_gradient_errors(result: Result, run: Callable[[Scene], Result]) -> Result:
    """The result with the errors of its derivatives, and with a note where they cannot be measured or are large.

    run: of a scene, with the same derivatives. Raises RunError where it is interrupted.
    """
    scene, gradients = result.alone.scene, result.gradients
    assert gradients is not None
    solver, atol = scene.solver, scene.solver.atol_angle
    tenth = replace(solver, rtol=solver.rtol / 10, atol_angle=None if atol is None else atol / 10)
    event = next(event for event in result.events if event.kind in INEXACT)
    try:
        error = measured_errors(result, run(replace(scene, solver=tenth)))
    except (InputError, RunError) as failure:
        if isinstance(failure, RunError) and failure.status == "interrupted":
            raise
        note = Note(event.time, "gradient", event.surface, 0.0, NOT_MEASURED.format(failure=failure))
        return replace(result, notes=(*result.notes, note))
    largest, path = max((_of_peaks(error, gradients, i), p.path) for i, p in enumerate(gradients.parameters))
    text = LARGE_ERROR.format(surface=event.surface, what=INEXACT[event.kind], path=path, share=largest)
    notes = (Note(event.time, "gradient", event.surface, largest, text),) if largest > LARGEST_ERROR else ()
    return replace(result, gradients=replace(gradients, error=error), notes=(*result.notes, *notes))


def _of_peaks(error: Gradients, gradients: Gradients, index: int) -> float:
    """The largest error of the derivative of a peak, over the largest derivative of peaks of its kind."""
    errors, slopes = (derivatives.extremes[index].arrays for derivatives in (error, gradients))
    return max(float(errors[name].max() / (np.abs(slopes[name]).max() or np.inf)) for name in PEAKS)


def undamped_surfaces(scene: Scene, effects: Effects) -> list[int]:
    """Surfaces (1..n-1) whose slider rings undamped while it is stuck."""
    if effects.sliders == "massless":
        return []
    return [i for i, surface in enumerate(scene.bearing.surfaces, 1) if surface.contact_damping == 0]


def gradient_notes(scene: Scene, effects: Effects, events: Sequence[Event]) -> tuple[Note, ...]:
    """A note where sliders of a run with gradients ring undamped, or ring after a rim contact. events: of the run."""
    undamped = undamped_surfaces(scene, effects)[:1]
    if undamped:
        return tuple(Note(0.0, "ringing", surface, 0.0, UNDAMPED.format(surface=surface)) for surface in undamped)
    contact = next((event for event in events if event.kind == "rim_contact"), None)
    damping = min(surface.contact_damping for surface in scene.bearing.surfaces)
    critical = slider_period(scene.bearing, load_at_rest(scene)) / pi  # T omega/2 = 1
    if contact is None or effects.sliders == "massless" or damping >= critical:
        return ()
    advised = max(1e-3, 1.2 * critical)
    text = RINGS_AT_RIM.format(surface=contact.surface, damping=damping, critical=critical, advised=advised)
    return (Note(contact.time, "ringing", contact.surface, damping, text),)


def measured_errors(result: Result, finer: Result) -> Gradients:
    """Errors of the derivatives of `result`, positive: `ERROR_FACTOR` times their differences from the derivatives of
    `finer`.

    The error of a row is the largest from there to the next event, because errors oscillate. Of an event that `finer`
    has not, and between two instants of the same event, the error is as large as the derivative itself.
    """
    ours, theirs = result.gradients, finer.gradients
    assert ours is not None
    assert theirs is not None
    at, times = result.history.time, finer.history.time
    passed = [np.searchsorted([event.time for event in run.events], at) for run in (result, finer)]
    spans = np.split(np.arange(len(at)), np.flatnonzero(np.any(np.diff(passed) != 0, axis=0)) + 1)
    above = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    share = np.clip((at - times[above - 1]) / (times[above] - times[above - 1]), 0.0, 1.0)

    def of_rows(values: Array, other: Array) -> Array:
        weight = share.reshape(-1, *[1] * (values.ndim - 2))
        error = ERROR_FACTOR * np.abs(values - (1 - weight) * other[:, above - 1] - weight * other[:, above])
        for span in spans:
            error[:, span] = np.maximum.accumulate(error[:, span[::-1]], axis=1)[:, ::-1]
        return error

    same = [(e.kind, e.surface) for e in result.events] == [(e.kind, e.surface) for e in finer.events]

    def of_events(values: Array, other: Array) -> Array:
        return ERROR_FACTOR * np.abs(values - other) if same else np.abs(values)

    errors = {
        name: (of_events if name in EVENTS else of_rows)(values, theirs.arrays[name])
        for name, values in ours.arrays.items()
    }
    slopes, finer_slopes = (
        gradients_of_extremes(run.gradients, run.history, run.recorded_extremes)  # type: ignore[arg-type]  # it has both
        for run in (result, finer)
    )
    peaks = {name: ERROR_FACTOR * np.abs(values - finer_slopes[name]) for name, values in slopes.items()}
    extremes = (Extremes(**{name: values[i] for name, values in peaks.items()}) for i in range(len(ours.parameters)))
    return Gradients(ours.parameters, errors, tuple(extremes))
