"""A study computes what its files say when it starts: no run takes the record, matrix or bearing of another."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from support.study_tables import rows_of, write_record

import msfp_gen
from msfp_gen import InputError
from msfp_gen.scene.file.toml_text import dumps
from msfp_gen.studies import load_study

EFFECTS = {"dimension": "planar", "sliders": "massless", "rims": False, "bouc_wen": "plastic"}
SHORT = {  # a run of a few milliseconds
    "bearing": "fenz-tfp",
    "motion": {"kind": "harmonic", "amplitude": 0.025, "frequency": 0.5, "cycles": 0.5},
    "top": {"kind": "rig", "axial_load": 112e3, "stiffness": 1e8, "rotational_stiffness": 1e6},
    "effects": EFFECTS,
    "solver": {"rtol": 1e-2},
}


def of_record(file: Path, **changes: Any) -> dict[str, Any]:
    records = {"motions": [{"file": str(file), "name": "one", "correct": False}]}
    return {"scene": SHORT, "records": records, "keep": ["peak_displacement"], **changes}


def test_two_studies_in_one_process_have_their_own_records(tmp_path: Path) -> None:
    """The same executor, and the same name of the record; the files differ."""
    small, large = (write_record(tmp_path / name / "record.csv", peak) for name, peak in (("a", 0.5), ("b", 2.5)))
    with ThreadPoolExecutor(1) as executor:
        for file in (small, large):
            msfp_gen.study(of_record(file), tmp_path / f"{file.parent.name}-out", executor=executor)
    msfp_gen.study(of_record(large), tmp_path / "alone", threads=True)
    found = [rows_of(tmp_path / name).peak_displacement[0] for name in ("a-out", "b-out", "alone")]
    assert found[1] == found[2] > 2 * found[0]


def test_the_same_file_with_other_contents_is_read_again(tmp_path: Path) -> None:
    """Also where size and time of the file are the same, as on a coarse clock."""
    import os

    file = write_record(tmp_path / "record.csv", 0.5)
    status = file.stat()
    with ThreadPoolExecutor(1) as executor:
        msfp_gen.study(of_record(file), tmp_path / "first", executor=executor)
        write_record(file, 2.5)
        os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
        msfp_gen.study(of_record(file), tmp_path / "second", executor=executor)
    first, second = (rows_of(tmp_path / name).peak_displacement[0] for name in ("first", "second"))
    assert second > 2 * first


def test_files_that_an_axis_names_are_in_the_identity(tmp_path: Path) -> None:
    """Their contents, not only their names."""
    files = [write_record(tmp_path / name, peak) for name, peak in (("a.csv", 0.5), ("b.csv", 1.0))]
    table = {
        "scene": {**SHORT, "motion": {"kind": "record", "file": "a.csv", "correct": False}},
        "axes": {"record": {"sets": "motion.file", "values": ["a.csv", "b.csv"]}},
        "keep": ["peak_displacement"],
        "chunk": 1,
    }
    (tmp_path / "study.toml").write_text(dumps(table), encoding="utf-8")
    msfp_gen.study(tmp_path / "study.toml", tmp_path / "out", threads=True)
    write_record(files[1], 2.5)
    with pytest.raises(InputError, match="parts of another study"):
        msfp_gen.study(tmp_path / "study.toml", tmp_path / "out", threads=True)


def test_values_of_an_axis_are_relative_to_the_study_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder, peak in ((tmp_path / "study", 0.5), (tmp_path / "elsewhere", 2.5)):
        write_record(folder / "a.csv", peak)
        write_record(folder / "b.csv", peak)
    table = {
        "scene": {**SHORT, "motion": {"kind": "record", "file": "a.csv", "correct": False}},
        "axes": {"record": {"sets": "motion.file", "values": ["b.csv"]}},
    }
    file = tmp_path / "study" / "study.toml"
    file.write_text(dumps(table), encoding="utf-8")
    monkeypatch.chdir(tmp_path / "elsewhere")
    motion = load_study(file).scene(1).motion
    assert abs(motion.acceleration(motion.knots)).max() == pytest.approx(0.5, rel=0.01)
    for path in (tmp_path / "elsewhere" / "b.csv", "../elsewhere/b.csv"):
        table["axes"]["record"]["values"] = [str(path)]
        file.write_text(dumps(table), encoding="utf-8")
        with pytest.raises(InputError, match=r"b.csv': outside the folder of the .* file"):
            load_study(file)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("bearing.friction", [0.05, 0.02, 0.02, 0.09]),
        ("bearing.friction", 0.06),
        ("bearing.radius", [0.5, 0.08, 0.08, 0.5]),
        ("bearing.height", 0.03),
        ("bearing.base_height", "30 mm"),
    ],
)
def test_an_axis_respects_where_friction_is_stated(path: str, value: Any) -> None:
    bearing = {"preset": "fenz-tfp", "friction": [0.03, 0.017, 0.017, 0.107], "friction_at": "pivot"}
    scene = {**SHORT, "bearing": bearing}
    study = load_study({"scene": scene, "axes": {"x": {"sets": path, "values": [value]}}})
    name = path.removeprefix("bearing.")
    expected = msfp_gen.scene.file.loader.bearing_from_table({**bearing, name: value})
    assert study.scene(1).bearing == expected
