"""Change of the models of bearings in the run of a building, where a monitor asks for it (docs/effects.md)."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from msfp_gen.buildings.change import BearingNotes, Change, earlier_work
from msfp_gen.buildings.compiled_run import BuildingRun
from msfp_gen.buildings.member import Member
from msfp_gen.results.monitor_notes import monitor_notes
from msfp_gen.results.note import Note
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
        before, known = _differences(member.effects, after), {note.kind for note in _earlier(run, index)}
        notes = monitor_notes(ending, after)
        kept = tuple(note for note in notes if note.action or note.kind not in known)
        rows, work = run.run.row_count, member.work
        work = work + earlier_work(run.changes, index, (rows + 1, len(work)))[-1]
        new = Member.of(run.scene, index, after)
        new.continue_from(member, run.run.ends(index))
        run.replace(new, Change(index, before, rows, work.tolist(), new.model.info.key, kept))
        changed = True
    return changed


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
