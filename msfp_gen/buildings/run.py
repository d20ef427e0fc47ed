"""The compiled run of a building: input, bearings with their monitors, changes of their models, and its rows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import reduce
from itertools import groupby
from typing import Any, Protocol, Self

import numpy as np

from msfp_gen.buildings.effects import EffectRequest
from msfp_gen.buildings.extremes import BuildingExtremes, lift_of, padded, temperature_of, vectors
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.spectra import Steps
from msfp_gen.buildings.storey import FREEDOMS
from msfp_gen.common.arrays import Array, parts
from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, RunError, prefixed
from msfp_gen.embedding.two_port import DISSIPATED, compiled_port, scene_at_rest
from msfp_gen.jit.build import load_driver
from msfp_gen.model.compiled import CompiledRun, Port
from msfp_gen.model.model import Model, build_model
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.time_grid import TimeGrid, snapped
from msfp_gen.results.note import Note, joined_notes, monitor_notes
from msfp_gen.scene.effect_switching import Ending, monitor_options, next_effects, stopping_monitors
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.outcome import provenance_of, stopped
from msfp_gen.simulation.start import RestartState, transferred_heights, transferred_state
from msfp_gen.specification.contract import WORKS, names
from msfp_gen.specification.layout import Auto, Effects, ModelSpec


@dataclass(frozen=True, eq=False)
class Change:
    """A bearing that continues with another model.

    bearing: from 0. effects: those that changed. rows: how many the run had. work: integrals of the powers of the
    bearing until then [J]. build: of the new model. notes: of the monitors of the earlier one.
    """

    bearing: int
    effects: dict[str, Any]
    rows: int
    work: list[float]
    build: str
    notes: tuple[Note, ...]

    @classmethod
    def of_table(cls, table: dict[str, Any]) -> Change:
        """The inverse of `asdict`."""
        return cls(**{**table, "notes": tuple(Note(**note) for note in table["notes"])})


def earlier_work(changes: Sequence[Change], bearing: int, shape: tuple[int, ...]) -> Array:
    """Integrals of the powers of a bearing before its model of a row began, shape (rows, integrals) [J]."""
    work = np.zeros(shape)
    for change in changes:
        if change.bearing == bearing:
            work[change.rows :] = change.work
    return work


OF_SURFACES = ("normal", "sliding", "rim", "compression", "temperature")  # of a row; not every model has the last two
STORED = ("kinetic", "potential", "restraint", "rim_stored", "seat_stored")
KEPT = (*OF_SURFACES, *STORED, "work")


@dataclass(frozen=True, eq=False)
class RunningBearing:
    """A bearing in a run.

    request: input that decides its effects. effects: of its model. rest: the scene of the bearing at rest between its
    ends. port: the two-port that the run steps.
    """

    request: EffectRequest
    effects: Effects
    rest: Scene
    model: Model
    port: Port

    @classmethod
    def of(cls, scene: BuildingScene, index: int, effects: Effects) -> Self:
        """A bearing of a building at rest, from 0, with a model of these effects. Raises InputError."""
        mount, load, solver = scene.bearings[index], float(scene.axial_loads[index]), scene.solver
        request = EffectRequest(Auto() if mount.effects is None else mount.effects, solver, scene.end)
        with prefixed(f"scene.bearings[{index}]: "):
            rest = scene_at_rest(mount.bearing, mount.interface, load, effects, solver)
        model = build_model(mount.bearing.layout, rest.modelled)
        stops = stopping_monitors(request, effects, strict=False)
        options = monitor_options(rest, effects, scene.effect_selections[index], stops, noted=("uplift",))
        return cls(request, effects, rest, model, compiled_port(rest, model, load, **options))

    @property
    def shapes(self) -> list[tuple[str, tuple[int, ...]]]:
        """The parts of its row that a run keeps: names and shapes, in order, the same for every model of a layout."""
        shapes = dict.fromkeys(OF_SURFACES, (self.rest.bearing.layout.surfaces,))
        shapes |= {name: tuple(shape) for name, shape in self.model.extension.ROW}
        return [(name, shapes[name]) for name in KEPT]

    @property
    def _indices(self) -> dict[str, Any]:
        """Indices into the row of its model, by field, each of the shape of the field."""
        row = [(name, tuple(shape)) for name, shape in self.model.extension.ROW]
        return parts(np.arange(sum(int(np.prod(shape, dtype=int)) for _, shape in row)), row)

    @property
    def entries(self) -> Array:
        """Indices into the row of its model of the numbers that are kept, shape (kept,) [-]; -1: none, it is 0."""
        indices = self._indices
        kept = [indices.get(name, np.full(shape, -1)) for name, shape in self.shapes]
        return np.concatenate([values.ravel() for values in kept])

    @property
    def faces(self) -> list[int]:
        """Places of contacts and rims in the row of its model, as MSFP_FACES of msfp_building.h."""
        layout, indices = self.rest.bearing.layout, self._indices
        normal, angles, tilts, gap, rim = (
            int(indices[name].flat[0]) for name in ("normal", "angles", "q", "gap", "rim")
        )
        stride = indices["q"].shape[1]
        return [not self.effects.uplift, layout.surfaces, layout.m, normal, angles, tilts, stride, gap, rim]

    @property
    def work(self) -> Array:
        """Integrals of its powers since its model began, at the committed state, shape (works,), [J]."""
        work: Array = self.model.unpack(self.port.row)["work"]
        return work

    def ending(self, status: str, surface: int = 0, value: float = 0.0) -> Ending:
        """How it ended with its model."""
        return Ending(self.effects, status, self.port.time, surface, value, self.port.trips)

    def continue_from(self, other: RunningBearing, ends: Array) -> None:
        """Enter the state of another model of the same bearing; ends: their motion in it, shape (2, 3, 6)."""
        at = RestartState.of_port(other.port)
        parts = (self.rest.bearing, self.rest.top, self.model, at)
        q, v, f = transferred_state(*parts)
        origin, foot = transferred_heights(*parts)
        memory = at.memory_of(self.effects.law)
        self.port.enter(at.time, q, v, f, ends, origin=origin, monitor_heat=at.monitor_heat, foot=foot, memory=memory)


STEPS_PER_CALL = 20  # of the compiled run, without the GIL
BEARINGS_OF_A_THREAD = 8  # fewer are not worth a thread
MOTIONS, ENERGIES = ("displacement", "velocity", "acceleration"), ("damped", "received", "input")


class CompiledBuildingRun(CompiledRun, Protocol):
    """`Run` of `compiled/msfp_building.pyx`."""

    @property
    def status(self) -> tuple[str, int, int, float]:
        """Name; bearing from 1, 0: the building; surface from 1, 0: none; value."""

    @property
    def steps(self) -> Array:
        """Time [s] and accelerations of the nodes at the start and ends of steps, shape (steps + 1, 1 + 6 nodes)."""

    @property
    def peaks(self) -> Array:
        """Peaks over all steps [SI] and when each was reached [s], one number after the other, shape (2, peaks)."""

    def ends(self, bearing: int) -> Array:
        """Motion of the ends of a bearing, from 0, at the present state, shape (2, 3, 6) [SI]."""

    def replace(self, bearing: int, port: Port, entries: Array, faces: Sequence[int]) -> None:
        """Continue with another two-port of a bearing in that state."""

    def advance(self, steps: int) -> bool:
        """Take at most `steps` steps; False where the run has ended."""

    def snapshot(self) -> bytes:
        """State with all rows."""


@dataclass(eq=False)
class BuildingRun:
    """A run of a building, as in `simulation.system.Run`: one segment, in which bearings change their models.

    run: compiled. members: the bearings, which only the run steps. grounds: the different motions of the ground, the
    scene's first. build: hash of all that determines the numbers beside the scene. changes: of the models of bearings,
    in order.
    """

    run: CompiledBuildingRun
    scene: BuildingScene
    members: list[RunningBearing]
    grounds: list[Motion]
    build: str
    changes: list[Change] = field(default_factory=list)
    without_checkpoint = ""

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.run.time

    @property
    def status(self) -> str:
        """How the run stands."""
        return self.run.status[0]

    def begin(self) -> None:
        """Nothing: the run has one segment, which `start_building_run` makes."""

    def advance(self) -> bool:
        """Take some steps, where needed with other models of bearings."""
        return self.run.advance(STEPS_PER_CALL) or self.switch()

    def end(self, status: str, wall: float) -> bool:
        """Keep how the run ended."""
        self._ended = status, wall
        return False

    def result(self, with_initial_row: bool = False) -> BuildingResult:
        """The result; the message of a failed run names the bearing."""
        (status, wall), (_, bearing, surface, value) = self._ended, self.run.status
        message = ""
        if status != "ok":
            who = self.scene.label(bearing - 1) if bearing else "building"
            message = f"{who}: {stopped(self.time, self.scene.end, status, surface, value)}"
        if status != "ok" and not self.run.row_count:
            raise RunError(message, status=status)
        ended = [member.model.spec for member in self.members]
        models = dict.fromkeys([_models(self.scene.every_spec), _models(ended)])
        about = provenance_of(self.scene.solver, ", then ".join(models))
        return replace(building_result(self), provenance=about, status=status, message=message, wall_time=wall)

    @property
    def extremes(self) -> BuildingExtremes:
        """Extremes over all steps."""
        return BuildingExtremes.of_run(self.scene, self.run.peaks, [member.shapes for member in self.members])

    def snapshot(self) -> bytes:
        """State with all rows and all changes of models."""
        return json.dumps(list(map(asdict, self.changes))).encode() + b"\n" + self.run.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Continue, before the first step, from a snapshot of a run of the same scene. Raises ValueError."""
        text, _, state = snapshot.partition(b"\n")
        for table in json.loads(text):
            self._repeat(Change.of_table(table))
        self.run.restore(state)

    def replace(self, member: RunningBearing, change: Change) -> None:
        """Put a member in place of the one of an earlier model."""
        self.members[change.bearing] = member
        self.changes.append(change)
        self.run.replace(change.bearing, member.port, member.entries, member.faces)

    def switch(self) -> bool:
        """Continue with other models of bearings, where the run has ended and their effects permit it.

        False: it has not (docs/effects.md).
        """
        status, failed, surface, value = self.run.status
        if status == "ok" or not self.run.row_count:
            return False
        own = range(len(self.members)) if status == "monitor" else [failed - 1] if failed else []
        changed = False
        for index in own:
            member = self.members[index]
            ending = member.ending(status, surface, value)
            after = next_effects(member.request, ending)
            if after is None or after == member.effects:
                continue
            values = {f.name: (getattr(member.effects, f.name), getattr(after, f.name)) for f in fields(after)}
            effects = {name: now for name, (before, now) in values.items() if now != before}
            rows, work = self.run.row_count, member.work
            work = work + earlier_work(self.changes, index, (rows + 1, len(work)))[-1]
            new = RunningBearing.of(self.scene, index, after)
            new.continue_from(member, self.run.ends(index))
            notes = tuple(monitor_notes(ending, after))
            self.replace(new, Change(index, effects, rows, work.tolist(), new.model.info.key, notes))
            changed = True
        return changed

    @property
    def notes(self) -> tuple[Note, ...]:
        """The notes of the monitors of all bearings until now, each with the number of its bearing."""
        notes: list[Note] = []
        for index, member in enumerate(self.members):
            parts = [change.notes for change in self.changes if change.bearing == index]
            own = reduce(joined_notes, [*parts, monitor_notes(member.ending("ok"), None)], list[Note]())
            notes += [replace(note, bearing=index + 1) for note in own]
        return tuple(notes)

    def _repeat(self, change: Change) -> None:
        """Make a change of an earlier process again, before its state is restored. Raises ValueError."""
        if not 0 <= change.bearing < len(self.members):
            raise ValueError("a change of models of no bearing")
        effects = replace(self.members[change.bearing].effects, **change.effects)
        member = RunningBearing.of(self.scene, change.bearing, effects)
        if member.model.info.key != change.build:
            raise ValueError("made by another build of a model")
        self.replace(member, change)


def start_building_run(scene: BuildingScene, threads: int | None = None, cores: int | None = None) -> BuildingRun:
    """The run of a scene before its first step.

    threads: for the bearings; None: one for each of the cores, with eight bearings each, while that is faster than one
    by the clock. Results do not depend on it. cores: None: all of this process. Raises InputError, RunError.
    """
    members = [RunningBearing.of(scene, index, effects) for index, effects in enumerate(scene.modelled)]
    grounds, ground_of = scene.grounds
    building, solver = scene.building, scene.solver
    grid = TimeGrid.of_histories(grounds, scene.end, (solver.max_step, *(ground.max_step for ground in grounds)))
    same = building.oscillators
    orders, watched, shares = vectors(scene)
    pieces = [snapped(ground.knots, ground.coefficients, grid.stops) for ground in grounds]
    module, key = load_driver("msfp_gen.buildings")
    run: CompiledBuildingRun = module.Run(
        (same.mass, same.damping, same.stiffness),
        same.shares,
        same.dampers,
        same.springs,
        [member.port for member in members],
        (scene.attachments @ same.basis)[..., : len(same.mass)],
        pieces,
        ground_of,
        [member.entries for member in members],
        [member.faces for member in members],
        (orders, watched @ same.basis, shares),
        np.stack([node.rows @ same.basis for node in building.nodes]),
        scene.places - scene.mass_centre,
        weight=float(scene.axial_loads.sum()),
        stops=grid.stops,
        jumps=grid.jumps,
        span_ends=grid.ends,
        span_steps=grid.steps,
        method=members[0].model.extension.METHODS[solver.method],
        rtol=solver.rtol,
        max_step=solver.max_step or 0.0,
        first_step=solver.first_step or 0.0,
        max_steps=float(solver.max_steps),
        end=scene.end,
        output_step=scene.row_step,
        threads=_threads(threads, cores, len(members)),
        timed=threads is None,
    )
    keys = [key, *(member.model.info.key for member in members)]
    return BuildingRun(run, scene, members, grounds, hashlib.sha256(" ".join(keys).encode()).hexdigest())


def unpacked(run: BuildingRun) -> dict[str, Array]:
    """The rows until now by name, of bearings with their index; each of shape (k, ...) [SI]."""
    basis = run.scene.building.oscillators.basis
    shapes = [("time", ()), *((name, (len(basis.T),)) for name in MOTIONS), ("ground", (len(run.grounds), 3, 3))]
    shapes += [(name, ()) for name in ENERGIES]
    for index, member in enumerate(run.members):
        shapes += [(f"wrench {index}", (2, 6)), *((f"{name} {index}", shape) for name, shape in member.shapes)]
    rows: dict[str, Array] = parts(run.run.rows, shapes)
    rows |= {name: rows[name] @ basis.T for name in MOTIONS}
    for index in {change.bearing for change in run.changes}:  # the integrals of their models begin anew
        work = rows[f"work {index}"]
        rows[f"work {index}"] = work + earlier_work(run.changes, index, work.shape)
    return rows


def building_result(run: BuildingRun) -> BuildingResult:
    """The rows of a run until now."""
    rows, bearings, count = unpacked(run), run.scene.every_bearing, len(run.members)
    works = [dict(zip(names(WORKS), rows[f"work {i}"].T, strict=True)) for i in range(count)]

    def of_bearings(name: str) -> list[Array]:
        return [rows[f"{name} {i}"] for i in range(count)]

    alike: dict[str, Any] = {name: rows[name] for name in ("time", *MOTIONS, *ENERGIES)}
    steps = run.run.steps
    return BuildingResult(
        **alike,
        scene=run.scene,
        ground=rows["ground"][:, 0],
        wrench=np.stack(of_bearings("wrench"), axis=1),
        normal_force=padded(of_bearings("normal"), np.nan),
        sliding=padded(of_bearings("sliding"), np.nan),
        rim_force=padded(of_bearings("rim"), np.nan),
        lift=padded(list(map(lift_of, of_bearings("compression"))), np.nan),
        temperature=padded(list(map(temperature_of, bearings, of_bearings("temperature"))), np.nan),
        dissipated=np.stack([sum((work[name] for name in DISSIPATED), np.zeros(1)) for work in works], axis=1),
        interface_dissipated=np.stack([work["top_dissipated"] for work in works], axis=1),
        stored=np.stack(
            [sum((rows[f"{name} {i}"] for name in STORED), works[i]["friction_stored"]) for i in range(count)], axis=1
        ),
        support=rows["ground"][:, run.scene.grounds[1]],
        steps=Steps(steps[:, 0], steps[:, 1:].reshape(len(steps), -1, FREEDOMS)),
        counters=run.run.counts,
        extremes=run.extremes,
        monitored=run.notes,
    )


def _models(specs: Sequence[ModelSpec]) -> str:
    """The models of all bearings in their order; equal ones that follow each other once, with their number."""
    return ", ".join(f"{len([*same])} x {key}" for key, same in groupby(spec.key for spec in specs))


def _threads(threads: int | None, cores: int | None, bearings: int) -> int:
    for name, given in (("threads", threads), ("cores", cores)):
        if given is not None and (isinstance(given, bool) or not isinstance(given, int) or given < 1):
            raise InputError(f"{name} = {given!r}: give a whole number of at least 1")
    return threads or max(1, min(cores or usable_cores(), bearings // BEARINGS_OF_A_THREAD))
