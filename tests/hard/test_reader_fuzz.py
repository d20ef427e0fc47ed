"""Every reader of a file that a user may give: whatever is done to a good file, it is read or refused in one line.

Hypothesis changes bytes, lines and words of each file and, where it is TOML, JSON or an array, values at any place. A
reader of the package that opens files is in `READERS`, or in `ELSEWHERE` with the tests that damage its files; one
that is added without either fails the first test.
"""

from __future__ import annotations

import ast
import json
import random
import tomllib
from collections.abc import Callable, Iterator
from copy import deepcopy
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import ROOT
from support.damaged_records import CSV, MUTATIONS

from msfp_gen import InputError, Motion, load_scene
from msfp_gen.auditing.columns import read_histories
from msfp_gen.buildings.building import matrix_of
from msfp_gen.motions import records
from msfp_gen.motions.records.scaling import read_spectrum
from msfp_gen.scene.file.loader import load_suite
from msfp_gen.simulation import checkpoint
from msfp_gen.studies import load_study, read_study, study_status
from msfp_gen.studies.bounding.factors import factor_text, load_factors
from msfp_gen.studies.calibration.measurement import read_measurement
from msfp_gen.studies.definition import example_text

EXAMPLES = ROOT / "examples"
# What a module calls that opens a file of the user.
OPENERS = {"read_input", "toml_file", "read_lines", "File", "read_bytes", "read_schema", "read_metadata", "dataset"}
ELSEWHERE = {
    "results/stored_group.py": "tests/unit/results/test_damaged_files.py",
    "motions/records/__init__.py": "tests/unit/motions/records/test_record_fuzz.py",
    "motions/records/text.py": "tests/unit/motions/records/test_record_fuzz.py",
    "studies/assessment/rows.py": "tests/unit/studies/test_study_runs.py",
    "studies/estimation/model_runs.py": "tests/unit/studies/test_estimate.py",
    "cli/sheet_commands.py": "tests/unit/design/test_equivalent.py",
    "jit/cache.py": "tests/unit/jit/test_cache_safety.py",
    "motions/records/peer.py": "tests/unit/motions/records/test_record_fuzz.py",
}
# Files that the package itself wrote a moment before, or came with it.
OWN = {
    "common/inputs.py",
    "embedding/library.py",
    "report/explore.py",
    "embedding/unit.py",
    "jit/compiler.py",
    "jit/build.py",
    "results/files.py",
    "simulation/rows.py",
}
VALUES: list[Any] = [
    "",
    "nan",
    "a\0b",
    "../../etc/passwd",
    "x" * 3000,
    True,
    0,
    -1,
    2**63,
    10**400,
    1e308,
    -1e-320,
    float("nan"),
    float("inf"),
    [],
    {},
    [[1.0]],
    ["a", 1],
    {"a": {"b": []}},
]


class Reader(NamedTuple):
    """How a kind of file is read: its name, a good one, and the call; numbers that it returns must be finite."""

    name: str
    content: bytes
    read: Callable[[Path], Any]
    structured: Callable[[bytes, st.DataObject], bytes] | None = None


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in a nested table."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield (*path, key)
        yield from places(item, (*path, key))


def changed(table: Any, data: st.DataObject) -> Any:
    """A table in which one to three places have other values, are missing or have another name."""
    for _ in range(data.draw(st.integers(1, 3))):
        if not (known := list(places(table))):
            break
        *path, last = data.draw(st.sampled_from(known))
        at = table
        for key in path:
            at = at[key]
        action = data.draw(st.sampled_from(["value", "value", "value", "number", "remove", "rename"]))
        if action == "remove" or (action == "rename" and isinstance(at, list)):
            del at[last]
        elif action == "rename":
            at[last + data.draw(st.sampled_from(["s", " ", "é", "."]))] = at.pop(last)
        elif action == "number":
            at[last] = data.draw(st.floats(width=64) | st.integers(-(10**6), 10**6))
        else:
            at[last] = deepcopy(data.draw(st.sampled_from(VALUES)))
    return table


def toml(content: bytes, data: st.DataObject) -> bytes:
    return tomli_w.dumps(changed(tomllib.loads(content.decode()), data)).encode()


def sealed_header(content: bytes, data: st.DataObject) -> bytes:
    """A checkpoint whose header is another one and whose digest is right."""
    head, snapshot = content[len(checkpoint.MAGIC) + 65 :].split(b"\n", 1)
    rest = json.dumps(changed(json.loads(head), data)).encode() + b"\n" + snapshot
    return checkpoint.MAGIC + sha256(rest).hexdigest().encode() + b"\n" + rest


def arrays(content: bytes, data: st.DataObject) -> bytes:
    """An archive of NumPy whose array has another shape, type or values."""
    wrong = [
        np.zeros(0),
        np.zeros((2, 2, 2)),
        np.full((3, 3), np.inf),
        np.array(["a"]),
        np.array(1j),
        np.array([b"\0"]),
    ]
    wrong += [np.eye(2, dtype=bool), np.eye(3, dtype=">f4"), np.zeros(2, [("a", float)]), np.full((2, 2), np.nan)]
    file = BytesIO()
    np.savez(file, **{data.draw(st.sampled_from(["mass", "arr", ""])): data.draw(st.sampled_from(wrong))})
    return file.getvalue()


def archive() -> bytes:
    file = BytesIO()
    np.savez(file, mass=np.diag([2.0, 3.0]))
    return file.getvalue()


def checkpoint_bytes(folder: Path) -> bytes:
    segments = [checkpoint.Saved("b", 1.0, 2.0, b"snapshot"), checkpoint.Saved("c", 2.0, 1.0, b"another")]
    checkpoint.write_checkpoint(folder / "good", checkpoint.Identity("name = 'a'\n", "d"), segments)
    return (folder / "good").read_bytes()


def read_checkpoint(path: Path) -> None:
    """As a run reads it, which makes one line of a ValueError or an OSError."""
    try:
        _, segments = checkpoint.read_checkpoint(path)
    except ValueError as error:
        raise InputError("checkpoint: damaged") from error
    assert all(np.isfinite(each.wall) for each in segments)


def read_folder(path: Path) -> None:
    """A study folder without rows: its status, and that there are no rows."""
    study_status(path.parent)
    with pytest.raises(InputError, match="no rows"):
        read_study(path.parent)


MATRIX = b"%%MatrixMarket matrix coordinate real symmetric\n3 3 4\n1 1 2.0\n2 2 3.0\n3 3 1.5\n2 1 0.5\n"
TEST = "time [s], displacement [mm], force [kN]\n" + "".join(
    f"{t:.2f}, {100 * np.sin(t):.3f}, {20 * np.sin(t) + 5 * np.cos(t):.3f}\n" for t in np.arange(0.0, 7.0, 0.2)
)
FOLDER = b'name = "a"\n[about]\nruns = 4\nchunk = 2\nsamples = 0\nversion = "0.2.0"\nseconds = 0.1\n[scene]\nx = 1\n'
SPECTRUM = b"period [s], sa [g]\n0.1, 0.5\n0.5, 1.0\n2.0, 0.3\n"
SUITE = b'[[records]]\nbundled = "ridgecrest-2019-ci-clc"\nduration = 4.0\nname = "one"\n'
AUDITED = b"time [s], u, fx\n" + b"".join(b"%.1f, %d, %d\n" % (0.1 * i, i % 7, i % 5) for i in range(40))
MAP = b'mass = "5 t"\nbearings = 2\n[columns]\ntime = "time"\ndisplacement_1 = "u [mm]"\nforce_1 = "-fx [kN]"\n'


def mapped(path: Path) -> Any:
    """A table by the map at a path."""
    (path.parent / "audited.csv").write_bytes(AUDITED)
    return read_histories(path.parent / "audited.csv", path).columns.get("force_1")


READERS: dict[str, list[Reader]] = {
    "scene/file/loader.py": [
        Reader("scene.toml", (EXAMPLES / "triple.toml").read_bytes(), load_scene, toml),
        Reader("building.toml", (EXAMPLES / "building" / "building.toml").read_bytes(), load_scene, toml),
        Reader("suite.toml", SUITE, load_suite, toml),
    ],
    "studies/definition.py": [Reader("study.toml", example_text().encode(), load_study, toml)],
    "studies/run.py": [Reader("study.toml", FOLDER, read_folder, toml)],
    "studies/bounding/factors.py": [Reader("factors.toml", factor_text("asce7").encode(), load_factors, toml)],
    "buildings/building.py": [
        Reader("mass.mtx", MATRIX, lambda path: matrix_of(path, "mass")),
        Reader("mass.npz", archive(), lambda path: matrix_of(path, "mass"), arrays),
    ],
    "motions/records/csv_table.py": [
        Reader("record.csv", CSV.encode(), lambda path: records.read_record(path).acceleration),
        Reader("motion.csv", b"time [s],u1 [mm]\n0,1\n1,2\n2,3\n3,1\n", lambda path: Motion.from_csv(path).duration),
    ],
    "auditing/columns.py": [
        Reader("map.toml", MAP, mapped, toml),
        Reader(
            "audited.csv", AUDITED, lambda path: read_histories(path, tomllib.loads(MAP.decode())).columns["force_1"]
        ),
    ],
    "motions/records/scaling.py": [Reader("target.csv", SPECTRUM, lambda path: np.array(read_spectrum(path)))],
    "studies/calibration/measurement.py": [
        Reader("test.csv", TEST.encode(), lambda path: read_measurement(path).force)
    ],
    "simulation/checkpoint.py": [Reader("run.ck", b"", read_checkpoint, sealed_header)],
}
ALL = [pytest.param(reader, id=f"{module}-{reader.name}") for module, readers in READERS.items() for reader in readers]


def opens_files(path: Path) -> bool:
    """Whether a module calls something that opens a file."""
    calls = (node.func for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call))
    return bool(OPENERS & {getattr(call, "attr", getattr(call, "id", "")) for call in calls})


def test_every_reader_is_fuzzed() -> None:
    package = ROOT / "msfp_gen"
    modules = {str(path.relative_to(package)) for path in package.rglob("*.py") if opens_files(path)}
    assert modules - OWN == (READERS.keys() | ELSEWHERE.keys()) - {"simulation/checkpoint.py"}
    assert all((ROOT / path).is_file() for path in ELSEWHERE.values())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("building", "fragility"):
        for path in (EXAMPLES / name).iterdir():
            if path.is_file():
                (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


def check(reader: Reader, path: Path, content: bytes) -> bool:
    """Whether the file is read; anything but finite numbers or one line fails the test."""
    path.write_bytes(content)
    try:
        value = reader.read(path)
    except InputError as error:
        assert str(error).isprintable() and len(str(error)) <= 700, str(error)
        return False
    if isinstance(value, np.ndarray | float):
        assert np.isfinite(value).all()
    return True


def fuzz(reader: Reader, folder: Path, examples: int) -> None:
    path = folder / reader.name
    whole = reader.content or checkpoint_bytes(folder)
    assert check(reader, path, whole)

    @settings(
        max_examples=examples, deadline=20000, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(st.data())
    def run(data: st.DataObject) -> None:
        if reader.structured is not None and data.draw(st.booleans()):
            content = reader.structured(whole, data)
        else:
            content, dice = whole, random.Random(data.draw(st.integers(0, 2**32)))
            for _ in range(data.draw(st.integers(1, 3))):
                content = dice.choice(MUTATIONS)(content, dice) or b"\n"
        check(reader, path, content)

    run()


@pytest.mark.parametrize("reader", ALL)
def test_a_changed_file_is_read_or_refused(reader: Reader, folder: Path) -> None:
    fuzz(reader, folder, 60)


@pytest.mark.slow
@pytest.mark.parametrize("reader", ALL)
def test_many_changed_files_are_read_or_refused(reader: Reader, folder: Path) -> None:
    fuzz(reader, folder, 3000)
