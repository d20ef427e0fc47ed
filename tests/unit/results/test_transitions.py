"""Transitions of monotonic runs whose stages were made up, so that the answers are known."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from support.synthetic import LOAD, contact, history, loops, ramp, scene

from msfp_gen.results.result import Result
from msfp_gen.results.summary import is_monotonic, stopping_displacement, transitions
from msfp_gen.scene.top import Top

KEYS = {"u_star", "u_star_star", "u_dr1", "u_dr4", "F_dr1", "F_dr4", "resolution"}


def turned(result: Result, azimuth: float) -> Result:
    """The same run along another direction."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    rows = result.history
    rows = dataclasses.replace(rows, displacement=rows.displacement @ turn.T, top_force=rows.top_force @ turn.T)
    return dataclasses.replace(result, history=rows, events=(contact(rows, 1), contact(rows, 4)))


@pytest.mark.parametrize("azimuth", [0.0, np.pi, 1.0])
def test_stages_come_out_where_they_were_put(azimuth):
    found = turned(ramp(), azimuth).summary["transitions"]
    assert set(found) == KEYS
    assert found["u_star"] == pytest.approx(0.002, abs=1.2e-4)  # half a window
    assert found["u_star_star"] == pytest.approx(0.048, abs=1.2e-4)
    assert found["u_dr1"] == pytest.approx(0.088, abs=1.01e-4)  # one row
    assert found["u_dr4"] == pytest.approx(0.134, abs=1.01e-4)
    assert found["F_dr1"] == pytest.approx((2e5 * found["u_dr1"] + 3e3) / LOAD)
    assert found["F_dr4"] == pytest.approx((2e5 * found["u_dr4"] + 3e3) / LOAD)
    assert found["resolution"] == pytest.approx(1e-4)


def test_what_did_not_happen_is_none():
    whole = ramp()
    rows = whole.history
    first: dict[str, Any] = {name: values[:300] for name, values in rows.arrays().items()}
    short = dataclasses.replace(
        whole,
        history=dataclasses.replace(rows, **first, energy={name: e[:300] for name, e in rows.energy.items()}),
        events=(),
    )
    found = transitions(short)
    assert found["u_star"] == pytest.approx(0.002, abs=1.2e-4)
    assert [found[key] for key in ("u_star_star", "u_dr1", "u_dr4", "F_dr1", "F_dr4")] == [None] * 5


def test_without_a_load_forces_are_none_and_displacements_stay():
    run = ramp()
    unloaded = dataclasses.replace(run.scene, top=Top.rig(axial_load=0.0, stiffness=1e8))
    found = transitions(dataclasses.replace(run, scene=unloaded))
    assert found["F_dr1"] is None and found["u_dr1"] is not None


def _run(u: np.ndarray, sliding: np.ndarray) -> Result:
    vector = np.stack([u, 0 * u, 0 * u], axis=1)
    capacities = (1.0,) * sliding.shape[1]
    return Result(scene(capacities=capacities, kind="ramp"), history(vector, vector * 1e5, sliding, capacities))


def test_a_surface_that_starts_late_has_not_stopped_before():
    """Stuck, then sliding from 5 to 20 mm: the start is no stop."""
    u = np.linspace(0, 0.03, 3001)
    second = np.clip(u - 0.005, 0, 0.015)
    rows = _run(u, np.stack([u - second, second], axis=1)).history
    assert stopping_displacement(rows, 2) == pytest.approx(0.02, abs=1.2e-4)
    assert stopping_displacement(rows, 1) == pytest.approx(0.005, abs=1.2e-4)


def test_a_surface_that_never_slides_never_stops():
    u = np.linspace(0, 0.03, 301)
    rows = _run(u, np.stack([u, 0 * u], axis=1)).history
    assert stopping_displacement(rows, 2) is None
    assert stopping_displacement(rows, 1) is None


def test_nothing_moves_nothing_stops():
    rows = _run(np.zeros(5), np.zeros((5, 4))).history
    assert stopping_displacement(rows, 2) is None


def test_a_quiver_is_no_stop():
    """A pause shorter than the window leaves the share below for less than a window."""
    u = np.linspace(0, 0.03, 3001)
    rates = np.where((u > 0.01) & (u < 0.0103), 0.0, 0.5)
    rates[u > 0.02] = 0.0
    second = np.cumsum(rates) * (u[1] - u[0])
    rows = _run(u, np.stack([u, second], axis=1)).history
    assert stopping_displacement(rows, 2) == pytest.approx(0.02, abs=1.2e-4)


def test_the_share_falls_below_where_five_per_cent_are_left_in_the_window():
    """One in two before, nothing after: 5 % of all sliding is left when 1/19 of the window lies before the stop."""
    u = np.linspace(0, 0.03, 30001)
    second = np.minimum(u, 0.01)
    rows = _run(u, np.stack([u, second], axis=1)).history
    assert stopping_displacement(rows, 2) == pytest.approx(0.01 + 1e-4 - 2e-4 / 19, abs=2e-6)


def test_other_stacks_get_every_rim():
    u = np.linspace(0, 0.2, 2001)
    run = _run(u, np.stack([u / 2, u / 2], axis=1))
    rows = dataclasses.replace(run.history, gap=0.05 - run.history.sliding)
    run = dataclasses.replace(run, history=rows, events=(contact(rows, 2),))
    found = transitions(run)
    assert set(found) == {"u_dr1", "u_dr2", "F_dr1", "F_dr2"}
    assert found["u_dr2"] == pytest.approx(0.1) and found["u_dr1"] is None


def test_a_rim_met_again_counts_once():
    run = ramp()
    again = dataclasses.replace(run.events[0], displacement=np.array([0.14, 0, 0]))
    assert transitions(dataclasses.replace(run, events=(*run.events, again)))["u_dr1"] < 0.09


def test_monotonic_by_name_or_by_displacement():
    assert is_monotonic(ramp())
    plain = dataclasses.replace(ramp(), scene=scene(capacities=(1.0,) * 4, kind="record"))
    assert is_monotonic(plain) and is_monotonic(turned(plain, 2.0))
    assert not is_monotonic(loops()) and not is_monotonic(loops(both=True))
    u = np.zeros(5)
    assert not is_monotonic(dataclasses.replace(_run(u, np.zeros((5, 1))), scene=scene(capacities=(1.0,))))
