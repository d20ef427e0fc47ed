"""The table of a sweep: one row for each run, with the varied fields and the peaks, as CSV, Parquet or text."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from msfp_gen.common.output import check_output, write_bytes
from msfp_gen.common.tables import Table

if TYPE_CHECKING:
    from msfp_gen.buildings.result import BuildingResult
    from msfp_gen.result import Result
    from msfp_gen.studies.sweep.variations import Variation

TABLE_SUFFIXES = (".csv", ".parquet")
WIDTH = 80  # columns of a terminal
LONGEST = 16  # characters of a varied value, or of the name of a scene, in a terminal

# Column -> (unit, path in the summary). A path that ends in * gives one column for each surface, bottom first.
COLUMNS = {
    "status": ("", "status"),
    "message": ("", "message"),
    "duration": ("s", "duration"),
    "peak_displacement": ("m", "peak_displacement.radial"),
    "peak_top_force": ("N", "peak_top_force.radial"),
    "peak_force_ratio": ("", "peak_force_ratio"),
    "peak_sliding": ("m", "peak_sliding.*"),
    "minimum_gap": ("m", "minimum_gap.*"),
    "minimum_normal_force": ("N", "minimum_normal_force.*"),
    "maximum_normal_force": ("N", "maximum_normal_force.*"),
    "rims_met": ("", "rims_met"),
    "peak_input_energy": ("J", "energy.peak_input"),
    "closure_error": ("", "energy.closure_error"),
    "steps": ("", "counters.steps"),
    "wall_time": ("s", "wall_time"),
}
# The same of a building; `.*.` stands for each floor, storey or bearing, from below or in the order of the file.
BUILDING_COLUMNS = {
    "status": ("", "status"),
    "message": ("", "message"),
    "duration": ("s", "duration"),
    "peak_displacement": ("m", "peak_displacement.radial"),
    "peak_base_shear": ("N", "peak_base_shear.radial"),
    "base_shear_ratio": ("", "base_shear_ratio"),
    "peak_base_torsion": ("N m", "peak_base_torsion"),
    "peak_floor_acceleration": ("m/s^2", "peak_floor_acceleration.radial"),
    "peak_vertical_acceleration": ("m/s^2", "peak_floor_acceleration.E3"),
    "peak_drift_ratio": ("", "peak_drift_ratio"),
    "minimum_load_ratio": ("", "minimum_load_ratio"),
    "maximum_load_ratio": ("", "maximum_load_ratio"),
    "rims_met": ("", "rims_met"),
    "floor_acceleration": ("m/s^2", "floors.*.peak_acceleration.radial"),
    "storey_drift_ratio": ("", "storeys.*.peak_drift_ratio"),
    "storey_shear": ("N", "storeys.*.peak_shear.radial"),
    "bearing_displacement": ("m", "bearings.*.peak_displacement.radial"),
    "bearing_load_ratio": ("", "bearings.*.minimum_load_ratio"),
    "closure_error": ("", "energy.closure_error"),
    "wall_time": ("s", "wall_time"),
}


class Row(NamedTuple):
    """A run of a sweep: its number from 1, source, varied fields by path, summary, and the file with its rows."""

    number: int
    source: str
    varied: Mapping[str, Any]
    summary: Mapping[str, Any]
    file: str

    def as_dict(self) -> dict[str, Any]:
        """The summary with the varied fields, ready for JSON."""
        about = {"number": self.number, "source": self.source, "varied": dict(self.varied), "file": self.file or None}
        return {**about, **self.summary}


def row_of(number: int, variation: Variation, result: Result | BuildingResult, file: Path | None) -> Row:
    """The row of a run; the result itself is not kept."""
    return Row(number, variation.source, variation.varied, result.summary, "" if file is None else file.name)


def write_table(rows: Sequence[Row], path: str | Path, name: str = "output") -> Path:
    """Write the rows, sorted by their number, as CSV or Parquet by the suffix; completely or not at all.

    Names carry units in CSV (`peak_displacement [m]`); in Parquet units are metadata of the columns. Raises InputError
    for an invalid path.
    """
    target = check_output(path, TABLE_SUFFIXES, name)
    table = _columns(sorted(rows))
    content = _csv(table) if target.suffix.lower() == ".csv" else _parquet(table)
    write_bytes(target, [content])
    return target


def _columns(rows: Sequence[Row]) -> dict[tuple[str, str], list[Any]]:
    """(name, unit) -> values, None where a run has none."""
    varied = dict.fromkeys(path for row in rows for path in row.varied)
    table: dict[tuple[str, str], list[Any]] = {
        ("number", ""): [row.number for row in rows],
        ("scene", ""): [row.source for row in rows],
        **{(path, ""): [plain_cell(row.varied.get(path)) for row in rows] for path in varied},
    }
    for name, (unit, path) in _known(rows).items():
        values = [summary_value(row.summary, path) for row in rows]
        if ".*" not in path:
            table[name, unit] = [plain_cell(value) for value in values]
            continue
        for index in range(max(map(len, filter(None, values)), default=0)):
            table[f"{name}_{index + 1}", unit] = [v[index] if v and index < len(v) else None for v in values]
    return {**table, ("file", ""): [row.file for row in rows]}


def of_building(summary: Mapping[str, Any]) -> bool:
    """Whether this is the summary of a building."""
    return "bearings" in summary


def _known(rows: Sequence[Row]) -> dict[str, tuple[str, str]]:
    """The columns that some of the rows have."""
    kinds = {of_building(row.summary) for row in rows}
    return {**(COLUMNS if False in kinds else {}), **(BUILDING_COLUMNS if True in kinds else {})}


def summary_value(summary: Mapping[str, Any], path: str) -> Any:
    """The value of a summary at a dotted path, None where it has none; `*` gives a list of the values of all rows."""
    value: Any = summary
    head, each, rest = path.partition(".*")
    for part in head.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if not each or value is None:
        return value
    return [summary_value(row, rest.lstrip(".")) for row in value] if rest else value


def plain_cell(value: Any) -> Any:
    """A value of a cell: lists of whole numbers separated by spaces (`rims_met`), other lists and tables as JSON."""
    if isinstance(value, list) and all(type(item) is int for item in value):
        return " ".join(map(str, value))
    return json.dumps(value, default=str) if isinstance(value, list | tuple | dict) else value


def _csv(table: Mapping[tuple[str, str], list[Any]]) -> bytes:
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([f"{name} [{unit}]" if unit else name for name, unit in table])
    writer.writerows(zip(*table.values(), strict=True))
    return text.getvalue().encode()


def _parquet(table: Mapping[tuple[str, str], list[Any]]) -> memoryview:
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [pa.array(_one_type(values)) for values in table.values()]
    fields = [
        pa.field(name, array.type, metadata={"units": unit}) for (name, unit), array in zip(table, arrays, strict=True)
    ]
    content = BytesIO()
    pq.write_table(pa.table(arrays, schema=pa.schema(fields)), content)
    return content.getbuffer()


def _one_type(values: list[Any]) -> list[Any]:
    """Values of one type for a column: numbers stay numbers; where texts occur, all are texts."""
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    return values if len(kinds) <= 1 else [None if value is None else str(value) for value in values]


def sweep_table(rows: Sequence[Row]) -> Table:
    """The rows for a terminal, 80 columns wide at most: what does not fit is only in the table that is written."""
    rows = sorted(rows)
    paths = [path for path in dict.fromkeys(path for row in rows for path in row.varied) if _differs(rows, path)]
    scenes = {row.source for row in rows}
    leading = {"no.": [str(row.number) for row in rows]}
    if len(scenes) > 1 or not paths:
        leading["scene"] = [_short(Path(row.source).stem) for row in rows]
    varied = {path: [_short(str(row.varied.get(path, ""))) for row in rows] for path in paths}
    forces = [row.summary["peak_base_shear" if of_building(row.summary) else "peak_top_force"] for row in rows]
    peaks = {
        "status": [str(row.summary["status"]) for row in rows],
        "u [mm]": [f"{row.summary['peak_displacement']['radial'] * 1e3:.2f}" for row in rows],
        "F [kN]": [f"{force['radial'] * 1e-3:.2f}" for force in forces],
        "rims": [str(len(row.summary["rims_met"])) for row in rows],
        "[ms]": [f"{row.summary['wall_time'] * 1e3:.0f}" for row in rows],
    }
    shown = list(paths)
    while True:
        named = _headings(shown)
        table = {**leading, **{named[path]: varied[path] for path in shown}, **peaks}
        if not shown or _width(table) <= WIDTH:
            break
        shown.pop()
    title = f"{len(rows)} runs: peak displacement u, peak force F, rims met, run time"
    if len(shown) < len(paths):
        title += f"\nnot shown: {', '.join(paths[len(shown) :])}; give --table FILE"
    return Table(title, tuple(table), list(zip(*table.values(), strict=True)))


def _differs(rows: Sequence[Row], path: str) -> bool:
    """Whether a varied field has several values, or there is one run only."""
    return len(rows) == 1 or len({str(row.varied.get(path)) for row in rows}) > 1


def _headings(paths: Sequence[str]) -> dict[str, str]:
    """Short names of fields: the last part of the path where no other has it."""
    last = [path.rpartition(".")[2] for path in paths]
    return {path: end if last.count(end) == 1 else path for path, end in zip(paths, last, strict=True)}


def _width(table: Mapping[str, list[str]]) -> int:
    """Width of a terminal table with three characters of space for each column and one more, as `rich` draws it."""
    return sum(max(map(len, (name, *cells))) + 3 for name, cells in table.items()) + 1


def _short(text: str) -> str:
    """`text`, shortened in its middle: names of records and lists differ at their ends."""
    half = (LONGEST - 2) // 2
    return text if len(text) <= LONGEST else f"{text[:half]}..{text[-half:]}"
