"""Simulate: a scene in, a result out. The loop runs in compiled C; this packs what goes in and names what comes out.

A run is one segment, or several where a watch trips and the run goes on with a model that has what was left out.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen import failures
from msfp_gen.build import build_model
from msfp_gen.checkpoint import EVERY, Checkpoint, Identity, kept_files, segment_file
from msfp_gen.errors import InputError, RunError
from msfp_gen.history import Counters
from msfp_gen.notes import Note, balance_of, notes_of
from msfp_gen.recorded import events_of, history_of, joined
from msfp_gen.segment import Begin, begin_run
from msfp_gen.start import at_rest, needs_settling, prelude
from msfp_gen.switching import stopping, widened
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.layout import Effects
    from msfp_gen.model import Model
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene

Progress = Callable[[float, float], None]
CHUNK = 4000  # steps between two looks at Ctrl-C and at the progress


@dataclass(frozen=True, eq=False)
class Segment:
    """A compiled run that has ended, its model and the azimuth of its frame."""

    model: Model
    run: Any
    azimuth: float
    status: str
    wall: float
    setup: float


def simulate(
    scene: Scene,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = EVERY,
    resume: bool = False,
    strict: bool = False,
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
    strict
        Stop where something that the model leaves out would matter, instead of going on with a model that has it
        (`Auto`) or with a note in the result (`Effects`): docs/effects.md.

    Raises
    ------
    InputError
        The parts of the scene do not go together; the checkpoint is damaged, or of another scene or build.
    RunError
        The run could not go on: the message says when, where and why, `.result` holds what was computed.

    """
    if checkpoint is not None and not resume:
        _refuse_leftovers(checkpoint)
    course = Course.of(scene, strict)
    while course.effects is not None:
        segments = course.segments
        keep = None if checkpoint is None else segment_file(checkpoint, len(segments))
        again = resume and keep is not None and (keep.exists() or not (segments or kept_files(keep)))
        course.took(_segment(course, progress, (keep, every, again)))
    result = course.result()
    if not result.succeeded:
        raise RunError(result.message, status=result.status, result=result)
    return result


@dataclass(eq=False)
class Course:
    """A scene on its way: the segments that have ended, and the effects of the next; None once it has ended for good.

    given: the scene as it was given; scene: with its plates turned. notes: what has been said until now.
    """

    given: Scene
    scene: Scene
    strict: bool
    effects: Effects | None
    segments: list[Segment]
    notes: list[Note]

    @classmethod
    def of(cls, scene: Scene, strict: bool = False) -> Course:
        """The course of a scene, which has not begun. Raises as `simulate`."""
        settled = _settled(scene)
        return cls(scene, settled, strict, settled.choice.effects, [], [])

    def begin(self, model: Model) -> tuple[Any, float]:
        """The run of the next segment with a model that has its effects, and the azimuth of its frame."""
        scene, before, choice = self.scene, self.segments[-1:], self.scene.choice
        at = Begin.of(before[0].model, before[0].run, before[0].azimuth) if before else None
        end = min(scene.end, choice.plane_until) if model.effects.dimension == "planar" else scene.end
        return begin_run(scene, model, choice, end, at, stopping(scene, model.effects, self.strict))

    def took(self, segment: Segment) -> None:
        """Take a segment that has ended, and find what comes next."""
        assert self.effects is not None
        self.segments.append(segment)
        following = None if self.strict else widened(self.scene, self.effects, segment)
        said = {note.kind for note in self.notes if not note.action}
        noted = notes_of(self.scene, segment, following)
        self.notes += [note for note in noted if note.action or note.kind not in said]
        self.effects = following

    def result(self, **provenance: str) -> Result:
        """What came of it; RunError where there is not one row."""
        last = self.segments[-1]
        if not len(last.run.rows):
            raise RunError(_message(self.scene, last), status=last.status)
        return _result(self, provenance)


def _settled(scene: Scene) -> Scene:
    """A scene whose plates are out of level at the start, with the state that turning them leaves."""
    if not needs_settling(scene):
        return scene
    try:
        end = simulate(prelude(scene)).history
    except RunError as error:
        raise RunError(f"before the start, while the plates are turned: {error}", status=error.status) from error
    return replace(scene, initial_state=at_rest(end.tilt_angles[-1], end.friction_state[-1]))


def _refuse_leftovers(checkpoint: str | Path) -> None:
    """A file of a later segment would be met in the middle of the run."""
    if found := [file for file in kept_files(checkpoint) if file != Path(checkpoint)]:
        raise InputError(
            f"checkpoint = {str(checkpoint)!r}: {str(found[0])!r} exists; resume it, or remove it to start anew"
        )


def _segment(course: Course, progress: Progress | None, keeping: tuple[Path | None, float, bool]) -> Segment:
    """Run with one set of effects from where the segments before ended, as far as it goes."""
    scene, effects = course.scene, course.effects
    assert effects is not None
    check(scene, effects)
    begin = time.perf_counter()
    model = build_model(scene.bearing.layout, effects)
    path, every, resume = keeping
    kept = None if path is None else Checkpoint(path, Identity.of(scene, model), every, resume)
    run, azimuth = course.begin(model)
    if kept is not None:
        kept.restore(run)
    ready = time.perf_counter()
    status = _advance(run, scene.end, progress, kept) or run.status[0]
    wall = time.perf_counter() - ready + (kept.wall if kept is not None else 0.0)
    return Segment(model, run, azimuth, status, wall, ready - begin)


def check(scene: Scene, effects: Effects) -> None:
    """InputError where a method cannot take these effects."""
    if effects.sliders == "massless" and scene.solver.method == "dopri5":
        raise InputError(
            "solver.method = 'dopri5': massless sliders have no accelerations to integrate; use 'implicit'"
        )
    if effects.uplift and scene.solver.method == "dopri5":
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


def _message(scene: Scene, segment: Segment) -> str:
    """Why it could not go on, in one line."""
    told = segment.status == "guard"
    why = "; ".join(note.text for note in notes_of(scene, segment, None)) if told else None
    return failures.message(scene, segment.model, segment.run, segment.status, why)


def _result(course: Course, more: dict[str, str]) -> Result:
    from msfp_gen.result import Result

    scene, segments = course.given, course.segments
    last = segments[-1]
    counts = [{k: int(n) for k, n in segment.run.counts.items()} for segment in segments]
    total = Counters(**{name: sum(count[name] for count in counts) for name in counts[0]})
    provenance = {
        "msfp_gen": __version__,
        "model": ", then ".join(segment.model.spec.key for segment in segments),
        "python": platform.python_version(),
        "numpy": _numpy(),
        "method": scene.solver.method,
        "rtol": f"{scene.solver.rtol:g}",
        "build_seconds": f"{sum(segment.setup for segment in segments):.3g}",
        **more,
    }
    history = joined([history_of(s.model, s.run.rows, s.azimuth) for s in segments], scene.output_step)
    return Result(
        scene=scene,
        history=history,
        events=tuple(event for s in segments for event in events_of(s.model, s.run, s.azimuth)),
        counters=replace(total, wall_time=sum(segment.wall for segment in segments)),
        status=last.status,
        message="" if last.status in ("ok", "stopped") else _message(scene, last),
        provenance=provenance,
        notes=tuple(course.notes) + balance_of(scene, history),
    )


def _numpy() -> str:
    import numpy as np

    return np.__version__
