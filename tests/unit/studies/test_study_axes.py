"""A property of every axis: the scene of a run is that of a scene file in which the value of the axis is written."""

from __future__ import annotations

import tomllib
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.study_tables import write_record

from msfp_gen import InputError, load_scene, presets
from msfp_gen.buildings.file import FrameTable
from msfp_gen.buildings.storey import BaseSlab, Storey
from msfp_gen.common.fields import Choice, Quantity, Rule, ruled_fields
from msfp_gen.common.identity import fingerprint
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.file.loader import bearing_table, dumps, plain_values
from msfp_gen.scene.file.motion_tables import Circle, Harmonic, RecordMotion
from msfp_gen.scene.scene_fields import Stop
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import MassTop, NodeTop, PrescribedTop, RigTop
from msfp_gen.specification.layout import Auto
from msfp_gen.studies import load_study

Table = dict[str, Any]
Rules = dict[str, Rule]
COLUMNS = {
    name: (rows, rule)
    for rows, kind in (("surfaces", Surface), ("bodies", Body))
    for name, rule, _ in ruled_fields(kind)
}
TOPS: tuple[tuple[type, Table], ...] = (
    (RigTop, {"axial_load": 112e3, "stiffness": 1e8, "rotational_stiffness": 1e6}),
    (MassTop, {"mass": 11e3, "inertia": 4e3, "height": 0.4, "rotational_stiffness": 1e7}),
    (PrescribedTop, {"force": [0.0, 0.0, -112e3]}),
)
MOTIONS: tuple[tuple[type, Table], ...] = (
    (Harmonic, {"amplitude": 0.02, "frequency": 0.5}),
    (Circle, {"amplitude": 0.02, "angular_frequency": 3.0, "lead_in": 1.0}),
    (RecordMotion, {"file": "a.csv", "correct": False, "name": "one"}),
)
BUILDING = """
duration = 0.2
[building]
[building.base]
mass = 45e3
inertia = [1.4e5, 1.4e5, 2.7e5]
[[building.storey]]
height = 3.0
mass = 1e3
inertia = [6e3, 6e3, 1.2e4]
stiffness = 9e6
torsional_stiffness = 1.8e8
[building.interface]
stiffness = 1e7
vertical_stiffness = 5e7
rotational_stiffness = 1e6
[[building.bearing]]
bearing = "corner"
position = [3.0, 2.0]
[[building.bearing]]
bearing = "corner"
position = [-3.0, 2.0]
motion = { kind = "record", file = "a.csv", correct = false }
[[building.bearing]]
bearing = "corner"
position = [0.0, -2.0]
[motion]
kind = "ramp"
acceleration = 2.0
duration = 0.3
"""


def kinds(kind: type) -> Rules:
    return {name: rule for name, rule, _ in ruled_fields(kind)}


def paths_of(prefix: str, kind: type) -> dict[str, Rule]:
    return {f"{prefix}{name}": rule for name, rule in kinds(kind).items()}


SCENE_PATHS: Rules = {
    **{f"bearing.{name}": rule for name, (_, rule) in COLUMNS.items()},
    **paths_of("bearing.", Bearing),
    **{path: rule for kind, _ in TOPS for path, rule in paths_of("top.", kind).items()},
    **{path: rule for kind, _ in MOTIONS for path, rule in paths_of("motion.", kind).items() if path != "motion.name"},
    **paths_of("solver.", Solver),
    **paths_of("effects.", Auto),
    **paths_of("stop.", Stop),
    "duration": Quantity("s", above=0.0),
    "output_step": Quantity("s", above=0.0),
}
BUILDING_PATHS: Rules = {
    **{f"building.bearing[*].bearing.{name}": rule for name, (_, rule) in COLUMNS.items()},
    **{f"building.bearing[1].bearing.surfaces[0].{name}": rule for name, rule in kinds(Surface).items()},
    **paths_of("building.base.", BaseSlab),
    **paths_of("building.storey[*].", Storey),
    **paths_of("building.interface.", NodeTop),
    **paths_of("building.bearing[1].motion.", RecordMotion),
    **{path: rule for path, rule in paths_of("building.", FrameTable).items() if isinstance(rule, Quantity)},
}


def a_bearing(rng: np.random.Generator) -> Any:
    """A preset, one with changes, or a complete table; friction at the surfaces or at the pivot."""
    name = str(rng.choice(["fenz-tfp", "becker-tfp"]))
    complete = plain_values(bearing_table(presets.bearing(name)))
    friction = [float(f"{each:.4f}") for each in rng.uniform(0.02, 0.12, 4)]
    at_pivot = {"friction": [max(friction), min(friction), min(friction), max(friction)], "friction_at": "pivot"}
    rows = [{**row, "friction": mu} for row, mu in zip(complete["surfaces"], at_pivot["friction"], strict=True)]
    choices: list[Any] = [
        name,
        {"preset": name, "friction": friction, "capacity": 0.05},
        {"preset": name, **at_pivot},
        complete,
        {**complete, "surfaces": rows, "friction_at": "pivot"},
    ]
    return choices[rng.integers(len(choices))]


def a_value(rng: np.random.Generator, rule: Rule, path: str, rows: int = 0) -> Any:
    """A value of a field, as a file may give it; of a column also a list."""
    if isinstance(rule, Choice):
        return list(rule.words)[rng.integers(len(rule.words))]
    if not isinstance(rule, Quantity):
        return {"file": "b.csv", "bundled": "ridgecrest-2019-ci-ccc", "components": ["E1"]}.get(
            path.split(".")[-1], "x"
        )
    if rows and rng.random() < 0.5:
        return [a_value(rng, rule, path) for _ in range(rows)]
    low, high = (1.0, 5.0) if rule.unit in ("N", "kg", "s") else (0.01, 0.3)
    numbers = [float(f"{each:.3g}") for each in rng.uniform(low, high, 3)]
    if rule.shape or rule.pair:
        return numbers[: (rule.shape or (2,))[0] or 3]
    number = int(numbers[0]) + 1 if rule.whole else numbers[0]
    return f"{number} {rule.unit}" if rule.unit and not rule.whole and rng.random() < 0.3 else number


def table_at(holder: Any, path: str) -> tuple[Any, Any]:
    """Holder and last key of a path of plain keys and of indices, by hand."""
    keys = [int(part) if part.isdigit() else part for part in path.replace("[", ".").replace("]", "").split(".")]
    for key in keys[:-1]:
        holder = holder[key] if isinstance(key, int) else holder.setdefault(key, {})
    return holder, keys[-1]


def rows_in(bearing: Table, name: str) -> list[Any]:
    """The values of a column of a bearing, as its table states them."""
    rows = COLUMNS[name][0]
    if "preset" not in bearing:
        return [row.get(name) for row in bearing[rows]]
    values = [row.get(name) for row in bearing_table(presets.bearing(bearing["preset"]))[rows]]
    if name in bearing:
        values = bearing[name] if isinstance(bearing[name], list) else [bearing[name]] * len(values)
    return values


def write_column(bearing: Any, name: str, value: Any) -> Table:
    """A bearing in whose table a column is written."""
    bearing = {"preset": bearing} if isinstance(bearing, str) else deepcopy(bearing)
    if "preset" in bearing:
        return {**bearing, name: value}
    rows = bearing[COLUMNS[name][0]]
    several = isinstance(value, list) and (name != "inertia" or isinstance(value[0], list))
    for index, row in enumerate(rows):
        row[name] = value[index] if several else value
    return bearing


def complete(bearing: Table) -> Table:
    """The complete table of a bearing, by hand."""
    if "preset" not in bearing:
        return deepcopy(bearing)
    found = plain_values(bearing_table(presets.bearing(bearing["preset"])))
    for name, value in bearing.items():
        if name in COLUMNS:
            found = write_column(found, name, value)
        elif name != "preset":
            found[name] = value
    return found


def written(table: Table, path: str, value: Any) -> Table:
    """A scene table in which a value is written."""
    table = deepcopy(table)
    if "[*]" in path:
        for index in range(3 if "bearing[*]" in path else 1):
            table = written(table, path.replace("[*]", f"[{index}]"), value)
        return table
    holder, key = table_at(table, path.partition(".surfaces[")[0])
    if ".surfaces[" in path:  # of a bearing of a building
        bearing = holder[key] if isinstance(holder[key], dict) else table["bearings"][holder[key]]
        holder[key] = complete(bearing)
        holder[key]["surfaces"][0][path.rpartition(".")[2]] = value
        return table
    if key in COLUMNS and path.rpartition(".")[0].endswith("bearing"):
        holder, key = table_at(table, path.rpartition(".")[0])
        bearing = holder[key]
        if isinstance(bearing, str) and bearing in table.get("bearings", {}):
            bearing = table["bearings"][bearing]
        holder[key] = write_column(bearing, path.rpartition(".")[2], value)
        return table
    if path.startswith("bearing.") and isinstance(table["bearing"], str):
        table["bearing"] = {"preset": table["bearing"]}
        holder, key = table_at(table, path)
    holder[key] = value
    return table


def identity(make: Any) -> str:
    """Fingerprint of a scene, or "refused"."""
    try:
        scene = make()
    except InputError as error:
        assert "\n" not in str(error)
        return "refused"
    table = plain_values(getattr(scene, "motion_table", None) or {})
    return fingerprint((replace(scene, name=""), table))


def agree(folder: Path, table: Table, axis: Table, expected: Table) -> str:
    """Whether the scene of a study with one axis is that of a file; the fingerprint of both."""
    (folder / "study.toml").write_text(dumps({"scene": table, "axes": {"x": axis}}), encoding="utf-8")
    (folder / "scene.toml").write_text(dumps(expected), encoding="utf-8")
    found = identity(lambda: load_study(folder / "study.toml").scene(1))
    assert found == identity(lambda: load_scene(folder / "scene.toml")), (axis, table)
    return found


def check_scene(folder: Path, path: str, seed: int) -> int:
    """One random base and value; returns how many scenes were valid."""
    rng = np.random.default_rng([seed, *path.encode()])
    part, name = path.partition(".")[::2]
    tops = [(kind, top) for kind, top in TOPS if part != "top" or name in kinds(kind)]
    motions = [(kind, motion) for kind, motion in MOTIONS if part != "motion" or name in kinds(kind)]
    kind, top = tops[rng.integers(len(tops))]
    moving, motion = motions[rng.integers(len(motions))]
    table = {
        "bearing": a_bearing(rng),
        "motion": {"kind": moving.kind, **motion},
        "top": {"kind": kind.kind, **top},
        **({"solver": {"rtol": 1e-3}} if rng.random() < 0.5 else {}),
    }
    rule = SCENE_PATHS[path]
    column = part == "bearing" and name in COLUMNS
    value = a_value(rng, rule, path, 4 if column else 0)
    valid = agree(folder, table, {"sets": path, "values": [value]}, written(table, path, value)) != "refused"
    if not isinstance(rule, Quantity) or part not in ("bearing", "top", "solver"):
        return valid
    factor, axis = float(f"{rng.uniform(0.9, 1.1):.3f}"), {"multiplies": path, "values": [1.0]}
    axis["values"] = [factor]
    if column:
        bearing = {"preset": table["bearing"]} if isinstance(table["bearing"], str) else table["bearing"]
        chosen = [1, 4] if COLUMNS[name][0] == "surfaces" and rng.random() < 0.5 else [1, 2, 3, 4]
        axis |= {"surfaces": chosen} if len(chosen) < 4 else {}
        values = [times(v, factor) if k in chosen else v for k, v in enumerate(rows_in(bearing, name), start=1)]
        product: Any = None if None in values else values
    else:
        owner = {"bearing": load_bearing(table), "top": kind(**top), "solver": Solver(**table.get("solver", {}))}[part]
        product = times(getattr(owner, name), factor)
    if product is None or rule.whole:
        return valid
    return valid + (agree(folder, table, axis, written(table, path, product)) != "refused")


def load_bearing(table: Table) -> Bearing:
    from msfp_gen.scene.file.loader import bearing_from_table

    bearing = table["bearing"]
    return bearing_from_table({"preset": bearing} if isinstance(bearing, str) else bearing)


def times(value: Any, factor: float) -> Any:
    if value is None:
        return None
    return [times(each, factor) for each in value] if isinstance(value, list | tuple) else value * factor


def check_building(folder: Path, path: str, seed: int) -> int:
    rng = np.random.default_rng([seed, *path.encode()])
    table = tomllib.loads(BUILDING)
    bearing = a_bearing(rng)
    table["bearings"] = {"corner": {"preset": bearing} if isinstance(bearing, str) else bearing}
    value = a_value(rng, BUILDING_PATHS[path], path)
    expected = written(table, path, value)
    return agree(folder, table, {"sets": path, "values": [value]}, expected) != "refused"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, peak in (("a.csv", 0.5), ("b.csv", 1.0)):
        write_record(tmp_path / name, peak)
    return tmp_path


def test_the_scene_of_an_axis_is_that_of_a_file(folder: Path) -> None:
    """Of every tenth field of a scene, in a random base scene that has it; of every field in the slow test."""
    paths = ["bearing.friction", "bearing.radius", "bearing.height", "motion.file", *list(SCENE_PATHS)[4::10]]
    assert sum(check_scene(folder, path, 1) for path in paths) > 0.5 * len(paths)


def test_the_building_of_an_axis_is_that_of_a_file(folder: Path) -> None:
    valid = sum(check_building(folder, path, 1) for path in list(BUILDING_PATHS)[::16])
    assert valid > len(BUILDING_PATHS) / 60


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 22))
def test_many_scenes_of_axes_are_those_of_files(folder: Path, seed: int) -> None:
    assert sum(check_scene(folder, path, seed) for path in SCENE_PATHS) > 0.4 * len(SCENE_PATHS)
    assert sum(check_building(folder, path, seed) for path in BUILDING_PATHS) > 0.2 * len(BUILDING_PATHS)
