"""Notes of the monitors that tripped in a run with one model."""

from __future__ import annotations

from dataclasses import replace

import pytest

from msfp_gen import Effects
from msfp_gen.results.monitor_notes import monitor_notes
from msfp_gen.scene.effect_switching import Ending


def test_a_switch_for_heat_is_no_answer_to_the_law() -> None:
    """What the monitors of a friction law noted before, another effect does not change."""
    trips = {"law_load": (0.5, 1, 9e6), "law_speed": (0.6, 2, 2.1), "heat": (1.0, 3, 12.0), "uplift": (1.0, 1, 0.0)}
    before = Effects(dimension="planar", friction="pv", sliders="massless")
    after = replace(before, friction="pvt", uplift=True, sliders="inertial")
    notes = monitor_notes(Ending(before, "guard", 1.0, 1, 0.0, trips), after)
    assert {note.kind: note.action for note in notes} == {
        "law_load": "",
        "law_speed": "",
        "heat": "friction = pvt",
        "uplift": "uplift = True, sliders = inertial",
    }


@pytest.mark.parametrize("status", ["newton", "irregular"])
def test_a_jam_names_the_effects_that_follow(status: str) -> None:
    ending = Ending(Effects(sliders="massless"), status, 1.0, 2, 5.0, {})
    (note,) = monitor_notes(ending, Effects())
    assert (note.kind, note.action, note.surface) == ("jammed", "sliders = inertial", 2)
    (note,) = monitor_notes(ending._replace(effects=Effects()), Effects(uplift=True))
    assert note.action == "uplift = True" and f"({status})" in note.text
