"""Results in other people's formats: every number comes back, with its unit and where it came from."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import tomllib

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.io import loadmat
from support.synthetic import loops

from msfp_gen import InputError, load_scene
from msfp_gen.cli import main
from msfp_gen.results.files import WRITERS, table_of
from msfp_gen.results.result import load_result
from msfp_gen.scene.file.loader import scene_from_table

FLAT = (".csv", ".parquet")


@pytest.fixture(scope="module")
def result():
    return dataclasses.replace(loops(both=True), scene=load_scene("fenz-test5"))


def as_table(path):
    """Columns of a flat file by `name [unit]`."""
    if path.suffix == ".csv":
        lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
        rows = np.array([[float(v) for v in line.split(",")] for line in lines[1:]])
        return dict(zip(lines[0].split(","), rows.T, strict=True))
    table = pq.read_table(path)
    return {f"{f.name} [{f.metadata[b'units'].decode()}]": table[f.name].to_numpy() for f in table.schema}


@pytest.mark.parametrize("suffix", FLAT)
def test_flat_files_hold_every_quantity_to_the_last_digit(result, suffix, tmp_path):
    found = as_table(result.save(tmp_path / f"run{suffix}"))
    rows = result.history
    assert next(iter(found)) == "time [s]"
    expected = {
        "time [s]": rows.time,
        "displacement_E1 [m]": rows.displacement[:, 0],
        "sliding_4 [m]": rows.sliding[:, 3],
        "Y_2 [1]": rows.friction_state[:, 1, 0],
        "tilt_3_theta [rad]": rows.tilt_angles[:, 1, 1],
        "top_force_E3 [N]": rows.top_force[:, 2],
        "energy_friction_dissipated [J]": rows.energy["friction_dissipated"],
    }
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)
    along_time = [v for v in result.dataset.data_vars.values() if v.dims[0] == "time"]
    assert len(found) == 1 + sum(v.size // len(rows.time) for v in along_time) == len(table_of(result.dataset))


def test_csv_says_where_it_came_from_and_holds_a_scene_that_runs(result, tmp_path):
    lines = result.to_csv(tmp_path / "run.csv").read_text().splitlines()
    comments = [line[2:] for line in lines if line.startswith("#")]
    assert lines[0].startswith("# fenz-test5, status ok; ") and lines[1].startswith("time [s],normal_force_1 [N],")
    assert not any(line.startswith("#") for line in lines[1 : 2 + len(result.history.time)])
    assert "source: msfp-gen" in comments and "status: ok" in comments and "provenance_version: 0" in comments
    scene = "\n".join(comments[comments.index("scene:") + 1 :])
    assert scene_from_table(tomllib.loads(scene)) == result.scene
    events = [json.loads(line.removeprefix("event: ")) for line in comments if line.startswith("event: ")]
    assert [(e["time"], e["surface"]) for e in events] == [(e.time, e.surface) for e in result.events]


def test_a_message_of_several_lines_stays_a_comment(result, tmp_path):
    failed = dataclasses.replace(result, status="step", message="one\ntwo, three")
    lines = failed.to_csv(tmp_path / "run.csv").read_text().splitlines()
    assert "# message: one two, three" in lines
    assert len(as_table(tmp_path / "run.csv")["time [s]"]) == len(result.history.time)


def test_parquet_keeps_meaning_scene_and_events(result, tmp_path):
    schema = pq.read_schema(result.to_parquet(tmp_path / "run.parquet"))
    assert "(3.20)" in schema.field("sliding_1").metadata[b"long_name"].decode()
    assert scene_from_table(tomllib.loads(schema.metadata[b"scene"].decode())) == result.scene
    assert len(json.loads(schema.metadata[b"events"])) == len(result.events)


def test_matlab_file_holds_every_variable_with_units(result, tmp_path):
    found = loadmat(result.to_mat(tmp_path / "run.mat"), simplify_cells=True)
    for name, variable in result.dataset.variables.items():
        if variable.dtype.kind != "U":
            np.testing.assert_array_equal(found[name], variable.to_numpy(), err_msg=str(name))
    assert found["units"]["sliding"] == "m" and found["units"]["time"] == "s"
    assert found["attributes"]["status"] == "ok"
    assert found["axis"].tolist() == ["E1", "E2", "E3"] and found["event_kind"].tolist() == ["rim_contact"] * 2
    shapes = loadmat(tmp_path / "run.mat")
    assert shapes["time"].shape == (2001, 1) and shapes["displacement"].shape == (2001, 3)


def test_matlab_names_are_valid_and_not_cut(result, tmp_path):
    found = loadmat(result.to_mat(tmp_path / "run.mat"), simplify_cells=True)
    names = {name for name in found if not name.startswith("__")}
    assert {str(name) for name in result.dataset.variables} <= names
    fields = set(found["attributes"]) | set(found["meaning"]) | names
    assert all(name.isidentifier() and len(name) <= 63 and not name.startswith("_") for name in fields)


def test_every_format_of_a_result_without_events(tmp_path, result):
    quiet = dataclasses.replace(result, events=())
    for suffix in WRITERS:
        assert quiet.save(tmp_path / f"run{suffix}").stat().st_size > 1000
    assert load_result(tmp_path / "run.nc").events == ()
    assert loadmat(tmp_path / "run.mat")["event_time"].size == 0


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_path_that_cannot_be_written_is_refused_and_nothing_is_left(result, suffix, tmp_path):
    with pytest.raises(InputError, match=r"folder .* does not exist"):
        result.save(tmp_path / "nowhere" / f"run{suffix}")
    writer = {".nc": "to_netcdf", ".csv": "to_csv", ".parquet": "to_parquet", ".mat": "to_mat"}[suffix]
    with pytest.raises(InputError, match=rf"give a name that ends in \{suffix}"):
        getattr(result, writer)(tmp_path / "run.txt")
    assert not list(tmp_path.iterdir())


def test_an_unknown_suffix_names_the_known_ones(result, tmp_path):
    with pytest.raises(InputError, match=r"ends in \.nc or \.parquet or \.csv or \.mat"):
        result.save(tmp_path / "run.xlsx")


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_failed_write_leaves_the_old_file(result, suffix, tmp_path, monkeypatch):
    path = tmp_path / f"run{suffix}"
    path.write_text("old")
    monkeypatch.setattr("pathlib.Path.replace", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        result.save(path)
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


@pytest.mark.parametrize("suffix", WRITERS)
def test_run_writes_the_format_of_the_suffix(suffix, tmp_path, capsys):
    path = tmp_path / f"run{suffix}"
    assert main(["run", "fenz-test5", "--duration", "0.5", "-o", str(path)]) == 0
    assert f"wrote {path}" in capsys.readouterr().err
    if suffix in FLAT:
        assert as_table(path)["time [s]"][-1] == 0.5
    elif suffix == ".mat":
        assert loadmat(path)["time"][-1, 0] == 0.5
    else:
        assert load_result(path).history.time[-1] == 0.5


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_full_disk_names_the_file(result, suffix, tmp_path, monkeypatch):
    path = tmp_path / f"run{suffix}"

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    monkeypatch.setattr("pathlib.Path.replace", full)
    with pytest.raises(OSError, match=rf"No space left on device: '{path}'$"):
        result.save(path)
    assert not list(tmp_path.iterdir())
