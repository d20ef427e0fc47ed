"""Many scenes at once: runs of one model take turns on a core, each evaluated in a lane of a vector (docs/batch.md)."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event, Lock
from typing import TYPE_CHECKING, Any

from msfp_gen.build import build_model
from msfp_gen.errors import InputError, RunError
from msfp_gen.lanes import alone_because, chosen_width, too_few
from msfp_gen.layout import ModelSpec
from msfp_gen.scene import Scene
from msfp_gen.simulation import Course, Segment, check

if TYPE_CHECKING:
    from msfp_gen.model import Model
    from msfp_gen.result import Result

Progress = Callable[[int, int], None]
CHUNK = 40_000  # evaluations between two looks at Ctrl-C


@dataclass(eq=False)
class Leg:
    """A scene in the batch: its place in the list, and how it is on its way."""

    place: int
    course: Course
    how: tuple[str, ...] = ()

    @property
    def kind(self) -> tuple[ModelSpec, str]:
        """What legs must share to run together: the model, and why it runs alone if it does."""
        assert self.course.effects is not None
        effects = self.course.effects
        spec = ModelSpec(self.course.scene.bearing.layout, effects)
        return spec, alone_because(effects, self.course.scene.solver.method)


def simulate_batch(
    scenes: Iterable[Scene],
    *,
    workers: int = 1,
    lanes: int | None = None,
    strict: bool = False,
    progress: Progress | None = None,
) -> list[Result]:
    """Integrate many scenes: those of one model side by side in the lanes of a vector.

    Every run has its own steps, events and end, by the same code as `simulate`; results differ from those of `simulate`
    by what rounding makes of them, within the tolerance of the scene.

    Parameters
    ----------
    scenes
        Scenes that may differ in everything; those with the same layout and effects share a model and its lanes.
    workers
        Threads to share the work among: as many as there are cores to use.
    lanes
        Runs side by side: 8 (AVX-512), 4 (AVX2) or 2; 0: one at a time. None: `MSFP_GEN_LANES`, else what this
        processor has.
    strict
        As of `simulate`.
    progress
        Called with how many scenes have ended, and how many there are.

    Returns
    -------
    list of Result
        In the order of the scenes. A run that could not go on raises nothing: its `status` and `message` say so, and
        its history goes as far as it came. `provenance["batch"]` says how each was run, and why if one at a time.

    Raises
    ------
    InputError
        The parts of a scene do not go together: the message begins with its place. Nothing is run then.
    RunError
        A scene has no history at all: it failed at its very start, and nothing can be said of where it begins.

    """
    given = _checked(scenes, workers)
    width = chosen_width(lanes)
    todo = [Leg(place, _course(scene, place, strict)) for place, scene in enumerate(given)]
    desk = Desk(len(given), progress)
    while todo:
        groups: dict[tuple[ModelSpec, str], list[Leg]] = {}
        for leg in todo:
            groups.setdefault(leg.kind, []).append(leg)
        todo = []
        for (spec, reason), legs in groups.items():
            why = reason or _reason(width, len(legs) / workers)
            many = 0 if why else width
            begin = time.perf_counter()
            model = build_model(spec.layout, spec.effects, lanes=many)
            setup = (time.perf_counter() - begin) / len(legs)
            todo += _run(Queue(legs, model, setup, f"{many} lanes" if many else f"one at a time: {why}", desk), workers)
    return [result for _, result in sorted(desk.results.items())]


def _reason(width: int, scenes: float) -> str:
    """Why scenes of one model, so many a worker, run one at a time; empty where they go in lanes."""
    if not width:
        return "no lanes here, or none asked for"
    return "too few scenes of its model" if scenes <= too_few(width) else ""


def _checked(scenes: Iterable[Scene], workers: int) -> list[Scene]:
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError(f"workers = {workers!r}: give a whole number of threads, 1 or more")
    if isinstance(scenes, Scene):
        raise InputError("scenes: this is one scene; give a list of them")
    given = list(scenes)
    for place, scene in enumerate(given):
        if not isinstance(scene, Scene):
            raise InputError(f"scenes[{place}]: a {type(scene).__name__} is no scene; give what load_scene returns")
    return given


def _course(scene: Scene, place: int, strict: bool) -> Course:
    try:
        course = Course.of(scene, strict)
        assert course.effects is not None
        check(course.scene, course.effects)
    except InputError as error:
        raise InputError(f"scenes[{place}]: {error}") from error
    except RunError as error:
        raise RunError(f"scenes[{place}]: {error}", status=error.status, result=error.result) from error
    return course


class Desk:
    """Where results are handed in, by any thread."""

    def __init__(self, count: int, progress: Progress | None) -> None:
        self.results: dict[int, Result] = {}
        self.lock = Lock()
        self.count, self.progress = count, progress

    def hand_in(self, leg: Leg) -> None:
        """Keep what came of a scene that has ended for good; its rows of the runtime are freed with its course."""
        run = leg.course.segments[-1].run
        if not len(run.rows):
            run.record_now()
        try:
            result = leg.course.result(batch=", then ".join(dict.fromkeys(leg.how)))
        except (RunError, IndexError) as error:
            status = run.status[0]
            raise RunError(f"scenes[{leg.place}]: failed at the start ({status})", status=status) from error
        with self.lock:
            self.results[leg.place] = result
            if self.progress is not None:
                self.progress(len(self.results), self.count)


@dataclass(eq=False)
class Queue:
    """Legs of one model that wait for a lane; threads take from it. Long ones first, so that lanes end together."""

    legs: Sequence[Leg]
    model: Model
    setup: float
    how: str
    desk: Desk

    def __post_init__(self) -> None:
        self.waiting = deque(sorted(self.legs, key=lambda leg: -leg.course.scene.end))
        self.on: list[Leg] = []  # what goes on with another model
        self.stop = Event()

    def next(self) -> tuple[Leg, Any, float, float] | None:
        """A leg, its run and the azimuth of its frame, and what preparing it took; None: there is none left."""
        try:
            leg = self.waiting.popleft()
        except IndexError:
            return None
        begin = time.perf_counter()
        run, azimuth = leg.course.begin(self.model)
        return leg, run, azimuth, time.perf_counter() - begin

    def ended(self, job: tuple[Leg, Any, float, float], wall: float) -> bool:
        """A run has ended: hand in what came of its scene, or let that go on with a wider model (False)."""
        leg, run, azimuth, setup = job
        leg.how = (*leg.how, self.how)
        leg.course.took(Segment(self.model, run, azimuth, run.status[0], wall, setup + self.setup))
        if leg.course.effects is None:
            self.desk.hand_in(leg)
            return True
        self.on.append(leg)
        return False


def _run(queue: Queue, workers: int) -> list[Leg]:
    """Run all legs of a queue; those that go on with another model."""
    work = _in_lanes if hasattr(queue.model.extension, "Batch") else _one_by_one
    if workers == 1:
        work(queue)
        return queue.on
    with ThreadPoolExecutor(workers) as pool:
        tasks = [pool.submit(work, queue) for _ in range(min(workers, len(queue.legs)))]
        try:
            for task in tasks:
                task.result()
        except BaseException:
            queue.stop.set()
            raise
    return queue.on


def _one_by_one(queue: Queue) -> None:
    while not queue.stop.is_set() and (job := queue.next()) is not None:
        begin = time.perf_counter()
        while job[1].advance(CHUNK // 8) and not queue.stop.is_set():
            pass
        queue.ended(job, time.perf_counter() - begin)


def _in_lanes(queue: Queue) -> None:
    """Runs of one thread: twice as many as lanes, so that there are always enough of a kind to fill a vector."""
    batch = queue.model.extension.Batch()
    width = queue.model.extension.WIDTH
    clock = Shares()
    jobs: dict[int, tuple[Leg, Any, float, float]] = {}
    free = list(range(min(2 * width, queue.model.extension.MOST_RUNS)))
    while not queue.stop.is_set():
        while free and (job := queue.next()) is not None:
            slot = free.pop()
            jobs[slot] = job
            batch.put(slot, job[1])
        if not jobs:
            return
        begin = time.perf_counter()
        done = batch.advance(CHUNK)
        clock.passed(time.perf_counter() - begin, [job[1] for job in jobs.values()])
        for slot in done:
            job = jobs.pop(slot)
            if queue.ended(job, clock.of(job[1])):
                batch.reuse(job[1])
            free.append(slot)


class Shares:
    """Wall time of runs that share a core, each by its evaluations."""

    def __init__(self) -> None:
        self.seen: dict[int, tuple[int, float]] = {}

    def passed(self, seconds: float, runs: Sequence[Any]) -> None:
        """So much time has passed for these runs together."""
        counts = {id(run): int(run.counts["evaluations"]) for run in runs}
        new = {key: count - self.seen.get(key, (0, 0.0))[0] for key, count in counts.items()}
        whole = max(sum(new.values()), 1)
        for key, count in counts.items():
            self.seen[key] = (count, self.seen.get(key, (0, 0.0))[1] + seconds * new[key] / whole)

    def of(self, run: Any) -> float:
        """The time of a run that has ended, which is forgotten."""
        return self.seen.pop(id(run))[1]
