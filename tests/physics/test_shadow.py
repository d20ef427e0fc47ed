"""The shadow of a result: the full model under its motion, and the effects that its element does not have."""

from __future__ import annotations

import pytest
from support.audits import run_of, shaken, uncoupled, with_columns, with_force

from msfp_gen import InputError, load_scene, shadow, simulate
from msfp_gen.auditing.histories import histories_of
from msfp_gen.auditing.shadow import _variants


def test_a_sound_result_has_a_shadow_like_itself():
    found = shadow(run_of(), shaken())
    assert found.difference < 0.003 and found.error < 0.001
    assert found.missing == () and [one.effect for one in found.left_out] == ["varying axial force"]
    assert found.result.extremes.sliding[0] == pytest.approx(0.3086, rel=0.01)


def test_an_element_without_vertical_coupling_is_named():
    found = shadow(uncoupled(run_of()), shaken())
    assert found.missing == ("varying axial force",)
    [one] = found.left_out
    assert one.before > 0.03 and one.after < 0.2 * one.before
    assert "does not have: varying axial force" in found.text
    assert found.tables[1].rows[0][-1] == "the element does not have it"
    assert found.as_dict["left_out"] == {"varying axial force": [one.before, one.after]}


def test_signs_and_units_are_put_right_first():
    data = with_force(run_of(), -1.0)
    found = shadow(data, shaken())
    assert found.difference < 0.003 and "opposite signs" in found.notes[0]


def test_what_cannot_be_followed_is_said():
    data = run_of()
    with pytest.raises(InputError, match="no column axial"):
        shadow(type(data)("half", {n: v for n, v in data.columns.items() if n != "axial"}), shaken())
    with pytest.raises(InputError, match="begin at the centre"):
        shadow(with_columns(data, displacement_1=data.columns["displacement_1"] + 0.1), shaken())


def test_one_pendulum_in_place_of_a_stack_runs_to_the_end_of_the_record():
    """Also where the axial force is left out, and with it the load that makes it run so long."""
    scene = load_scene("fenz-test3")
    result = simulate(scene)
    variants = dict(_variants(scene, result, histories_of(result)))
    changed = variants["sliding regimes"](scene)
    assert scene.load is None and changed.fidelity == "equivalent" and changed.end == scene.end


@pytest.mark.slow
def test_an_element_that_does_not_heat_is_named():
    found = shadow(run_of(law="pvt", temperature_ratio=1.0), shaken(law="pvt"))
    assert found.missing == ("heat",)
    assert found.difference > 0.1 and found.left_out[0].after < 0.005
