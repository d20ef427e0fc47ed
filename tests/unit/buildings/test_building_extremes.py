"""Extremes of a building over all steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.buildings import BEARING, extremes_of_rows, frame, scene

from msfp_gen import Motion, Solver, simulate
from msfp_gen.buildings import run as building_run
from msfp_gen.buildings.extremes import DIMENSIONS
from msfp_gen.buildings.run import start_building_run, unpacked
from msfp_gen.results.geometry import contact_offsets
from msfp_gen.results.result import load_result

ROUNDING = 1e-12  # of sums of some ten terms that differ in the order of addition
EVENTFUL = scene(frame(), duration=0.8)


def test_peaks_do_not_depend_on_the_rows():
    fine, coarse = (
        simulate(replace(EVENTFUL, output_step=step, solver=Solver(rtol=1e-5, max_step=1e-3))) for step in (1e-3, 0.1)
    )
    assert len(coarse.time) == 9
    for name in DIMENSIONS:
        expected = getattr(fine.extremes, name)
        assert getattr(coarse.extremes, name) == pytest.approx(expected, rel=2e-3, abs=1e-4 * expected.max()), name
    short = extremes_of_rows(coarse)
    # A row is within the peaks but for its last digits: its sum is NumPy's, that of the peaks is the run's.
    assert np.all(short.node_acceleration <= (1 + ROUNDING) * coarse.extremes.node_acceleration)
    assert np.any(short.node_acceleration < 0.8 * coarse.extremes.node_acceleration)
    assert coarse.summary["floors"][-1]["peak_acceleration"]["E1"] == coarse.extremes.node_acceleration[-1, 0]
    assert coarse.summary["peak_force"]["radial"] == coarse.extremes.base_reaction[3]
    assert short.base_reaction[3] <= (1 + ROUNDING) * coarse.extremes.base_reaction[3]
    found = coarse.characterise()
    assert found.peak_force == coarse.extremes.base_reaction[3] and found.peak_drift_ratio > 0
    assert found.bearings[1].minimum_load_ratio == coarse.extremes.axial_force[1, 0] / coarse.scene.axial_loads[1]


def test_times_of_peaks_are_those_of_all_steps(tmp_path):
    """With rows at both ends of the run alone, against the rows at the ends of steps of the same run."""
    bearing = BEARING.replace(capacity=[0.03, 0.0215, 0.0215, 0.03])
    given = scene(frame(), bearing=bearing, duration=0.8, solver=Solver(max_step=1e-3))
    fine, coarse = (simulate(replace(given, output_step=step)) for step in (1e-3, 0.8))
    assert len(coarse.time) == 2 and coarse.extremes.times.keys() == set(DIMENSIONS)
    assert all(coarse.extremes.times[name].shape == getattr(coarse.extremes, name).shape for name in DIMENSIONS)
    shear = np.hypot(*fine.base_reaction[:, :2].T)
    times = [
        coarse.summary["times"]["peak_force"]["radial"],
        coarse.summary["floors"][-1]["times"]["peak_acceleration"]["E1"],
    ]
    top = np.abs(fine.node(fine.scene.building.nodes[-1].name)[:, 2, 0])
    assert times == pytest.approx([fine.time[shear.argmax()], fine.time[top.argmax()]], abs=2e-3)
    for dense, one in zip(fine.bearings, coarse.bearings, strict=True):
        rows, found = dense.history, one.extremes.times
        assert found["displacement"][3] == pytest.approx(fine.time[rows.horizontal.argmax()], abs=2e-3)
        assert found["top_force"][2] == pytest.approx(fine.time[np.abs(rows.top_force[:, 2]).argmax()], abs=2e-3)
        assert found["gap"] == pytest.approx(fine.time[rows.gap.argmin(axis=0)], abs=2e-3)
        assert found["rim_force"] == pytest.approx(fine.time[rows.rim_force.argmax(axis=0)], abs=2e-3)
        limits = [each.verdict.worst["travel"].value for each in (one, dense)]
        met = (rows.gap <= 0).sum(axis=1)
        assert limits[0].reached == limits[1].reached == met.max() > 0
        assert limits[0].time == pytest.approx(fine.time[met.argmax()], abs=2e-3)
    again = load_result(coarse.to_netcdf(tmp_path / "run.nc"))
    assert again.summary == coarse.summary


def test_rims_push_with_their_stiffness():
    """Rows and extremes of the force, of models that have no unilateral contacts."""
    bearing = BEARING.replace(capacity=[0.03, 0.0215, 0.0215, 0.03])
    result, capacity = simulate(scene(frame(), bearing=bearing)), bearing.arrays()["capacity"]
    for one, sliding in ((result, result.sliding), (result.extremes, result.extremes.sliding)):
        elastic = bearing.surfaces[0].rim_stiffness * np.maximum(0.0, sliding - capacity)
        assert elastic.max() > 6e3 and one.rim_force == pytest.approx(elastic, abs=1.0)
        assert not one.lift.any()
    assert result.bearings[1].history.rim_force.max() == pytest.approx(result.extremes.rim_force[1, 0], rel=1e-3)


def test_places_of_contacts_are_those_of_the_rows(monkeypatch: pytest.MonkeyPatch):
    """The compiled sine against the positions of contacts by `contact_offsets`, which drawings use."""
    monkeypatch.setattr(building_run, "KEPT", (*building_run.KEPT, "angles", "q"))
    run = start_building_run(scene(frame(), duration=0.8, solver=Solver(max_step=1e-3), output_step=1e-3))
    while run.run.advance(1000):
        pass
    rows, extremes = unpacked(run), run.extremes
    for index in range(4):
        offsets = contact_offsets(BEARING, rows[f"angles {index}"], rows[f"q {index}"])
        assert extremes.contact_offset[index] == pytest.approx(offsets.max(axis=0), rel=1e-3)
        times = rows["time"][offsets.argmax(axis=0)]
        assert extremes.times["contact_offset"][index] == pytest.approx(times, abs=2e-3)
    assert extremes.contact_offset[:, 3].min() > 5e-3


def test_peaks_are_those_of_rows_at_every_step():
    """The compiled sums against those of the result, also with a motion of its own below one bearing."""
    times = np.linspace(0.0, 1.0, 101)
    path = np.zeros((101, 3))
    path[:, :2] = 0.02 * np.sin(np.pi * times)[:, None] ** 4 * [1.0, 0.5]
    bearings = [*EVENTFUL.bearings[:3], replace(EVENTFUL.bearings[3], motion=Motion.from_arrays(times, path))]
    made = replace(EVENTFUL, bearings=bearings, duration=0.5, output_step=1e-3, solver=Solver(max_step=1e-3))
    found = simulate(made)
    rows, surfaces = extremes_of_rows(found), BEARING.layout.surfaces
    assert found.extremes.normal_force.shape == (4, 2, surfaces)
    for name in DIMENSIONS:
        if name == "contact_offset":
            continue  # no row has it
        recorded, of_rows = getattr(found.extremes, name), getattr(rows, name)
        assert recorded == pytest.approx(of_rows, rel=1e-2, abs=1e-3 * np.abs(of_rows).max()), name
        may_be_zero = ("node_displacement", "node_acceleration", "rim_force", "rims_met", "lift", "overturning_moment")
        assert np.count_nonzero(recorded) == recorded.size or name in may_be_zero
    assert np.all(found.extremes.normal_force[:, 0] <= rows.normal_force[:, 0])
    assert np.all(found.extremes.normal_force[:, 1] >= rows.normal_force[:, 1])
