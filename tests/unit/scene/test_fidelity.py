"""Cheaper models of a scene: its backbone, its equivalent pendulum, and what their runs say they cannot see."""

from dataclasses import replace

import numpy as np
import pytest

from msfp_gen import Auto, InitialState, InputError, Limits, Load, Motion, changed_scene, load_scene, simulate
from msfp_gen.results.result import load_result
from msfp_gen.scene.fidelity import (
    LOOSE,
    Backbone,
    at_fidelity,
    constant_friction,
    equivalent_pendulum,
    lively_end,
    main_regime,
    peak_speed,
)
from msfp_gen.scene.file.loader import bearing_from_table, scene_table
from msfp_gen.scene.parameters import parameters_of
from msfp_gen.studies import load_study
from msfp_gen.studies.bounding import bound, load_factors

PRESETS = ("fenz-tfp", "single-fp", "single-articulated-fp", "double-fp", "double-articulated-fp", "quintuple-fp")


def bearing(name):
    return bearing_from_table({"preset": name})


@pytest.mark.parametrize("name", PRESETS)
def test_the_backbone_is_linear_between_its_points(name):
    backbone = Backbone.of(bearing(name))
    u, force = backbone.points
    assert (np.diff(u) > 0).all() and (np.diff(force) > 0).all() and u[0] == 0
    assert [backbone.displacement(f) for f in force] == pytest.approx(u, abs=1e-15)
    middle = [backbone.displacement(f) for f in (force[1:] + force[:-1]) / 2]
    assert middle == pytest.approx((u[1:] + u[:-1]) / 2, rel=1e-12)  # linear between its points


def test_the_backbone_is_the_published_formula_of_the_triple_pendulum():
    """Fenz and Constantinou (2008): the regime in which both outer surfaces slide has the slope of their radii."""
    tfp = bearing("fenz-tfp")
    friction, radius, _ = main_regime(Backbone.of(tfp))
    outer = tfp.surfaces[0].radius - tfp.bodies[0].height - tfp.bodies[1].height / 2
    assert radius == pytest.approx(2 * outer, rel=1e-12)
    moment = sum(surface.friction * surface.radius for surface in (tfp.surfaces[0], tfp.surfaces[3]))
    assert friction == pytest.approx(moment / (2 * outer), rel=1e-12)


@pytest.mark.parametrize("name", PRESETS)
def test_the_equivalent_pendulum_of_a_pendulum_keeps_the_line(name):
    """The main regime of the pendulum that is made is that of the stack; so it is its own equivalent."""
    stack = bearing(name)
    one = equivalent_pendulum([stack], [1.0])
    given, made = main_regime(Backbone.of(stack)), main_regime(Backbone.of(one))
    assert made[:2] == pytest.approx(given[:2], rel=2e-3)
    two = equivalent_pendulum([stack, stack], [0.5, 0.5])
    assert two.surfaces[0].friction == pytest.approx(one.surfaces[0].friction)
    assert two.surfaces[0].rim_stiffness == 2 * one.surfaces[0].rim_stiffness


@pytest.mark.parametrize("word", ["loose", "massless", "equivalent"])
def test_each_level_runs_alone_and_says_what_it_cannot_see(word):
    scene = changed_scene("fenz-test2", {"fidelity": word, "effects.dimension": "planar"})
    exact = simulate(changed_scene("fenz-test2", {"effects.dimension": "planar"}))
    run = simulate(scene)
    notes = [note.text for note in run.notes if note.kind == "fidelity"]
    assert run.status == "ok" and len(notes) == 1 and f"fidelity = '{word}'" in notes[0]
    assert scene.solver.rtol == LOOSE
    for name, within in (("peak_displacement", 5e-3), ("peak_force", 0.08)):
        assert run.summary[name]["radial"] == pytest.approx(exact.summary[name]["radial"], rel=within)


@pytest.mark.slow
def test_a_reduced_scene_is_written_and_read_as_it_is(tmp_path):
    run = simulate(changed_scene("fenz-test2", {"fidelity": "equivalent", "effects.dimension": "planar"}))
    path = run.to_netcdf(tmp_path / "run.nc")
    again = load_result(path)
    assert again.scene.bearing == run.scene.bearing and again.notes == run.notes


def test_the_equivalent_pendulum_ends_when_the_record_is_over():
    """Its peaks are those of the whole record; a base that moves evenly, or a load, keeps the end."""
    given = load_scene("ridgecrest-clc")
    one = at_fidelity(given, "equivalent")
    assert 0.4 * given.end < one.end < 0.6 * given.end
    short, whole = simulate(one).summary, simulate(replace(one, duration=given.end)).summary
    assert short["peak_displacement"] == whole["peak_displacement"] and short["peak_force"] == whole["peak_force"]
    times = np.linspace(0.0, 5.0, 51)
    even = Motion.from_velocity(times, np.outer(np.minimum(times, 0.1), [1.0, 0.0, 0.0]))
    assert lively_end(even, 5.0) == pytest.approx(4.95, abs=0.01)
    assert lively_end(Motion.from_velocity(times, np.zeros((51, 3))), 5.0) == 5.0
    loaded = replace(load_scene("fenz-test2"), load=Load.harmonic((0.0, 0.0, 1e3), frequency=0.1, cycles=5.0))
    assert at_fidelity(loaded, "equivalent").end == loaded.end


def test_an_initial_state_has_no_equivalent():
    scene = load_scene("fenz-test2")
    state = {"q": [[0.0] * 3] * 4, "v": [[0.0] * 3] * 4, "h": [[0.0] * 2] * 4}
    scene = replace(scene, initial_state=InitialState(**state))
    with pytest.raises(InputError, match="leave initial_state out"):
        at_fidelity(scene, "equivalent")


def test_a_rigid_building_keeps_mass_weight_and_loads():
    scene = load_scene("hospital-clc")
    rigid = at_fidelity(scene, "rigid")
    assert rigid.building.mass.shape == (6, 6) and not rigid.building.stiffness.any()
    assert rigid.weight == pytest.approx(scene.weight, rel=1e-9)
    assert rigid.axial_loads.sum() == pytest.approx(scene.axial_loads.sum(), rel=1e-9)
    one = at_fidelity(scene, "equivalent")
    assert one.top.mass * scene.gravity == pytest.approx(scene.weight, rel=1e-9)


def test_a_level_may_be_an_axis_beside_factors():
    """Factors act on the stack before it is reduced, whichever of the two comes first."""
    level, factors = {"level": {"sets": "fidelity", "values": ["equivalent"]}}, {"bounds": {"factors": "asce7"}}
    alone = load_study({"scene": {**scene_table("fenz-test2")[0], "fidelity": "equivalent"}, "axes": factors})
    for axes in ({**level, **factors}, {**factors, **level}):
        study = load_study({"scene": "fenz-test2", "axes": axes})
        for run in (1, 2, 3):
            assert study.scene(run).bearing == alone.scene(run).bearing and study.scene(run).fidelity == "equivalent"
    for value in ("cheap", 1.0, [1]):
        with pytest.raises(InputError, match=r"fidelity = .*: give one of 'exact'"):
            load_study({"scene": "fenz-test2", "axes": {"level": {"sets": "fidelity", "values": [value]}}})


def test_of_regimes_with_one_slope_the_first_is_taken():
    """With upper bound friction two regimes of this stack differ in slope by rounding alone, in friction by 1.8."""
    stack = bearing("fenz-tfp")
    for factor in (1.6, 2.1228999999999996, 2.1229, 2.5):
        raised = stack.replace(friction=[factor * surface.friction for surface in stack.surfaces])
        assert main_regime(Backbone.of(raised))[0] / factor == pytest.approx(0.0317254, rel=1e-5)


@pytest.mark.slow
def test_a_model_of_one_ground_takes_that_of_the_bearings():
    """The motion below the bearings, not that of the scene which none of them has; two of them are refused."""
    scene = changed_scene("hospital-clc", {"motion.duration": 6.0})
    own = Motion.harmonic(0.15, 0.5, cycles=1)
    bearings = [replace(one, motion=own) for one in scene.bearings]
    moved = replace(scene, bearings=bearings, duration=own.duration)
    expected = simulate(at_fidelity(replace(scene, motion=own), "equivalent")).summary
    found = simulate(at_fidelity(moved, "equivalent")).summary
    for name in ("peak_displacement", "peak_force"):
        assert found[name]["radial"] == expected[name]["radial"]
    mixed = replace(moved, bearings=[*bearings[:-1], scene.bearings[-1]])
    with pytest.raises(InputError, match="fidelity = 'equivalent': it has one motion of the ground"):
        at_fidelity(mixed, "equivalent")


def test_the_equivalent_of_a_building_is_judged_by_its_displacement_alone():
    """Forces of one bearing are no limits of one pendulum below the whole building."""
    limits = Limits(displacement=0.05, axial_load=2e6, rim_force=1e5)
    scene = replace(load_scene("hospital-clc"), limits=limits)
    assert at_fidelity(scene, "equivalent").limits == Limits(displacement=0.05)
    assert at_fidelity(scene, "rigid").limits == limits


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "reference"), [(1.4, 5e7), (1.0, 3.4e6)])
def test_no_level_drops_the_friction_law(factor, reference):
    """Pressure below the reference raises friction by half, which levels without the law did not see."""
    changes = {"motion.duration": 20.0, "effects.friction": "pv", "bearing.reference_pressure": reference}
    exact = simulate(changed_scene("ridgecrest-ccc", changes))
    mean = float(np.mean(exact.summary["most_friction"]) / np.mean(exact.summary["friction"]))
    assert mean == pytest.approx(factor, rel=0.1)
    for word, within in (("massless", 0.02), ("equivalent", 0.12)):
        run = simulate(changed_scene("ridgecrest-ccc", {**changes, "fidelity": word}))
        for name in ("peak_displacement", "peak_force"):
            assert run.summary[name]["radial"] == pytest.approx(exact.summary[name]["radial"], rel=within)


def test_the_constant_friction_of_a_law_is_that_of_the_formula():
    scene = changed_scene("ridgecrest-ccc", {"bearing.surfaces[0].reference_pressure": 2e7})
    load, speed = 1.1e5, 0.004
    found = constant_friction(scene.bearing, scene.law[1], load, speed)
    for index, (surface, made) in enumerate(zip(scene.bearing.surfaces, found.surfaces, strict=True)):
        pressure = load / (np.pi * scene.bearing.slider_rim_radius(index) ** 2)
        expected = surface.friction * 0.7 ** ((pressure - surface.reference_pressure) / 50e6)
        assert made.friction == pytest.approx(expected * (1 - 0.5 * np.exp(-100 * speed)), rel=1e-12)
    assert constant_friction(scene.bearing, None, load, speed) is scene.bearing
    motion, times = Motion.harmonic(0.1, 0.5, cycles=2), np.linspace(0.0, 4.0, 40001)
    slopes = np.gradient(motion.evaluate(times)[:, 0], times)
    assert peak_speed(motion, 4.0) == pytest.approx(np.abs(slopes).max(), rel=1e-3)


@pytest.mark.slow
def test_cheaper_models_add_rims_and_heat_where_the_scene_lets_them():
    """A level that fixed the effects of the start would leave out what the exact run takes in on its way."""
    massless = changed_scene("fenz-test5", {"fidelity": "massless", "effects": {}})
    assert massless.effects == Auto(sliders="massless", uplift=False)
    rigid = at_fidelity(load_scene("hospital-clc"), "rigid")
    assert all(m.effects.sliders == "massless" and not m.effects.uplift for m in rigid.bearings)
    changes = {"motion.duration": 12.0, "effects": {"bouc_wen": "plastic"}, "fidelity": "massless"}
    pushed = changed_scene("ridgecrest-ccc", changes)
    assert pushed.modelled.friction == "pv" and "pvt" in simulate(pushed).provenance["model"]


@pytest.mark.slow
def test_surfaces_of_one_pendulum_are_none_of_the_device(tmp_path):
    """No verdict, note, table or column is about a surface or a body that the device does not have."""
    changes = {"motion.duration": 12.0, "fidelity": "equivalent"}
    run = simulate(changed_scene("ridgecrest-ccc", changes))
    assert [note.kind for note in run.notes] == ["fidelity"]
    assert run.verdict.word == "not judged" and not run.verdict.ok and not run.verdict.readings
    surfaces = {"peak_sliding", "minimum_gap", "rims_met", "friction", "uplift", "peak_temperature"}
    assert not surfaces & run.summary.keys()
    assert not any("surface" in "".join(table.columns) for table in (*run.tables(), *run.characterise().tables()))
    assert not run.characterise().surfaces and "one pendulum is in place of the stack" in run.characterise().notes[-1]
    limit = 0.9 * run.summary["peak_displacement"]["radial"]
    limits = {"limits.displacement": limit, "limits.rim_force": 1.0}
    found = simulate(changed_scene("ridgecrest-ccc", {**changes, **limits}))
    assert [one.limit.key for one in found.verdict.exceeded] == ["displacement"] and found.verdict.word == "exceeded"
    read = load_result(run.to_netcdf(tmp_path / "run.nc"))
    assert read.verdict.word == "not judged" and read.summary.keys() == run.summary.keys()
    table = {"scene": "fenz-test2", "keep": ["peak_displacement", "peak_sliding", "capacity_used", "verdict"]}
    study = load_study({**table, "axes": {"level": {"sets": "fidelity", "values": ["equivalent"]}}})
    row, _ = study.keep.values(simulate(study.scene(1)), {})
    assert row["peak_displacement"] > 0.02 and row["verdict"] == "not judged"
    assert row["peak_sliding_1"] is None and row["capacity_used_1"] is None


def test_values_of_the_stack_are_none_of_its_equivalent():
    """A factor on surface 1 would be one on the whole pendulum: 10 % too much force."""
    scene = changed_scene("fenz-test2", {"fidelity": "equivalent"})
    refused = "fidelity = 'equivalent': its surfaces make one pendulum"
    with pytest.raises(InputError, match=refused):
        bound(scene, load_factors("asce7"))
    with pytest.raises(InputError, match=refused):
        parameters_of(scene, ["bearing.surfaces[0].friction"])
    assert parameters_of(scene, ["motion.amplitude"])[0].value == 0.025
    factors = {"bounds": {"factors": "asce7"}}
    study = load_study({"scene": {**scene_table("fenz-test2")[0], "fidelity": "equivalent"}, "axes": factors})
    stack = load_scene("fenz-test2").bearing
    for found, factor in ((study.scene(1), 0.595), (study.scene(3), 2.1229)):
        expected = equivalent_pendulum([stack.replace(friction=[factor * s.friction for s in stack.surfaces])], [1.0])
        assert found.bearing.surfaces[0].friction == pytest.approx(expected.surfaces[0].friction, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("word", "scale"), [("rigid", 0.5), ("massless", 0.5), ("equivalent", 1.5)])
def test_levels_of_a_building(word, scale):
    """The equivalent pendulum where the stack slides far beyond its yield displacement (docs/studies.md)."""
    changes = {"motion.duration": 6.0, "motion.scale": scale}
    exact = simulate(changed_scene("hospital-clc", changes))
    run = simulate(changed_scene("hospital-clc", {**changes, "fidelity": word}))
    assert run.status == "ok" and "fidelity" in [note.kind for note in run.notes]
    assert run.summary["peak_force"]["radial"] == pytest.approx(exact.summary["peak_force"]["radial"], rel=0.3)
