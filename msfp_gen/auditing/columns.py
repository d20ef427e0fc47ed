"""A table of any program as `Histories`: a map file names the columns with their units (docs/audit.md).

The map is TOML. `[columns]` has the names of `QUANTITIES`, each with the name of a column, or `#3` for the third of a
file without a header, and its unit in brackets; a minus before it turns the sign. A table {file, column} reads it from
another file beside the map, as recorders of OpenSees write one for each quantity.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.auditing.histories import QUANTITIES, Histories, histories_of
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Quantity, to_si
from msfp_gen.motions.records.text import Lines, read_lines
from msfp_gen.scene.file.loader import toml_file

_CELL = re.compile(r"\s*(-?)\s*(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))?\s*")
_KEYS = {"columns", "mass", "bearings", "title"}
# Columns of a CSV of this package, where no map is given, beside those whose sign it states.
OWN = {
    "time": "time",
    **{f"lower_{i}": f"base_displacement_E{i}" for i in (1, 2, 3)},
    **{f"upper_{i}": f"top_displacement_E{i}" for i in (1, 2, 3)},
    **{f"{name}_{i}": f"{name}_{i}" for name in ("sliding", "temperature") for i in range(1, 10)},
}


class TextTable(NamedTuple):
    """A table of text: its lines, names of columns (none: it has no header), units in a line of their own, and rows.

    values: shape (T, columns) [unit of the column].
    """

    lines: Lines
    names: list[str]
    units: list[str]
    values: Array

    def column(self, text: str, unit: str) -> Array:
        """A column, ndarray, shape (T,) [SI]. text: as in the map; unit: of the quantity. Raises InputError."""
        match = _CELL.fullmatch(text)
        assert match is not None  # the pattern matches every text of one line
        minus, name, given = match[1], match[2], (match[3] or match[4] or "").strip()
        index = self._index(name)
        given = (
            given or (self.units[index] if self.units else "") or (_split(self.names[index])[1] if self.names else "")
        )
        if not given:
            raise InputError(f"{self.lines.path.name}: column {name!r} has no unit; write {name} [{unit}] in the map")
        try:
            factor = to_si(f"1 {given}", unit)
        except ValueError as error:
            raise InputError(f"{self.lines.path.name}: column {name!r}: {error}") from None
        values: Array = self.values[:, index] * (-factor if minus else factor)
        return values

    def _index(self, name: str) -> int:
        count = self.values.shape[1]
        if re.fullmatch(r"#\d+", name):
            if 1 <= int(name[1:]) <= count:
                return int(name[1:]) - 1
            raise InputError(f"{self.lines.path.name}: column {name} of {count}; give #1 to #{count}")
        places = [i for i, text in enumerate(self.names) if name.lower() in (text.lower(), _split(text)[0].lower())]
        if len(places) == 1:
            return places[0]
        what = f"{len(places)} columns" if places else "no column"
        known = ", ".join(repr(text[:24]) for text in self.names[:12]) or f"#1 to #{count}, without a header"
        raise InputError(f"{self.lines.path.name}: {what} {name!r} among {known}; name it in the map (docs/audit.md)")


def read_table(path: Path) -> TextTable:
    """A table with or without a header, of columns between commas, semicolons, tabs or blanks.

    Lines before the first row of numbers: the last is the header, or a line of units after the header, as ETABS and
    SAP2000 export them. Lines that begin with # are comments. Raises InputError with file and line.
    """
    lines = read_lines(path)
    rows: list[list[float]] = []
    before: list[list[str]] = []
    separator: str | None = None
    for index in range(len(lines)):
        text = lines[index]
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        if not rows:
            separator = next((mark for mark in ("\t", ";", ",") if mark in text), None)
        cells = [cell.strip().strip('"') for cell in text.split(separator)]
        numbers = [cell for cell in cells if _is_number(cell)]
        if not rows and len(numbers) < max(1, len(cells) / 2):
            before.append(cells)
            continue
        if rows and len(cells) != len(rows[0]):
            lines.fail(index, f"{len(cells)} columns, the first row has {len(rows[0])}")
        rows.append([float(cell) if _is_number(cell) else np.nan for cell in cells])
    if not rows:
        lines.fail(len(lines) - 1, "no rows of numbers; give a table of time histories")
    names, units = _head([cells for cells in before if len(cells) == len(rows[0])])
    return TextTable(lines, names, units, np.array(rows))


def _head(lines: list[list[str]]) -> tuple[list[str], list[str]]:
    """Names of columns, and units where they stand in a line of their own."""
    if not lines:
        return [], []
    if len(lines) > 1 and any(_is_unit(cell) for cell in lines[-1] if cell):
        return lines[-2], [cell if _is_unit(cell) else "" for cell in lines[-1]]
    return lines[-1], []


def _is_unit(text: str) -> bool:
    """Whether a text is a unit of a quantity."""
    for unit in dict.fromkeys(unit for unit, _ in QUANTITIES.values()):
        with suppress(ValueError):
            return bool(np.isfinite(to_si(f"1 {text}", unit)))
    return False


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _split(text: str) -> tuple[str, str]:
    """Name and unit of a header cell such as `force [kN]`."""
    match = _CELL.fullmatch(text)
    assert match is not None
    return match[1] + match[2], (match[3] or match[4] or "").strip()


@np.errstate(over="ignore", invalid="ignore")  # `Histories` refuses numbers that are not finite
def read_histories(path: str | Path, columns: str | Path | Mapping[str, Any] | None = None) -> Histories:
    """Read the histories of a file.

    path: a table of text, or a result of this package (.nc). columns: the map, as a TOML file or its table; None: the
    columns of a CSV of this package. Raises InputError of one line that names file and column.
    """
    path = Path(path)
    if path.suffix.lower() == ".nc":
        from msfp_gen.results.result import load_result

        if columns is not None:
            raise InputError(f"{path.name}: a result of msfp-gen needs no map; leave it out")
        return histories_of(load_result(path))
    table, folder = _map(columns)
    source = table.get("columns")
    own = source is None
    tables = {path: read_table(path)}
    found: dict[str, Array] = {}
    for name, entry in (_own_columns(tables[path]) if own else _columns(source)).items():
        file, text = (folder / entry["file"], entry["column"]) if isinstance(entry, dict) else (path, entry)
        if file not in tables:
            tables[file] = read_table(file)
        if own and name != "time" and text.removeprefix("-") not in [_split(cell)[0] for cell in tables[file].names]:
            continue
        found[name] = tables[file].column(text, QUANTITIES[name][0])
    if own:
        found |= {name: found[name] - found[name][0] for name in found if name.startswith("upper_")}  # of its position
        found |= _slip_speeds(tables[path])
    rows = min(map(len, found.values()), default=0)
    if any(len(values) > rows + 1 for values in found.values()):  # recorders may write a row more or less
        counts = ", ".join(f"{name} {len(values)}" for name, values in found.items())
        raise InputError(f"{path.name}: columns of different lengths: {counts}; give files of one analysis")
    found = {name: values[:rows] for name, values in found.items()}
    if "time" in found:  # a first row of the same time, as recorders write it, is left out
        first = next((i for i in range(rows - 1) if found["time"][i + 1] > found["time"][i]), 0)
        found = {name: values[first:] for name, values in found.items()}
    mass, bearings = (table.get(key) for key in ("mass", "bearings"))
    return Histories(
        str(table.get("title", path.name)),
        found,
        None if mass is None else _quantity("mass", mass, "kg"),
        1.0 if bearings is None else _quantity("bearings", bearings, ""),
    )


def _own_columns(table: TextTable) -> dict[str, str]:
    """Columns of a CSV of this package: the force of its uppermost surface, or on the top support; u is base - top."""
    present = {_split(cell)[0] for cell in table.names}
    surfaces = [i for i in range(1, 10) if f"interface_force_{i}_E3" in present]
    turned = "u = top - base" in table.lines[0]  # u, and the force on the top support, have the other sign then
    minus, plus = ("", "-") if turned else ("-", "")
    force = f"interface_force_{surfaces[-1]}" if surfaces else f"{plus}top_force"
    found = {f"displacement_{i}": f"{plus}displacement_E{i}" for i in (1, 2)} | {"rise": f"{minus}displacement_E3"}
    return OWN | found | {f"force_{i}": f"{force}_E{i}" for i in (1, 2)} | {"axial": f"{force}_E3"}


def _slip_speeds(table: TextTable) -> dict[str, Array]:
    """Slip speeds of the surfaces in a CSV of this package, which has both components of the slip velocity."""
    present = {_split(cell)[0] for cell in table.names}
    found = {}
    for i in range(1, 10):
        names = [name for axis in (1, 2) if (name := f"slip_velocity_{i}_t~{axis}") in present]
        if names:
            found[f"slip_speed_{i}"] = np.linalg.norm([table.column(name, "m/s") for name in names], axis=0)
    return found


def histories_from(source: Any, columns: str | Path | Mapping[str, Any] | None = None) -> Histories:
    """The histories of a file, a `Result`, or `Histories` as they are. Raises InputError."""
    if isinstance(source, str | Path):
        return read_histories(source, columns)
    if columns is not None:
        raise InputError("columns: only a file needs a map; leave it out")
    return source if isinstance(source, Histories) else histories_of(source)


def _columns(source: Any) -> Mapping[str, Any]:
    """The table of columns, checked. Raises InputError."""
    if not isinstance(source, dict) or not source:
        raise InputError('map.columns: give a table of names, such as force_1 = "Fx [kN]" (docs/audit.md)')
    for name, entry in source.items():
        if name not in QUANTITIES:
            raise InputError(f"map.columns.{name}: unknown; give {', '.join(QUANTITIES)}")
        whole = isinstance(entry, dict) and set(entry) == {"file", "column"} and all(map(_is_text, entry.values()))
        if not (_is_text(entry) or whole):
            raise InputError(f'map.columns.{name} = {entry!r}: give "NAME [unit]", or {{file, column}}')
    return source


def _is_text(entry: Any) -> bool:
    return isinstance(entry, str) and bool(entry.strip()) and "\n" not in entry


def _quantity(name: str, value: Any, unit: str) -> float:
    try:
        return float(Quantity(unit, above=0.0).parse(value, text=True))
    except ValueError as error:
        raise InputError(f"map.{name} = {value!r}: {error}") from None


def _map(columns: str | Path | Mapping[str, Any] | None) -> tuple[Mapping[str, Any], Path]:
    """The table of a map, and the folder to which its files are relative. Raises InputError."""
    if columns is None or isinstance(columns, Mapping):
        table, folder = columns or {}, Path()
    else:
        folder = Path(columns).parent
        with prefixed(f"{columns}: "):
            if not Path(columns).is_file():
                raise InputError("no such file; give a map of columns (docs/audit.md)")
            table = toml_file(Path(columns))
    if unknown := sorted(table.keys() - _KEYS):
        raise InputError(f"map.{unknown[0]}: unknown; give {', '.join(sorted(_KEYS))}")
    return table, folder
