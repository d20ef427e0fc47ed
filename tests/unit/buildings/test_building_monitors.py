"""Monitors of the bearings of a building, and the change of their models in the run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.buildings import BEARING, LOAD, rocking

from msfp_gen import Auto, Effects, RunError, bound, simulate
from msfp_gen.buildings import effects as selection
from msfp_gen.buildings.extremes import DIMENSIONS
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.run import start_building_run
from msfp_gen.results.result import load_result
from msfp_gen.scene import effect_switching
from msfp_gen.scene.scene import effects_named
from msfp_gen.simulation.start import RestartState
from msfp_gen.studies.bounding import bounded_scenes, load_factors, runs


@pytest.fixture
def unforeseen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The estimate does not ask for uplift."""
    monkeypatch.setattr(selection, "LEAST_SHARE", -np.inf)


def same(one: BuildingResult, other: BuildingResult) -> bool:
    names = ("time", "displacement", "acceleration", "wrench", "dissipated", "stored", "input", "received")
    rows = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)
    peaks = all(np.array_equal(getattr(one.extremes, name), getattr(other.extremes, name)) for name in DIMENSIONS)
    times = all(np.array_equal(one.extremes.times[name], other.extremes.times[name]) for name in DIMENSIONS)
    return rows and peaks and times and one.monitored == other.monitored


@pytest.mark.slow
@pytest.mark.usefixtures("unforeseen")
def test_a_run_is_resumed_bit_by_bit_before_and_after_a_switch(tmp_path):
    scene = rocking(None)
    whole = simulate(scene)
    times = [note.time for each in whole.bearings for note in each.model_changes]
    assert [len(each.model_changes) for each in whole.bearings] == [0, 1, 1, 0] and times[0] != times[1]
    for stop in (min(times) - 0.1, max(times) + 0.1):
        file = tmp_path / f"{stop}.ckpt"

        def interrupt(time: float, _: float, stop: float = stop) -> None:
            if time > stop:
                raise KeyboardInterrupt

        with pytest.raises(RunError, match="interrupted") as caught:
            simulate(scene, progress=interrupt, checkpoint=file)
        assert len(caught.value.result.monitored) < len(whole.monitored) or stop > max(times)
        assert same(simulate(scene, checkpoint=file, resume=True, threads=2), whole)


@pytest.mark.usefixtures("unforeseen")
def test_no_axial_force_jumps_where_uplift_opens():
    run = start_building_run(rocking(None))
    while run.run.advance(1000):
        pass
    old, time = run.members[2], run.time
    before, force = RestartState.of_port(old.port), old.model.unpack(old.port.row)["top_force"]
    pressed = before.contact_force(BEARING)[:, 2]  # without the rims, which the contacts do not carry
    assert run.run.status[:2] == ("monitor", 3) and old.port.trips["uplift"][0] == time
    assert run.switch() and run.run.status[0] == "ok"
    after = RestartState.of_port(run.members[2].port)
    assert np.array_equal(after.q[:, :3], before.q) and np.array_equal(after.f, before.f) and after.time == time
    assert after.q[:, 5] == pytest.approx(-pressed / 5e9, rel=1e-9)
    new = run.members[2]
    jump = np.abs(new.model.unpack(new.port.row)["top_force"] - force)
    assert jump[2] < 1e-3 * LOAD  # the contacts do not yet move with the damper
    assert jump[:2].max() < 1e-3 * LOAD
    run.run.advance(3)
    assert run.time > time and run.run.status[0] in ("ok", "monitor")  # the next bearing follows soon


@pytest.mark.usefixtures("unforeseen")
def test_runs_with_different_models_get_every_effect_of_them():
    """Provenance has the models of all bearings at start and end; then all that leave uplift open begin with it."""
    made = rocking(None)
    scene = replace(made, bearings=[*made.bearings[:3], replace(made.bearings[3], effects=Auto(uplift=False))])
    whole = simulate(scene)
    begun, ended = whole.provenance["model"].split(", then ")
    (key,) = (spec.key for spec in scene.specs)
    lifted = key.replace("-top_rotation", "-uplift-top_rotation")
    assert begun == f"4 x {key}" and ended == f"1 x {key}, 2 x {lifted}, 1 x {key}"
    wider = scene.with_effects_of([begun, ended])
    assert [effects.uplift for effects in wider.modelled] == [True, True, True, False]
    assert scene.with_effects_of([ended, ended]) is None and scene.with_effects_of([]) is None
    assert scene.with_effects(uplift=False).with_effects_of([begun, ended]) is None
    assert simulate(wider).provenance["model"] == f"3 x {lifted}, 1 x {key}"
    assert effects_named([begun]).get("uplift") is None and effects_named([whole.provenance["model"]])["uplift"]


@pytest.mark.usefixtures("unforeseen")
def test_all_cases_of_bounds_have_the_same_effects(monkeypatch):
    """Two bearings lift off at the upper bound alone; then all cases run again with uplift in every bearing."""
    scene = replace(rocking(None), duration=1.4)
    cases = bounded_scenes(scene, load_factors("asce7"))
    changes = {name: [len(one.model_changes) for one in simulate(case).bearings] for name, case in cases.items()}
    assert changes == {"lower": [0, 0, 0, 0], "nominal": [0, 0, 0, 0], "upper": [1, 0, 0, 1]}
    # In this process, where the estimate does not ask for uplift.
    monkeypatch.setattr(
        runs, "completed_runs", lambda scenes, **_: ((i, simulate(one)) for i, one in enumerate(scenes))
    )
    found = bound(scene, load_factors("asce7"))
    (model,) = {case.result.provenance["model"] for case in found.cases}
    assert model.startswith("4 x ") and "-uplift" in model and ", then " not in model


@pytest.mark.usefixtures("unforeseen")
def test_changes_of_models_and_peaks_are_in_the_file(tmp_path):
    found = simulate(rocking(None))
    notes = [note for note in found.notes if note.kind == "uplift"]
    assert [note.text[:11] for note in notes] == ["bearing 3: ", "bearing 2: "]
    assert {note.action for note in notes} == {"uplift = True"}
    heat = np.diff(found.dissipated, axis=0)  # the integrals of a new model begin anew; the sum goes on
    assert heat.min() >= -1e-9 * found.dissipated.max()
    read = load_result(found.to_netcdf(tmp_path / "out.nc"))
    assert same(found, read) and read.summary == found.summary and read.notes == found.notes


@pytest.mark.parametrize("fixed", [Effects(), Auto(uplift=False)], ids=["effects", "auto"])
def test_fixed_effects_are_noted_and_end_the_run_with_the_name_of_the_bearing(fixed):
    with pytest.raises(RunError, match=r"^bearing 3: stopped at t = .* give effects.uplift = true") as caught:
        simulate(rocking(fixed))
    found = caught.value.result
    notes = [note for note in found.notes if note.kind == "uplift"]
    assert caught.value.status == "uplift" and [note.text[:10] for note in notes] == ["bearing 3:"]
    assert notes[0].text.endswith("; the same holds for 1 other bearing")
    assert all(0 < note.value < 0.05 * LOAD * 1.2 and not note.action for note in notes)
    assert notes[0].time < found.time[-1] + 0.01 and not any(each.model_changes for each in found.bearings)


@pytest.mark.usefixtures("unforeseen")
def test_notes_of_heat_give_the_peak_over_all_models_of_a_bearing(monkeypatch):
    """Two of the bearings change their model after the limit of heat, here a hundredth of the usual one, is passed."""
    monkeypatch.setattr(effect_switching, "NOTED_SOFTENING", 5e-4)
    run, highest = start_building_run(rocking(None)), np.zeros(4)
    while run.run.advance(10) or run.switch():
        parts = [RestartState.of_port(member.port).monitor_heat for member in run.members]
        highest = np.maximum(highest, [each.sum(axis=1).max() for each in parts])
    notes = {note.bearing - 1: note for note in run.notes if note.kind == "heat"}
    assert sorted(notes) == [0, 1, 2, 3]
    for index, note in notes.items():
        assert highest[index] <= note.value < 1.05 * highest[index] and note.time < 0.5 * run.time
    assert {change.bearing for change in run.changes} == {1, 2}
    for change in run.changes:
        before = next(note for note in change.notes if note.kind == "heat")
        assert before.time == notes[change.bearing].time and before.value < notes[change.bearing].value


def test_a_damaged_change_of_models_is_refused():
    run = start_building_run(rocking(None))
    table = {"bearing": 7, "effects": {}, "rows": 1, "work": [], "build": "", "notes": []}
    for change in ({**table}, {**table, "bearing": 1}):
        with pytest.raises(ValueError, match=r"change of models of no bearing|another build"):
            run.restore(str([change]).replace("'", '"').encode() + b"\n" + run.run.snapshot())


def test_a_state_that_no_bearing_has_is_not_entered():
    rest = start_building_run(rocking(None)).members[0]
    q, ends = np.zeros((4, 3)), np.zeros((2, 3, 6))
    assert rest.port.enter(1.0, q, q, np.zeros((4, 2)), ends) == "ok" and rest.port.time == 1.0
    assert rest.port.enter(1.0, q * np.nan, q, np.zeros((4, 2)), ends) == "argument"
    assert rest.port.enter(np.inf, q, q, np.zeros((4, 2)), ends) == "argument"
    with pytest.raises(ValueError, match="q: needs 12 values"):
        rest.port.enter(1.0, np.zeros((4, 6)), q, np.zeros((4, 2)), ends)
