"""Parameter sweeps (`--vary`): a scene with every combination of the values of some fields, and the table of the runs.

Scenes come from the axes of a study (`axes`), rows from the quantities of their results (`columns`); a batch runs them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from msfp_gen.common.errors import InputError, RunError, prefixed
from msfp_gen.common.tables import Table, write_columns
from msfp_gen.results.quantities import ColumnSource, quantities, value_at
from msfp_gen.scene.file.changes import keys_of_path
from msfp_gen.scene.file.loader import scene_table
from msfp_gen.scene.file.source import with_absolute_paths
from msfp_gen.scene.system import System
from msfp_gen.studies.axes import Axis, SceneFactory, StudyInputs, located, motion_of
from msfp_gen.studies.columns import plain_cell

if TYPE_CHECKING:
    from msfp_gen.results.result import AnyResult
    from msfp_gen.scene.file.loader import SuiteRecord

MAX_SCENES = 100_000  # of one sweep; more scenes are taken to be a typing error
WIDTH = 80  # characters of a line of a terminal
LONGEST = 16  # characters of a varied value, or of the name of a scene, in a terminal


class Variation(NamedTuple):
    """A scene of a sweep. source: its file or preset. varied: path of each varied field -> value."""

    source: str
    varied: Mapping[str, Any]
    scene: System


def varied_field(text: str) -> tuple[str, list[Any]]:
    """Path and values of a field from a text such as `motion.scale=0.5,1,2`; values as in TOML. Raises InputError."""
    path, equals, values = text.partition("=")
    path = path.strip()
    try:
        keys = keys_of_path(path) if equals else []
    except InputError:
        keys = []
    if not keys:
        raise InputError(f"--vary = {text!r}: give a field of the scene and its values: motion.scale=0.5,1,2")
    try:
        listed = tomllib.loads(f"values = [{values}]")["values"]
    except (ValueError, RecursionError):
        raise InputError(
            f"--vary = {text!r}: the values are no TOML; texts need quotes, numbers do not: top.kind='rig','mass'"
        ) from None
    if not listed:
        raise InputError(f"--vary = {text!r}: there are no values; give some: motion.scale=0.5,1,2")
    return path, listed


def variations(
    source: str | Path, fields: Sequence[tuple[str, list[Any]]], records: Sequence[SuiteRecord] = ()
) -> list[Variation]:
    """The scenes of all combinations of values, the last field fastest; the name of a scene states its values.

    source: scene file or preset. fields: (path, values) of each field. records: of a suite, in place of the motion of
    the scene; slowest, as the field "record". Raises InputError: a field is given twice, does not exist, or does not
    accept a value.
    """
    paths = [path for path, _ in fields]
    if records and (motion := [path for path in paths if path.partition(".")[0] == "motion"]):
        raise InputError(f"--vary {motion[0]}: --suite gives the motion; change its records there")
    if repeated := [path for path in paths if paths.count(path) > 1]:
        raise InputError(f"--vary {repeated[0]}: given twice; give all its values at once")
    tables = {record.name: record.table for record in records}
    axes = [Axis("record", "record", values=tuple(tables))] if records else []
    axes += [Axis(path, "sets", (path,), values=tuple(values)) for path, values in fields]
    lists = [axis.values or () for axis in axes]
    if prod(map(len, lists)) > MAX_SCENES:
        raise InputError(f"--vary: {prod(map(len, lists))} scenes; give at most {MAX_SCENES} in all")
    table, file = scene_table(source)
    folder = None if file is None else file.parent
    with prefixed("" if file is None else f"{file}: "):
        axes = [located(axis, folder) for axis in axes]
        scene = with_absolute_paths(table if not records else {**table, "motion": motion_of(records[0].table)}, folder)
        factory = SceneFactory(StudyInputs(scene, tuple(axes), tables, {}, {}))
        scenes = []
        for given, values in zip(product(*lists), product(*(axis.values or () for axis in axes)), strict=True):
            run, varied = factory.scene(values), {axis.name: value for axis, value in zip(axes, given, strict=True)}
            texts = [f"{field} = {value}" for field, value in varied.items()]
            name = ", ".join([run.name or Path(source).stem, *texts])
            scenes.append(Variation(str(source), varied, replace(run, name=name)))
        return scenes


class Row(NamedTuple):
    """A run of a sweep. number: from 1. variation: its scene. file: name of the file with its rows, or ""."""

    number: int
    variation: Variation
    summary: Mapping[str, Any]
    file: str

    def as_dict(self) -> dict[str, Any]:
        """The summary with the varied fields, ready for JSON."""
        source, varied, _ = self.variation
        about = {"number": self.number, "source": source, "varied": dict(varied), "file": self.file or None}
        return {**about, **self.summary}


def row_of(number: int, variation: Variation, result: AnyResult | RunError, file: Path | None) -> Row:
    """The row of a run, without its result. result: of the run, or its RunError where it failed before a first row."""
    if not isinstance(result, RunError):
        return Row(number, variation, result.summary, "" if file is None else file.name)
    summary = {"status": result.status, "message": str(result), "name": variation.scene.name}
    return Row(number, variation, summary, "")


def write_table(rows: Sequence[Row], path: str | Path, name: str = "output") -> Path:
    """Write the rows, sorted by number, as CSV or Parquet; path, name and errors as in `write_columns`.

    The columns are the varied fields and the quantities of the summaries of bearings and of buildings.
    """
    rows = sorted(rows)
    varied = dict.fromkeys(path for row in rows for path in row.variation.varied)
    table: dict[tuple[str, str], list[Any]] = {
        ("number", ""): [row.number for row in rows],
        ("scene", ""): [row.variation.source for row in rows],
        **{(path, ""): [plain_cell(row.variation.varied.get(path)) for row in rows] for path in varied},
    }
    sources: dict[str, ColumnSource] = {}
    for row in rows:
        sources = quantities(row.variation.scene) | sources
    for column, source in sources.items():
        if source.quantity.characterised or source.quantity.apart:
            continue
        values = [plain_cell(source.value(row.summary.get, None)) for row in rows]
        if source.place is None or any(value is not None for value in values):
            table[column, source.quantity.unit] = values
    return write_columns(path, {**table, ("file", ""): [row.file for row in rows]}, name)


def sweep_table(rows: Sequence[Row]) -> Table:
    """The rows for a terminal, at most 80 characters wide; fields that do not fit are named in the title."""
    rows = sorted(rows)
    fields = dict.fromkeys(path for row in rows for path in row.variation.varied)
    paths = [
        path for path in fields if len(rows) == 1 or len({str(row.variation.varied.get(path)) for row in rows}) > 1
    ]
    scenes = {row.variation.source for row in rows}
    leading = {"no.": [str(row.number) for row in rows]}
    if len(scenes) > 1 or not paths:
        leading["scene"] = [_short(Path(row.variation.source).stem) for row in rows]
    varied = {path: [_short(str(row.variation.varied.get(path, ""))) for row in rows] for path in paths}
    peaks = {
        "status": [str(row.summary["status"]) for row in rows],
        "u [mm]": [_number(row, "peak_displacement.radial", 1e3, 2) for row in rows],
        "F [kN]": [_number(row, "peak_force.radial", 1e-3, 2) for row in rows],
        "rims": [str(len(row.summary.get("rims_met", ()))) for row in rows],
        "verdict": [str(value_at(row.summary, "verdict.word") or "failed") for row in rows],
        "[ms]": [_number(row, "wall_time", 1e3, 0) for row in rows],
    }
    for count in range(len(paths), -1, -1):
        ends = [
            path.rpartition(".")[2] for path in paths[:count]
        ]  # the last key names a field unless two paths share it
        names = [end if ends.count(end) == 1 else path for path, end in zip(paths, ends, strict=False)]
        table = {**leading, **dict(zip(names, varied.values(), strict=False)), **peaks}
        # `rich` adds three characters for each column, and one for the table
        if sum(max(map(len, (name, *cells))) + 3 for name, cells in table.items()) + 1 <= WIDTH:
            break
    title = f"{len(rows)} runs: peak displacement u, peak force F, rims met, run time"
    if count < len(paths):
        title += f"\nnot shown: {', '.join(paths[count:])}; give --table FILE"
    return Table(title, tuple(table), list(zip(*table.values(), strict=True)))


def _number(row: Row, path: str, scale: float, digits: int) -> str:
    """A value of a summary as text; "-" for a run that failed before its first row."""
    value = value_at(row.summary, path)
    return "-" if value is None else f"{value * scale:.{digits}f}"


def _short(text: str) -> str:
    """`text`, shortened in its middle, since names of records and lists differ at their ends."""
    half = (LONGEST - 2) // 2
    return text if len(text) <= LONGEST else f"{text[:half]}..{text[-half:]}"
