"""`simulate`: runs a scene and returns its result. The time integration is compiled C.

The run of a bearing is one segment, or several: where a monitor trips, the next one continues with a model that has
the effect. That of a building changes the models of its bearings by itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, overload

from msfp_gen.buildings.dataset import scene_text
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.identity import fingerprint
from msfp_gen.model.compiled import Run
from msfp_gen.model.model import Model, build_model
from msfp_gen.results.history import Counters, History
from msfp_gen.results.joining import joined
from msfp_gen.results.note import Note, joined_notes, monitor_notes
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_switching import check, next_effects, stopping_monitors
from msfp_gen.scene.file.loader import dumps
from msfp_gen.scene.parameters import Parameter
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import is_sprung
from msfp_gen.simulation.building_run import result_of as building_result
from msfp_gen.simulation.building_run import start_run as start_building
from msfp_gen.simulation.checkpoint import (
    EVERY,
    Checkpoint,
    Identity,
    Resumable,
)
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
from msfp_gen.simulation.outcome import (
    Progress,
    extremes_of,
    history_notes,
    landing_notes,
    message_of,
    provenance_of,
    stopped,
)
from msfp_gen.simulation.rows import (
    Segment,
    events_of,
    finite_rows,
    history_of,
    start_temperatures,
)
from msfp_gen.simulation.start import (
    RestartState,
    moves_settling,
    needs_settling,
    settling_scene,
    start_run,
    start_slopes,
    state_at_rest,
)
from msfp_gen.specification.layout import Effects

# Of the compiled runs of a bearing, and of a building, without the GIL; Ctrl-C, progress and checkpoints are handled in
# between.
STEPS_PER_CALL, BUILDING_STEPS_PER_CALL = 4000, 20


@overload
def simulate(
    scene: BuildingScene,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = ...,
    resume: bool = False,
    threads: int | None = None,
) -> BuildingResult: ...


@overload
def simulate(
    scene: Scene,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = ...,
    resume: bool = False,
    strict: bool = False,
    gradients: Sequence[str] = (),
    energy_gradients: bool = False,
    gradient_errors: bool = True,
) -> Result: ...


@overload
def simulate(scene: Scene | BuildingScene, *, progress: Progress | None = None) -> Any: ...


def simulate(
    scene: Scene | BuildingScene,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = EVERY,
    resume: bool = False,
    strict: bool = False,
    gradients: Sequence[str] = (),
    energy_gradients: bool = False,
    gradient_errors: bool = True,
    threads: int | None = None,
) -> Result | BuildingResult:
    """Integrate a scene.

    Parameters
    ----------
    scene
        Of a bearing or of a building; see `Scene` and `BuildingScene`. The options from `strict` to `gradient_errors`
        are those of a bearing.
    progress
        Called repeatedly with the time reached and the end of the run [s]. An exception in it ends the run.
    checkpoint
        File of the checkpoint, written at intervals, when the run is interrupted and when it ends. It must not exist
        unless `resume` is given. It is not removed after the run.
    every
        Wall time between two checkpoints [s].
    resume
        Continue from the state in `checkpoint`; the rows are bit by bit those of an uninterrupted run.
    strict
        Stop where a monitor trips (status `monitor`), instead of continuing with a model that includes the effect
        (`Auto`) or with a note in the result (`Effects`): docs/effects.md.
    gradients
        Paths of parameters (`bearing.surfaces[*].friction`) by which the run is differentiated: docs/gradients.md.
    energy_gradients
        Whether the energies that are integrals over the run are differentiated too, at up to four fifths more cost.
    gradient_errors
        Whether the errors of the derivatives of a run that meets a rim or lifts off are measured, by another run at a
        tenth of its tolerance.
    threads
        For the bearings of a building; None: chosen. Results do not depend on their number.

    Returns
    -------
    Result, or BuildingResult of a building
        Rows, events, counters and notes of the run.

    Raises
    ------
    InputError
        The method does not support the effects; the rows do not fit into memory; the checkpoint is damaged, or
        of another scene or build; a parameter does not exist, or the run has no gradients; an option is none of this
        scene.
    RunError
        The run failed: the message gives time, bearing, surface and cause, `.result` has the rows until then.

    """
    if getattr(scene, "fidelity", "") == "backbone":
        raise InputError("fidelity = 'backbone': only studies run it, it keeps no history; give 'equivalent'")
    if checkpoint is None and resume:
        raise InputError("resume: needs the checkpoint to resume from; give checkpoint")
    if isinstance(scene, BuildingScene):
        options = {
            "strict": strict, "gradients": bool(gradients), "energy_gradients": energy_gradients,
            "gradient_errors": not gradient_errors,
        }  # fmt: skip
        if unknown := [name for name, value in options.items() if value]:
            raise InputError(f"{unknown[0]}: the run of a building has no such option; leave it out")
        return _simulate_building(scene, progress, checkpoint, every, resume, threads)
    if not isinstance(scene, Scene):
        raise InputError(f"scene: a {type(scene).__name__} is no scene; give what load_scene returns")
    if threads is not None:
        raise InputError("threads: the run of one bearing has no such option; leave it out")
    parameters = gradient_parameters(scene, gradients, checkpoint, energy_gradients)
    require_memory([scene] * (1 + len(parameters)))
    sequence = replace(RunSequence.of(scene, strict, parameters), energies=energy_gradients)
    saved = None if checkpoint is None else Checkpoint(checkpoint, Identity.of(sequence.settled), every, resume)
    while sequence.effects is not None:
        sequence.run_segment(progress, saved)
    result = sequence.result()
    if not result.succeeded:
        raise RunError(result.message, status=result.status, result=result)
    if gradient_errors and parameters and any(event.kind in INEXACT for event in result.events):

        def again(changed: Scene) -> Result:
            return simulate(
                changed,
                progress=progress,
                strict=strict,
                gradients=gradients,
                energy_gradients=energy_gradients,
                gradient_errors=False,
            )

        return with_gradient_errors(result, again)
    return result


@dataclass(eq=False)
class RunSequence:
    """The segments of a run that have ended, and the effects of the next one.

    scene: that of the user. settled: the same with the initial state after settling. effects: of the next segment;
    None: the run has ended. notes: those of the segments that have ended. parameters: of the derivatives; energies:
    whether these include energies that are integrals over the run. start: the derivatives of the state after settling,
    as of `start_slopes`; None: the run starts as the scene says.
    """

    scene: Scene
    settled: Scene
    strict: bool
    effects: Effects | None
    segments: list[Segment]
    notes: list[Note]
    parameters: tuple[Parameter, ...] = ()
    energies: bool = False
    start: tuple[Array, Array] | None = None

    @classmethod
    def of(cls, scene: Scene, strict: bool = False, parameters: tuple[Parameter, ...] = ()) -> RunSequence:
        """The sequence before its first segment. Raises RunError as `settle`."""
        settled, start = settle(scene, parameters)
        effects = settled.effect_selection.effects
        return cls(scene, settled, strict, effects, [], [], parameters=parameters, start=start)

    def start_segment(self, model: Model) -> tuple[Run, float]:
        """The compiled run of the next segment before its first step, and the azimuth of its frame [rad]."""
        scene, selection = self.settled, self.settled.effect_selection
        last = [segment for segment in self.segments if segment.run.row_count][-1:]  # one that failed at once has none
        at = RestartState.of(last[0].model, last[0].run, last[0].azimuth) if last else None
        end = min(scene.end, selection.plane_until) if model.effects.dimension == "planar" else scene.end
        stops = stopping_monitors(scene, model.effects, self.strict)
        run, azimuth = start_run(scene, model, selection, end, at, stops)
        if self.parameters:
            start_gradients(run, scene, model, self.parameters, energies=self.energies, start=self.start)
        return run, azimuth

    def run_segment(self, progress: Progress | None = None, checkpoint: Checkpoint | None = None) -> None:
        """Build the next model and run it to its end, add its notes, and determine the effects of the segment after it.

        checkpoint: of the run, from which the segment continues if it has it.
        """
        scene, effects = self.settled, self.effects
        assert effects is not None
        check(scene, effects)
        start = time.perf_counter()
        model = build_model(scene.bearing.layout, effects, gradients=bool(self.parameters))
        run, azimuth = self.start_segment(model)
        if checkpoint is not None:
            checkpoint.begin(run, model.info.key)
        ready = time.perf_counter()
        earlier, copies = sum(segment.run.row_count for segment in self.segments), 1 + len(self.parameters)

        def step() -> bool:
            return run.advance(STEPS_PER_CALL)

        def is_full() -> bool:
            return outgrown(copies * (earlier + run.row_count), scene.bearing.layout.surfaces)

        status = _advance(run, step, scene.end, progress, checkpoint, is_full)
        wall = time.perf_counter() - ready + (checkpoint.wall if checkpoint is not None else 0.0)
        segment = Segment(model, run, azimuth, status, wall, ready - start)
        self.segments.append(segment)
        following = None if self.strict else next_effects(scene, segment.ending)
        notes = monitor_notes(segment.ending, following)
        self.notes = joined_notes(self.notes, notes)
        if self.parameters and following is not None:
            raise switching_error(segment, notes)
        if checkpoint is not None and following is not None:
            checkpoint.end(run)
        self.effects = following

    def result(self, with_initial_row: bool = False) -> Result:
        """The result of all segments; raises RunError where none has a row. A segment that failed at once has none.

        with_initial_row: record the initial state of a run that failed before its first row, if that state is finite.
        """
        last = self.segments[-1]
        if with_initial_row and not any(segment.run.row_count for segment in self.segments):
            last.run.record_now()
        parts = [(s, rows) for s in self.segments if len(rows := finite_rows(s.run.rows))]
        if not parts:
            raise RunError(message_of(self.settled, last), status=last.status)
        sprung, before = is_sprung(self.scene.top), start_temperatures(self.segments, self.scene)
        histories = [history_of(segment.model, rows, segment.azimuth, sprung) for segment, rows in parts]
        return _result(self, joined(histories, self.scene.output_step, before))


def state_at_start(scene: Scene, strict: bool = False) -> Result:
    """The result of a run that fails before its first row: its initial state, so that a table has a row of it.

    Raises RunError where that state is not finite.
    """
    sequence = RunSequence.of(scene, strict)
    while sequence.effects is not None:
        sequence.run_segment()
    return sequence.result(with_initial_row=True)


def settle(scene: Scene, parameters: Sequence[Parameter] = ()) -> tuple[Scene, tuple[Array, Array] | None]:
    """A scene whose plates are tilted at the start, with the initial state after a slow tilting; others unchanged.

    Returns the derivatives of that state too, as of `start_slopes`; None: the run starts as the scene says. Raises
    RunError where the tilting fails.
    """
    if not needs_settling(scene):
        return scene, None
    settling = settling_scene(scene)
    moving = [parameter.path for parameter in parameters if moves_settling(parameter, settling)]
    try:
        end = simulate(settling, gradients=moving, gradient_errors=False)
    except RunError as error:
        raise RunError(f"before the start, while the plates are tilted: {error}", status=error.status) from error
    state = state_at_rest(end.history.tilt_angles[-1], end.history.friction_state[-1])
    return replace(scene, initial_state=state), start_slopes(end.history, end.gradients, parameters)


def _advance(
    run: Resumable,
    step: Callable[[], bool],
    end: float,
    progress: Progress | None,
    checkpoint: Checkpoint | None,
    is_full: Callable[[], bool] | None = None,
) -> str:
    """Take all steps of a run; its status: "interrupted" after Ctrl-C, "memory" where it is full.

    step: some steps; False: they were the last. end: of the run [s].
    """
    status = ""
    try:
        while step():
            if is_full is not None and is_full():
                status = "memory"
                break
            if checkpoint is not None:
                checkpoint.save_if_due(run)
            if progress is not None:
                progress(run.time, end)
    except KeyboardInterrupt:
        status = "interrupted"
    # After a failure the last checkpoint is kept: resumed from there, the run fails again in the same way.
    if checkpoint is not None and run.status[0] in ("ok", "stopped"):
        checkpoint.save(run)
    return status or str(run.status[0])


def _result(sequence: RunSequence, history: History) -> Result:
    scene, segments, parameters, last = sequence.scene, sequence.segments, sequence.parameters, sequence.segments[-1]
    counts = [{k: int(n) for k, n in segment.run.counts.items()} for segment in segments]
    total = Counters(**{name: sum(count[name] for count in counts) for name in counts[0]})
    events = tuple(event for s in segments for event in events_of(s.run, s.azimuth))
    return Result(
        scene=scene,
        history=history,
        events=events,
        counters=replace(total, wall_time=sum(segment.wall for segment in segments)),
        status=last.status,
        message="" if last.status in ("ok", "stopped") else message_of(scene, last),
        provenance=provenance_of(scene.solver, ", then ".join(segment.model.spec.key for segment in segments))
        | {"build_seconds": f"{sum(segment.setup for segment in segments):.3g}"},
        notes=tuple(sequence.notes)
        + history_notes(scene, last.model.effects, history, total.steps)
        + landing_notes(events)
        + (gradient_notes(scene, last.model.effects, events) if parameters else ()),
        recorded_extremes=extremes_of(segments),
        gradients=run_gradients(scene, last, parameters, sequence.energies, len(history.time), events)
        if parameters
        else None,
    )


def _simulate_building(
    scene: BuildingScene,
    progress: Progress | None,
    checkpoint: str | Path | None,
    every: float,
    resume: bool,
    threads: int | None,
) -> BuildingResult:
    """`simulate` of a building; the RunError names the bearing."""
    run = start_building(scene, threads)
    saved = None
    if checkpoint is not None:
        motion = {"name": scene.motion.name, "duration": scene.motion.duration}
        identity = Identity(scene_text(scene) + dumps({"motion": motion}), fingerprint(scene))
        saved = Checkpoint(checkpoint, identity, every, resume)
        saved.begin(run, run.build)
    begin = time.perf_counter()
    status = _advance(run, lambda: run.run.advance(BUILDING_STEPS_PER_CALL) or run.switch(), scene.end, progress, saved)
    wall = time.perf_counter() - begin + (0.0 if saved is None else saved.wall)
    message, result = "", None
    if status != "ok":
        _, bearing, surface, value = run.status
        who = scene.label(bearing - 1) if bearing else "building"
        message = f"{who}: {stopped(run.time, scene.end, status, surface, value)}"
    if status == "ok" or run.run.row_count:
        about = provenance_of(scene.solver, ", ".join(spec.key for spec in scene.specs))
        ended: dict[str, Any] = {"status": status, "message": message, "wall_time": wall}
        result = replace(building_result(run), provenance=about, **ended)
    if result is None or message:
        raise RunError(message, status=status, result=result)
    return result
