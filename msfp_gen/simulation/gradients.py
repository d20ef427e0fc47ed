"""Gradients of a run: which runs have them, what was computed, and the errors by a run of smaller tolerance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import pi
from typing import TYPE_CHECKING, Protocol

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.gradient import EVENTS, Gradients, energy_terms, gradients_of_extremes
from msfp_gen.results.note import Note
from msfp_gen.scene.effect_selection import quasistatic, slider_period
from msfp_gen.scene.parameters import Parameter, parameters_of
from msfp_gen.scene.top import is_sprung
from msfp_gen.simulation.settling import needs_settling

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.results.history import Event
    from msfp_gen.scene.scene import Scene
    from msfp_gen.simulation.segment import Segment
    from msfp_gen.specification.layout import Effects

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


class RunParts(Protocol):
    """What is needed of a run that has ended: its scene, the parameters of its derivatives and its segments."""

    scene: Scene
    parameters: tuple[Parameter, ...]
    energies: bool
    segments: list[Segment]


def gradient_parameters(
    scene: Scene, paths: Sequence[str], checkpoint: object = None, stream: object = None, energies: bool = False
) -> tuple[Parameter, ...]:
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
    if checkpoint is not None:
        raise InputError(f"checkpoint = {str(checkpoint)!r}: a checkpoint holds no gradients; leave out one of them")
    if stream is not None:
        raise InputError(f"stream = {str(stream)!r}: gradients are kept in memory; leave out one of them")
    return parameters


def switching_error(segment: Segment, notes: Sequence[Note]) -> InputError:
    """The error of a run with gradients that would continue with other effects. notes: of the segment."""
    action = next((note.action for note in notes if note.action), "other effects")
    return InputError(
        f"effects: at {segment.run.time:.6g} s the run continues with {action}, and gradients need one model for the "
        f"whole run; give these effects in the scene, or {ADVICE}"
    )


def run_gradients(sequence: RunParts, rows: int, events: Sequence[Event]) -> Gradients | None:
    """The derivatives that a run computed; None without parameters. rows: number of its rows that are kept.

    events: of the run. Raises InputError where undamped ringing was resolved: the response is chaotic, and a derivative
    has no meaning; and for energies through a rim contact in quasi-static steps, see `CONTACT_IN_LONG_STEP`.
    """
    if not sequence.parameters:
        return None
    scene, segment = sequence.scene, sequence.segments[-1]
    azimuth, sprung = segment.azimuth, is_sprung(scene.top)
    if sequence.energies and events and quasistatic(scene, segment.model.effects):
        raise InputError(CONTACT_IN_LONG_STEP.format(time=events[0].time, surface=events[0].surface))
    energies = energy_terms(sequence.energies, segment.model.effects.uplift)
    gradients = Gradients.of_run(sequence.parameters, energies, segment.model, segment.run, rows, azimuth, sprung)
    steps, undamped = segment.run.counts["steps"], undamped_surfaces(scene, segment.model.effects)
    resolved = undamped and segment.run.time < steps * RESOLVED_SHARE * slider_period(scene)
    for parameter, size in zip(gradients.parameters, gradients.largest_numbers(), strict=True):
        if resolved or not np.isfinite(size):
            raise InputError(f"gradients = {parameter.path!r}: {RINGING}")
    return gradients


def with_gradient_errors(result: Result, run: Callable[[Scene], Result]) -> Result:
    """The result with the errors of its derivatives, and with a note where they cannot be measured or are large.

    run: of a scene, with the same derivatives. Raises RunError where it is interrupted.
    """
    scene, gradients = result.scene, result.gradients
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


def gradient_notes(sequence: RunParts, events: Sequence[Event]) -> tuple[Note, ...]:
    """A note where sliders of a run with gradients ring undamped, or ring after a rim contact. events: of the run."""
    if not sequence.parameters:
        return ()
    effects = sequence.segments[-1].model.effects
    undamped = undamped_surfaces(sequence.scene, effects)[:1]
    if undamped:
        return tuple(Note(0.0, "ringing", surface, 0.0, UNDAMPED.format(surface=surface)) for surface in undamped)
    contact = next((event for event in events if event.kind == "rim_contact"), None)
    damping = min(surface.contact_damping for surface in sequence.scene.bearing.surfaces)
    critical = slider_period(sequence.scene) / pi  # T omega/2 = 1
    if contact is None or effects.sliders == "massless" or damping >= critical:
        return ()
    advised = max(1e-3, 1.2 * critical)
    text = RINGS_AT_RIM.format(surface=contact.surface, damping=damping, critical=critical, advised=advised)
    return (Note(contact.time, "ringing", contact.surface, damping, text),)


def measured_errors(result: Result, finer: Result) -> Gradients:
    """Errors of the derivatives of `result`, positive: `ERROR_FACTOR` times their differences from those of `finer`.

    That of a row is the largest from there to the next event, because errors oscillate. Of an event that `finer` has
    not, and between two instants of the same event, the error is as large as the derivative itself.
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
    return Gradients(ours.parameters, errors, _of_extremes(result, finer))


def _of_extremes(result: Result, finer: Result) -> tuple[Extremes, ...]:
    """Errors of the derivatives of the extremes that the summary states, by parameter."""
    ours, theirs = _slopes(result), _slopes(finer)
    count = len(next(iter(ours.values())))
    errors = {name: ERROR_FACTOR * np.abs(values - theirs[name]) for name, values in ours.items()}
    return tuple(Extremes(**{name: values[i] for name, values in errors.items()}) for i in range(count))


def _slopes(result: Result) -> dict[str, Array]:
    assert result.gradients is not None
    assert result.recorded_extremes is not None
    return gradients_of_extremes(result.gradients, result.history, result.recorded_extremes)
