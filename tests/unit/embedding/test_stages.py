"""A two-port in the stages of another program's method: forces, derivatives, refused calls."""

from __future__ import annotations

import numpy as np
import pytest
from support.buildings import BEARING, INTERFACE, LOAD

from msfp_gen import Effects, Solver, TwoPort

GAMMA = 1 - np.sqrt(0.5)  # diagonal entry of TR-BDF2
STEP, COUNT = 1.25e-4, 400  # of the motion [s]
RATES = np.array([0.2, 0.1, 1e-3, 0.01, -0.02, 0.005])  # of the upper end
STAGES = ((1, 2 * GAMMA), (2, 1.0))  # and their shares of the step


def ends(displacement: np.ndarray, rates: np.ndarray) -> np.ndarray:
    found = np.zeros((2, 3, 6))
    found[1, 0], found[1, 1] = displacement, rates
    return found


def swing(t: float) -> np.ndarray:
    """Displacements, rates and accelerations of a motion that begins smoothly, shape (3, 6)."""
    s, end = t / (COUNT * STEP), COUNT * STEP
    return np.outer([end * s**3 / 3, s**2, 2 * s / end], RATES)


def moved(port: TwoPort) -> list[float]:
    """Forces along E1 at the steps of that motion."""
    forces, compiled = [], port.compiled
    for n in range(COUNT):
        assert compiled.step_begin(STEP, swing((n + 1) * STEP)[0, :2]) == "ok"
        for stage, share in STAGES:
            status, wrench = compiled.stage(stage, ends(*swing((n + share) * STEP)[:2]))
            assert status == "ok"
        status, error, share = compiled.step_end()
        assert status == "ok" and error <= 1.0 == share and compiled.step_commit((n + 1) * STEP) == "ok"
        forces.append(wrench[1, 0])
    return forces


@pytest.mark.parametrize("effects", [None, Effects(uplift=True)], ids=["default", "uplift"])
def test_derivatives_are_those_of_the_stage(effects):
    """Central differences of solved stages, in which displacements change with the rates by beta."""
    port = TwoPort(BEARING, INTERFACE, LOAD, effects)
    compiled = port.compiled
    moved(port)
    beta = GAMMA * STEP
    start = swing(COUNT * STEP)[0] + beta * RATES  # of the stage, without its own part
    compiled.step_begin(STEP, start[:2])
    assert compiled.stage(1, ends(start + beta * RATES, RATES))[0] == "ok"
    status, derivative = compiled.stage_derivative()
    assert status == "ok"
    differences = np.zeros((6, 6))
    for k, change in enumerate(1e-4 * np.eye(6)):
        sides = (RATES + change, RATES - change)
        pair = [compiled.stage(1, ends(start + beta * rates, rates))[1][1] for rates in sides]
        differences[:, k] = (pair[0] - pair[1]) / 2e-4
    scale = np.sqrt(np.abs(np.outer(np.diag(differences), np.diag(differences)))) + 1e-3 * np.abs(differences).max()
    assert np.abs(derivative - differences).max() > 0
    assert np.all(np.abs(derivative - differences) < 1e-5 * scale)


def test_steps_by_stages_and_trials_agree():
    """The same motion of the upper end, followed by stages and by the steps of the two-port itself."""
    forces = moved(TwoPort(BEARING, INTERFACE, LOAD))
    port, still = TwoPort(BEARING, INTERFACE, LOAD, solver=Solver(rtol=1e-6)), np.zeros((3, 6))
    for n in range(40, COUNT + 1, 40):
        wrench = port.trial(n * STEP, still, swing(n * STEP)).wrench
        port.commit()
        assert wrench[1, 0] == pytest.approx(forces[n - 1], abs=2e-3 * max(forces))


def test_a_step_given_up_leaves_the_committed_wrench():
    """In the port, and in a snapshot that it writes afterwards."""
    port, other = TwoPort(BEARING, INTERFACE, LOAD).compiled, TwoPort(BEARING, INTERFACE, LOAD).compiled
    assert port.step_begin(STEP, np.zeros(2)) == "ok"
    for stage, share in STAGES:
        status, wrench = port.stage(stage, ends(*swing(share * STEP)[:2]))
        assert status == "ok"
    assert port.step_end()[0] == "ok" and port.step_commit(STEP) == "ok"
    assert np.array_equal(port.wrench, wrench)
    assert port.step_begin(STEP, np.zeros(2)) == "ok"
    assert np.abs(port.stage(1, ends(0.01 * RATES, RATES))[1] - wrench).max() > 0.01 * LOAD
    port.revert()
    assert np.array_equal(port.wrench, wrench)
    other.restore(port.snapshot())
    assert np.array_equal(other.wrench, wrench)


def test_stages_out_of_order_are_refused():
    compiled = TwoPort(BEARING, INTERFACE, LOAD).compiled
    at = ends(np.zeros(6), np.zeros(6))
    for call in (
        lambda: compiled.step_begin(0.0, np.zeros(2)),
        lambda: compiled.step_begin(STEP, np.array([np.nan, 0.0])),
        lambda: compiled.stage(1, at)[0],
        lambda: compiled.stage_derivative()[0],
        lambda: compiled.step_end()[0],
        lambda: compiled.step_commit(STEP),
    ):
        assert call() == "argument"
    assert compiled.step_begin(STEP, np.zeros(2)) == "ok"
    assert compiled.stage(2, at)[0] == "argument"
    assert compiled.stage(1, at)[0] == "ok" and compiled.step_end()[0] == "argument"
    assert compiled.stage(1, at * np.nan)[0] == "finite"
    assert compiled.stage(3, at)[0] == "argument"
    assert compiled.stage(2, at)[0] == "ok" and compiled.step_commit(STEP) == "argument"
    assert compiled.step_end()[0] == "ok"
    for time in (np.nan, -1.0, 0.0, np.inf):
        assert compiled.step_commit(time) == "argument"
    assert compiled.step_commit(STEP) == "ok" and compiled.step_commit(2 * STEP) == "argument"


def test_a_stage_that_failed_must_be_solved_before_what_follows():
    compiled = TwoPort(BEARING, INTERFACE, LOAD).compiled
    at = ends(np.zeros(6), np.zeros(6))
    far = ends(np.array([1.0, 0, 0, 0, 0, 0]), np.zeros(6))
    assert compiled.step_begin(STEP, np.zeros(2)) == "ok"
    assert compiled.stage(1, far)[0] == "newton"
    assert compiled.stage(2, at)[0] == compiled.stage_derivative()[0] == "argument"
    assert compiled.stage(1, at)[0] == compiled.stage_derivative()[0] == "ok"
    assert compiled.stage(2, far)[0] == "newton" and compiled.step_end()[0] == "argument"
    assert compiled.stage(2, at)[0] == compiled.step_end()[0] == compiled.step_commit(STEP) == "ok"
