"""A run to a wanted error: the error it is estimated to have is the one it has, and what does not fit is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from msfp_gen import Auto, Effects, InputError, RunError, Solver, Top, load_scene, simulate
from msfp_gen.accuracy import simulate_within, within
from msfp_gen.accuracy.effects import full
from msfp_gen.accuracy.measure import errors
from msfp_gen.accuracy.trial import CUT_OFF, run_native
from msfp_gen.accuracy.within import LADDER, worst
from msfp_gen.cli import main


def truth(scene, rtol):
    """What a run at `rtol` is off by, against one far tighter."""
    tight = run_native("implicit", scene, 1e-8, 60.0, repeats=0)
    return worst(errors(run_native("implicit", scene, rtol, 60.0, repeats=0), tight))


@pytest.mark.parametrize("name", ["fenz-test2", "becker-circle-50", "double-push", "single-push"])
@pytest.mark.parametrize("target", [5e-3, 5e-4])
def test_the_estimate_is_the_error(name, target):
    """Within a factor of two below and five above, and the target is met."""
    scene = load_scene(name)
    found = simulate_within(scene, target)
    true = truth(scene, found.chosen.rtol)
    assert true < target and true / 2 < found.chosen.estimate < max(5 * true, 1e-6)
    assert found.chosen.estimate <= target


def test_tighter_targets_cost_more_and_say_so():
    scene = load_scene("fenz-test2")
    loose, tight = simulate_within(scene, 0.05), simulate_within(scene, 1e-4)
    assert tight.chosen.rtol < loose.chosen.rtol and tight.chosen.newton > loose.chosen.newton
    assert loose.next_step.rtol < loose.chosen.rtol
    ratio = loose.next_step.newton / loose.chosen.newton
    assert loose.next_step.seconds == pytest.approx(ratio * loose.chosen.seconds)
    assert loose.seconds > loose.chosen.seconds
    assert tight.result.provenance["error_target"] == "0.0001"
    assert float(tight.result.provenance["error_estimate"]) == pytest.approx(tight.chosen.estimate, rel=1e-2)


def test_the_result_is_that_of_the_scene_at_the_chosen_tolerance():
    scene = replace(load_scene("fenz-test2"), duration=10.0, output_step=0.5)
    found = simulate_within(scene, 1e-2)
    plain = simulate(replace(scene, solver=replace(scene.solver, rtol=found.chosen.rtol)))
    assert found.result.history.top_force == pytest.approx(plain.history.top_force)
    assert len(found.result.history.time) == 21


def test_work_decides_between_rungs_that_meet_the_target(monkeypatch):
    scene = replace(load_scene("fenz-test2"), duration=10.0)
    real = within.run_native

    def wasteful(name, scene, rtol, limit, repeats):
        """The loosest rung takes a thousand iterations more, as rejected steps do."""
        found = real(name, scene, rtol, limit, repeats)
        return replace(found, newton=found.newton + 1000 * (rtol == LADDER[0]))

    monkeypatch.setattr(within, "run_native", wasteful)
    found = simulate_within(scene, 0.05)
    assert found.chosen.rtol == LADDER[1] and any("rejected" in reason for reason in found.reasons)


def test_an_error_out_of_reach_is_said(monkeypatch):
    monkeypatch.setattr(within, "LADDER", LADDER[:5])
    with pytest.raises(RunError, match=r"error of 1e-07 was not reached .* the best is rtol = 0.001"):
        simulate_within(load_scene("fenz-test2"), 1e-7)


def test_a_spent_budget_is_said():
    with pytest.raises(RunError, match="nothing was judged") as caught:
        simulate_within(load_scene("ridgecrest-clc"), 1e-6, budget=0.05)
    assert caught.value.status == "accuracy"


def test_a_scene_that_fails_fails():
    scene = replace(load_scene("fenz-test2"), solver=Solver(max_steps=20))
    with pytest.raises(RunError, match="max_steps"):
        simulate_within(scene, 1e-2)


def test_one_failing_rung_is_passed_over(monkeypatch):
    real = within.run_native

    def sometimes(name, scene, rtol, limit, repeats):
        found = real(name, scene, rtol, limit, repeats)
        return replace(found, status="newton") if rtol == LADDER[0] else found

    monkeypatch.setattr(within, "run_native", sometimes)
    found = simulate_within(load_scene("fenz-test2"), 0.05)
    assert found.chosen.rtol == LADDER[1] and found.attempts[0].estimate is None


def test_reasons_tell_of_ringing_and_the_reports_method():
    found = simulate_within(load_scene("fenz-monotonic"), 0.02, explain=True)
    text = " ".join(found.reasons)
    assert "filtered" in text and "dopri5" in text and "effects as the scene" in text


def test_what_no_estimate_holds_is_said_where_rims_are_met():
    found = simulate_within(load_scene("fenz-monotonic"), 0.02)
    assert "after impacts" in found.left_out and any("not in it" in row for row in found.tables[0].rows)
    calm = simulate_within(load_scene("fenz-test1"), 0.02)
    assert not calm.left_out and not any("not in it" in row for row in calm.tables[0].rows)


def test_reports_method_is_timed_or_refused(monkeypatch):
    scene = load_scene("fenz-test2")
    assert "about" in within._report_method(scene)[0]
    massless = replace(scene, effects=replace(scene.effects, sliders="massless"))
    assert "cannot run" in within._report_method(massless)[0]
    burst = within.run_native("implicit", scene, 1e-2, 1.0, 0)
    for status, words in (("ok", "takes"), ("newton", "fails here"), (CUT_OFF, "at its pace")):
        monkeypatch.setattr(within, "run_native", lambda *a, s=status, **k: replace(burst, status=s))
        assert words in within._report_method(scene)[0]


@pytest.mark.parametrize(("error", "budget", "why"), [(0.0, 1.0, "error = 0"), (1.5, 1.0, "error = 1.5"),
                                                      (0.1, 0.0, "budget = 0")])  # fmt: skip
def test_what_makes_no_sense_is_refused(error, budget, why):
    with pytest.raises(InputError, match=why):
        simulate_within(load_scene("fenz-test1"), error, budget=budget)


def test_a_bearing_at_rest_has_no_relative_error():
    still = replace(load_scene("fenz-test1"), motion=load_scene("fenz-test1").motion, top=Top.rig(112e3, 1e8))
    still = replace(still, motion=replace(still.motion, coefficients=0 * still.motion.coefficients), motion_table=None)
    with pytest.raises(InputError, match="did not move"):
        simulate_within(still, 0.01)


def test_command_prints_error_cost_and_next_step(capsys, tmp_path):
    assert main(["run", "fenz-test2", "--error", "0.5%", "--explain", "-o", str(tmp_path / "a.nc")]) == 0
    out = capsys.readouterr().out
    for words in ("asked for", "0.5 %", "estimated error of this run", "the next step up", "why", "what was tried"):
        assert words in out
    assert (tmp_path / "a.nc").is_file()
    assert main(["run", "fenz-test2", "--error", "0.01", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["accuracy"]["estimate"] <= data["accuracy"]["target"] == 0.01 and data["status"] == "ok"


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--error", "five"], "'five' is no share"),
        (["--error", "0.5 mm"], "is no share"),
        (["--error", "200%"], "error = 2"),
        (["--error", "1%", "--rtol", "1e-3"], "--rtol"),
        (["--error", "1%", "--method", "dopri5"], "--method"),
        (["--error", "1%", "--checkpoint", "x.ck"], "--checkpoint"),
        (["--explain"], "belongs to --error"),
        (["--budget", "3"], "belongs to --error"),
    ],
)
def test_command_refuses(words, why, capsys):
    assert main(["run", "fenz-test1", *words]) == 2
    err = capsys.readouterr().err
    assert why in err and err.count("\n") == 1


def chosen(name="fenz-test2", **changes):
    return replace(load_scene(name), effects=Auto(**changes), duration=10.0)


def test_chosen_effects_are_judged_by_all_of_them():
    """Planar and massless for half the error; the estimate holds what that leaves out."""
    found = simulate_within(chosen(), 0.01)
    assert found.result.scene.modelled.dimension == "planar" and found.result.scene.modelled.sliders == "massless"
    assert found.chosen.estimate <= 0.01 and any("with every effect" in reason for reason in found.reasons)
    tight = run_native("implicit", replace(chosen(), effects=Effects()), 1e-8, 60.0, repeats=0)
    mine = run_native("implicit", found.result.scene, found.chosen.rtol, 60.0, repeats=0)
    assert worst(errors(mine, tight)) < 0.01


def test_effects_that_cannot_meet_the_target_are_given_up(monkeypatch):
    """An axis of the orbit alone, said to be enough: the full model tells otherwise."""
    scene = replace(load_scene("fenz-test5"), effects=Auto(rims=None), output_step=None)
    real = within.effects_for
    monkeypatch.setattr(within, "effects_for", lambda s, e: (replace(s.effects, rims=None), real(s, e)[1]))
    monkeypatch.setattr(within, "full", full_with_other_friction)
    found = simulate_within(scene, 0.01)
    assert isinstance(found.result.scene.effects, Effects) and "they leave" in " ".join(found.reasons)


def full_with_other_friction(scene):
    """A judge that differs whatever the tolerance."""
    if isinstance(scene.effects, Effects):
        return scene
    surfaces = [replace(s, friction=1.2 * s.friction) for s in scene.bearing.surfaces]
    return replace(scene, effects=Effects(), bearing=replace(scene.bearing, surfaces=surfaces))


def test_a_bearing_without_rims_is_judged_without_them():
    scene = load_scene("fenz-test2")
    bodies = [replace(body, rim_radius=0.0) for body in scene.bearing.bodies]
    bare = replace(scene, bearing=replace(scene.bearing, bodies=bodies), effects=Auto(rims=False))
    assert full(bare).effects.rims is False and full(scene) is scene
