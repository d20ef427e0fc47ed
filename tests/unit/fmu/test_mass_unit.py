"""The unit of a supported mass: force in, motion out; Co-Simulation and Model Exchange."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support import Array
from support.ends import swing
from support.units import MASS, Unit, mass

from msfp_gen.fmu import write_fmu
from msfp_gen.fmu.unit import scene_of_unit
from msfp_gen.model.model import build_model

pytest.importorskip("fmpy")

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
