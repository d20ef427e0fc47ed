"""Change of the models of bearings in the run of a building, where a monitor asks for it (docs/effects.md)."""

from __future__ import annotations

from dataclasses import fields
from functools import reduce
from typing import Any

from msfp_gen.buildings.bearing_member import BearingNotes, Change, Member, earlier_work
from msfp_gen.buildings.compiled_run import BuildingRun
from msfp_gen.results.note import Note, joined_notes, monitor_notes
from msfp_gen.scene.effect_switching import next_effects
from msfp_gen.specification.layout import Effects


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
        before, notes = _differences(member.effects, after), tuple(monitor_notes(ending, after))
        rows, work = run.run.row_count, member.work
        work = work + earlier_work(run.changes, index, (rows + 1, len(work)))[-1]
        new = Member.of(run.scene, index, after)
        new.continue_from(member, run.run.ends(index))
        run.replace(new, Change(index, before, rows, work.tolist(), new.model.info.key, notes))
        changed = True
    return changed


def notes_until_now(run: BuildingRun) -> BearingNotes:
    """The notes of the monitors of all bearings."""
    found: list[tuple[int, Note]] = []
    for index, member in enumerate(run.members):
        parts = [change.notes for change in run.changes if change.bearing == index]
        notes = reduce(joined_notes, [*parts, monitor_notes(member.ending("ok"), None)], list[Note]())
        found += [(index, note) for note in notes]
    return tuple(found)


def _differences(before: Effects, after: Effects) -> dict[str, Any]:
    names = (field.name for field in fields(after))
    return {name: getattr(after, name) for name in names if getattr(after, name) != getattr(before, name)}
