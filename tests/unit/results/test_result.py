"""Rows, dataset, summary and netCDF files of a result, on rows with known answers."""

from __future__ import annotations

import dataclasses
import json

import h5netcdf
import numpy as np
import pytest
from support import thinned
from support.buildings import pushed
from support.synthetic import LOAD, history, loops, opened, ramp, scene

from msfp_gen import Load, load_scene, simulate
from msfp_gen.common.errors import InputError
from msfp_gen.results.history import ENERGY, Counters, row_fields
from msfp_gen.results.result import Result, load_result
from msfp_gen.results.summary import energy_balance
from msfp_gen.scene.top import Top


def still(surfaces: int = 1, rows: int = 3) -> Result:
    """A bearing that does not move."""
    zero = np.zeros((rows, 3))
    capacities = (0.1,) * surfaces
    return Result(scene(capacities=capacities), history(zero, zero, np.zeros((rows, surfaces)), capacities))


@pytest.mark.parametrize("run", [loops, pushed])
def test_every_variable_has_unit_and_meaning(run):
    for name, variable in run().dataset.data_vars.items():
        assert variable.attrs["long_name"] and (variable.attrs.get("units") or name == "event_kind"), name


def test_dataset_has_every_quantity():
    result = loops()
    dataset = result.dataset
    names = {name for field in result.history.arrays() for name in row_fields()[field].names or (field,)} - {"time"}
    assert names | {f"energy_{name}" for name in ENERGY} <= set(dataset.data_vars)
    assert dataset.sizes == {
        "time": 2001,
        "body": 4,
        "surface": 4,
        "axis": 3,
        "angle": 3,
        "contact_angle": 2,
        "direction": 2,
        "event": 2,
    }


def test_dataset_is_addressed_by_the_numbers_of_the_report():
    result = loops()
    dataset = result.dataset
    assert dataset["body"].values.tolist() == [2, 3, 4, 5]
    np.testing.assert_array_equal(dataset["sliding"].sel(surface=4), result.history.sliding[:, 3])
    np.testing.assert_array_equal(dataset["displacement"].sel(axis="E1"), result.history.displacement[:, 0])
    assert np.all(dataset["Y"] == 0.25) and np.all(dataset["Z"] == -0.5)
    assert dataset["Y"].dims == ("time", "surface")
    assert "Bouc-Wen variable Y" in dataset["Y"].attrs["long_name"]


def test_dataset_is_built_when_asked_for_and_once():
    result = loops()
    assert "dataset" not in vars(result)
    assert result.dataset is result.dataset


RUNS = {"with events": loops, "without events": still, "of a building": pushed}


@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS)
def test_a_file_gives_back_what_was_written(run, tmp_path):
    result = dataclasses.replace(run(), status="stopped", message="as asked")
    path = result.to_netcdf(tmp_path / "run.nc")
    assert path == tmp_path / "run.nc"
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]
    read = opened(path)
    assert read.equals(result.dataset)
    assert {name: v.attrs for name, v in read.variables.items()} == {
        n: v.attrs for n, v in result.dataset.variables.items()
    }
    assert (read.attrs["status"], read.attrs["title"]) == ("stopped", result.scene.name)
    for name in ("surface", "kind") if isinstance(result, Result) else ():
        assert read[f"event_{name}"].values.tolist() == [getattr(event, name) for event in result.events]
    back = load_result(path)
    assert back.identity == result.identity and back.summary == result.summary
    assert (back.counters, back.provenance) == (result.counters, result.provenance)
    assert back.dataset.identical(result.dataset)


@pytest.mark.parametrize("run", thinned(RUNS.values(), lambda run: run is not still), ids=RUNS)
def test_damaged_and_foreign_files_are_refused(run, tmp_path):
    path = run().to_netcdf(tmp_path / "run.nc")
    content = path.read_bytes()
    with pytest.raises(InputError, match="no such file"):
        load_result(tmp_path / "none.nc")
    (tmp_path / "short.nc").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match="no netCDF-4 file that can be read"):
        load_result(tmp_path / "short.nc")


def test_a_file_of_something_else_is_no_result(tmp_path):
    import xarray as xr

    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with pytest.raises(InputError, match=r"a\.nc.*no result"):
        load_result(tmp_path / "a.nc")


def test_failed_run_is_saved_with_its_status(tmp_path):
    failed = dataclasses.replace(loops(), status="singular_matrix", message="t = 3 s, surface 2")
    read = opened(failed.to_netcdf(tmp_path / "partial.nc"))
    assert (read.attrs["status"], read.attrs["message"]) == ("singular_matrix", "t = 3 s, surface 2")
    assert not failed.succeeded and loops().succeeded


@pytest.mark.parametrize("name", ["run.txt", "nowhere/run.nc", "run"])
def test_netcdf_refuses_a_path_and_writes_nothing(name, tmp_path):
    with pytest.raises(InputError, match="output"):
        still().to_netcdf(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_failed_write_leaves_the_old_file_and_no_other(tmp_path, monkeypatch):
    path = tmp_path / "run.nc"
    path.write_text("old")
    result = still()
    monkeypatch.setattr("os.fsync", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        result.to_netcdf(path)
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


def test_history_refuses_a_wrong_shape_a_nan_and_no_rows():
    rows = loops().history
    with pytest.raises(InputError, match=r"history\.gap has shape \(2001, 3\): give \(2001, 4\)"):
        dataclasses.replace(rows, gap=rows.gap[:, :3])
    bad = rows.top_force.copy()
    bad[7, 1] = np.nan
    with pytest.raises(InputError, match=r"history\.top_force is not finite in row 7"):
        dataclasses.replace(rows, top_force=bad)
    with pytest.raises(InputError, match="energy"):
        dataclasses.replace(rows, energy={"input": rows.energy["input"]})
    with pytest.raises(InputError, match="no rows"):
        dataclasses.replace(rows, time=rows.time[:0])


def test_rows_that_do_not_follow_each_other_are_refused(tmp_path):
    whole = loops().history
    for time in (whole.time[::-1].copy(), np.where(np.arange(2001) == 7, whole.time[6], whole.time)):
        with pytest.raises(InputError, match=r"history\.time\[\d+\] = .*rising"):
            dataclasses.replace(whole, time=time)
    path = loops().to_netcdf(tmp_path / "run.nc")
    with h5netcdf.File(path, "a") as file:
        file["time"][...] = whole.time[::-1]
    with pytest.raises(InputError, match="rising"):
        load_result(path)


def test_summary_knows_the_answers():
    result = loops()
    rows, summary = result.history, result.summary
    assert summary["name"] == "fenz-test5" and summary["status"] == "ok" and summary["duration"] == 20.0
    assert summary["peak_displacement"] == pytest.approx({"E1": 0.14, "E2": 0, "E3": 0, "radial": 0.14}, rel=1e-3)
    peak = np.abs(rows.top_force[:, 0]).max()
    assert summary["peak_force"]["radial"] == peak
    assert summary["peak_force_ratio"] == pytest.approx(peak / LOAD)
    assert summary["peak_sliding"] == rows.sliding.max(axis=0).tolist()
    assert summary["rims_met"] == [1, 4] and min(summary["minimum_gap"]) == pytest.approx(-1e-4)
    assert summary["minimum_normal_force"] == summary["maximum_normal_force"] == [LOAD] * 4
    assert summary["minimum_load_ratio"] == LOAD / result.scene.loads_at_rest[0]  # with the weights of the bodies
    assert summary["counters"]["steps"] == 2000 and "wall_time" not in summary["counters"]
    assert summary["real_time_factor"] == 80.0
    assert "transitions" not in summary


def test_the_duration_of_a_run_does_not_depend_on_its_rows():
    result = simulate(dataclasses.replace(load_scene("fenz-test2"), output_step=10.0))
    assert result.history.time[-1] == 50.0 and result.summary["duration"] == result.scene.end == 56.25


def test_summary_is_json():
    for result in (loops(both=True), ramp(), still()):
        assert json.loads(json.dumps(result.summary, allow_nan=False)) == result.summary


def test_peak_of_the_radius_is_not_the_radius_of_the_peaks():
    u = np.array([[0.03, 0, 0], [0, 0.04, 0], [0.02, 0.02, 0]])
    result = Result(scene(capacities=(0.1,)), history(u, 0 * u, np.zeros((3, 1)), (0.1,)))
    assert result.summary["peak_displacement"] == {"E1": 0.03, "E2": 0.04, "E3": 0.0, "radial": 0.04}


def test_energy_balance_divides_by_the_peak_input():
    balance = energy_balance(loops().history)
    assert balance == pytest.approx({"peak_input": 2000.0, "closure_error": 5e-4, "dissipated_share": 0.9})
    rows = still().history
    nothing = dataclasses.replace(rows, energy={name: np.zeros(3) for name in ENERGY})
    assert energy_balance(nothing) == {"peak_input": 0.0, "closure_error": None, "dissipated_share": None}


@pytest.mark.parametrize(
    ("top", "load"),
    [
        (Top.rig(axial_load=5e3, stiffness=1.0), 5e3),
        (Top.prescribed(force=(1.0, 2.0, -7e3)), 7e3),
        (Top.prescribed(force=(1.0, 2.0, 0.0)), None),
        (Top.mass(mass=100.0, inertia=1.0, height=1.0), 980.0),
    ],
)
def test_axial_load_of_every_top(top, load):
    result = still()
    result = dataclasses.replace(result, scene=dataclasses.replace(result.scene, top=top))
    assert result.summary["axial_load"] == pytest.approx(load)
    assert (result.summary["peak_force_ratio"] is None) == (load is None)


@pytest.mark.parametrize(("forces", "load"), [((-2e3, -2e3), 7e3), ((2e3, 2e3), 3e3), ((-2e3, 0.0), None)])
def test_the_axial_load_includes_a_constant_vertical_load(forces, load):
    result = still()
    vertical = Load.from_arrays(
        [0.0, 0.5 * result.scene.end, result.scene.end], [[1.0, 2.0, forces[i]] for i in (0, 1, 1)]
    )
    scene = dataclasses.replace(result.scene, top=Top.rig(axial_load=5e3, stiffness=1.0), load=vertical)
    assert dataclasses.replace(result, scene=scene).axial_load == load


def test_no_time_taken_is_no_infinite_speed():
    assert dataclasses.replace(still(), counters=Counters()).summary["real_time_factor"] is None
