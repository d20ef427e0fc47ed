"""Model error: what is left out, the linearised bearing by hand, OpenSees where it is installed."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from plain import plain_scene
from support import scene_of
from support.peers import opensees_runs

from msfp_gen import InputError, Motion, RunError, Top, load_scene, presets, simulate
from msfp_gen.cli import main
from msfp_gen.scene.planarity import along
from msfp_gen.studies.accuracy import model_errors, series
from msfp_gen.studies.accuracy.methods import METHODS, VARIANTS
from msfp_gen.studies.accuracy.series import Series, run_series
from msfp_gen.studies.accuracy.study import _variant_trials, markdown, without_stop
from msfp_gen.studies.accuracy.timed_run import OK, ROWS, errors, run_native

NAMED = {variant.name: variant for variant in VARIANTS}
FENZ = presets.bearing("fenz-tfp")
W = 112e3


def quiet(line):
    """Nobody to tell."""


def short(name="fenz-test2", duration=6.0, **changes):
    return replace(load_scene(name), duration=duration, **changes)


def pushed(series, displacements):
    force, out = 0j, []
    for u in displacements:
        force = series.force(complex(u), W, 0.0, force)
        out.append(force)
    return np.array(out)


@pytest.mark.parametrize("arms", [False, True])
def test_linearised_triple_pendulum_is_the_published_formula(arms):
    """Fenz and Constantinou (2008): in stages II and III two links of R_eff = 435 and 53 mm hang in series."""
    eff1, eff2 = 0.473 - 0.038, 0.076 - 0.023
    starts = [0.03, 0.017, 0.107]
    if arms:
        grips = [0.03 * 0.473, 0.017 * 0.076, 0.107 * 0.473]
        starts = [(grips[0] - grips[1]) / (eff1 - eff2), grips[1] / eff2, (grips[2] - grips[1]) / (eff1 - eff2)]
    bearing = replace(FENZ, surfaces=[replace(s, yield_displacement=1e-9) for s in FENZ.surfaces])
    F = np.array([0.06, 0.09, 0.12, 0.13])
    stage2 = (eff1 - eff2) * (F - starts[0]) + eff2 * (F - starts[1]) * 2
    u = stage2 + (eff1 - eff2) * np.maximum(0.0, F - starts[2])
    assert pushed(Series(bearing, rims=True, arms=arms), u).real == pytest.approx(F, abs=2e-5)


def test_linearised_loop_closes_and_dissipates():
    series, phase = Series(FENZ, rims=True), np.linspace(0, 4 * np.pi, 801)
    force = pushed(series, 0.02 * np.sin(phase))
    assert abs(force[800] - force[400]) < 1e-6
    lost = np.sum((force.real[401:] + force.real[400:-1]) / 2 * np.diff(0.02 * np.sin(phase))[400:])
    assert lost == pytest.approx(4 * 0.02 * 0.03, rel=0.3)  # a rectangle of friction, less its corners


def test_linearised_bearing_turns_with_the_path():
    path = 0.03 * np.exp(1j * np.linspace(0, 3, 40)) * np.linspace(0, 1, 40)
    one, turned = Series(FENZ, rims=True), Series(FENZ, rims=True)
    force = complex(0)
    other = complex(0)
    for u in path:
        force = one.force(complex(u), W, 0.0, force)
        other = turned.force(complex(u) * np.exp(0.5j), W, 0.0, other)
        assert other == pytest.approx(force * np.exp(0.5j), abs=1e-6)


def test_linearised_rim_is_a_spring():
    """Past the travel of all rims only the rims and what yields give: four springs in series."""
    series = Series(FENZ, rims=True)
    end = sum(s.capacity / s.radius * r for s, r in zip(FENZ.surfaces, (0.435, 0.053, 0.053, 0.435), strict=True))
    force = pushed(series, np.append(np.linspace(0, end, 50), [end + 0.02, end + 0.021])).real
    assert W * (force[-1] - force[-2]) / 0.001 == pytest.approx(1e7 / 4, rel=1e-3)
    assert max(series.sliding(complex(force[-1]), 4)) < 0.067
    assert pushed(Series(FENZ, rims=False), [end + 0.021])[0].real < force[-1] / 2


def test_linearised_run_is_near_the_full_one():
    scene = short("fenz-test3", 60.0)
    found = errors(run_series(scene, 400, arms=True), METHODS["implicit"].attempt(scene, 1e-4, 10.0))
    assert found["force"].rms < 0.04 and found["sliding"].rms < 0.04


def test_linearised_mass_follows_the_full_one_while_it_slides():
    scene = replace(plain_scene("ridgecrest-clc"), duration=10.0)
    found = errors(run_series(scene, 1000, arms=True), METHODS["implicit"].attempt(scene, 1e-3, 20.0))
    assert found["force"].rms < 0.08 and found["force"].peak < 0.05


def test_linearised_bearing_needs_something_to_be_driven_by():
    with pytest.raises(InputError, match="prescribed"):
        run_series(short(top=Top.prescribed((0.0, 0.0, -W))), 10)
    with pytest.raises(InputError, match="axial load"):
        run_series(short(top=Top.rig(0.0, 1e8)), 10)


def test_a_force_that_does_not_exist_is_an_error():
    surfaces = [replace(s, rim_stiffness=0.0) for s in FENZ.surfaces]
    with pytest.raises(RunError, match="no force found"):
        Series(replace(FENZ, surfaces=surfaces), rims=True).force(0.5 + 0j, W, 0.0, 0j)


@pytest.fixture(scope="module")
def study():
    """Every variant on a quarter of a cycle; OpenSees where it is installed."""
    return model_errors(short(), tolerances=[1e-2, 1e-4], limit=20.0)


@pytest.mark.slow
def test_model_errors_are_measured_against_the_full_model(study):
    assert study.series[:5] == ["as it stands", "planar", "massless", "no rims", "planar massless"]
    worst = {name: study.of(name)[-1].errors.worst_rms for name in study.series}
    assert worst["no rims"] == pytest.approx(worst["as it stands"])  # none is met
    assert worst["planar"] < 1e-3 and worst["massless"] < 1e-3  # a slow test in one plane
    assert worst["linearised"] > 10 * worst["as it stands"] > 0
    assert not any(point.wrong for point in study.points)


@pytest.mark.slow
def test_steps_are_told_from_tolerances(study):
    settings = {point.series: point.trial.setting for point in study.points}
    assert settings["linearised"] == "0.0015 s" and settings["planar"] == "0.0001"
    assert "0.0015 s" in markdown(study)


def test_what_does_not_apply_is_left_out_and_said(monkeypatch):
    monkeypatch.setattr(series, "find_spec", lambda name: None)
    for name, changes, why in (
        ("massless", {"sliders": "massless"}, "the scene itself has sliders = 'massless'"),
        ("no rims", {"rims": False}, "the scene itself has rims = False"),
        ("OpenSees", {}, "pip install openseespy"),
    ):
        scene = scene_of("fenz-test2", changes, duration=1.0)
        trials, notes = _variant_trials(NAMED[name], scene, [1e-2], 5.0, quiet)
        assert not trials and why in notes[0]


def test_an_interrupt_ends_the_study_and_a_failure_does_not():
    """A model that finds no force is a failed run; Ctrl-C is for all of them."""
    for status in ("newton", "interrupted"):

        def fails(*_, status=status):
            raise RunError("no force", status=status)

        method = replace(NAMED["linearised"], run=fails)
        if status == "interrupted":
            with pytest.raises(RunError):
                _variant_trials(method, short(), [1e-2], 5.0, quiet)
        else:
            trials, notes = _variant_trials(method, short(), [1e-2], 5.0, quiet)
            assert [trial.status for trial in trials] == ["newton"] * 3 and not notes


def test_a_motion_in_two_directions_is_run_axis_by_axis():
    scene = short("becker-circle-50", 12.0)
    found = NAMED["planar"].run(scene, 1e-3, 20.0)
    full = run_native("implicit", scene, 1e-3, 20.0)
    assert found.status == OK and found.newton > full.newton and found.rows == ROWS + 1
    assert errors(found, full)["force"].rms > 0.05  # friction does not act axis by axis
    one = replace(scene, effects=replace(scene.effects, dimension="planar"), motion=along(scene.motion, 0))
    alone = simulate(replace(one, motion_table=None, output_step=12.0 / ROWS, solver=replace(scene.solver, rtol=1e-3)))
    assert found.histories["force"][:, 0, 0] == pytest.approx(alone.history.top_force[: ROWS + 1, 0], abs=1.0)


def test_a_rocking_base_has_no_planar_parts():
    pieces = np.zeros((1, 6, 6))
    pieces[0, :5, 3] = 1e-3
    with pytest.raises(InputError, match="rocks about both axes"):
        along(Motion(np.array([0.0, 1.0]), pieces), 0)


class Ops(ModuleType):
    """Stands for OpenSees: a linear spring of 1e5 N/m that breaks after some steps."""

    def __init__(self, last):
        super().__init__("openseespy.opensees")
        self.last, self.step, self.calls, self.values = last, 0, {}, []

    def __getattr__(self, name):
        def call(*words):
            self.calls[name] = words
            if name == "timeSeries" and words[0] == "Path":
                self.values.append(words[5:])
            if name == "analyze":
                self.step = 0 if words == (10,) else self.step + 1
                return -1 if self.step > self.last else 0
            return [0.0] * 6 + [1e5 * v[self.step] for v in self.values[:2]] if name == "eleForce" else None

        return call


@pytest.fixture
def fake(monkeypatch):
    def use(last=10**9):
        ops = Ops(last)
        monkeypatch.setattr(series, "find_spec", lambda name: True)
        monkeypatch.setitem(sys.modules, "openseespy", ModuleType("openseespy"))
        monkeypatch.setitem(sys.modules, "openseespy.opensees", ops)
        return ops

    return use


def test_opensees_is_given_the_bearing(fake):
    ops, scene = fake(), short(duration=1.0)
    found = series.run_opensees(scene, 50)
    words = ops.calls["element"]
    assert words[0] == "TripleFrictionPendulum"
    assert words[11:14] == pytest.approx((0.053, 0.435, 0.435))
    assert words[14:17] == pytest.approx((0.0215 / 0.076 * 0.053, *(0.065 / 0.473 * 0.435,) * 2))
    assert words[17] == W and found.status == OK and found.steps == 50
    u = scene.motion.displacement(1.0)[0] - scene.motion.displacement(0.0)[0]
    assert found.histories["force"][-1, 0] == pytest.approx([1e5 * u, 0.0])
    assert "wipe" in ops.calls


def test_opensees_that_fails_is_a_failure(fake):
    fake(last=20)
    found = series.run_opensees(short(duration=1.0), 50)
    assert found.status == "failed" and found.reached == pytest.approx(0.4) and found.rows == 801


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        (load_scene("double-push"), "four surfaces"),
        (short(top=Top.prescribed((0.0, 0.0, -W))), "rig, or a mass"),
        (
            short(
                bearing=replace(
                    FENZ, surfaces=[*FENZ.surfaces[:2], replace(FENZ.surfaces[2], friction=0.03), FENZ.surfaces[3]]
                )
            ),
            "equal inner",
        ),
    ],
)
def test_opensees_is_not_given_what_it_cannot_be(fake, scene, why):
    fake()
    with pytest.raises(InputError, match=why):
        series.run_opensees(scene, 10)


def test_opensees_agrees_with_the_linearised_bearing():
    if not opensees_runs():
        pytest.skip("OpenSeesPy cannot be imported")
    scene = without_stop(load_scene("fenz-test3"))
    found = errors(series.run_opensees(scene, 1000), run_series(scene, 1000))
    assert found["force"].rms < 0.05


@pytest.mark.slow
def test_command(capsys):
    words = ["bench", "model-error", "fenz-test2", "--duration", "1", "--tolerances", "1e-2"]
    assert main(words) == 0
    out, err = capsys.readouterr()
    assert "planar massless" in out and "linearised, arms" in out and "planar at 0.01: ok" in err
    assert main(["bench", "model-error", "--help"]) == 0
    assert "msfp-gen bench model-error" in capsys.readouterr().out
