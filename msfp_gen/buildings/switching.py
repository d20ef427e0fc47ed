"""Change of the models of bearings in the run of a building, where a monitor asks for it (docs/effects.md)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.member import Member
from msfp_gen.common.arrays import Array
from msfp_gen.results.monitor_notes import monitor_notes
from msfp_gen.results.note import Note
from msfp_gen.scene.effect_switching import next_effects
from msfp_gen.specification.layout import Effects

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msfp_gen.buildings.compiled_run import BuildingRun

BearingNotes = tuple[tuple[int, Note], ...]
"""Notes of monitors, each with the bearing that it is about, from 0."""


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

    @property
    def table(self) -> dict[str, Any]:
        """As plain data."""
        return {**vars(self), "notes": [vars(note) for note in self.notes]}

    @classmethod
    def of_table(cls, table: dict[str, Any]) -> Change:
        """The inverse of `table`."""
        return cls(**{**table, "notes": tuple(Note(**each) for each in table["notes"])})


def switch(run: BuildingRun) -> bool:
    """Continue with other models of bearings, where a run has ended and their effects permit it; False: it has not."""
    status, failed, surface, value = run.run.status
    if status == "ok" or not run.run.row_count:
        return False
    own = range(len(run.members)) if status == "guard" else [failed - 1] if failed else []
    changed = False
    for index in own:
        member = run.members[index]
        ending = member.ending(status, surface, value)
        after = next_effects(member.asked, ending)
        if after is None or after == member.effects:
            continue
        before, known = _differences(member.effects, after), {note.kind for note in _earlier(run, index)}
        notes = monitor_notes(ending, after)
        kept = tuple(note for note in notes if note.action or note.kind not in known)
        rows, work = run.run.row_count, member.work
        work = work + earlier_work(run.changes, index, (rows + 1, len(work)))[-1]
        new = Member.of(run.scene, index, after)
        new.continue_from(member, run.run.ends(index))
        install(run, new, Change(index, before, rows, work.tolist(), new.model.info.key, kept))
        changed = True
    return changed


def install(run: BuildingRun, member: Member, change: Change) -> None:
    """Put a member into a run in place of the one of an earlier model."""
    run.members[change.bearing] = member
    run.changes.append(change)
    run.run.replace(change.bearing, member.port, member.entries)


def restored(run: BuildingRun, change: Change) -> None:
    """Make a change of an earlier process again, in a run whose state is restored then. Raises ValueError."""
    if not 0 <= change.bearing < len(run.members):
        raise ValueError("a change of models of no bearing")
    effects = replace(run.members[change.bearing].effects, **change.effects)
    member = Member.of(run.scene, change.bearing, effects)
    if member.model.info.key != change.build:
        raise ValueError("made by another build of a model")
    install(run, member, change)


def earlier_work(changes: Sequence[Change], bearing: int, shape: tuple[int, ...]) -> Array:
    """Integrals of the powers of a bearing before its model of a row began, shape (rows, integrals) [J]."""
    found = np.zeros(shape)
    for change in changes:
        if change.bearing == bearing:
            found[change.rows :] = change.work
    return found


def notes_until_now(run: BuildingRun) -> BearingNotes:
    """The notes of the monitors of all bearings."""
    found = [(change.bearing, note) for change in run.changes for note in change.notes]
    for index, member in enumerate(run.members):
        known = {note.kind for note in _earlier(run, index)}
        found += [(index, each) for each in monitor_notes(member.ending("ok"), None) if each.kind not in known]
    return tuple(found)


def _earlier(run: BuildingRun, bearing: int) -> list[Note]:
    """Notes of earlier models of a bearing that changed nothing."""
    return [n for change in run.changes if change.bearing == bearing for n in change.notes if not n.action]


def _differences(before: Effects, after: Effects) -> dict[str, Any]:
    names = (field.name for field in fields(after))
    return {name: getattr(after, name) for name in names if getattr(after, name) != getattr(before, name)}
