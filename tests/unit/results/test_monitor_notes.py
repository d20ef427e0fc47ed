"""Notes of the monitors that tripped in a run with one model."""

from __future__ import annotations

from dataclasses import replace

import pytest

from msfp_gen import Effects
from msfp_gen.results.note import Note, by_importance, joined_notes, monitor_notes
from msfp_gen.scene.effect_switching import Ending


def test_a_switch_for_heat_is_no_answer_to_the_law() -> None:
    """What the monitors of a friction law noted before, another effect does not change."""
    trips = {
        "law_load": (0.5, 1, 9e6, 0.5),
        "law_speed": (0.6, 2, 2.1, 0.6),
        "heat": (1.0, 3, 12.0, 1.0),
        "uplift": (1.0, 1, 0.0, 1.0),
    }
    before = Effects(dimension="planar", friction="pv", sliders="massless")
    after = replace(before, friction="pvt", uplift=True, sliders="inertial")
    notes = monitor_notes(Ending(before, "monitor", 1.0, 1, 0.0, trips), after)
    assert {note.kind: note.action for note in notes} == {
        "law_load": "",
        "law_speed": "",
        "heat": "friction = pvt",
        "uplift": "uplift = True, sliders = inertial",
    }


def test_a_note_gives_the_largest_value_since_its_time() -> None:
    """Of the model that goes on, and of the next one; a note of a switch stays as it is."""
    effects = Effects(dimension="planar", rims=False, sliders="massless")
    first = Ending(effects, "ok", 2.0, 0, 0.0, {"heat": (0.5, 1, 12.0, 0.5), "rims": (1.0, 2, 0.01, 1.0)})
    second = first._replace(
        effects=Effects(rims=False), time=4.0, trips={"heat": (2.1, 3, 65.0, 2.1), "rims": (2.2, 1, 0.002, 2.2)}
    )
    notes = joined_notes(monitor_notes(first, second.effects), monitor_notes(second, None))
    assert [(note.kind, note.time, note.surface, note.value) for note in notes] == [
        ("heat", 0.5, 3, 65.0),
        ("rims", 1.0, 2, 0.01),
        ("plane", 2.0, 0, 0.0),
    ]
    assert notes[0].text.startswith("from here on, friction may heat surface 3 by up to 65 K")
    assert notes[0].text.endswith("friction is then some 25% lower than here: give effects.friction = 'pvt'")
    assert notes[1].text.endswith("a force that is missing here: give effects.rims = true") and ";" not in notes[2].text
    (stopped,) = monitor_notes(first._replace(status="monitor", trips={"rims": (2.0, 2, 0.01, 2.0)}), None)
    assert stopped.text.startswith("a slider is 0.01 m beyond the capacity of surface 2")
    switched = replace(notes[0], action="friction = pvt")
    assert joined_notes([switched], [notes[0]]) == [switched, notes[0]]


@pytest.mark.parametrize("status", ["newton", "irregular"])
def test_a_jam_names_the_effects_that_follow(status: str) -> None:
    ending = Ending(Effects(sliders="massless"), status, 1.0, 2, 5.0, {})
    (note,) = monitor_notes(ending, Effects())
    assert (note.kind, note.action, note.surface) == ("jammed", "sliders = inertial", 2)
    (note,) = monitor_notes(ending._replace(effects=Effects()), Effects(uplift=True))
    assert note.action == "uplift = True" and f"({status})" in note.text


def test_those_come_first_that_question_most() -> None:
    kinds = ("inertia", "creep", "heat", "value", "energy")
    notes = [Note(float(time), kind, 1, 0.0, "") for time, kind in enumerate(kinds)]
    added = Note(0.0, "value", 1, 0.0, "", "uplift = True")
    assert [note.kind for note in by_importance([added, *notes])] == [
        *("value", "energy", "heat", "creep"),
        "inertia",
        "value",
    ]
