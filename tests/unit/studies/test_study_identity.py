"""A study computes what its files say when it starts: no run takes the record, matrix or bearing of another."""

from __future__ import annotations

import os
import random
import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.study_tables import rows_of, write_record

import msfp_gen
from msfp_gen import BaseSlab, Building, InputError, RunError, Storey, changed_scene, load_scene, simulate
from msfp_gen.common.identity import fingerprint
from msfp_gen.results.result import load_result
from msfp_gen.scene.file import motion_tables
from msfp_gen.scene.file.catalogue import preset_scene_table
from msfp_gen.scene.file.loader import dumps
from msfp_gen.studies import load_study
from msfp_gen.studies.bounding.factors import factor_text
from msfp_gen.studies.run import Chunks

SHORT = {  # a run of a few milliseconds
    **preset_scene_table("fenz-test1"),
    "bearing": "fenz-tfp",
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
    msfp_gen.study(of_record(large), tmp_path / "alone")
    found = [rows_of(tmp_path / name).peak_displacement[0] for name in ("a-out", "b-out", "alone")]
    assert found[1] == found[2] > 2 * found[0]


def test_the_same_file_with_other_contents_is_read_again(tmp_path: Path) -> None:
    """Also where size and time of the file are the same, as on a coarse clock."""
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
    msfp_gen.study(tmp_path / "study.toml", tmp_path / "out")
    write_record(files[1], 2.5)
    with pytest.raises(InputError, match="parts of another study"):
        msfp_gen.study(tmp_path / "study.toml", tmp_path / "out")


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


def test_a_file_that_changes_while_a_study_runs_ends_it(tmp_path: Path) -> None:
    """Nothing that is written mixes two contents; a lost file is no row of the table."""
    file = write_record(tmp_path / "record.csv", 0.5)
    study = load_study(of_record(file))
    write_record(file, 2.5)
    clear_kept()
    with pytest.raises(RunError, match=r"record.csv: not as it was when it was first read .it has changed since.; run"):
        msfp_gen.study(study, tmp_path / "out")
    file.unlink()
    with pytest.raises(RunError, match=r"record.csv: not as it was .*cannot be read here"):
        msfp_gen.study(study, tmp_path / "out")
    assert not list((tmp_path / "out").glob("part-*"))


def clear_kept() -> None:
    """Forget what was made of files, as another process does."""
    for kept in (motion_tables._motions, motion_tables._records):
        kept._values.clear()


def frame_files(folder: Path) -> None:
    """A study of a building whose matrices, ground motions, records, axis and factors are files."""
    for name in ("ground", "corner", "first", "second", "third"):
        write_record(folder / f"{name}.csv", {"ground": 0.4, "corner": 0.5}.get(name, 0.6))
    storey = Storey(3.0, 1e3, (6e3, 6e3, 1.2e4), 9e6, 1.8e8)
    frame = Building.shear(BaseSlab(45e3, (1.4e5, 1.4e5, 2.7e5)), [storey])
    for name in ("mass", "stiffness", "damping"):
        matrix = getattr(frame, name)
        head = f"%%MatrixMarket matrix array real general\n{len(matrix)} {len(matrix)}\n"
        lines = "\n".join(f"{value:.15e}" for value in matrix.T.ravel())
        (folder / f"{name}.mtx").write_text(f"{head}{lines}\n", encoding="utf-8")
    np.savez(folder / "mass.npz", mass=frame.mass)
    (folder / "factors.toml").write_text(factor_text("asce7"), encoding="utf-8")
    places = [[3.0, 2.0], [-3.0, 2.0], [0.0, -2.0]]
    bearing = {"bearing": {"preset": "fenz-tfp", "contact_damping": 1e-4}}
    rows: list[dict[str, Any]] = [{**bearing, "position": place} for place in places]
    rows[1]["motion"] = {"kind": "record", "file": "corner.csv", "correct": False}
    node = {"name": "base", "coordinates": [0, 1, 2, 3, 4, 5], "position": [0.0, 0.0, 0.0]}
    interface = {"stiffness": 1e7, "vertical_stiffness": 5e7, "rotational_stiffness": 1e6}
    matrices = {name: f"{name}.mtx" for name in ("mass", "stiffness", "damping")}
    scene = {
        "duration": 0.2,
        "building": {**matrices, "node": [node], "interface": interface, "bearing": rows},
        "motion": {"kind": "record", "file": "ground.csv", "correct": False},
    }
    (folder / "scene.toml").write_text(dumps(scene), encoding="utf-8")
    study = {
        "scene": "scene.toml",
        "axes": {
            "corner": {"sets": "building.bearing[1].motion.file", "values": ["first.csv", "second.csv", "third.csv"]},
            "mass": {"sets": "building.mass", "values": ["mass.mtx", "mass.npz"]},
            "bounds": {"factors": "factors.toml"},
        },
        "keep": ["peak_force"],
        "chunk": 6,
    }
    (folder / "study.toml").write_text(dumps(study), encoding="utf-8")


def parts_of(folder: Path) -> list[str]:
    """The names of all parts of the study in a folder."""
    study = load_study(folder / "study.toml")
    chunks = Chunks(study, folder / "out")
    return [chunks.path(study.task(number)).name for number in range(study.chunks)]


OPENED = {  # file -> which of the three chunks, one for each value of the slowest axis, depend on it
    "ground.csv": (0, 1, 2),
    "first.csv": (0, 1, 2),  # the first run opens it
    "second.csv": (1,),
    "third.csv": (2,),
    "mass.mtx": (0, 1, 2),
    "stiffness.mtx": (0, 1, 2),
    "mass.npz": (0, 1, 2),
    "factors.toml": (0, 1, 2),
}


def changed_at(path: Path, rng: random.Random) -> None:
    """Change one number of a file where it matters: of a matrix in its eleventh decimal, so that it stays symmetric."""
    if path.suffix == ".npz":
        np.savez(path, mass=(1 + 1e-11) * np.load(path)["mass"])
        return
    text = path.read_text(encoding="utf-8")
    numbers, place = {
        ".csv": (r"(?<=,)-?0\.\d{6}", -2),
        ".mtx": (r"[1-9]\.\d{15}(?=e)", 12),
        ".toml": (r"(?<=\[)0\.\d+(?=,)", -1),
    }[path.suffix]
    match = rng.choice(list(re.finditer(numbers, text)))
    digits = list(match[0])
    digits[place] = str((int(digits[place]) + 1) % 10)
    path.write_text(text[: match.start()] + "".join(digits) + text[match.end() :], encoding="utf-8")


def test_parts_are_those_of_the_bytes_of_every_file_that_is_opened(tmp_path: Path) -> None:
    frame_files(tmp_path)
    before, rng = parts_of(tmp_path), random.Random(3)
    for name, dependent in OPENED.items():
        content = (tmp_path / name).read_bytes()
        changed_at(tmp_path / name, rng)
        now = parts_of(tmp_path)
        assert tuple(k for k in range(3) if now[k] != before[k]) == dependent, name
        (tmp_path / name).write_bytes(content)
    assert parts_of(tmp_path) == before


def test_parts_depend_on_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frame_files(tmp_path / "a")
    before = parts_of(tmp_path / "a")
    (tmp_path / "a" / "other.csv").write_text("nothing", encoding="utf-8")
    for path in (tmp_path / "a").iterdir():
        os.utime(path, (1e9, 1e9))
    for name in ("scene.toml", "study.toml"):
        path = tmp_path / "a" / name
        path.write_text(f"# a comment\n{path.read_text(encoding='utf-8')}\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert parts_of(tmp_path / "a") == before
    shutil.move(tmp_path / "a", tmp_path / "b")
    clear_kept()
    assert parts_of(tmp_path / "b") == before


def test_the_identity_of_a_scene_is_that_of_all_its_values(tmp_path: Path) -> None:
    """Of checkpoints and results: with motions of supports, matrices and records; not with words that do not count."""
    frame_files(tmp_path)
    before, rng = fingerprint(load_scene(tmp_path / "scene.toml")), random.Random(4)
    for name in ("ground.csv", "corner.csv", "mass.mtx", "stiffness.mtx", "damping.mtx"):
        content = (tmp_path / name).read_bytes()
        changed_at(tmp_path / name, rng)
        assert fingerprint(load_scene(tmp_path / "scene.toml")) != before, name
        (tmp_path / name).write_bytes(content)
    with (tmp_path / "ground.csv").open("a", encoding="utf-8") as file:
        file.write("# a comment\n")
    assert fingerprint(load_scene(tmp_path / "scene.toml")) == before


def test_a_result_knows_the_scene_of_its_run(tmp_path: Path) -> None:
    result = simulate(changed_scene("fenz-test1", {"solver.rtol": 1e-2}))
    assert result.identity == fingerprint(result.scene)
    assert load_result(result.to_netcdf(tmp_path / "run.nc")).identity == result.identity
    assert simulate(changed_scene("fenz-test1", {"solver.rtol": 2e-2})).identity != result.identity
