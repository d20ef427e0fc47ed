"""Planar models without masses are not integrated: friction flows in closed form over the slip of a step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from support import scene_of

from msfp_gen import Auto, Effects, Load, Motion, Scene, Top, presets, simulate
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_selection import damping_share, quasistatic
from msfp_gen.scene.explain import explain
from msfp_gen.specification.friction_laws import HYSTERESIS, Hysteresis

PLANAR = Effects(dimension="planar", sliders="massless")
TEST2 = scene_of("fenz-test2", {"dimension": "planar", "sliders": "massless"}, output_step=0.05)


def solved(scene: Scene, **solver: Any) -> Result:
    return simulate(replace(scene, solver=replace(scene.solver, **solver)))


def apart(one: Result, other: Result) -> float:
    """Largest difference of the top force over its horizontal peak."""
    first, second = one.history.top_force, other.history.top_force
    return float(np.abs(first - second).max() / np.abs(second[:, :2]).max())


def test_where_nothing_needs_integration() -> None:
    assert quasistatic(TEST2, PLANAR)
    assert not quasistatic(TEST2, Effects())
    assert 1e-5 < damping_share(TEST2) < 1e-3
    assert not quasistatic(replace(TEST2, solver=replace(TEST2.solver, method="esdirk4")), PLANAR)
    assert not quasistatic(replace(TEST2, solver=replace(TEST2.solver, rtol=1e-8)), PLANAR), "dampers would be seen"
    rig = Top.rig(112e3, 1e8, damping=1e5, rotational_stiffness=1e6)
    assert not quasistatic(replace(TEST2, top=rig), PLANAR)
    mass = Top.mass(11e3, 4e3, 0.3, rotational_stiffness=1e7)
    assert not quasistatic(replace(TEST2, top=mass), PLANAR)
    slippery = TEST2.bearing.replace(friction=[0.03, 0.0, 0.01, 0.1])
    assert damping_share(replace(TEST2, bearing=slippery)) == np.inf


def test_explain_says_so() -> None:
    def steps(scene: Scene) -> str:
        table = next(table for table in explain(scene) if table.title == "solver")
        return next(row[1] for row in table.rows if row[0] == "steps")

    assert steps(TEST2).startswith("quasi-static: ") and "damper forces are 0.043% of friction" in steps(TEST2)
    assert steps(TEST2).endswith("exact for any step length")
    assert steps(replace(TEST2, effects=Effects())) == "integrated"


def test_which_models_flow(monkeypatch: pytest.MonkeyPatch) -> None:
    assert PLANAR.permits_quasistatic_steps and replace(PLANAR, bouc_wen="isotropic").permits_quasistatic_steps
    for other in ({"sliders": "inertial"}, {"dimension": "spatial"}, {"friction": "velocity"}):
        assert not replace(PLANAR, **other).permits_quasistatic_steps
    others = [
        lambda yu, zv, step: (step(yu - 0.5), step(zv)),  # grows past the middle only
        lambda yu, zv, step: (0.0 * step(yu), step(zv)),  # never grows
        lambda yu, zv, step: (step(2 * yu), step(zv)),  # the same in other words, which nobody claims to see
        lambda yu, zv, step: (1.0, 1.0),
    ]
    for switches in others:
        monkeypatch.setitem(HYSTERESIS, "report", Hysteresis("another", switches))
        assert not PLANAR.permits_quasistatic_steps


@pytest.mark.parametrize("name", ["fenz-test2", "fenz-test5"])
def test_forces_are_those_of_an_integration_to_a_tight_tolerance(name: str) -> None:
    changes = {"output_step": 0.05, "duration": 50.0}
    scene = scene_of(name, {"dimension": "planar", "sliders": "massless"}, **changes)
    fine = solved(scene, method="esdirk4", rtol=1e-7)
    coarse = solved(scene, rtol=1e-3)
    assert coarse.counters.steps < 1.1 * len(coarse.history.time) + 200, "a row is a step"
    assert apart(coarse, fine) < 1e-3
    assert apart(solved(scene, rtol=1e-5), fine) < 5e-5


def test_a_step_is_exact_whatever_its_length() -> None:
    long, short = solved(TEST2, rtol=1e-5), solved(TEST2, rtol=1e-5, max_step=0.01)
    assert short.counters.steps > 4 * long.counters.steps
    assert apart(long, short) < 2e-5


def test_energy_closes() -> None:
    rows = simulate(TEST2)
    assert rows.summary["energy"]["closure_error"] < 5e-6
    own = simulate(replace(TEST2, output_step=None))
    assert own.counters.steps < 200
    assert own.summary["energy"]["closure_error"] < 2e-3
    assert own.summary["energy"]["peak_input"] == pytest.approx(rows.summary["energy"]["peak_input"], rel=2e-3)


def test_the_flow_is_the_law_of_the_report() -> None:
    """(3.18) along one slip, Y and what is lost, against an integration of it: a single pendulum pulled to and fro."""
    bearing = presets.bearing("single-fp")
    surface = bearing.surfaces[0]
    d_y, radius = surface.yield_displacement, surface.radius
    turns = np.array([0.0, 0.4, 2.5, 1.3, -0.4, -0.2, -3.0, 0.0]) * d_y
    motion = Motion.from_arrays(np.arange(8.0), turns[:, None] * [1.0, 0.0, 0.0])
    scene = Scene(bearing, motion, Top.rig(1e5, 1e9, rotational_stiffness=1e8), effects=PLANAR, output_step=0.05)
    assert quasistatic(scene, PLANAR)
    run = simulate(scene)
    theta = run.history.tilt_angles[:, 0, 1]
    for last in range(1, len(theta)):
        first = last - 1
        slip = -radius * (theta[last] - theta[first]) * np.sign(bearing.layout.signs[0]) / d_y
        Y = run.history.friction_state[first, 0, 0]
        found = run.history.friction_state[last, 0, 0]
        assert found == pytest.approx(_flown(Y, slip), abs=5e-3), "turns back within a step cost the tolerance"


def _flown(Y: float, slip: float) -> float:
    way = np.sign(slip)
    rates = solve_ivp(lambda s, y: way * (1 - (y * way > 0) * y * y), (0, abs(slip)), [Y], rtol=1e-9, atol=1e-12)
    return float(rates.y[0, -1])


@settings(max_examples=8, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=7), st.floats(0.002, 0.08))
@example([0.0078125, 0.0, -0.171875, -0.75, 0.0], 0.0625)
@example([0.0493912051877736, 0.0, 0.0, 0.0, 0.0, 0.42130850566702116], 0.03594109265996657)
def test_histories_with_many_turns(points: list[float], reach: float) -> None:
    """Few histories are off by more than 0.2 % at an ordinary tolerance, such as these; all converge."""
    time = np.linspace(0.0, 2.0 * (len(points) + 1), len(points) + 2)
    path = np.zeros((len(time), 3))
    path[1:-1, 0] = reach * np.array(points)
    motion = Motion.from_arrays(time, path)
    scene = replace(TEST2, motion=motion, duration=None, output_step=0.1)
    fine = solved(scene, method="esdirk4", rtol=1e-7)
    peak = max(112e3 * 0.03, np.abs(fine.history.top_force[:, 0]).max())
    for rtol, limit in ((1e-4, 1e-2), (1e-6, 1e-3)):
        result = solved(scene, rtol=rtol)
        assert np.abs(result.history.top_force - fine.history.top_force).max() < limit * peak, rtol


def test_loads_that_change_do_their_work() -> None:
    load = Load.from_arrays([0, 5, 10, 20, 60], np.outer([0, 0.3, -0.2, 0.1, 0.1], [2e3, 0.0, 4e4]))
    scene = replace(TEST2, load=load, duration=30.0)
    run, fine = simulate(scene), solved(scene, method="esdirk4", rtol=1e-6)
    assert quasistatic(scene, PLANAR)
    assert apart(run, fine) < 1e-3
    assert run.summary["energy"]["closure_error"] < 1e-4


def test_auto_takes_them_and_the_counts_say_so() -> None:
    auto = simulate(replace(scene_of("fenz-test2"), effects=Auto(), output_step=None))
    full = simulate(scene_of("fenz-test2", output_step=None))
    assert auto.counters.steps < 0.7 * full.counters.steps
    assert auto.counters.evaluations < 0.4 * full.counters.evaluations


def test_what_friction_loses_is_the_integral_of_its_law() -> None:
    """One pass with one sign: work of friction less what it stores, mu N d_y times the integral of Y^3 in slip."""
    result = simulate(replace(TEST2, output_step=0.02))
    lost = result.history.energy["friction_dissipated"]
    assert np.all(np.diff(lost) >= -1e-9 * lost[-1])
    k = int(np.searchsorted(result.history.time, 10.0))
    steps = slice(k, k + 10)
    by_slip = 0.0
    for j, surface in enumerate(TEST2.bearing.surfaces):
        theta, Y = result.history.tilt_angles[steps, j, 1], result.history.friction_state[steps, j, 0]
        force = surface.friction * result.history.normal_force[steps, j]
        for i in range(len(theta) - 1):
            slip = abs(surface.radius * (theta[i + 1] - theta[i]))
            by_slip += 0.25 * (force[i] + force[i + 1]) * slip * (abs(Y[i]) ** 3 + abs(Y[i + 1]) ** 3)
    assert lost[k + 9] - lost[k] == pytest.approx(by_slip, rel=0.02)


def to_the_rim(motion: Motion, duration: float, rim_stiffness: float = 1e8) -> Scene:
    """A single pendulum without dampers under a stiff rig."""
    scene = scene_of("single-push", {"dimension": "planar", "sliders": "massless"}, stop=None, duration=duration)
    bearing = scene.bearing.replace(rim_damping=0.0, rim_stiffness=rim_stiffness)
    top = replace(scene.top, damping=0.0, stiffness=1e9)
    return replace(scene, bearing=bearing, top=top, motion=motion, motion_table=None)


def test_times_of_rim_events_depend_on_neither_method_nor_tolerance_nor_rows() -> None:
    """Two cycles, in which the slider meets its rim and leaves it twice."""
    scene = to_the_rim(Motion.harmonic(0.4, 0.5, cycles=2.0), 1.8)
    found = []
    for method, rtol, rows in (("implicit", 1e-3, 0.05), ("implicit", 1e-6, None), ("esdirk4", 1e-4, 0.05),
                               ("esdirk4", 1e-8, None)):  # fmt: skip
        run = solved(replace(scene, output_step=rows), method=method, rtol=rtol)
        assert [event.kind for event in run.events] == 2 * ["rim_contact", "rim_release"]
        assert run.summary["energy"]["closure_error"] < 0.02
        found.append([event.time for event in run.events])
    assert np.ptp(found, axis=0).max() < 1e-5


@pytest.mark.parametrize("method", ["implicit", "esdirk4"])
def test_a_rim_that_stays_closed_has_one_contact(method: str) -> None:
    """Its gap returns into the tolerance of events, a millionth of the capacity, and does not become zero."""
    time, least, most = np.linspace(0.0, 2.0, 201), 0.3769, 0.3791
    path = np.interp(time, [0.0, 1.0, 1.3, 1.6, 2.0], [0.0, most, least, most, most])
    motion = Motion.from_arrays(time, np.outer(path, [1.0, 0.0, 0.0]))
    run = solved(replace(to_the_rim(motion, 2.0, 1e12), output_step=0.01), method=method)
    assert [event.kind for event in run.events] == ["rim_contact"]
    gap, tolerance = run.history.gap[run.history.time > 1.05, 0], 1e-6 * run.scene.bearing.surfaces[0].capacity
    assert gap.min() < -3 * tolerance and -tolerance < gap.max() < 0
