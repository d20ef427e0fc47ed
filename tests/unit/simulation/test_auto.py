"""Effects chosen from the scene; watches over what is left out, and what follows when one trips."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.resuming import assert_same, stopping_at

from msfp_gen import (
    Auto,
    Effects,
    InputError,
    Load,
    Motion,
    Rotation,
    RunError,
    Scene,
    Top,
    load_scene,
    presets,
    simulate,
)
from msfp_gen.model.model import build_model
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.results.result import Result, load_result
from msfp_gen.scene import effect_switching
from msfp_gen.scene.effect_selection import EffectSelection, quasistatic
from msfp_gen.scene.effect_switching import Ending, all_effects, next_effects, stopping_monitors
from msfp_gen.scene.explain import explain
from msfp_gen.scene.file.loader import scene_from_table
from msfp_gen.scene.friction_parameters import thermal_softening
from msfp_gen.scene.scene_fields import InitialState, Stop
from msfp_gen.simulation import bearing_run as simulation
from msfp_gen.simulation import checkpoint
from msfp_gen.simulation.bearing_run import BearingRun
from msfp_gen.simulation.start import RestartState, start_compiled_run

FULL = Effects()
STILL = Motion(np.array([0.0, 4.0]), np.zeros((1, 6, ORDER)))
TEST2 = replace(load_scene("fenz-test2"), output_step=0.02)


def chosen(scene: Scene, effect: str) -> tuple[object, str]:
    """The choice of one effect and what it rests on."""
    reason = next(reason for reason in scene.effect_selection.reasons if reason.effect == effect)
    return reason.chosen, reason.because


def with_selection(scene: Scene, **effects: Any) -> Scene:
    """The same scene started with other effects than selected: those of a wrong selection."""
    again = replace(scene)
    again.__dict__["effect_selection"] = EffectSelection(replace(scene.modelled, **effects))
    return again


def apart(one: Result, other: Result) -> float:
    """Largest difference of the top force over its horizontal peak."""
    first, second = one.history.top_force, other.history.top_force
    return float(np.abs(first - second).max() / np.abs(second[:, :2]).max())


def kinds(result: Result) -> list[str]:
    """What a run went on with more for."""
    return [note.kind for note in result.notes if note.action]


# ---- the choice ---------------------------------------------------------------------------------------------------


def test_motion_loads_and_start_decide_the_plane() -> None:
    across = Load.constant((0.0, 1e3, 0.0))
    aslant = Motion.harmonic(0.05, 0.5, direction=0.4)
    for scene, word in [
        (replace(TEST2, effects=Auto()), "planar"),
        (replace(TEST2, effects=Auto(), motion=aslant, duration=None), "planar"),
        (replace(TEST2, effects=Auto(), load=across), "spatial"),
        (replace(TEST2, effects=Auto(), motion=Motion.circle(0.05, 1.0), duration=None), "spatial"),
        (replace(TEST2, effects=Auto(dimension="spatial")), "spatial"),
    ]:
        assert chosen(scene, "dimension")[0] == word == scene.modelled.dimension
    assert "22.92 deg" in chosen(replace(TEST2, effects=Auto(), motion=aslant, duration=None), "dimension")[1]


def test_masses_and_loads_decide_inertia() -> None:
    heavy = replace(TEST2, effects=Auto())
    assert chosen(heavy, "sliders")[0] == "massless" and "respond within" in chosen(heavy, "sliders")[1]
    free = replace(TEST2.top, stiffness=1e6, damping=0.0, rotational_damping=0.0)
    undamped = TEST2.bearing.replace(rim_damping=0.0)
    quick = replace(heavy, motion=Motion.harmonic(0.05, 0.5), duration=None, top=free, bearing=undamped)
    jerked = replace(quick, top=replace(free, axial_load=2e3))
    assert chosen(quick, "sliders")[0] == "inertial" and "respond within" in chosen(quick, "sliders")[1]
    assert chosen(jerked, "sliders")[0] == "inertial" and "of N" in chosen(jerked, "sliders")[1]
    assert chosen(replace(heavy, effects=Auto(spin="free")), "sliders")[0] == "inertial"
    explicit = replace(heavy, solver=replace(heavy.solver, method="dopri5"))
    assert chosen(explicit, "sliders")[0] == "inertial"


def test_massless_sliders_are_chosen_only_with_quasi_static_steps() -> None:
    """Each scene has one property that excludes the steps, and inertia for that reason."""
    slow = replace(TEST2, effects=Auto())
    assert chosen(slow, "sliders")[0] == "massless" and quasistatic(slow, slow.modelled)
    pushed, turned = Load.constant((1e3, 0.0, 0.0)), Rotation.ramp(theta=0.001, duration=60.0)
    law = slow.bearing.replace(friction_slow=0.01, velocity_rate=50.0)
    carried = Top.mass(11e3, 300.0, 0.5, rotational_stiffness=1e7)
    for changed, words in (
        ({"motion": Motion.circle(0.05, 0.05)}, "one vertical plane"),
        ({"bearing": law}, "friction depends on more than the slip"),
        ({"top": carried}, "the supported mass has inertia"),
        ({"top": replace(TEST2.top, damping=1e6)}, "dampers carry"),
        ({"solver": replace(slow.solver, method="esdirk4")}, "'esdirk4' has no quasi-static steps"),
        ({"load": pushed}, "vertical loads"),
        ({"top_rotation": turned}, "only translates"),
    ):
        scene = replace(slow, duration=None, **changed)
        found, because = chosen(scene, "sliders")
        assert found == "inertial" and words in because, (words, because)


def test_loads_decide_uplift_and_capacity_decides_rims() -> None:
    heavy = replace(TEST2, effects=Auto())
    lifted = replace(heavy, load=Load.ramp((0.0, 0.0, 0.9 * 112e3), duration=3.0))
    assert chosen(heavy, "uplift")[0] is False and chosen(lifted, "uplift")[0] is True
    assert lifted.modelled.sliders == "inertial"
    gentle = replace(heavy, motion=Motion.harmonic(0.004, 0.5), duration=None)
    assert chosen(heavy, "rims")[0] is True and chosen(gentle, "rims")[0] is False
    assert "21.5 mm" in chosen(gentle, "rims")[1]


def test_the_rims_are_judged_by_the_largest_distance_of_the_base_from_its_start() -> None:
    """Not by the range of the motion, and not by its components: 400 mm each way along 30 degrees is 400 mm."""
    far = Motion.harmonic(0.4, 0.5, direction=np.radians(30))
    assert "up to 400 mm from its start" in chosen(replace(TEST2, effects=Auto(), motion=far, duration=None), "rims")[1]
    eight = Motion.figure_eight(0.4, 1.0)
    t = np.linspace(0, eight.duration, 100_001)
    farthest = np.hypot(*eight.displacement(t)[:, :2].T).max()
    because = chosen(replace(TEST2, effects=Auto(), motion=eight, duration=None), "rims")[1]
    assert f"up to {1e3 * farthest:.4g} mm" in because and farthest == pytest.approx(0.5, rel=1e-3)
    near = Motion.harmonic(0.021, 0.2)  # less than 21.5 mm each way, more from one side to the other
    assert chosen(replace(TEST2, effects=Auto(), motion=near, duration=None), "rims")[0] is False


def test_what_a_file_leaves_out_is_chosen_and_what_it_gives_stands() -> None:
    table = {
        "bearing": "fenz-tfp",
        "motion": {"kind": "harmonic", "amplitude": 0.05, "frequency": 0.5},
        "top": {"kind": "rig", "axial_load": 112e3, "stiffness": 1e8, "rotational_stiffness": 1e6},
    }
    assert scene_from_table(table).effects == Auto() == scene_from_table({**table, "effects": "auto"}).effects
    assert scene_from_table({**table, "effects": {"rims": False}}).effects == Auto(rims=False)
    everything = {"dimension": "spatial", "sliders": "inertial", "rims": True, "uplift": False}
    assert scene_from_table({**table, "effects": everything}).effects == FULL
    assert load_scene("fenz-test2").effects == FULL  # presets are the report's model
    with pytest.raises(InputError, match="effects = 'all'"):
        scene_from_table({**table, "effects": "all"})
    with pytest.raises(InputError, match=r"effects\.error = 2"):
        Auto(error=2.0)


def test_explain_says_what_each_choice_rests_on_and_saves() -> None:
    table = next(t for t in explain(replace(TEST2, effects=Auto())) if t.title.startswith("effects"))
    text = "\n".join(" ".join(row) for row in table.rows)
    for words in (
        "vertical plane at azimuth 0 deg",
        "of N",
        "smallest capacity",
        "of the load at rest",
        "in place of 8",
    ):
        assert words in text, words


# ---- what is left out does not matter -----------------------------------------------------------------


@pytest.mark.parametrize("name", ["fenz-test1", "fenz-test2", "fenz-test5", "becker-eight-125"])
def test_the_chosen_effects_give_the_answer_of_all(name: str) -> None:
    scene = replace(load_scene(name), output_step=0.05)
    fewer = simulate(replace(scene, effects=Auto()))
    massless = name in ("fenz-test2", "fenz-test5")
    assert ("massless" in fewer.provenance["model"]) is massless and not kinds(fewer)
    assert apart(fewer, simulate(scene)) < 5e-3


@pytest.mark.slow
def test_a_planar_run_lies_in_any_plane() -> None:
    aslant = replace(TEST2, motion=Motion.harmonic(0.05, 0.2, cycles=1, direction=0.7), duration=None)
    result = simulate(replace(aslant, effects=Auto(bouc_wen="isotropic")))
    assert "planar" in result.provenance["model"]
    assert apart(result, simulate(replace(aslant, effects=Effects(bouc_wen="isotropic")))) < 5e-3


# ---- the watches --------------------------------------------------------------------------------------


def test_motion_that_leaves_its_plane_is_followed_out_of_it() -> None:
    time = np.linspace(0.0, 12.0, 601)
    moved = np.zeros((601, 3))
    moved[:, 0] = 0.05 * np.sin(np.pi * time) * np.sin(np.pi * np.clip(time / 8, 0, 1)) ** 2
    moved[:, 1] = 0.02 * np.sin(np.pi * np.clip(time - 8, 0, None) / 4) ** 3
    scene = replace(TEST2, motion=Motion.from_arrays(time, moved), duration=None)
    result = simulate(replace(scene, effects=Auto()))
    full = simulate(scene)
    assert kinds(result) == ["plane"] and "planar" in result.provenance["model"].split(", then ")[0]
    np.testing.assert_array_equal(result.history.time, full.history.time)
    assert apart(result, full) < 1e-3
    flat = simulate(with_selection(replace(scene, effects=Auto()), dimension="planar"))  # what ignoring it would say
    assert apart(flat, full) > 0.2
    assert result.summary["energy"]["closure_error"] < 1e-3


@pytest.mark.parametrize("frequency", [0.18695163208365206, 0.8363174641294197])
def test_a_change_of_models_at_an_output_time_writes_one_row(frequency: float) -> None:
    """The plane is left a rounding error beside an output time."""
    time = np.linspace(0.0, 4.0, 401)
    moved = np.zeros((401, 3))
    moved[:, 0] = 0.05 * np.sin(2 * np.pi * time) * np.sin(np.pi * time / 4) ** 2
    moved[:, 1] = 0.025 * np.sin(np.pi * np.clip(time - 2.5, 0.0, None) / 1.5) ** 3
    motion = Motion.from_arrays(time / frequency, moved)
    step = motion.duration / 400
    result = simulate(replace(TEST2, motion=motion, duration=None, effects=Auto(), output_step=step))
    assert kinds(result) == ["plane"] and len(result.history.time) == 401
    assert np.diff(result.history.time).min() > 0.99 * step


def test_sliders_get_their_mass_back_when_the_load_falls() -> None:
    load = Load.from_arrays([0, 1, 3, 40], np.outer([0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 111.95e3]))
    top = Top.rig(112e3, stiffness=1e6, damping=5.0, rotational_stiffness=1e5, rotational_damping=5.0)
    motion = Motion.harmonic(0.05, 1.0, cycles=4)
    scene = Scene(presets.bearing("fenz-tfp"), motion, top, load=load, output_step=0.005, effects=Auto(uplift=False))
    scene = replace(scene, solver=replace(scene.solver, rtol=1e-5))
    wrong = with_selection(scene, sliders="massless")
    result, full = simulate(wrong), simulate(replace(scene, effects=Effects(dimension="planar")))
    assert kinds(result) == ["inertia"] and result.provenance["model"].count("massless") == 1
    ignored = simulate(replace(scene, effects=Auto(uplift=False, sliders="massless")))
    (note,) = [note for note in ignored.notes if note.kind == "inertia"]
    assert f"of body {note.surface + 1} is" in note.line and f"surface {note.surface};" in note.line
    assert not kinds(ignored)

    def peak(result: Result) -> float:
        return float(np.abs(result.history.top_force[result.history.time > 3.2, 0]).max())

    # Light bodies ring for long without damping: their phase is nobody's business, their force is.
    assert peak(result) == pytest.approx(peak(full), rel=0.03) and peak(ignored) < 0.87 * peak(full)


def test_rims_are_there_when_a_slider_comes_to_them() -> None:
    scene = replace(load_scene("fenz-test5"), output_step=0.1, duration=60.0, effects=Auto(sliders="inertial"))
    full = simulate(replace(scene, effects=FULL))
    blind = with_selection(scene, rims=False)
    result = simulate(blind)
    assert kinds(result) == ["rims"] and result.notes[0].value > 0
    assert apart(result, full) < 5e-3
    ignored = simulate(replace(scene, effects=Auto(rims=False, sliders="inertial")))
    assert apart(ignored, full) > 0.05 and next(note.kind for note in ignored.notes) == "rims"
    with pytest.raises(RunError, match="beyond the capacity") as error:
        simulate(blind, strict=True)
    assert error.value.status == "monitor" and isinstance(error.value.result, Result)
    assert error.value.result.history.time[-1] == pytest.approx(result.notes[0].time, abs=0.1)
    assert error.value.result.history.gap.min() > 0


def test_a_bearing_that_parts_is_followed_into_flight() -> None:
    """A jerk that unloads the bearing for a fifth of a second."""
    weight = 11e3 * 9.80665
    load = Load.from_arrays([0, 1, 1.05, 1.15, 1.2, 4], np.outer([0, 0, 1, 1, 0, 0], [0.0, 0.0, 1.5 * weight]))
    top = Top.mass(11e3, 4e3, 0.3, rotational_stiffness=1e7, rotational_damping=1e4)
    scene = Scene(presets.bearing("fenz-tfp"), STILL, top, load=load, output_step=0.005, duration=1.5, effects=Auto())
    assert chosen(scene, "uplift")[0] is True
    known = simulate(scene)
    result = simulate(with_selection(scene, uplift=False, sliders="massless"))
    assert "uplift" in kinds(result) and result.history.lift is not None and known.history.lift is not None
    flown = result.history.top_displacement[:, 2].max()
    assert flown > 0.01 and flown == pytest.approx(known.history.top_displacement[:, 2].max(), rel=1e-2)
    assert result.summary["energy"]["closure_error"] < 5e-3
    with pytest.raises(RunError, match="would have to pull"):
        simulate(replace(scene, effects=Effects(dimension="planar")))


def kumar() -> Scene:
    """Strokes that heat: a triple pendulum whose surfaces carry the numbers of Kumar et al. (2015)."""
    bearing = presets.bearing("fenz-tfp").replace(reference_pressure=15e6)
    return replace(TEST2, bearing=bearing, motion=Motion.harmonic(0.08, 0.5, cycles=8), duration=None, effects=Auto())


@pytest.mark.slow
def test_heat_is_followed_once_it_matters() -> None:
    scene = kumar()
    assert chosen(scene, "friction")[0] == "pv"
    result = simulate(scene)
    full = simulate(replace(scene, effects=Effects(friction="pvt")))
    assert "heat" in kinds(result) and result.history.temperature is not None
    assert apart(result, full) < 0.01
    ignored = simulate(replace(scene, effects=Auto(friction="pv")))
    assert apart(ignored, full) > 0.05
    assert [note.kind for note in ignored.notes] == ["heat"]


def test_heat_without_numbers_is_noted() -> None:
    scene = replace(TEST2, motion=Motion.harmonic(0.08, 0.5, cycles=8), duration=None)
    result = simulate(scene)
    assert [note.kind for note in result.notes] == ["heat"] and "K" in result.notes[0].line
    assert result.summary["notes"] == [note.line for note in result.notes]


@pytest.mark.parametrize(("share", "noted"), [(1.2, True), (0.95, False)])
def test_heat_is_noted_from_its_limit_on(share: float, noted: bool, monkeypatch: Any) -> None:
    """share: the largest rise in temperature, over its limit."""
    scene = replace(TEST2, motion=Motion.harmonic(0.08, 0.5, cycles=2), duration=None)
    softening = thermal_softening(scene.modelled.law, scene.bearing)
    monkeypatch.setattr(effect_switching, "NOTED_SOFTENING", 1e-4)
    (note,) = simulate(scene).notes
    assert note.kind == "heat" and note.value * softening > 1e-4
    monkeypatch.setattr(effect_switching, "NOTED_SOFTENING", note.value * softening / share)
    assert [other.value for other in simulate(scene).notes] == [note.value] * noted


@pytest.mark.slow
def test_the_temperatures_of_the_monitor_are_those_of_the_law() -> None:
    """Of the law of Kumar et al. where heat does not change friction; the run is handed over with them."""
    scene = kumar()
    cold = replace(scene, bearing=scene.bearing.replace(temperature_ratio=1.0), effects=Auto(friction="pv"))
    full = simulate(replace(cold, effects=Effects(friction="pvt")))
    run = BearingRun.of(cold)
    run.begin()
    while run.advance():
        pass
    run.end(run.status, 0.0)
    at = RestartState.of(run.segments[0].model, run.segments[0].run, 0.0)
    assert full.history.temperature is not None
    np.testing.assert_allclose(at.monitor_heat.sum(axis=1), full.history.temperature[-1] - 20.0, rtol=0.03)


@pytest.mark.slow
def test_the_note_of_heat_gives_the_peak(tmp_path: Any, monkeypatch: Any) -> None:
    """The limit is passed at 0.6 s, the peak is that of the last of two models; a resumed run agrees."""
    time = np.linspace(0.0, 12.0, 601)
    moved = np.zeros((601, 3))
    moved[:, 0] = 0.012 * np.minimum(time, 7.0) * np.sin(np.pi * time)
    moved[:, 1] = 0.02 * np.sin(np.pi * np.clip(time - 8.0, 0.0, None) / 4.0) ** 3
    scene = replace(kumar(), motion=Motion.from_arrays(time, moved), effects=Auto(friction="pv"))
    result = simulate(scene)
    (note,) = (note for note in result.notes if note.kind == "heat")
    full = simulate(
        replace(scene, bearing=scene.bearing.replace(temperature_ratio=1.0), effects=Effects(friction="pvt"))
    )
    assert full.history.temperature is not None and kinds(result) == ["plane"]
    rise = full.history.temperature - 20.0
    assert rise[full.history.time < 2.0].max() < 0.2 * rise.max() and note.time < 2.0
    assert note.value == pytest.approx(rise.max(), rel=0.03) and note.surface == rise.max(axis=0).argmax() + 1
    assert f"from here on, friction may heat surface {note.surface} by up to {note.value:.3g} K" in note.line
    monkeypatch.setattr(simulation, "STEPS_PER_CALL", 20)
    with pytest.raises(RunError, match="interrupted"):
        simulate(scene, progress=stopping_at(6.0), checkpoint=tmp_path / "run.ck", every=0.0)
    assert note in simulate(scene, checkpoint=tmp_path / "run.ck", every=0.0, resume=True).notes


def test_all_effects_are_all_that_monitors_may_add() -> None:
    """Whatever was selected; what the scene fixes stays."""
    for scene, friction in ((kumar(), "pvt"), (replace(TEST2, effects=Auto()), "constant")):
        every = all_effects(scene)
        assert every == Effects(friction=friction, uplift=True)
        assert all_effects(with_selection(scene, dimension="planar", sliders="massless", rims=False)) == every
        assert not stopping_monitors(scene, every, strict=False)
        assert next_effects(scene, Ending(every, "ok", 0.0, 0, 0.0, {})) is None  # where a plane would be left
    for given in ({"dimension": "planar"}, {"rims": False}, {"uplift": False}, {"friction": "pv"}, {"spin": "patch"}):
        fixed = all_effects(replace(kumar(), effects=Auto(**given)))
        assert fixed == Effects(**{"friction": "pvt", "uplift": True} | given)
    assert all_effects(replace(kumar(), effects=Auto(sliders="massless"))) == Effects(
        sliders="massless", friction="pvt"
    )
    law = "mu * (1 - c1 * exp(-c2 * v))"
    bearing = TEST2.bearing.replace(c1=0.3, c2=50.0)
    custom = all_effects(replace(TEST2, bearing=bearing, effects=Auto(friction_law=law)))
    assert custom == Effects(friction="custom", friction_law=law, uplift=True)
    assert all_effects(replace(TEST2, effects=FULL)) is FULL
    turned = replace(TEST2, effects=Auto(), top_rotation=Rotation.ramp(theta=0.001, duration=60.0))
    assert all_effects(turned).top_rotation


# ---- going on -----------------------------------------------------------------------------------------


def test_positions_and_friction_are_carried_over_exactly() -> None:
    scene = replace(kumar(), output_step=None)
    result = simulate(with_selection(scene, rims=True))
    time = next(note.time for note in result.notes if note.action)
    row = int(np.searchsorted(result.history.time, time))
    assert result.history.time[row] == time
    assert np.all(np.diff(result.history.time) > 0)
    alone = simulate(replace(scene, effects=Auto(friction="pv")))
    for name in ("tilt_angles", "friction_state", "tilt_rates"):
        np.testing.assert_array_equal(getattr(result.history, name)[: row + 1], getattr(alone.history, name)[: row + 1])


def test_a_state_has_the_rotation_of_the_base_and_what_the_surfaces_remember() -> None:
    turned = Motion.harmonic(0.05, 0.5).rocking(Rotation.harmonic(0.01, 0.02, frequency=0.3, cycles=1.0))
    scene = replace(load_scene("fenz-test2"), motion=turned, motion_table=None, duration=1.0, effects=FULL)
    model = build_model(scene.bearing.layout, scene.modelled)
    run, azimuth = start_compiled_run(scene, model, scene.effect_selection, scene.end, None, ())
    run.advance(20)
    state = RestartState.of(model, run, azimuth)
    assert (
        state.base_angles == pytest.approx(scene.motion.rotation(state.time))
        and np.abs(state.base_angles[:2]).min() > 0
    )
    memory, of_heat = np.ones((4, 2)), Effects(friction="pvt").law
    assert state.memory_of(FULL.law) is None and state.memory_of(of_heat) is state.monitor_heat
    assert replace(state, memory=memory).memory_of(of_heat) is memory


def test_energies_go_on_over_a_change_of_models() -> None:
    """No term jumps where another model takes over, and all of them end where those of the full model do."""
    chosen = Auto(bouc_wen="report", sliders="inertial")
    scene = replace(load_scene("fenz-test5"), output_step=0.02, duration=60.0, effects=chosen)
    result, full = simulate(with_selection(scene, rims=False)), simulate(replace(scene, effects=FULL))
    (time,) = [note.time for note in result.notes if note.action]
    energy, rows = result.history.energy, result.history.time
    row = int(np.searchsorted(rows, time))
    peak = energy["input"].max()
    for name, values in energy.items():
        steps = np.abs(np.diff(values))
        around = np.r_[steps[row - 10 : row - 2], steps[row + 2 : row + 10]].max()
        assert steps[row - 2 : row + 2].max() <= 2 * around + 1e-4 * peak, name
        if name not in ("kinetic", "numerical"):
            assert values[-1] == pytest.approx(full.history.energy[name][-1], abs=5e-3 * peak), name
    assert result.summary["energy"]["closure_error"] < 1e-3


def test_notes_are_kept_in_the_file(tmp_path: Any) -> None:
    result = simulate(kumar())
    again = load_result(result.to_netcdf(tmp_path / "out.nc"))
    assert again.notes == result.notes and again.scene == result.scene


def test_a_run_of_several_models_resumes_to_the_same_rows(tmp_path: Any) -> None:
    scene, path = kumar(), tmp_path / "run.ck"
    whole = simulate(scene)
    first = simulate(scene, checkpoint=path, every=0.0)
    models = whole.provenance["model"].count(", then ") + 1
    assert models > 1 and [file.name for file in tmp_path.iterdir()] == ["run.ck"]
    assert len(checkpoint.read_checkpoint(path)[1]) == models
    with pytest.raises(InputError, match="this file exists; resume it"):
        simulate(scene, checkpoint=path)
    again = simulate(scene, checkpoint=path, every=0.0, resume=True)
    for result in (first, again):
        np.testing.assert_array_equal(result.history.top_force, whole.history.top_force)
        assert result.notes == whole.notes


def test_a_run_interrupted_before_a_switch_resumes_through_it(tmp_path: Any, monkeypatch: Any) -> None:
    """The file has no segment after the switch yet."""
    monkeypatch.setattr(simulation, "STEPS_PER_CALL", 20)
    scene, path = kumar(), tmp_path / "run.ck"
    whole = simulate(scene)
    switch = next(note.time for note in whole.notes if note.action)
    with pytest.raises(RunError, match="interrupted"):
        simulate(scene, progress=stopping_at(0.1), checkpoint=path, every=0.0)
    assert [file.name for file in tmp_path.iterdir()] == ["run.ck"] and checkpoint.read_checkpoint(path)[1][
        -1
    ].time < switch
    assert_same(whole, simulate(scene, checkpoint=path, every=0.0, resume=True))


def test_a_note_in_the_step_of_a_switch_does_not_end_the_run() -> None:
    """Heat without numbers can only be noted; inertia, in the same step, is answered."""
    scene = replace(TEST2, effects=Auto())
    trips = {"heat": (1.001, 2, 11.0, 1.001), "inertia": (1.0, 1, 0.1, 1.0)}
    ending = Ending(scene.modelled, "monitor", 1.0, 0, 0.0, trips)
    assert next_effects(scene, ending) == replace(scene.modelled, sliders="inertial")


def test_displacements_go_on_from_their_start_in_the_frame_of_the_user() -> None:
    """A planar run aslant, begun off centre, that becomes spatial: events measure from where the first run began."""
    time = np.linspace(0.0, 6.0, 301)
    moved = np.outer(0.02 * np.sin(np.pi * time) * np.sin(np.pi * np.clip(time / 4, 0, 1)) ** 2, [0.0, 1.0, 0.0])
    moved[:, 0] = 0.05 * np.sin(np.pi * np.clip(time - 4, 0, None) / 4) ** 3
    tilt = np.zeros((4, 3))
    tilt[:, 0] = 0.01, -0.02, 0.02, -0.01
    start = InitialState(tilt.tolist(), np.zeros((4, 3)).tolist(), np.zeros((4, 2)).tolist())
    scene = replace(TEST2, motion=Motion.from_arrays(time, moved), duration=None, initial_state=start)
    whole = simulate(replace(scene, effects=FULL))
    far = 0.9 * whole.history.horizontal[whole.history.time > 4.5].max()
    assert whole.history.horizontal[whole.history.time < 4.0].max() < far
    stop = Stop(displacement=float(far))
    stopped = [simulate(replace(scene, effects=each, stop=stop)) for each in (Auto(sliders="inertial"), FULL)]
    assert kinds(stopped[0]) == ["plane"] and [result.status for result in stopped] == ["stopped", "stopped"]
    times = [result.history.time[-1] for result in stopped]
    assert times[0] == pytest.approx(times[1], abs=2e-3)
    assert np.hypot(*stopped[0].events[-1].displacement[:2]) == pytest.approx(far, rel=1e-3)


def test_energies_are_continuous_over_a_change_of_models() -> None:
    """Every term goes on from where it stood: the first step after moves it no more than those beside."""
    load = Load.from_arrays([0, 1, 3, 40], np.outer([0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 111.95e3]))
    motion, top = Motion.harmonic(0.05, 1.0, cycles=4), Top.rig(112e3, 1e8, damping=5.0, rotational_stiffness=1e6)
    falling = Scene(presets.bearing("fenz-tfp"), motion, top, load=load, effects=Auto(uplift=False))
    leaving = replace(load_scene("fenz-test5"), duration=60.0, effects=Auto(sliders="inertial"))
    for scene, fewer, model in [
        (falling, {"sliders": "massless"}, Effects(dimension="planar")),
        (replace(kumar(), duration=2.0, output_step=None), {}, Effects(friction="pvt", dimension="planar")),
        (leaving, {"rims": False}, FULL),
    ]:
        result = simulate(with_selection(scene, **fewer) if fewer else scene)
        time = next(note.time for note in result.notes if note.action)
        at, whole = result.history, simulate(replace(scene, effects=model)).history
        row, size = int(np.searchsorted(at.time, time)), max(np.abs(values).max() for values in at.energy.values())
        assert 5 < row < len(at.time) - 10 and at.time[row] == time
        for name, values in at.energy.items():
            change = np.abs(np.diff(values))
            assert change[row] <= 10 * np.median(change[row - 5 : row + 5]) + 1e-5 * size, name
            ends = [np.interp(min(at.time[-1], whole.time[-1]), h.time, h.energy[name]) for h in (at, whole)]
            assert ends[0] == pytest.approx(ends[1], abs=0.02 * size), name
