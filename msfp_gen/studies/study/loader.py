"""Reading of study files (TOML): the definition of a study, complete and checked before the first run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from msfp_gen.buildings.load import located_value, with_absolute_paths
from msfp_gen.common.fields import Quantity
from msfp_gen.common.inputs import is_input, recording
from msfp_gen.errors import InputError
from msfp_gen.scene.file.loader import scene_table, toml_file
from msfp_gen.scene.file.motion_tables import RecordMotion
from msfp_gen.studies.bounding import load_factors
from msfp_gen.studies.study.axes import Axis, axis_from
from msfp_gen.studies.study.definition import Limits, Study, check_study
from msfp_gen.studies.study.fields import fields_of, known_keys
from msfp_gen.studies.study.quantities import Keep
from msfp_gen.studies.study.recipe import INTENSITY, Recipe
from msfp_gen.studies.study.records import NOUN, records_from
from msfp_gen.studies.study.sampling import Sampling

Table = dict[str, Any]
Progress = Callable[[float, float], None]
KEYS = {
    "name": "a text",
    "scene": "a scene file, the name of a preset, or a table",
    "records": NOUN,
    "axes": "a table with one table for each axis",
    "sampling": "a table: how random axes are drawn",
    "keep": "a list of quantities",
    "quantities": "a table of names and formulas",
    "limits": "a table",
    "chunk": "a number of runs",
    "about": "written by msfp-gen",
}
DEFAULT_KEEP = ("peak_displacement", "peak_top_force", "peak_sliding", "rims_met")
BUILDING_KEEP = (
    "peak_displacement", "peak_base_shear", "peak_floor_acceleration", "peak_drift_ratio", "minimum_load_ratio",
)  # fmt: skip
_CHUNK = Quantity("", least=1, whole=True)


def example_text() -> str:
    """A small study file, to start from: a few hundred runs."""
    return (files(__package__) / "example.toml").read_text(encoding="utf-8")


def load_study(
    source: str | Path | Mapping[str, Any], progress: Progress | None = None, *, design: bool = False
) -> Study:
    """The study in a TOML file, or of a table of the same keys. Paths in a file are relative to it.

    progress: of the scaling of a suite of records. design: whether to try both ends of each random axis in place of
    `[sampling]`, as the start of a search. Raises InputError of one line that names the file, the path of the
    field, the value and the remedy.
    """
    if isinstance(source, Mapping):
        return _study(_for_search(source) if design else dict(source), None, progress)
    path = Path(source)
    if not is_input(path):
        raise InputError(f"study = {str(source)!r}: no such file; `msfp-gen study --example` prints one to start from")
    try:
        table = toml_file(path)
        return _study(_for_search(table) if design else table, path.parent, progress)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _for_search(table: Mapping[str, Any]) -> Table:
    """A study that tries its axes at both ends: what cannot be designed is found before the search."""
    ends = {"method": "one-at-a-time", "quantiles": [1e-9, 1 - 1e-9]}
    random = any(isinstance(axis, Mapping) and "distribution" in axis for axis in _table(table, "axes").values())
    rest = {key: value for key, value in table.items() if key != "sampling"}
    return {**rest, "sampling": ends} if random else rest


def _study(table: Table, folder: Path | None, progress: Progress | None) -> Study:
    known_keys(table, KEYS, "")
    if "scene" not in table:
        raise InputError(f"scene is missing: give {KEYS['scene']}")
    with recording():  # a file that changes from here to the end of the check is an error
        return _checked(table, folder, progress)


def _checked(table: Table, folder: Path | None, progress: Progress | None) -> Study:
    scene = _scene(table["scene"], folder)
    records = records_from(table.get("records"), folder, progress)
    own = [_located(axis_from(name, each), folder) for name, each in _table(table, "axes").items()]
    axes = (*records.axes, *own)
    if len({axis.name for axis in axes}) < len(axes):
        raise InputError("axes: [records] makes the axes record and scale; give other names")
    sampling = _sampling(table, axes)
    keep = Keep(
        _texts(table, "keep", BUILDING_KEEP if "building" in scene else DEFAULT_KEEP),
        tuple((name, _formula(name, text)) for name, text in _table(table, "quantities").items()),
        1,
        (*(axis.name for axis in axes if axis.numeric), *([INTENSITY] if records.intensities else [])),
    )
    tables = records.tables
    if tables and "motion" not in scene:
        scene = {**scene, "motion": {"kind": RecordMotion.kind, **next(iter(tables.values()))}}
    factors = {
        path: load_factors(_beside(path, folder)) for axis in axes if axis.change == "factors" for path in axis.paths
    }
    complete = {
        **{key: value for key, value in table.items() if key != "about"},
        "scene": scene,
        **({"records": records.table} if tables else {}),
        **({"axes": {axis.name: _complete(axis, table["axes"][axis.name]) for axis in own}} if own else {}),
    }
    return check_study(
        Study(
            name=str(table.get("name", "")),
            recipe=Recipe(scene, axes, tables, factors, records.intensities),
            sampling=sampling,
            keep=keep,
            limits=Limits(**fields_of(table, "limits", Limits)),
            given_chunk=_chunk(table.get("chunk")),
            table=complete,
        )
    )


def _located(axis: Axis, folder: Path | None) -> Axis:
    """The axis with absolute paths of the files that its values name, relative to the folder of the study file."""
    if axis.change != "sets" or axis.values is None:
        return axis
    values = axis.values
    try:
        for path in axis.paths:
            values = tuple(located_value(path, value, folder) for value in values)
    except InputError as error:
        raise InputError(f"axes.{axis.name}: {error}") from None
    return replace(axis, values=values)


def _complete(axis: Axis, table: Table) -> Table:
    """The table of an axis for the copy of the study: with the paths of its values and the labels that these had."""
    if axis.values is None or list(axis.values) == table.get("values"):
        return table
    return {**table, "values": list(axis.values), "labels": list(axis.labels)} if "values" in table else table


def _table(table: Mapping[str, Any], key: str) -> Table:
    value = table.get(key, {})
    if not isinstance(value, Mapping):
        raise InputError(f"{key} = {value!r}: give {KEYS[key]}")
    return dict(value)


def _scene(value: Any, folder: Path | None) -> Table:
    """The table of the base scene, with absolute paths."""
    if isinstance(value, str):
        found, path = scene_table(_beside(value, folder))
        folder = path.parent if path is not None else None
    elif isinstance(value, Mapping):
        found = dict(value)
    else:
        raise InputError(f"scene = {value!r}: give {KEYS['scene']}")
    return with_absolute_paths(found, folder)


def _beside(source: str, folder: Path | None) -> str:
    """A path in a study file as seen from here; names of presets as they are."""
    path = (folder or Path()) / source
    return str(path) if is_input(path) else source


def _sampling(table: Table, axes: tuple[Axis, ...]) -> Sampling | None:
    drawn = [axis.name for axis in axes if axis.random]
    if not drawn:
        if "sampling" in table:
            raise InputError("sampling: no axis has a distribution; leave it out")
        return None
    if "sampling" not in table:
        raise InputError(
            f"sampling is missing: axes.{drawn[0]} has a distribution; give [sampling] with samples and seed"
        )
    return Sampling(**fields_of(table, "sampling", Sampling))


def _texts(table: Table, key: str, default: tuple[str, ...]) -> tuple[str, ...]:
    value = table.get(key, list(default))
    if not isinstance(value, list | tuple) or not all(isinstance(item, str) for item in value):
        raise InputError(f"{key} = {value!r}: give {KEYS[key]} in quotes")
    return tuple(value)


def _formula(name: str, text: Any) -> str:
    if not isinstance(text, str):
        raise InputError(f"quantities.{name} = {text!r}: give a formula in quotes, such as 'peak_sliding_1 / 0.13'")
    return text


def _chunk(value: Any) -> int | None:
    if value is None:
        return None
    try:
        return int(_CHUNK.parse(value))
    except ValueError as error:
        raise InputError(f"chunk = {value!r}: {error}") from None
