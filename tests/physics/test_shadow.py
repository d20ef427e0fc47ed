"""The shadow of a result: the full model under its motion, and the effects that its element does not have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from external import MAT
from support.audits import run_of, shaken, tensile, uncoupled, with_columns, with_force

from msfp_gen import InputError, load_scene, shadow, simulate
from msfp_gen.auditing.histories import histories_of
from msfp_gen.auditing.shadow import _variants
from msfp_gen.results.sliding import merged, open_times


def across(data):
    """Histories without columns of the plates: the displacement across the bearing remains."""
    kept = {name: values for name, values in data.columns.items() if not name.startswith(("lower", "upper"))}
    return replace(data, columns=kept)


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


def test_a_plate_that_rotates_needs_the_motion_of_both_ends():
    """A mass whose rotation little restrains: 1.7 degrees, which the displacement across the bearing does not tell."""
    scene = shaken()
    scene = replace(scene, top=replace(scene.top, rotational_stiffness=3e6, rotational_damping=1e5))
    data = histories_of(simulate(scene))
    assert np.abs(data.columns["upper_rotation_2"]).max() > 0.02
    both, relative = shadow(data, scene), shadow(across(data), scene)
    assert relative.difference > 0.02 and both.difference < 0.003
    surfaces = [{(one.quantity, one.surface): one for one in each.differences} for each in (both, relative)]
    assert set(surfaces[0]) == {("force", 0), *((name, i) for name in ("sliding", "slip_speed") for i in (1, 2))}
    whole, half = (each["sliding", 1] for each in surfaces)
    assert whole.size > 0.3 and whole.largest < 1e-4 and half.largest > 0.005
    assert surfaces[0]["slip_speed", 1].rms < 5e-4 and surfaces[1]["slip_speed", 1].rms > 0.01


def test_ends_without_displacement_and_of_the_other_sign():
    """Half a turn of the ends, where the displacement is upper - lower; and no displacement at all."""
    data = run_of()
    ends = {name: values for name, values in data.columns.items() if name.startswith(("lower", "upper"))}
    turned = shadow(with_columns(data, **{n: v if n.endswith("3") else -v for n, v in ends.items()}), shaken())
    named = {name: values for name, values in data.columns.items() if not name.startswith("displacement")}
    without = shadow(replace(data, columns=named), shaken())
    assert turned.difference < 0.003 and without.difference < 0.003


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"upper_1": None, "upper_2": None}, "lower without upper"),
        ({"upper_1": 1.2}, "displacement is not lower - upper"),
        ({"sliding_3": 1.0}, "the bearing has 2 surfaces"),
    ],
)
def test_ends_and_surfaces_that_do_not_fit_are_said(columns, words):
    data = run_of()
    kept = {name: values for name, values in data.columns.items() if columns.get(name, 1.0) is not None}
    factors = {name: factor for name, factor in columns.items() if factor is not None}
    changed = {name: factor * kept.get(name, data.columns["sliding_2"]) for name, factor in factors.items()}
    with pytest.raises(InputError, match=words):
        shadow(replace(data, columns={**kept, **changed}), shaken())


def test_tension_parts_the_surfaces_of_the_model():
    found = shadow(tensile(run_of()), shaken())
    assert found.missing == ("lift-off",) and found.difference < 0.02
    pulled = found.data.time[found.data.axial < -0.1 * found.data.at_rest]
    inside = [any(start <= time <= start + length for start, length in found.openings) for time in pulled]
    assert np.mean(inside) > 0.8 and found.opened is not None
    assert f"{found.data.axial.min() / 1e3:.4g} kN" in found.lift_off and "surfaces part" in found.lift_off
    assert shadow(across(run_of()), shaken()).lift_off == ""


def test_a_result_with_lift_off_has_a_shadow_that_lifts_off():
    scene = shaken(axes=(1, 0, 5), uplift=True)
    result = simulate(scene)
    found = shadow(result, scene)
    assert found.difference < 0.01 and found.missing == ()
    own = merged(spell for surface in open_times(result.history, result.events) for spell in surface)
    long = [(start, length) for start, length in own if length > 0.02]
    seen = [any(a < start + length and start < a + b for a, b in found.openings) for start, length in long]
    assert len(long) > 10 and np.mean(seen) > 0.8  # 14 of 16: without force, the mass may drift with its dish
    assert 0.5 < sum(length for _, length in found.openings) / sum(length for _, length in own) < 2.0


@pytest.mark.slow
def test_an_element_that_does_not_heat_is_named():
    found = shadow(run_of(law="pvt", temperature_ratio=1.0), shaken(law="pvt"))
    assert found.missing == ("heat",)
    assert found.difference > 0.1 and found.left_out[0].after < 0.005
    heat = {one.surface: one for one in found.differences if one.quantity == "temperature"}
    assert set(heat) == {1, 2} and heat[1].unit == "K"


def test_a_plate_in_one_piece_with_the_only_slider_tilts():
    scene = load_scene("single-push")
    data = histories_of(simulate(scene))
    for given in (data, across(data)):
        assert shadow(given, scene).difference < 2e-3


def test_a_bearing_without_rims_has_a_shadow_without_them():
    found = shadow(MAT / "case1.csv", MAT / "bearing.toml", MAT / "map.toml")
    assert found.difference < 0.01 and found.missing == () and not found.result.effects.rims
