"""Suites of ground motions: a file that lists records, and their scaling to a mean spectrum (docs/data.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.common.fields import errors_at
from msfp_gen.common.inputs import is_input
from msfp_gen.errors import InputError
from msfp_gen.scene.file import schema
from msfp_gen.scene.file.loader import toml_file
from msfp_gen.scene.file.motion_tables import RecordMotion, located, with_spectrum

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.motions.records import ScaledSuite

Table = dict[str, Any]


@dataclass(frozen=True)
class SuiteRecord:
    """A motion of a suite: its name, its `[motion]` table, from which a result file describes it, and the motion."""

    name: str
    table: Table
    motion: Motion


@dataclass(frozen=True)
class Suite:
    """The motions of a suite; scaled: their spectra, where the suite is scaled to a mean spectrum."""

    records: tuple[SuiteRecord, ...]
    scaled: ScaledSuite | None


def load_suite(path: str | Path, progress: Callable[[float, float], None] | None = None) -> Suite:
    """The suite in a TOML file; paths inside it are relative to it, and permitted as in a scene file.

    progress: called with the number of spectra computed and of all. Raises InputError of one line that names the file,
    the path of the field, the value and the remedy.
    """
    path = Path(path)
    if not is_input(path):
        raise InputError(f"suite = {str(path)!r}: no such file; give the path of a TOML file with [[records]]")
    try:
        return suite_from_table(toml_file(path), path.parent, progress)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def suite_from_table(
    table: Table, folder: Path | None, progress: Callable[[float, float], None] | None = None
) -> Suite:
    """The suite of a plain table, as in a suite file. folder: as of `scene_from_table`. Raises InputError."""
    valid = schema.validate_suite(table)
    if not valid["records"]:
        raise InputError("records = []: give at least one [[records]]")
    tables = [_located(record, folder, index) for index, record in enumerate(valid["records"])]
    target = valid.get("scale_to")
    return _suite(tables, target and with_spectrum(target, folder, "scale_to"), progress)


def _located(table: Table, folder: Path | None, index: int) -> Table:
    """The table of a record with absolute paths."""
    with errors_at("motion", f"records[{index}]"):
        return located(table, folder)


def _suite(tables: list[Table], target: Table | None, progress: Callable[[float, float], None] | None) -> Suite:
    if target is None:
        return Suite(_records(tables), None)
    from msfp_gen.motions.records import ScaleTo, scaled_suite

    for index, table in enumerate(tables):
        if own := [name for name in ("scale", "scale_to") if name in table]:
            raise InputError(f"records[{index}].{own[0]}: [scale_to] scales all records of the suite; leave one out")
    values = dict(target)
    share = values.pop("least_share", None)
    scaled = scaled_suite([record.motion for record in _records(tables)], ScaleTo(**values), share, progress)
    factors = scaled.factors.tolist()
    return Suite(_records([{**table, "scale": f} for table, f in zip(tables, factors, strict=True)]), scaled)


def _records(tables: list[Table]) -> tuple[SuiteRecord, ...]:
    records = []
    for index, table in enumerate(tables):
        try:
            motion = RecordMotion(**table).build()
        except InputError as error:
            raise InputError(f"records[{index}].{str(error).removeprefix('motion').lstrip('.: ')}") from None
        records.append(SuiteRecord(motion.name, table, motion))
    names = [record.name for record in records]
    return tuple(
        replace(record, name=f"{record.name}-{index}") if names.count(record.name) > 1 else record
        for index, record in enumerate(records, start=1)
    )
