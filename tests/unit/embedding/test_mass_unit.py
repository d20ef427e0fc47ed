"""The unit of a supported mass: force in, motion out; Co-Simulation and Model Exchange."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest
from support import Array
from support.ends import swing
from support.standard import objections
from support.units import MASS, Unit, mass

from msfp_gen.embedding.unit import scene_of_unit, write_fmu
from msfp_gen.model.model import build_model

pytest.importorskip("fmpy")
pytestmark = pytest.mark.slow  # a second unit, compiled for twenty seconds; that of a rig is built every time

STEP, COUNT = 0.02, 60
BASE = np.zeros((2, 6))
BASE[0, :3] = 0.04, 0.02, 0.0005  # amplitudes of `swing` [m]
TOP_FORCE, SLIDING, NORMAL = slice(18, 21), slice(24, 28), slice(28, 32)  # of the outputs


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mass") / "isolated.fmu"
    return write_fmu(mass(), path, exchange=True).path


def base(time: float) -> Array:
    """Inputs at a time: the base swings, no load beside the weight."""
    return swing(time, BASE)


def quintic(start: Array, end: Array, h: float) -> list[float]:
    """Coefficients of the polynomial through values and two derivatives at both ends, in the order of rounding of C."""
    moved, v0, v1, a0, a1 = end[0] - start[0], h * start[1], h * end[1], h * h * start[2], h * h * end[2]
    h3 = 2.0 * h * h * h
    return [
        start[0],
        start[1],
        0.5 * start[2],
        (20.0 * moved - 8.0 * v1 - 12.0 * v0 - 3.0 * a0 + a1) / h3,
        (-30.0 * moved + 14.0 * v1 + 16.0 * v0 + 3.0 * a0 - 2.0 * a1) / (h3 * h),
        (12.0 * moved - 6.0 * (v1 + v0) - a0 + a1) / (h3 * h * h),
    ]


def test_rows_are_those_of_a_run_bit_by_bit(unit: Path) -> None:
    """A run over the same pieces, whose steps end at their ends, which are the communication points."""
    scene = scene_of_unit(mass())
    times, pieces, rows, before = [0.0], [], [], base(0.0)[0]
    with Unit(unit, inputs_at_step_end=True) as unit_at_work:
        unit_at_work.start()
        for _ in range(COUNT + 1):
            end = base(times[-1] + STEP)
            rows.append(unit_at_work.step(times[-1], STEP, end))
            length = (times[-1] + STEP) - times[-1]
            pieces.append([quintic(before[:, k], end[0][:, k], length) for k in range(6)])
            times.append(times[-1] + STEP)
            before = end[0]
    model, knots, count = build_model(scene.bearing.layout, scene.modelled), np.array(times), 4
    run = model.extension.Run(
        model.stack(scene.bearing, scene.top),
        *(knots, np.array(pieces), np.array([0.0, 2.0]), np.zeros((1, 6, 6)), np.array([])),
        *(np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 2))),
        method="implicit",
        rtol=scene.solver.rtol,
        atol_angle=scene.solver.angle_tolerance,
        stops=knots[1:-1],
        duration=knots[-1],
    )
    while run.advance(1000):
        pass
    found = model.unpack(run.rows)
    at = np.searchsorted(found["time"], knots[1:-1])
    assert np.array_equal(found["time"][at], knots[1:-1])
    given = np.array(rows[:-1])
    assert np.array_equal(found["top_force"][at], given[:, TOP_FORCE])
    assert np.array_equal(found["sliding"][at], given[:, SLIDING])
    assert np.array_equal(found["normal"][at], given[:, NORMAL])
    assert np.array_equal(found["q"][at, -1], given[:, 3:6]) and np.array_equal(found["v"][at, -1], given[:, 9:12])
    assert np.allclose(found["top"][at] - found["top"][0], given[:, :3], rtol=0, atol=1e-15)
    assert np.abs(given[:, SLIDING]).max() > 0.02


def test_directional_derivatives_equal_differences_of_steps(unit: Path) -> None:
    """Steps of the solver that all have the longest length are smooth enough to be differenced from outside."""
    step, count = 0.005, 60
    solver = {"solver__rtol": 1e-6, "solver__angle_tolerance": 1e-8, "solver__max_step": 2e-4}
    with Unit(unit, inputs_at_step_end=True, **solver) as at_work:
        at_work.start()
        for i in range(count):
            at_work.step(i * step, step, base((i + 1) * step))
        state, time, end = at_work.state(), count * step, base((count + 1) * step)
        at_work.step(time, step, end)
        # Displacement, rotation, rate and acceleration of the lower end, force and moment on the top plate.
        sizes = {1: 1e-8, 5: 1e-7, 7: 1e-6, 13: 1e-3, 19: 5.0, 23: 5.0}
        found = {known: at_work.derivative(at_work.outputs, known) for known in sizes}
        for known, size in sizes.items():
            sides = []
            for sign in (-1, 1):
                at_work.restore(state)
                moved = end.ravel().copy()
                moved[known - 1] += sign * size
                sides.append(at_work.step(time, step, moved))
            expected = (sides[1] - sides[0]) / (2 * size)
            for block in (slice(0, 3), slice(6, 9), slice(12, 15), TOP_FORCE, slice(21, 24), NORMAL):
                largest = np.abs(expected[block]).max()
                assert np.abs(found[known][block] - expected[block]).max() < 1e-3 * largest, (known, block)


def test_it_conforms_to_the_standard(unit: Path) -> None:
    assert objections(unit, 2) == []


@pytest.mark.slow  # another unit to build
def test_a_unit_for_co_simulation_alone_steps(unit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is built without an archiver."""
    monkeypatch.setenv("AR", "no-such-ar")
    steps = []
    for path in (write_fmu(mass(), tmp_path / "isolated.fmu").path, unit):
        with Unit(path, inputs_at_step_end=True) as at_work:
            steps.append(at_work.start().step(0.0, STEP, base(STEP)))
    assert np.array_equal(*steps) and steps[0].any()


# ---- Model Exchange ----------------------------------------------------------------------------------------------


def signals(names: list[str], times: Array) -> Array:
    """The inputs of `base` as FMPy wants them."""
    found = np.zeros(len(times), dtype=[(name, float) for name in ["time", *names]])
    found["time"] = times
    for i, time in enumerate(times):
        for name, value in zip(names, base(time).ravel(), strict=True):
            found[name][i] = value
    return found


def test_both_kinds_simulate_under_fmpy_and_agree(unit: Path) -> None:
    """Co-Simulation from inputs at the begin of its steps, Model Exchange by CVODE at a tight tolerance."""
    from fmpy import read_model_description, simulate_fmu

    names = [v.name for v in read_model_description(str(unit)).modelVariables if v.causality == "input"]
    outputs = ["top.displacement[1]", "top.velocity[1]", "surface[1].sliding"]
    given = signals(names, np.arange(0.0, 0.4001, 0.005))
    options = {"stop_time": 0.4, "input": given, "output": outputs, "output_interval": 0.005}
    stepped = simulate_fmu(str(unit), fmi_type="CoSimulation", **options)
    exchanged = simulate_fmu(str(unit), fmi_type="ModelExchange", relative_tolerance=1e-7, **options)
    for name in outputs:
        assert np.abs(stepped[name] - exchanged[name]).max() < 5e-3 * np.abs(stepped[name]).max(), name
    assert np.abs(stepped["surface[1].sliding"]).max() > 5e-3


STATES = np.concatenate(
    [
        np.tile([3e-3, -2e-3, 0.0], 4) * np.repeat([0.5, 1.0, 1.0, 0.5], 3),
        np.tile([0.02, -0.01, 0.0], 4),
        np.tile([0.3, -0.2], 4),
    ]
)


def test_casadi_confirms_the_derivatives_of_model_exchange(unit: Path, tmp_path: Path) -> None:
    """Jacobians that `DaeBuilder` assembles of directional derivatives against differences of its evaluations."""
    casadi = pytest.importorskip("casadi")
    from fmpy import extract

    builder = casadi.DaeBuilder("bearing", str(extract(str(unit), str(tmp_path / "unit"))))
    assert (builder.nx(), builder.nu(), builder.ny()) == (len(STATES), 36, 32)
    function = builder.create("f", ["x", "u"], ["ode", "y"])
    sizes = [len(STATES), 36]
    empty = casadi.DM(builder.nx(), 1), casadi.DM(builder.ny(), 1)
    blocks = [np.array(block) for block in function.jacobian()(STATES, np.zeros(36), *empty)]
    jacobian = np.block([blocks[:2], blocks[2:]])
    at, differences = np.concatenate([STATES, np.zeros(36)]), np.empty_like(jacobian)
    scales = np.concatenate([np.full(12, 1e-2), np.full(12, 0.1), np.ones(8), np.ones(18), np.full(18, 1e4)])
    for column, scale in enumerate(scales):
        sides = []
        for sign in (-1, 1):
            moved = at.copy()
            moved[column] += sign * 3e-6 * scale
            values = function(*np.split(moved, sizes[:1]))
            sides.append(np.concatenate([np.array(value).ravel() for value in values]))
        differences[:, column] = (sides[1] - sides[0]) / (6e-6 * scale)
    largest = np.abs(differences * scales).max(axis=1, keepdims=True)
    assert np.abs((jacobian - differences) * scales).max() > 0
    assert np.all(np.abs((jacobian - differences) * scales) <= 1e-5 * largest)
    with Unit(unit, exchange=True) as at_work:
        at_work.start()
        states = [at_work.references[v.derivative.name] for v in at_work.description.modelVariables if v.derivative]
        at_work.fmu.setContinuousStates((ctypes.c_double * len(STATES))(*STATES), len(STATES))
        given = at_work.derivative(at_work.outputs, states[0])
        assert np.allclose(given, jacobian[32:, 0], rtol=1e-6, atol=1e-6)


def test_casadi_validates_the_derivatives_by_itself(unit: Path, tmp_path: Path) -> None:
    """Its list of disagreements, at tolerances below rounding, holds every derivative with a difference of its own.

    It validates where it evaluates blocks of the Jacobian, not where it differentiates a function.
    """
    casadi = pytest.importorskip("casadi")
    from fmpy import extract

    builder = casadi.DaeBuilder("bearing", str(extract(str(unit), str(tmp_path / "unit"))))
    file = tmp_path / "disagreements"
    options = {"validate_forward": True, "validate_ad_file": str(file), "abstol": 1e-14, "reltol": 1e-14}
    builder.create("f", ["x", "u"], ["jac_ode_x", "jac_ode_u", "jac_y_x", "jac_y_u"], options)(STATES, np.zeros(36))
    heads, *lines = (line.split() for line in file.read_text().splitlines())
    found = [dict(zip(heads, line, strict=False)) for line in lines]
    largest: dict[str, float] = {}
    for each in found:
        size = abs(float(each["FD"])) * float(each["Nominal"])
        largest[each["Output"]] = max(largest.get(each["Output"], 0.0), size)
    assert len(found) > 1000 and len(largest) > 50
    for each in found:
        error = abs(float(each["AD"]) - float(each["FD"])) * float(each["Nominal"])
        assert error < 1e-4 * largest[each["Output"]], each


def test_what_model_exchange_refuses(unit: Path) -> None:
    from fmpy.fmi1 import FMICallException

    with Unit(unit, exchange=True) as at_work:
        at_work.start()
        with pytest.raises(FMICallException):
            at_work.fmu.setContinuousStates((ctypes.c_double * 2)(0.0, 1.0), 2)
        assert "this instance has 32" in at_work.messages[-1]
        lifted = base(0.0)
        lifted[1, 0, 2] = 2 * 9.8 * MASS
        at_work.write(range(1, 37), lifted)
        with pytest.raises(FMICallException):
            at_work.read(at_work.outputs)
        assert "uplift" in at_work.messages[-1]
