"""Studies of work and precision: what is measured, against what, and what is said of runs that fail or lie."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from support import buildings, scene_of, thinned

from msfp_gen import Auto, Effects, InputError, Motion, RunError, Solver, Stop, load_scene, simulate
from msfp_gen.cli import main
from msfp_gen.studies.accuracy import study, work_precision
from msfp_gen.studies.accuracy.methods import METHODS, methods_named
from msfp_gen.studies.accuracy.study import (
    ErrorStudy,
    Point,
    confirming_reruns,
    is_wrong,
    model_errors,
    run_tolerances,
    without_stop,
)
from msfp_gen.studies.accuracy.timed_run import (
    CUT_OFF,
    OK,
    REFUSED,
    ROWS,
    Reference,
    Trial,
    best_reference,
    comparison_times,
    errors,
    of_bearing,
)

TIME = comparison_times(1.0)
FAMILIES = {"a": "a", "b": "b", "c": "a"}
QUANTITIES = ("bearing_displacement", "base_shear", "floor_acceleration", "drift")  # of a building


def trial(method="a", rtol=1e-3, wave=0.0, status=OK, rows=ROWS + 1, **changes):
    """A made-up run: force cos(t), sliding 1 - t on two surfaces, both off by `wave` sin(40 t)."""
    off = wave * np.sin(40 * TIME[:rows])
    force = np.stack([np.cos(TIME[:rows]) + off, np.zeros(rows)], axis=1)
    sliding = np.stack([1 - TIME[:rows] + off, 0.1 * (1 - TIME[:rows])], axis=1)
    made = Trial(
        method,
        rtol,
        status,
        seconds=1.0,
        reached=1.0,
        end=1.0,
        newton=5,
        evaluations=9,
        steps=3,
        histories=of_bearing(force, sliding),
    )
    return replace(made, **changes)


def short(name="fenz-test1", duration=0.2, **changes):
    return replace(load_scene(name), duration=duration, **changes)


@pytest.fixture(scope="module")
def small():
    """Two methods of two families over one second of test 1."""
    return work_precision(short(duration=1.0), methods=["implicit", "Radau"], tolerances=[1e-2, 1e-4], limit=20.0)


def test_errors_are_relative_to_the_peaks_of_the_reference():
    found = errors(trial(wave=0.01), trial())
    assert found["force"].max == pytest.approx(0.01, rel=1e-3) and found["sliding"].max == pytest.approx(0.01, rel=1e-3)
    rms = np.sqrt(np.mean((0.01 * np.sin(40 * TIME)) ** 2))
    assert found["force"].rms == pytest.approx(rms) and found["sliding"].rms == pytest.approx(rms)
    assert {"force_max", "force_rms", "sliding_max"} < set(found.as_dict()) and found["force"].peak < 1e-2


def test_a_run_that_ended_early_is_compared_as_far_as_it_came():
    assert errors(trial(rows=300, wave=0.01), trial())["force"].max == pytest.approx(0.01, rel=1e-2)
    assert errors(trial(rows=0), trial()) is None


def test_a_bearing_at_rest_has_no_relative_error():
    still = trial(histories=of_bearing(np.zeros((ROWS + 1, 2)), np.ones((ROWS + 1, 2))))
    with pytest.raises(InputError, match="nothing moved"):
        errors(trial(), still)


def test_the_reference_is_of_two_families_that_agree():
    runs = [trial("a", 1e-6), trial("c", 1e-9, 1e-7), trial("b", 1e-5, 1e-4), trial("b", 1e-2, 1e-9)]
    found = best_reference(runs, FAMILIES)
    assert (found.trial.method, found.second.method, found.second.rtol) == ("c", "b", 1e-5)
    assert found.floor["force"].max == pytest.approx(1e-4, rel=1e-2)


def test_one_family_alone_confirms_little():
    found = best_reference([trial("a", 1e-6, 1e-3), trial("c", 1e-9)], FAMILIES)
    assert (found.trial.method, found.second.method, found.independent) == ("c", "a", False)
    assert found.floor["force"].max == pytest.approx(1e-3, rel=1e-2)
    assert "own family alone" in study.reference_notes(found)[0]
    found = best_reference([trial("a", 1e-6), trial("a", 1e-4, 1e-2), trial("a", 1e-5, 1e-3)], FAMILIES)
    assert (found.second.rtol, found.independent) == (1e-5, False)
    found = best_reference([trial("a")], FAMILIES)
    assert found.second is None and "nothing confirms" in study.reference_notes(found)[0]
    assert not is_wrong(trial(wave=0.5), errors(trial(wave=0.5), trial()), found)  # nothing is known to be wrong
    with pytest.raises(RunError, match="raise the limit"):
        best_reference([trial(status=CUT_OFF)], FAMILIES)


def test_references_that_disagree_are_said_to():
    found = best_reference([trial("a"), trial("b", wave=0.05)], FAMILIES)
    assert "differ by" in study.reference_notes(found)[0]
    assert not study.reference_notes(best_reference([trial("a"), trial("b", wave=1e-4)], FAMILIES))


def test_a_success_far_above_its_tolerance_is_wrong():
    sure = Reference(trial(rtol=1e-9), trial("b"), errors(trial(wave=1e-6), trial()))
    for wave, wrong in ((0.1, True), (0.01, False)):
        run = trial(rtol=1e-3, wave=wave)
        assert is_wrong(run, errors(run, sure.trial), sure) is wrong
    tight = trial(rtol=1e-7, wave=1e-3)
    assert not is_wrong(tight, errors(tight, sure.trial), sure)  # nobody is misled by less than 0.1 %
    loose = trial(rtol=0.1, wave=0.3)
    assert is_wrong(loose, errors(loose, sure.trial), sure)  # no tolerance makes a fifth of the peak right
    failed = trial(rtol=1e-3, wave=0.5, status="failed")
    assert not is_wrong(failed, errors(failed, sure.trial), sure)
    vague = replace(sure, floor=errors(trial(wave=0.09), trial()))
    run = trial(rtol=1e-3, wave=0.1)
    assert not is_wrong(run, errors(run, vague.trial), vague)  # below what is known


def test_what_was_cut_off_is_expected_to_go_on_at_its_pace():
    assert trial(status=CUT_OFF, reached=0.25, seconds=2.0).expected_seconds == 8.0
    assert trial(seconds=2.0).expected_seconds == 2.0


def test_runs_are_cut_off_and_tighter_ones_left_out():
    scene = load_scene("fenz-test2")
    trials, notes = run_tolerances(METHODS["dopri5"], scene, [1e-2, 1e-3, 1e-4], 0.01, lambda line: None)
    assert [t.status for t in trials] == [CUT_OFF] * 2 and "tighter than 0.001 was not tried" in notes[0]
    assert 0 < trials[0].reached < scene.end and trials[0].expected_seconds > 10 * trials[0].seconds
    assert trials[0].rows < ROWS


def test_libraries_are_cut_off_too():
    run = METHODS["DOP853"].attempt(load_scene("fenz-test2"), 1e-4, 0.3)
    assert run.status == CUT_OFF and run.steps > 0 and run.reached < run.end and "0.3 s" in run.message


def test_what_would_end_soon_is_taken_to_its_end():
    scene = short(duration=0.02)
    nearly = METHODS["DOP853"].attempt(scene, 1e-4, 10.0)
    stopped = replace(nearly, status=CUT_OFF, seconds=1.0, reached=0.01)
    ended = confirming_reruns(scene, [stopped], 1.0, lambda line: None)
    assert [t.status for t in ended] == [OK]
    assert [t.status for t in study.with_reruns([stopped, trial()], ended)] == [OK, OK]
    assert not confirming_reruns(scene, [replace(stopped, reached=1e-4)], 1.0, lambda line: None)


@pytest.mark.parametrize("name", thinned(["Radau", "BDF", "LSODA", "DOP853"], lambda name: name == "Radau"))
def test_every_library_method_gives_the_same_motion(name):
    scene = short("fenz-monotonic", 0.06, stop=None)
    tight = METHODS["implicit"].attempt(scene, 1e-9, 20.0)
    found = METHODS[name].attempt(scene, 1e-5, 30.0)
    assert found.finished and found.newton > 0 and found.rows == ROWS + 1
    assert errors(found, tight).worst_rms < 1e-4


def test_a_method_that_cannot_run_a_scene_is_left_out():
    scene = scene_of("fenz-test1", {"dimension": "planar", "sliders": "massless"}, duration=0.2)
    for name in ("dopri5", "Radau"):
        trials, notes = run_tolerances(METHODS[name], scene, [1e-2], 5.0, lambda line: None)
        assert not trials and "massless" in notes[0]
    assert METHODS["Radau"].attempt(scene, 1e-2, 5.0).status == REFUSED


def test_a_stop_becomes_the_end():
    scene = load_scene("fenz-monotonic")
    assert isinstance(scene.stop, Stop)
    ended = without_stop(scene)
    assert ended.stop is None and ended.end == pytest.approx(1.676, abs=2e-3)


def test_a_failure_is_a_point_without_an_error():
    scene = replace(load_scene("fenz-test1"), solver=Solver(max_steps=20))
    run = METHODS["implicit"].attempt(scene, 1e-4, 5.0)
    assert run.status == "steps" and run.reached < run.end and "max_steps" in run.message
    point = study.point_of("implicit", run, Reference(trial(), None, None))
    assert point.errors is None and not point.wrong


def test_study_measures_and_confirms(small):
    assert small.reference.trial.method == "implicit" and small.reference.second.method == "Radau"
    assert small.reference.floor.worst_rms < 1e-3
    loose, tight = small.of("implicit")
    assert loose.errors.worst_rms > tight.errors.worst_rms and loose.trial.seconds > 0
    assert small.series == ["implicit", "Radau"] and not any(p.wrong for p in small.points)


@pytest.mark.slow
def test_output_is_complete(small, tmp_path):
    paths = study.write(small, tmp_path / "made")
    assert {p.suffix for p in paths} == {".csv", ".json", ".md", ".svg", ".png"}
    data = json.loads((tmp_path / "made" / "work-precision.json").read_text(encoding="utf-8"))
    assert data["confirmed_by"]["method"] == "Radau" and len(data["points"]) == 4
    assert {"processor", "compiler", "python"} <= set(data["machine"])
    rows = list(csv.DictReader((tmp_path / "made" / "work-precision.csv").read_text(encoding="utf-8").splitlines()))
    assert float(rows[0]["force_rms"]) == pytest.approx(data["points"][0]["force_rms"])
    text = (tmp_path / "made" / "work-precision.md").read_text(encoding="utf-8")
    assert text.count("| implicit |") == 2 and "confirmed by Radau" in text


def test_failures_and_wrong_successes_are_marked():
    reference = Reference(trial(rtol=1e-9), trial("b"), errors(trial(wave=1e-6), trial()))
    runs = [trial(wave=0.2), trial(status="newton"), trial(status=CUT_OFF, reached=0.1, seconds=2.0)]
    points = tuple(study.point_of("a", run, reference) for run in runs)
    made = ErrorStudy(load_scene("fenz-test1"), "work-precision", points, reference, ())
    columns = study.figure_table(made)["a"]
    assert columns["wrong"] == [1, 0, 0] and columns["failed"] == [0, 1, 0] and columns["cut"] == [0, 0, 1]
    assert columns["seconds"][2] == pytest.approx(20.0) and columns["newton"][2] == pytest.approx(50.0)
    cells = study.tables(made)[0].rows
    assert cells[0][2] == "WRONG SUCCESS" and cells[1][2] == "newton" and cells[2][3] == "(about 20)"
    assert [row[2] for row in study.cost_table(made).rows] == ["14 %"]  # 0.2 times sqrt(1/2)
    assert "errors are known to" in study.cost_table(made).title
    alone = replace(made, reference=replace(reference, floor=None))
    assert "errors are not confirmed" in study.cost_table(alone).title
    left_out = Point("c", trial("c", status=REFUSED), None, False)
    assert "c" not in study.figure_table(replace(made, points=(*points, left_out)))


def test_the_summary_marks_the_tolerance_of_the_scene(tmp_path):
    scene = load_scene("fenz-test1")
    reference = Reference(trial(rtol=1e-9), trial("b"), errors(trial(wave=1e-6), trial()))
    runs = [trial("implicit", 10 * scene.solver.rtol, 0.01), trial("implicit", scene.solver.rtol, 0.001)]
    points = tuple(study.point_of("implicit", run, reference) for run in runs)
    made = ErrorStudy(scene, "work-precision", points, reference, ())
    assert study.default_point(made) is points[1]
    line = study.summary_line(made)
    assert f"{100 * points[1].errors.worst_rms:.2g} %" in line and "1.00 s" in line and f"{scene.solver.rtol:g}" in line
    study.draw_summary(made, tmp_path / "summary.png")
    assert (tmp_path / "summary.png").read_bytes().startswith(b"\x89PNG")
    assert study.default_point(replace(made, points=points[:1])) is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"methods": ["euler"]}, "methods = 'euler'"),
        ({"tolerances": [2.0]}, "tolerances = 2"),
        ({"tolerances": []}, "tolerances: none"),
        ({"limit": 0.0}, "limit = 0"),
    ],
)
def test_settings_that_make_no_sense_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        work_precision(short(), **options)


def test_methods_by_name():
    assert [m.name for m in methods_named(["Radau"])] == ["Radau"] and len(methods_named(None)) == len(METHODS)


def test_command_writes_and_prints(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(study, "draw", lambda found, path: None)  # drawn in the test above
    words = ["bench", "work-precision", "fenz-test1", "--duration", "0.3", "--methods", "implicit,Radau"]
    assert main([*words, "--tolerances", "1e-2,1e-3", "-o", str(tmp_path / "out"), "--json"]) == 0
    out, err = capsys.readouterr()
    assert len(json.loads(out)["points"]) == 4 and "implicit at 0.01: ok" in err and err.count("wrote ") == 6
    assert main([*words[:5], "--tolerances", "1e-2", "--methods", "implicit"]) == 0
    assert "own family alone" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["--tolerances", "tight"], ["--methods", "euler"], ["--limit", "-1"]])
def test_command_refuses(words, capsys):
    assert main(["bench", "work-precision", "fenz-test1", *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("words", [["bench"], ["bench", "work-precision"]])
def test_help_has_an_example(words, capsys):
    assert main([*words, "--help"]) == 0
    assert "msfp-gen bench work-precision" in capsys.readouterr().out


@pytest.mark.slow
def test_a_jump_of_the_motion_starts_the_libraries_anew():
    """The base accelerates, then holds its speed: an integrator that knew of one piece only would be lost after it."""
    knots, pieces = np.array([0.0, 0.05, 0.1]), np.zeros((2, 6, 6))
    pieces[0, 0, 2], pieces[1, 0, :2] = 0.5, (0.5 * 0.05**2, 0.05)
    motion = Motion(knots, pieces, jumps=np.array([0.05]))
    scene = replace(load_scene("fenz-monotonic"), motion=motion, stop=None, motion_table=None)
    found = METHODS["Radau"].attempt(scene, 1e-5, 30.0)
    assert found.finished
    assert errors(found, METHODS["implicit"].attempt(scene, 1e-9, 20.0)).worst_rms < 1e-4


def test_effects_are_fixed_for_all_runs():
    scene = replace(load_scene("fenz-test1"), effects=Auto(), duration=0.3)
    found = work_precision(scene, methods=["implicit", "Radau"], tolerances=[1e-2], limit=20.0)
    assert isinstance(found.scene.effects, Effects) and found.scene.effects.sliders == "inertial"
    assert {point.trial.status for point in found.points} == {OK}


def swaying():
    """A frame of storeys on its bearings, which slide."""
    motion = Motion.harmonic(0.05, 0.6, direction=0.4, cycles=1)
    return buildings.scene(buildings.frame(), motion=motion, duration=0.5, output_step=0.01)


def test_effects_are_fixed_for_all_runs_of_a_building():
    """No run changes the model of a bearing, where `Auto` would take uplift in on the way."""
    scene = swaying()
    fixed = without_stop(scene)
    assert not any(effects.uplift for effects in scene.modelled) and all(effects.uplift for effects in fixed.modelled)
    given = scene.with_effects(uplift=False)
    assert not any(effects.uplift for effects in without_stop(given).modelled)


def test_errors_of_a_building_are_those_of_its_own_rows():
    """The error of a run against a much tighter one, by the histories of the results, is the one that is stated."""
    scene = swaying()
    found = work_precision(scene, methods=["implicit", "esdirk4"], tolerances=[1e-2, 1e-4], limit=60.0)
    assert set(found.shown) == {f"{name}_rms" for name in QUANTITIES}
    scene = found.scene  # with all effects
    loose, exact = (simulate(replace(scene, solver=replace(scene.solver, rtol=rtol))) for rtol in (1e-2, 1e-7))
    away = np.linalg.norm((loose.bearing_displacement - exact.bearing_displacement)[:, :, :2], axis=2)
    peak = np.linalg.norm(exact.bearing_displacement[:, :, :2], axis=2).max()
    stated = found.of("implicit")[0]
    assert stated.errors["bearing_displacement"].max == pytest.approx(away.max() / peak, rel=0.1)
    assert stated.trial.steps == loose.work["steps"] and stated.trial.newton == loose.work["newton_iterations"]
    assert found.of("esdirk4")[0].errors.worst_rms < 0.05 and "storey" not in study.summary_line(found)
    assert "bearing displacement, base shear, floor acceleration and drift" in study.cost_table(found).columns[2]


@pytest.mark.slow
def test_simpler_models_of_a_building():
    found = model_errors(swaying(), tolerances=[1e-3], limit=60.0)
    notes = " ".join(found.notes)
    assert "planar: left out" in notes and "OpenSees: left out; this method runs one bearing alone" in notes
    own, without = (found.of(name)[0].errors.worst_rms for name in ("as it stands", "no rims"))
    assert without == pytest.approx(own, rel=1e-3)  # no slider comes near its rim
