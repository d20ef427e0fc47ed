"""examples/reference_loop.py, the simulation in plain NumPy, against `simulate`."""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from support import ROOT, bearing_of
from support.random_states import sensible

from msfp_gen import Effects, Layout, Motion, Top, load_scene, presets, simulate, symbolic

PATH = ROOT / "examples" / "reference_loop.py"
sys.path.append(str(PATH.parent))
import reference_loop as loop  # noqa: E402


def difference(scene, end, step, capsys):
    """Largest difference of the horizontal force over its peak; prints how much longer the loop takes."""
    begin = time.perf_counter()
    times, forces, found = loop.compare(scene, end, step)
    middle = time.perf_counter()
    simulate(replace(scene, duration=end))
    compiled = time.perf_counter() - middle
    with capsys.disabled():
        print(f"\n{scene.name}, {end:g} s: the loop takes {(middle - begin) / compiled:.0f} times as long as simulate")
    size = np.linalg.norm(found[:, :2], axis=1).max()
    assert len(times) == round(end / step) and size > 0
    return np.linalg.norm((forces - found)[:, :2], axis=1).max() / size


@pytest.mark.slow
@pytest.mark.parametrize(("end", "step"), [(2.5, 5e-3), (8.0, 4e-3)])
def test_test_2_of_chapter_4_is_that_of_simulate(end, step, capsys):
    """First sliding, and with the longer one also the turn and the way back."""
    assert difference(load_scene("fenz-test2"), end, step, capsys) < 1e-3


@pytest.mark.slow
def test_a_record_is_that_of_simulate(capsys):
    """Five seconds of the Ridgecrest record, three components, under the rig of chapter 4."""
    scene = load_scene("ridgecrest-clc")
    bearing = scene.bearing.replace(reference_pressure=None)
    top = Top.rig(112e3, 1e8, 1e4, 1e7, 1e4)
    scene = replace(scene, bearing=bearing, top=top, effects=Effects(bouc_wen="report"))
    scene = replace(scene, solver=replace(scene.solver, rtol=1e-6))
    assert difference(scene, 5.0, 1.5e-3, capsys) < 1e-3


@pytest.mark.slow
def test_both_integrations_tend_to_one_solution():
    """The midpoint rule with its order two, against Dormand and Prince; soft friction, with which that is quick."""
    bearing, motion = presets.bearing("single-articulated-fp"), Motion.harmonic(amplitude=0.05, frequency=1.0)
    top = Top.mass(5e4, 1e4, 0.3, rotational_stiffness=1e8, rotational_damping=1e5)
    b = loop.values_of(bearing.replace(yield_displacement=5e-3), top)

    def base(t):
        return np.array([motion.evaluate(t, order)[:3] for order in range(3)])

    rows = loop.dormand_prince(b, base, 0.08, 1e-7)
    errors = []
    for step in (1e-3, 5e-4):
        times, forces = loop.midpoint(b, base, 0.081, step)
        errors.append(
            np.abs(np.interp(rows[:, 0], times, forces[:, 0]) - rows[:, 1]).max() / np.abs(forces[:, 0]).max()
        )
    assert errors[0] < 3e-4 and errors[0] / errors[1] == pytest.approx(4.0, rel=0.25)


@pytest.mark.parametrize("met", [False, True], ids=("clear", "at the rims"))
@pytest.mark.parametrize("layout", [(3, 1, 1), (3, 2, 0), (5, 2, 2)])
def test_balances_are_those_of_the_symbols(layout, met):
    """With every rim met, contact damping, and a mass on springs above the top plate, at random states."""
    values, state, h, _ = sensible(layout, 4)
    count, rng = layout[0] - 1, np.random.default_rng(5)
    bearing = bearing_of(values).replace(contact_damping=1e-3, **({"capacity": [1e-4] * count} if met else {}))
    model = symbolic(Layout(*layout), Effects(bouc_wen="report"))
    top = Top.mass(3e3, (2e3, 1e3), 0.3, rotational_stiffness=1e7, rotational_damping=1e4)
    q, v, a = (x * [1.0, 1.0, 0.0] for x in (state.q, state.v, state.a))
    angles, normal = rng.uniform(-0.1, 0.1, (count, 2)), rng.uniform(8e3, 1.2e4, count)
    base = np.array([state.base.displacement, state.base.velocity, state.base.acceleration])
    at = (
        np.concatenate([q.ravel(), v.ravel(), h.ravel()]),
        np.concatenate([a.ravel(), angles.ravel(), normal]),
        np.concatenate([base.ravel(), np.zeros(15)]),
        model.values(bearing, top),
    )
    x = np.concatenate([a[:, :2].ravel(), angles.ravel(), normal])
    found, rates = loop.balances(loop.values_of(bearing, top), base, q[:, :2], v[:, :2], h, x)
    want = model.residual.lambdify()(*at).reshape(count, 6)
    assert np.abs(found[: 3 * count] - want[:, :3].ravel()).max() < 1e-11 * np.abs(want[:, :3]).max()
    assert np.abs(found[3 * count :] - want[:, 3:5].ravel()).max() < 1e-11 * np.abs(want[:, 3:5]).max()
    want = model.friction_rates.lambdify()(*at)
    assert np.abs(rates - want).max() < 1e-11 * np.abs(want).max()
