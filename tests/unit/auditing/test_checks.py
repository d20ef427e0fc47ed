"""What the checks say of histories by hand, of one pendulum in rigid-plastic friction under a constant axial force."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from support.audits import WEIGHT, rows_of, run_of, shaken, with_columns, with_force

from msfp_gen import InputError, audit, shadow
from msfp_gen.auditing import Histories
from msfp_gen.auditing.case import CONSISTENT, INCONSISTENT, OPEN, AuditCase
from msfp_gen.auditing.checks import CHECKS
from msfp_gen.auditing.corrections import corrected
from msfp_gen.auditing.stated import stated_of

SCENE = shaken()
STATED = stated_of(SCENE)
MASS = WEIGHT / SCENE.bearing.gravity
TIME = np.arange(0.0, 20.0, 0.01)


def pendulum(time=TIME, u=None):
    """The histories of the pendulum of `shaken`, along one axis."""
    u = 0.25 * np.sin(1.5 * time) * np.minimum(1.0, time / 4.0) if u is None else u
    force = WEIGHT * (u / STATED.radius + STATED.friction * np.tanh(np.gradient(u, time) / 0.005))
    return Histories("by hand", {"time": time, "displacement_1": u, "force_1": force, "axial": WEIGHT + 0 * time})


def without(data, name):
    return replace(data, columns={n: values for n, values in data.columns.items() if n != name})


def finding(data, check, scene=SCENE):
    return audit(data, scene).finding(check)


def test_the_pendulum_is_sound():
    assert not audit(pendulum(), SCENE).inconsistent


def test_a_force_that_does_not_rise_has_no_radius():
    data = pendulum()
    flat = with_force(data, 1.0, -2.0 * WEIGHT * data.displacement / STATED.radius)
    found = audit(flat, SCENE)
    assert found.finding("radius").verdict == INCONSISTENT and found.finding("radius").value is None
    assert "does not rise with displacement" in found.finding("radius").sentence
    json.dumps(found.as_dict, allow_nan=False)


def test_the_mass_of_a_scene_is_on_one_bearing():
    seventy = replace(pendulum(), bearings=70.0)
    assert finding(seventy, "weight").verdict == CONSISTENT
    assert finding(replace(seventy, mass=70.0 * MASS), "weight").verdict == CONSISTENT
    assert finding(replace(seventy, mass=MASS), "weight").value == pytest.approx(70.0)
    uneven = finding(replace(seventy, mass=77.0 * MASS), "weight")
    assert uneven.verdict == "not decidable" and "share it equally" in uneven.sentence
    assert finding(replace(seventy, mass=140.0 * MASS), "weight").verdict == INCONSISTENT


def test_a_record_that_returns_to_the_centre_has_its_signs():
    """Curvature gives back more than friction takes up, in any unit; a force that is turned is still named."""
    time = np.arange(0.0, 4.0, 0.01)
    back = pendulum(time, 0.15 * (1.0 + np.cos(np.pi * time / 4.0)))
    low = with_force(back, 1.0, 0.6 * WEIGHT * STATED.friction * np.array([[1.0, 0.0]]) * (time < 10)[:, None])
    for data in (back, low):
        assert finding(data, "signs").verdict == CONSISTENT
    for unit in (1.0, 1e3):
        assert finding(pendulum().scaled({"displacement_1": unit}), "signs").verdict == CONSISTENT
        turned = pendulum().scaled({"displacement_1": unit, "force_1": -1.0})
        assert "opposite signs" in finding(turned, "signs").sentence


def test_the_sentence_of_signs_says_what_was_seen():
    assert "compression" in finding(pendulum(), "signs").sentence
    found = finding(without(pendulum(), "axial"), "signs")
    assert found.verdict == CONSISTENT and "axial" not in found.sentence


def test_sizes_that_no_unit_explains_are_not_consistent():
    found = finding(with_force(pendulum(), 5.0), "units")
    assert found.verdict == OPEN and found.value > 3.0 and "no other unit" in found.sentence
    assert finding(pendulum(), "units").verdict == CONSISTENT


@pytest.mark.parametrize("mass", [MASS, None])
def test_units_of_force_and_axial_force_are_told_apart_by_the_weight(mass):
    """Of F/N alone, kilonewtons of the one are meganewtons of the other."""
    stated = replace(STATED, mass=mass)
    for name, words in (("force_1", "the force is 0.001 times"), ("axial", "the axial force is 0.001 times")):
        sentence = corrected(pendulum().scaled({name: 1e-3}), stated)[1]["units"].sentence
        assert words in sentence or (mass is None and name == "axial" and "the force is 1000 times" in sentence)


def test_friction_that_falls_with_velocity_is_no_damping():
    data = pendulum()
    rate = 0.2 * WEIGHT * STATED.friction / np.abs(data.velocity).max()
    falls = finding(with_force(data, 1.0, -rate * data.velocity), "damping")
    assert falls.verdict == INCONSISTENT and falls.value == pytest.approx(-20.0, rel=0.1)
    assert "falls with velocity" in falls.sentence and "-" not in falls.sentence and "damping" not in falls.sentence
    rises = finding(with_force(data, 1.0, rate * data.velocity), "damping")
    assert rises.value == pytest.approx(20.0, rel=0.1) and "damping of the structure" in rises.sentence


def test_a_constant_column_is_not_cut_off():
    found = finding(pendulum(), "clipped")
    assert found.verdict == CONSISTENT and "cut off" in found.sentence and "stays" not in found.sentence


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_line_of_the_mass_follows_the_sign_of_the_force(sign):
    data = pendulum()
    drawn = finding(with_columns(data, acceleration_1=sign * data.columns["force_1"] / MASS), "mass")
    _, (_, acceleration, line) = drawn.drawing.curves
    assert drawn.verdict == CONSISTENT and drawn.value == pytest.approx(MASS, rel=1e-6)
    assert line == pytest.approx(sign * MASS * acceleration, rel=1e-3)


def test_a_small_vertical_acceleration_is_too_little():
    wave = np.sin(9.0 * TIME)
    calm = with_columns(pendulum(), axial=WEIGHT + MASS * 0.01 * wave, acceleration_3=0.01 * wave)
    found = finding(calm, "vertical_mass")
    assert found.verdict == OPEN and "too little" in found.sentence
    other = with_columns(pendulum(), axial=WEIGHT * (1 + 0.1 * wave), acceleration_3=np.cos(7.0 * TIME))
    found = finding(other, "vertical_mass")
    assert found.verdict == OPEN and "does not follow" in found.sentence


def test_the_sentence_of_energy_states_what_is_permitted():
    """A hundredth of the loss, and what is stored, of a force that pushes for a moment."""
    data = pendulum()
    lost = finding(data, "energy").value
    assert "1 % of the loss" in finding(data, "energy").sentence
    for share, verdict in ((0.5, CONSISTENT), (4.0, INCONSISTENT)):
        pushing = (TIME > 12.0) & (np.abs(data.displacement[:, 0]) < 0.05)
        reach = 0.01 * share * lost / 0.1
        pushed = np.where(pushing & (TIME < 13.0), 1.0, 0.0)[:, None] * np.sign(data.velocity) * -reach
        found = finding(with_force(data, 1.0 - 1.0 * (pushed[:, 0] != 0), pushed), "energy")
        assert found.verdict == verdict, found.sentence


def parting(pull=0.0, rows=1):
    """The pendulum, which parts for 0.1 s of every second after two seconds, and pulls for some rows of each [N]."""
    data = pendulum()
    phase = np.round(100 * (TIME % 1.0)).astype(int)
    share = np.where((TIME > 2.0) & (phase < 10), 0.0, 1.0)
    share = np.where((TIME > 2.0) & (phase >= 10), 10.0 / 9.0, share)  # the mean remains
    pulls = (TIME > 2.0) & (phase >= 3) & (phase < 3 + rows)
    return with_columns(with_force(data, share), axial=WEIGHT * share - pull * pulls)


def test_a_plate_that_hangs_on_its_support_pulls_for_a_moment():
    plate = SCENE.bearing.bodies[-1].mass * SCENE.bearing.gravity
    assert finding(parting(), "tension").verdict == CONSISTENT
    assert finding(parting(8.0 * plate, 1), "tension").verdict == OPEN
    held = finding(parting(8.0 * plate + 0.01 * WEIGHT, 8), "tension")
    assert held.verdict == INCONSISTENT and "would have opened" in held.sentence


def test_a_rim_that_is_inclined_pulls():
    """By the slope of its dish at most: more is tension of the bearing."""
    for ratio, verdict in ((1.1, OPEN), (0.5, INCONSISTENT)):
        data = parting(0.05 * WEIGHT, 6)
        side = np.where(data.axial < 0, ratio * 0.05 * WEIGHT / STATED.steepest, 0.0)
        assert finding(with_force(data, 1.0, np.column_stack([side, 0 * side])), "tension").verdict == verdict


def test_what_parted_surfaces_leave_open():
    """Loads whose mean misses impacts, travel beyond rims, coarse rows: each is inconsistent of a closed bearing."""
    data = parting()
    assert finding(data, "weight").verdict == CONSISTENT and finding(data, "weight").value == pytest.approx(1, abs=0.01)
    short = with_columns(data, axial=np.where(data.axial > WEIGHT, 0.9, 1.0) * data.axial)
    assert finding(short, "weight").verdict == OPEN and "before the motion" in finding(short, "weight").sentence
    far = 1.2 * STATED.capacity / np.abs(data.displacement).max()
    for name, check in ((data.scaled({"displacement_1": far}), "travel"), (rows_of(data, 25), "sampling")):
        assert finding(name, check).verdict == OPEN
        closed = with_columns(name, axial=WEIGHT + 0 * name.time)
        assert finding(closed, check).verdict == INCONSISTENT


def test_the_coefficient_is_stated_by_speed_axial_force_and_time():
    """Friction that falls with the axial force and over time: medians of thirds of the rows, beside the law."""
    data = pendulum()
    axial = WEIGHT * (1.0 + 0.3 * np.sin(0.7 * TIME))
    share = (WEIGHT / axial) ** 0.5 * (1.0 - 0.02 * TIME)
    friction = STATED.friction * share * np.tanh(data.velocity[:, 0] / 0.005)
    force = axial * (data.displacement[:, 0] / STATED.radius + friction)
    found = audit(with_columns(data, axial=axial, force_1=force), SCENE)
    names = ("speed", "axial force", "time")
    by = {name: [one for one in found.coefficients if one.quantity == name] for name in names}
    assert all(len(ranges) == 3 for ranges in by.values())
    for one in by["axial force"]:
        assert one.law == pytest.approx(STATED.friction, rel=1e-3) and one.least <= one.median <= one.most
    low, _, high = by["axial force"]
    assert low.high < WEIGHT < high.low and low.median > 1.15 * high.median
    first, _, last = by["time"]
    assert first.median > 1.05 * last.median and last.high > 19.0
    assert len(found.as_dict["coefficients"]) == 9 and found.tables[1].rows[3][0] == "axial force"
    assert [figure.check for figure in found.figures] == ["by_speed", "by_axial force", "by_time"]
    even = audit(data, SCENE)
    assert {one.quantity for one in even.coefficients} == {"speed", "time"}  # its axial force is constant
    assert audit(without(data, "axial"), SCENE).coefficients == ()


def test_a_map_is_for_a_file():
    with pytest.raises(InputError, match="only a file needs a map"):
        audit(pendulum(), SCENE, {"columns": {"time": "t [s]"}})


def test_every_check_of_a_few_rows_answers():
    data, found = corrected(rows_of(pendulum(), 40), STATED)
    case = AuditCase(data, STATED, data, found)
    assert all(check(case).sentence for _, check in CHECKS.values())


@pytest.mark.parametrize("axial", [0.0 * TIME, 0.3 * WEIGHT * np.sin(11.0 * TIME)])
def test_an_axial_force_without_the_weight_is_named(axial):
    """An empty column, or the variation about the weight; with an acceleration, inertia has no weight to compare."""
    data = with_columns(pendulum(), axial=axial, acceleration_1=-pendulum().force[:, 0] / MASS)
    found = audit(data, SCENE)
    assert [one.check for one in found.inconsistent] == ["signs"]
    assert "the bearing carries nothing" in found.finding("signs").sentence
    assert found.finding("friction_bound").verdict == found.finding("mass").verdict == OPEN
    with pytest.raises(InputError, match="carries nothing; a shadow needs the load at rest"):
        shadow(data, SCENE)


def test_a_record_of_nothing_has_no_shadow():
    with pytest.raises(InputError, match="the force is zero in every row"):
        shadow(pendulum(u=0.0 * TIME), SCENE)


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "millimetres"), (39.3701, "inches")])
def test_a_displacement_far_beyond_the_rims_has_another_unit(factor, unit):
    """Of a quintuple pendulum whose outermost surfaces do not slide: radius and friction do not tell the unit."""
    choices = {"bearing": "quintuple-fp", "scale": 0.8}
    found = audit(run_of(**choices).scaled({"displacement_1": factor, "displacement_2": factor}), shaken(**choices))
    assert [one.check for one in found.inconsistent] == ["units"]
    assert unit in found.finding("units").sentence and found.finding("units").value == factor
