"""The run of one bearing: segments, and the change of effects between them where a monitor trips."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import RunError
from msfp_gen.model.compiled import CompiledBearingRun
from msfp_gen.model.model import Model, build_model
from msfp_gen.results.history import BearingRows, Counters
from msfp_gen.results.joining import joined
from msfp_gen.results.note import Note, joined_notes, monitor_notes
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_switching import check_effects, next_effects, stopping_monitors
from msfp_gen.scene.parameters import Parameter
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import is_sprung
from msfp_gen.simulation.gradients import (
    INEXACT,
    gradient_notes,
    gradient_parameters,
    run_gradients,
    start_gradients,
    switching_error,
    with_gradient_errors,
)
from msfp_gen.simulation.memory import outgrown, require_memory
from msfp_gen.simulation.outcome import extremes_of, history_notes, landing_notes, message_of, provenance_of
from msfp_gen.simulation.rows import Segment, events_of, finite_rows, history_of, temperature_row
from msfp_gen.simulation.start import (
    RestartState,
    moves_settling,
    needs_settling,
    settling_scene,
    start_compiled_run,
    start_slopes,
    state_at_rest,
)
from msfp_gen.simulation.system import finish
from msfp_gen.specification.layout import Effects

SegmentParts = list[tuple[Model, Array, float]]  # of segments with rows: model, rows and azimuth of its frame
STEPS_PER_CALL = 4000  # of the compiled run, without the GIL; Ctrl-C, progress and checkpoints are handled in between


def start_bearing(
    scene: Scene,
    *,
    strict: bool = False,
    gradients: Sequence[str] = (),
    energy_gradients: bool = False,
    gradient_errors: bool = True,
) -> BearingRun:
    """The run of a bearing before its first segment; options, errors: see `simulate`."""
    parameters = gradient_parameters(scene, gradients, energy_gradients)
    require_memory([scene] * (1 + len(parameters)))
    options = {"strict": strict, "gradients": gradients, "energy_gradients": energy_gradients}
    run = BearingRun.of(scene, strict, parameters)
    return replace(run, energies=energy_gradients, repeated=options if parameters and gradient_errors else {})


@dataclass(eq=False)
class BearingRun:
    """A run of a bearing; see `simulation.system.Run`.

    scene: the user's. settled: the same with the initial state after settling. strict: see `simulate`. effects:
    of the next segment. segments: that have ended. notes: of these. parameters: of the derivatives; energies: whether
    these include energies that are integrals over the run. slopes: the derivatives of the state after settling, from
    `start_slopes`; None: the run starts as the scene says. repeated: options of the run that measures the errors of
    derivatives; empty: they are not measured.
    """

    scene: Scene
    settled: Scene
    strict: bool
    effects: Effects
    segments: list[Segment] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    parameters: tuple[Parameter, ...] = ()
    energies: bool = False
    slopes: tuple[Array, Array] | None = None
    repeated: dict[str, Any] = field(default_factory=dict)
    _full: bool = False

    @classmethod
    def of(cls, scene: Scene, strict: bool = False, parameters: tuple[Parameter, ...] = ()) -> BearingRun:
        """The run before its first segment. Raises RunError as `settle`."""
        settled, slopes = settle(scene, parameters)
        effects = settled.effect_selection.effects
        return cls(scene, settled, strict, effects, parameters=parameters, slopes=slopes)

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self._run.time

    @property
    def build(self) -> str:
        """Key of the build of the model."""
        return self._model.info.key

    @property
    def without_checkpoint(self) -> str:
        """Why the run cannot be saved."""
        return "a checkpoint holds no gradients" if self.parameters else ""

    @property
    def status(self) -> str:
        """How the present segment stands."""
        return "memory" if self._full else str(self._run.status[0])

    def begin(self) -> None:
        """Build the next model and make its compiled run."""
        check_effects(self.settled, self.effects)
        begin = time.perf_counter()
        self._model = build_model(self.scene.bearing.layout, self.effects, gradients=bool(self.parameters))
        self._run, self._azimuth = self.start_segment(self._model)
        self._earlier = sum(segment.run.row_count for segment in self.segments)
        self._setup = time.perf_counter() - begin

    def start_segment(self, model: Model) -> tuple[CompiledBearingRun, float]:
        """The compiled run of the next segment before its first step, and the azimuth of its frame [rad]."""
        scene, selection = self.settled, self.settled.effect_selection
        last = [segment for segment in self.segments if segment.run.row_count][-1:]  # one that failed at once has none
        at = RestartState.of(last[0].model, last[0].run, last[0].azimuth) if last else None
        end = min(scene.end, selection.plane_until) if model.effects.dimension == "planar" else scene.end
        stops = stopping_monitors(scene, model.effects, self.strict)
        run, azimuth = start_compiled_run(scene, model, selection, end, at, stops)
        if self.parameters:
            start_gradients(run, scene, model, self.parameters, energies=self.energies, start=self.slopes)
        return run, azimuth

    def advance(self) -> bool:
        """Take some steps; False: the segment has ended, or its rows leave no memory for the result."""
        if not self._run.advance(STEPS_PER_CALL):
            return False
        rows = (1 + len(self.parameters)) * (self._earlier + self._run.row_count)
        self._full = outgrown(rows, self.scene.bearing.layout.surfaces)
        return not self._full

    def end(self, status: str, wall: float) -> bool:
        """Add the notes of the segment, and determine the effects of the one after it."""
        segment = Segment(self._model, self._run, self._azimuth, status, wall, self._setup)
        self.segments.append(segment)
        following = None if self.strict else next_effects(self.settled, segment.ending)
        notes = monitor_notes(segment.ending, following)
        self.notes = joined_notes(self.notes, notes)
        if following is None:
            return False
        if self.parameters:
            raise switching_error(segment, notes)
        self.effects = following
        return True

    def snapshot(self) -> bytes:
        """State of the present segment, with all rows."""
        return self._run.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Continue the present segment from a snapshot."""
        self._run.restore(snapshot)

    def result(self, with_initial_row: bool = False) -> Result:
        """The result of all segments. A segment that failed at once has no rows."""
        last = self.segments[-1]
        failed_at_once = not any(segment.run.row_count for segment in self.segments)
        if with_initial_row and failed_at_once and last.status != "interrupted":
            last.run.record_now()
        parts = [(s.model, rows, s.azimuth) for s in self.segments if len(rows := finite_rows(s.run.rows))]
        if not parts:
            raise RunError(message_of(self.settled, last), status=last.status)
        result = _result(self, parts)
        if not (self.repeated and result.succeeded and any(event.kind in INEXACT for event in result.events)):
            return result
        return with_gradient_errors(result, lambda changed: _finished(changed, gradient_errors=False, **self.repeated))


def _finished(scene: Scene, **options: Any) -> Result:
    """The result of a run that reached its end. Raises RunError for another."""
    run = start_bearing(scene, **options)
    finish(run, scene.end)
    result = run.result()
    if not result.succeeded:
        raise RunError(result.message, status=result.status)
    return result


def settle(scene: Scene, parameters: Sequence[Parameter] = ()) -> tuple[Scene, tuple[Array, Array] | None]:
    """A scene whose plates are tilted at the start, with the initial state after a slow tilting; others unchanged.

    Returns the derivatives of this state too, as in `start_slopes`; None: the run starts as the scene says. Raises
    RunError where the tilting fails.
    """
    if not needs_settling(scene):
        return scene, None
    settling = settling_scene(scene)
    moving = [parameter.path for parameter in parameters if moves_settling(parameter, settling)]
    try:
        end = _finished(settling, gradients=moving, gradient_errors=False)
    except RunError as error:
        raise RunError(f"before the start, while the plates are tilted: {error}", status=error.status) from error
    history = end.alone.history
    state = state_at_rest(history.tilt_angles[-1], history.friction_state[-1])
    return replace(scene, initial_state=state), start_slopes(history, end.gradients, parameters)


def _result(run: BearingRun, parts: SegmentParts) -> Result:
    scene, segments, parameters, last = run.scene, run.segments, run.parameters, run.segments[-1]
    effects, counts = last.model.effects, [segment.run.counts for segment in segments]
    events = tuple(event for s in segments for event in events_of(s.run, s.azimuth))
    return Result(
        scene=scene,
        history=partial(_history, parts, scene),
        events=events,
        counters=Counters(
            **{name: sum(int(count[name]) for count in counts) for name in counts[0]},
            wall_time=sum(segment.wall for segment in segments),
        ),
        status=last.status,
        message="" if last.status in ("ok", "stopped") else message_of(scene, last),
        provenance=provenance_of(scene.solver, ", then ".join(segment.model.spec.key for segment in segments))
        | {"build_seconds": f"{sum(segment.setup for segment in segments):.3g}"},
        notes=partial(_notes, tuple(run.notes), effects, gradient_notes(scene, effects, events) if parameters else ()),
        recorded_extremes=extremes_of(segments),
        gradients=run_gradients(scene, last, parameters, run.energies, len(parts[-1][1]), events)
        if parameters
        else None,
    )


def _history(parts: SegmentParts, scene: Scene, _: Result) -> BearingRows:
    """The history of a result."""
    before = temperature_row(parts[-1][0].effects.law, scene)
    histories = [history_of(model, rows, azimuth, is_sprung(scene.top)) for model, rows, azimuth in parts]
    return joined(histories, scene.output_step, before)


def _notes(
    of_monitors: tuple[Note, ...], effects: Effects, of_gradients: tuple[Note, ...], run: Result
) -> tuple[Note, ...]:
    """The notes of a result. effects: of its last segment."""
    scene, history, counters = run.alone
    of_rows = history_notes(scene, effects, history, counters.steps, run.recorded_extremes)
    return of_monitors + of_rows + landing_notes(run.events) + of_gradients
