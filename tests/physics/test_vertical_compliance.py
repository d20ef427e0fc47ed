"""A top on a vertical spring: a supported mass that settles, a rig that holds its height (docs/model.md)."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plain import plain_scene
from reference import stack
from reference import top as reference
from scipy.integrate import solve_ivp
from scipy.interpolate import BPoly, PPoly
from support import Array, bearing_of, model_of, thinned
from support.random_states import sensible
from support.resuming import assert_same, interrupted

from msfp_gen import Auto, Effects, InputError, Motion, Scene, Solver, Top, build_model, load_scene, presets, simulate
from msfp_gen.model.model import Ode
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_selection import quasistatic
from msfp_gen.scene.explain import explain
from msfp_gen.scene.file.loader import scene_from_table, scene_text
from msfp_gen.scene.standing import seat_stiffness
from msfp_gen.simulation.start import RestartState, start_compiled_run

BEARING = presets.bearing("fenz-tfp")
MASS, GRAVITY = 11e3, BEARING.gravity
WEIGHT = MASS * GRAVITY
FREQUENCY, DAMPING = 12.0, 0.05  # of the mass on its spring [Hz], ratio [-]
STIFFNESS = MASS * (2 * np.pi * FREQUENCY) ** 2
PLANAR = Effects(dimension="planar")
MASSLESS = Effects(dimension="planar", sliders="massless")
UPLIFT = Effects(dimension="planar", uplift=True)


def sprung(stiffness: float | None = STIFFNESS, ratio: float = DAMPING) -> Top:
    """The supported mass on a vertical spring, or rigid."""
    damping = 0.0 if stiffness is None else 2 * ratio * np.sqrt(stiffness * MASS)
    return Top.mass(MASS, 300.0, 0.5, 1e7, 1e4, vertical_stiffness=stiffness, vertical_damping=damping)


HELD = Top.rig(112e3, 1e8, 0.0, 1e6, 0.0, vertical_stiffness=1e7, vertical_damping=1e4)


def motion(heave: float, sway: float = 0.0, frequency: float = 5.0, duration: float = 1.0) -> Motion:
    """A base that rises and falls by `heave` [m], and moves to the side and back by `sway` [m], in quintic pieces.

    Displacements are squares of 1 - cos, so that the accelerations start from zero.
    """
    time, w = np.linspace(0.0, duration, round(80 * frequency * duration) + 1), 2 * np.pi * frequency
    pieces = np.zeros((len(time) - 1, 6, 6))
    for channel, size, rate in ((2, heave, w), (0, sway, 0.2 * w)):
        p = 0.5 * np.stack([1 - np.cos(rate * time), rate * np.sin(rate * time), rate**2 * np.cos(rate * time)])
        values = [p[0] ** 2, 2 * p[0] * p[1], 2 * (p[1] ** 2 + p[0] * p[2])]
        curve = PPoly.from_bernstein_basis(BPoly.from_derivatives(time, size * np.stack(values, axis=1)))
        pieces[:, channel] = curve.c[::-1].T
    return Motion(time, pieces)


def scene(moved: Motion, top: Top, effects: Effects | Auto = PLANAR, **solver: Any) -> Scene:
    return Scene(BEARING, moved, top, effects, Solver(**{"rtol": 1e-6, **solver}))


def oscillator(moved: Motion, time: Array) -> tuple[Array, Array]:
    """Settlement [m] and force [N] of a mass on a spring above this base."""
    damping = 2 * DAMPING * np.sqrt(STIFFNESS * MASS)

    def rates(t: float, y: Array) -> list[float]:
        base = moved.evaluate(t, 0)[2] - y[0], moved.evaluate(t, 1)[2] - y[1]
        return [y[1], (STIFFNESS * base[0] + damping * base[1]) / MASS]

    y = solve_ivp(rates, (0.0, time[-1]), [0.0, 0.0], "DOP853", time, rtol=1e-10, atol=1e-13).y
    shortening = moved.evaluate(time, 0)[:, 2] - y[0], moved.evaluate(time, 1)[:, 2] - y[1]
    return WEIGHT / STIFFNESS + shortening[0], WEIGHT + STIFFNESS * shortening[0] + damping * shortening[1]


def closure(result: Result) -> float:
    return float(result.summary["energy"]["closure_error"])


# ---- the equations ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["condensed", "report"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_accelerations_equal_the_reference(seed, formulation):
    """At a random state of a mass, and of a rig, above a base that moves in every direction."""
    layout = (5, 2, 2)
    values, state, h, _ = sensible(layout, seed)
    state = replace(state, a=np.zeros_like(state.a))
    base = state.base
    moved = np.array(
        [
            np.r_[base.displacement, base.angles],
            np.r_[base.velocity, base.rates],
            np.r_[base.acceleration, base.rate_rates],
        ]
    )
    model, bearing = model_of(layout), bearing_of(values)
    height = model.kinematics(bearing, state.q, state.v, state.a, base=moved)["r_55"][2]
    foot = np.array([height - 4e-3, 0.2])
    mass = Top.mass(3e3, (2e3, 1e3), 0.3, 1e5, 1e3, vertical_stiffness=5e6, vertical_damping=1e4)
    rig = Top.rig(2e4, 1e5, 1e3, 1e5, 1e3, vertical_stiffness=1e6, vertical_damping=1e4)
    tops = {
        mass: partial(reference.mass, mass, values.gravity, tuple(foot)),
        rig: partial(reference.rig, rig, foot[0]),
    }
    for top, acts in tops.items():
        axial = np.r_[0.0, 0.0, -getattr(top, "axial_load", 0.0), np.zeros(3)]
        given = foot if top is mass else foot * [1.0, 0.0]
        args = (np.ascontiguousarray(x) for x in (state.q, state.v, h))
        status, a, row, *_ = model.stack(bearing, top).accelerations(
            *args, moved, axial, report=formulation == "report", foot=given
        )
        want = stack.solve(values, state, h, acts, "locked")
        assert status == "ok"
        assert np.abs(a - want.acceleration).max() < 1e-8 * (1 + np.abs(want.acceleration).max())
        normal = model.unpack(row)["normal"]
        assert np.abs(normal - want.normal_force).max() < 1e-8 * normal.max()


@pytest.mark.parametrize("beta", [1e-4, 1e-2])
def test_the_closed_form_of_a_stage_satisfies_the_stage_formula(beta):
    """Forces with y'' eliminated equal those with y, y' of a linear system; without friction Y, Z do not enter."""
    layout = (5, 2, 2)
    values, state, _, _ = sensible(layout, 3)
    model, bearing = model_of(layout), bearing_of(values).replace(friction=[0.0] * 4)
    base, load, zero = np.zeros((3, 6)), np.zeros(6), np.zeros((4, 2))
    top = Top.mass(3e3, 2e3, 0.3, vertical_stiffness=5e6, vertical_damping=1e4)
    found = model.kinematics(bearing, state.q, state.v, state.a)
    height, speed = found["r_55"][2], found["v_55"][2]
    w, dw, t3 = found["omega_5"], found["alpha_5"], found["t_5"][2]
    raised = 0.3 * (np.cross(dw, t3) + np.cross(w, np.cross(w, t3)))[2]
    given = (height - 3e-3, 0.05, beta)
    y = reference.foot_in_stage(top, bearing.gravity, given, (height, speed), raised)
    compiled = model.stack(bearing, top)
    at = [np.ascontiguousarray(x) for x in (state.q, state.v, state.a)]
    stage = compiled.condensed(*at, zero, base, load, 0.0, 0.0, 1.0, beta, foot=np.array(given[:2]))[1]
    plain = compiled.condensed(*at, zero, base, load, 0.0, 0.0, 1.0, 0.0, foot=y[:2])[1]
    assert np.abs(stage - plain).max() < 1e-9 * np.abs(plain).max()
    other = compiled.condensed(*at, zero, base, load, 0.0, 0.0, 1.0, 0.0, foot=np.array(given[:2]))[1]
    assert np.abs(other - plain).max() > 1e-6 * np.abs(plain).max(), "the stage moves the foot"


def test_the_foot_is_at_rest_unless_given():
    stack_of = build_model(BEARING.layout, PLANAR).stack(BEARING, sprung())
    zero, base, load = np.zeros((4, 3)), np.zeros((3, 6)), np.zeros(6)
    row = stack_of.observe(zero, zero, zero, np.zeros((4, 2)), base, load)[0]
    found = build_model(BEARING.layout, PLANAR).unpack(row)
    assert found["top_settlement"] == pytest.approx(WEIGHT / STIFFNESS, rel=1e-12)
    assert found["normal"][-1] == pytest.approx(WEIGHT + BEARING.bodies[-1].mass * GRAVITY, rel=1e-10)


# ---- runs ---------------------------------------------------------------------------------------------------------

HEAVE = motion(2e-3)


@pytest.mark.parametrize(("method", "rtol"), [("implicit", 1e-7), ("esdirk4", 1e-7), ("dopri5", 1e-6)])
def test_a_centred_bearing_is_a_linear_oscillator(method, rtol):
    result = simulate(scene(HEAVE, sprung(), method=method, rtol=rtol))
    settlement, force = oscillator(HEAVE, result.history.time)
    assert np.abs(force).max() > 1.1 * WEIGHT
    assert np.abs(result.history.top_force[:, 2] - force).max() < 1e-4 * WEIGHT
    assert np.abs(result.history.top_settlement - settlement).max() < 1e-4 * WEIGHT / STIFFNESS
    assert closure(result) < 2e-4


@pytest.mark.parametrize("method", ["implicit", "esdirk4"])
def test_rows_between_steps_are_those_of_the_oscillator(method):
    result = simulate(replace(scene(HEAVE, sprung(), method=method), output_step=0.0037))
    settlement, force = oscillator(HEAVE, result.history.time)
    assert np.abs(result.history.top_force[:, 2] - force).max() < 1e-3 * WEIGHT
    assert np.abs(result.history.top_settlement - settlement).max() < 1e-3 * WEIGHT / STIFFNESS


@pytest.mark.parametrize("effects", [PLANAR, MASSLESS], ids=("inertial", "massless"))
def test_a_rig_holds_its_height(effects):
    """Above a base that heaves, the force is that of the spring and the damper beside the axial load."""
    given = scene(HEAVE, HELD, effects, rtol=1e-5)
    result = simulate(given)
    time = result.history.time
    force = 112e3 + 1e7 * HEAVE.evaluate(time, 0)[:, 2] + 1e4 * HEAVE.evaluate(time, 1)[:, 2]
    assert np.abs(result.history.top_force[:, 2] - force).max() < 1e-9 * 112e3
    assert np.abs(result.history.top_settlement - HEAVE.evaluate(time, 0)[:, 2]).max() < 1e-12
    assert closure(result) < 1e-3


SWAY = motion(2e-3, 0.04)


def test_methods_agree_and_energy_closes():
    """A base that sways and heaves: every surface slides, and the settlement follows the slopes of the sliders."""
    given = replace(scene(SWAY, sprung(), rtol=1e-7), output_step=2e-3)
    methods = ("implicit", "esdirk4", "dopri5")
    runs = [simulate(replace(given, solver=replace(given.solver, method=method))) for method in methods]
    assert runs[0].history.sliding.max() > 0.01
    for run in runs:
        difference = run.history.top_settlement - runs[0].history.top_settlement
        assert np.abs(difference).max() < 1e-3 * WEIGHT / STIFFNESS
        assert closure(run) < 1e-3
        assert run.history.energy["top_dissipated"][-1] > 0.1


@pytest.mark.parametrize(
    ("top", "effects"),
    [(sprung(), MASSLESS), (HELD, MASSLESS), (HELD, PLANAR), (sprung(), UPLIFT), (HELD, UPLIFT)],
    ids=("massless, mass", "massless, rig", "rig", "uplift, mass", "uplift, rig"),
)
def test_energy_closes_with_every_effect(top, effects):
    result = simulate(scene(SWAY, top, effects, rtol=1e-5))
    assert closure(result) < 2e-3
    assert np.ptp(result.history.top_settlement) > 1e-4


def test_quasistatic_steps_take_the_spring_of_a_rig():
    """With a spring but no damper steps are quasi-static; with a damper, or on a spring that carries a mass, not."""
    soft = replace(HELD, vertical_damping=0.0)
    slow = motion(2e-3, 0.04, frequency=0.05, duration=10.0)
    flowing, integrated = (
        simulate(replace(scene(slow, soft, effects, rtol=1e-5), output_step=0.05)) for effects in (MASSLESS, PLANAR)
    )
    assert quasistatic(flowing.scene, MASSLESS)
    assert not quasistatic(replace(flowing.scene, top=replace(soft, vertical_damping=1e7)), MASSLESS)
    assert not quasistatic(replace(flowing.scene, top=sprung()), MASSLESS)
    found, want = flowing.history.top_settlement, integrated.history.top_settlement
    assert np.abs(found - want).max() < 1e-3 * np.ptp(want)
    assert closure(flowing) < 1e-3


def test_a_stiff_spring_tends_to_the_rigid_mass():
    gentle = motion(2e-3, 0.04, frequency=2.0)
    rigid, soft, stiff = (
        simulate(replace(scene(gentle, sprung(k, 0.3)), output_step=1e-3)).history for k in (None, STIFFNESS, 1e11)
    )
    peaks = [history.normal_force.max() / rigid.normal_force.max() - 1 for history in (soft, stiff)]
    assert abs(peaks[1]) < 1e-3 < abs(peaks[0])
    assert rigid.top_settlement is None and np.abs(stiff.top_settlement).max() < 2e-6


@pytest.mark.parametrize("effects", [PLANAR, UPLIFT], ids=("closed", "uplift"))
def test_at_rest_nothing_moves(effects):
    """The spring carries the weight from the start."""
    still = Motion(np.array([0.0, 2.0]), np.zeros((1, 6, 6)))
    for top in (sprung(), HELD):
        history = simulate(scene(still, top, effects)).history
        assert np.ptp(history.top_settlement) < 1e-12 and np.abs(history.tilt_angles).max() < 1e-12
        assert np.ptp(history.top_force[:, 2]) < 1e-5


def test_a_rig_that_lets_the_bearing_go_is_modelled_with_uplift():
    """A base that sinks by 20 mm below a rig that holds its height unloads the bearing."""
    sinking = motion(-0.02, 0.04, frequency=0.5)
    chosen = [scene(sinking, replace(HELD, vertical_stiffness=k), Auto()).modelled.uplift for k in (1e5, 1e7)]
    assert chosen == [False, True]


# ---- runs that continue -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", thinned(["implicit", "dopri5"], lambda method: method == "implicit"))
def test_a_resumed_run_repeats_every_bit(tmp_path, monkeypatch, method):
    monkeypatch.setattr("msfp_gen.simulation.bearing_run.STEPS_PER_CALL", 20)
    given, path = scene(SWAY, sprung(), method=method, rtol=1e-4), tmp_path / "checkpoint"
    whole = simulate(given)
    interrupted(given, path, when=0.4)
    assert_same(simulate(given, checkpoint=path, resume=True), whole)


def restarted(first: Effects, then: Effects, at: float, **changes: Any) -> tuple[Any, Any]:
    """The row that ends a segment and the one that begins the next, with the foot, as arrays by name."""
    given = scene(SWAY, sprung(), first, **changes)
    models = [build_model(BEARING.layout, effects) for effects in (first, then)]
    run, azimuth = start_compiled_run(given, models[0], given.effect_selection, at, None, ())
    while run.advance():
        pass
    end = RestartState.of(models[0], run, azimuth)
    following, _ = start_compiled_run(given, models[1], given.effect_selection, 1.0, end, ())
    rows = [model.unpack(each.rows[-1]) for model, each in zip(models, (run, following), strict=True)]
    feet = [
        model.extension.read_state(each.snapshot(rows=1))["foot"]
        for model, each in zip(models, (run, following), strict=True)
    ]
    return tuple({**row, "foot": foot} for row, foot in zip(rows, feet, strict=True))


@pytest.mark.parametrize(("first", "then"), [(MASSLESS, PLANAR), (PLANAR, Effects())], ids=("inertia", "plane"))
def test_a_switch_of_effects_keeps_the_foot(first, then):
    before, after = restarted(first, then, 0.3, rtol=1e-4)
    assert np.array_equal(before["foot"], after["foot"]) and before["foot"][1] != 0.0
    assert after["top_settlement"] == pytest.approx(before["top_settlement"], rel=1e-12)


def test_a_switch_to_uplift_keeps_the_forces():
    """Contacts that are compressed from now on lower the top plate; their compliance is taken out of the spring."""
    before, after = restarted(PLANAR, UPLIFT, 0.3, rtol=1e-4)
    assert after["top"][2] < before["top"][2] - 1e-5
    assert after["normal"] == pytest.approx(before["normal"], rel=1e-8)
    assert after["top_settlement"] == pytest.approx(before["top_settlement"], rel=2e-3)
    weights = BEARING.gravity * sum(np.cumsum([body.mass for body in BEARING.bodies[::-1]]))
    settled = weights / seat_stiffness(BEARING, sprung())[0]  # of all contacts, under the bodies alone
    assert after["foot"] == pytest.approx(before["foot"] - np.array([settled, 0.0]), abs=1e-12)


# ---- input --------------------------------------------------------------------------------------------------------


def test_a_scene_file_gives_the_spring(tmp_path: Path) -> None:
    given = replace(load_scene("fenz-test2"), top=sprung())
    again = scene_from_table(tomllib.loads(scene_text(given)))
    assert again.top == given.top
    rows = {row[0]: row[1] for table in explain(again) if table.title.startswith("top:") for row in table.rows}
    assert rows["vertical stiffness"] == f"{STIFFNESS:g} N/m"
    rigid = scene_from_table(tomllib.loads(scene_text(replace(given, top=sprung(None)))))
    assert rigid.top.vertical_stiffness is None  # type: ignore[attr-defined]
    rows = {row[0]: row[1] for table in explain(rigid) if table.title.startswith("top:") for row in table.rows}
    assert rows["vertical stiffness"] == "rigid"


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"vertical_stiffness": -1.0}, "top.vertical_stiffness = -1.0: give a finite number not below 0 [N/m]"),
        ({"vertical_stiffness": 1e8, "vertical_damping": -1.0}, "top.vertical_damping = -1.0"),
        ({"vertical_damping": 1e5}, "top.vertical_damping = 100000.0: a damper alone carries no weight"),
    ],
)
def test_an_impossible_spring_is_refused(values, word):
    with pytest.raises(InputError) as error:
        Top.mass(MASS, 300.0, 0.5, **values)
    assert word in str(error.value) and "\n" not in str(error.value)
    if "vertical_stiffness" not in values:
        return
    with pytest.raises(InputError, match=r"top\.vertical_"):
        Top.rig(1e5, 1e8, **values)
    table = tomllib.loads(scene_text(replace(load_scene("fenz-test2"), top=sprung())))
    table["top"] |= values
    with pytest.raises(InputError, match=r"top\.vertical_"):
        scene_from_table(table)


def test_a_spring_of_no_stiffness_is_none_as_of_a_rig():
    assert Top.mass(MASS, 300.0, 0.5, vertical_stiffness=0) == Top.mass(MASS, 300.0, 0.5)


def test_library_integrators_refuse_a_spring():
    with pytest.raises(InputError, match=r"top\.vertical_stiffness = .*foot"):
        Ode(build_model(BEARING.layout, PLANAR), BEARING, HEAVE, sprung())


@pytest.mark.slow
@pytest.mark.parametrize("scene_name", ["ridgecrest-clc", "ridgecrest-ccc"])
@pytest.mark.parametrize("bearing_name", ["prototype-tfp", "becker-tfp", "fenz-tfp"])
@pytest.mark.parametrize("frequency", [None, 12.4])
def test_records_complete_with_sliders_of_real_mass(scene_name, bearing_name, frequency):
    """Sliders of a thousandth of the mass that they carry, full scale: one answer at every tolerance."""
    scene, bearing = plain_scene(scene_name), presets.bearing(bearing_name)
    mass = scene.top.mass
    factors = [1e-3 * mass / body.mass for body in bearing.bodies[:-1]] + [1.0]
    bodies = [
        replace(body, mass=factor * body.mass, inertia=tuple(factor * value for value in body.moments))
        for body, factor in zip(bearing.bodies, factors, strict=True)
    ]
    stiffness = None if frequency is None else mass * (2 * np.pi * frequency) ** 2
    damping = 0.0 if frequency is None else 0.1 * mass * 2 * np.pi * frequency
    top = replace(scene.top, vertical_stiffness=stiffness, vertical_damping=damping)
    whole = replace(scene, bearing=replace(bearing, bodies=bodies), top=top, effects=Auto())
    results = [simulate(replace(whole, solver=Solver(rtol=rtol))) for rtol in (1e-3, 1e-4, 1e-5, 1e-6)]
    assert all(result.status == "ok" for result in results)
    peaks = [result.extremes.displacement[3] for result in results]
    assert max(peaks) < 1.005 * min(peaks)
    if frequency is not None:
        shears = [result.extremes.top_force[3] for result in results]
        assert max(shears) < 1.01 * min(shears)
