"""Reading of study files (TOML): the definition of a study, complete and checked before the first run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from msfp_gen.buildings.file import with_absolute_paths
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Choice, Quantity, check_fields, ruled_fields
from msfp_gen.common.inputs import is_input, recording
from msfp_gen.scene.file.catalogue import known_keys, parsed
from msfp_gen.scene.file.loader import Suite, load_suite, scene_table, suite_from_table, toml_file
from msfp_gen.studies.bounding import load_factors
from msfp_gen.studies.columns import Keep
from msfp_gen.studies.study.axes import INTENSITY, Axis, Recipe, Sampling, axis_from, grid, located, motion_of
from msfp_gen.studies.study.definition import Limits, Study, check_study

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion

Table = dict[str, Any]
Progress = Callable[[float, float], None]
RECORD_KEYS = ("suite", "motions", "scales", "intensity")
NOUN = "a table with motions or the file of a suite, and scales"
COMPONENTS = ("E1", "E2", "E3", "geomean", "rotd50", "rotd100")
KEYS = {
    "name": "a text",
    "scene": "a scene file, the name of a preset, or a table",
    "records": NOUN,
    "axes": "a table with one table for each axis",
    "sampling": "a table: how random axes are drawn",
    "keep": "a list of quantities",
    "quantities": "a table of names and formulas",
    "limits": "a table",
    "accuracy": "a table: what is estimated, and how well",
    "chunk": "a number of runs",
    "about": "written by msfp-gen",
}
DEFAULT_KEEP = ("peak_displacement", "peak_force", "peak_sliding", "rims_met", "limits_exceeded")
BUILDING_KEEP = (
    "peak_displacement", "peak_force", "peak_floor_acceleration", "peak_drift_ratio", "minimum_load_ratio",
    "limits_exceeded",
)  # fmt: skip
_CHUNK = Quantity("", least=1, whole=True)


def fields_of(table: Mapping[str, Any], key: str, kind: type, where: str = "") -> dict[str, Any]:
    """The table at `key`, whose keys are fields of `kind`; empty if it is not there. Raises InputError."""
    inner = table.get(key, {})
    if not isinstance(inner, Mapping):
        raise InputError(f"{where}{key} = {inner!r}: give a table")
    known_keys(inner, [name for name, _, _ in ruled_fields(kind)], f"{where}{key}.")
    return dict(inner)


@dataclass(frozen=True)
class Intensity:
    """The intensity measure of a record: spectral pseudo-acceleration, or peak ground acceleration without a period.

    period [s], damping: of the oscillator. component: of the spectrum. Raises InputError.
    """

    period: Annotated[float | None, Quantity("s", above=0.0)] = None
    damping: Annotated[float, Quantity("", above=0.0)] = 0.05
    component: Annotated[str, Choice(COMPONENTS)] = "geomean"

    def __post_init__(self) -> None:
        check_fields(self, "records.intensity")

    def of(self, motion: Motion) -> float:
        """The measure of a motion [m/s^2]."""
        from msfp_gen.motions.records.spectrum import MEASURES, response_spectrum

        spectrum = response_spectrum(motion, [self.period or 1.0], damping=self.damping)
        values = spectrum.pga if self.period is None else spectrum.psa[0]
        return float(values[MEASURES.index(self.component)])


@dataclass(frozen=True)
class Records:
    """What `[records]` gives.

    Attributes:
        axes: `record`, and `scale` where scales are given; none without `[records]`.
        tables: name -> `[motion]` table, without its key `kind`; paths are absolute.
        intensities: name -> intensity measure at scale 1 [m/s^2]; empty where none is asked for.
        table: `[records]` with the motions in it; empty without `[records]`.
    """

    axes: tuple[Axis, ...]
    tables: dict[str, Table]
    intensities: dict[str, float]
    table: Table


def records_from(table: Any, folder: Path | None, progress: Progress | None) -> Records:
    """The records of a table `[records]`; None: none. folder: of the study file. Raises InputError."""
    if table is None:
        return Records((), {}, {}, {})
    if not isinstance(table, Mapping):
        raise InputError(f"records = {table!r}: give {NOUN}")
    known_keys(table, RECORD_KEYS, "records.")
    suite = _suite(table, folder, progress)
    axes = [grid(Axis("record", "record"), [record.name for record in suite.records])]
    if (scales := table.get("scales")) is not None:
        axes.append(_scales(scales))
    tables = {record.name: record.table for record in suite.records}
    intensities = {}
    if "intensity" in table:
        measure = Intensity(**fields_of(table, "intensity", Intensity, "records."))
        intensities = {record.name: measure.of(record.motion) for record in suite.records}
        if weak := [name for name, value in intensities.items() if not value > 0]:
            raise InputError(f"records.intensity: record {weak[0]!r} has none in this component; give another")
    complete = {"motions": [*tables.values()], "scales": scales, "intensity": table.get("intensity")}
    return Records(tuple(axes), tables, intensities, complete)


def _suite(table: Mapping[str, Any], folder: Path | None, progress: Progress | None) -> Suite:
    if ("suite" in table) == ("motions" in table):
        raise InputError("records: give suite, the path of a suite file, or motions, a list of [[records.motions]]")
    if "suite" in table:
        if not isinstance(table["suite"], str):
            raise InputError(f"records.suite = {table['suite']!r}: give a path in quotes")
        path = (folder or Path()) / table["suite"]
        return load_suite(path if is_input(path) else table["suite"], progress)
    try:
        return suite_from_table({"records": table["motions"]}, folder, progress)
    except InputError as error:
        raise InputError(f"records.motions: {error}") from None


def _scales(values: Any) -> Axis:
    try:
        axis = grid(Axis("scale", "scale"), values)
    except InputError as error:
        raise InputError(f"records.scales: {error}") from None
    if not axis.numeric or min(axis.labels) <= 0:
        raise InputError(f"records.scales = {values!r}: give numbers above 0")
    return axis


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
    own = [_axis(name, axis, folder) for name, axis in _table(table, "axes").items()]
    axes = (*records.axes, *own)
    if len({axis.name for axis in axes}) < len(axes):
        raise InputError("axes: [records] makes the axes record and scale; give other names")
    sampling = _sampling(table, axes)
    keep = Keep(
        _texts(table, "keep", BUILDING_KEEP if "building" in scene else DEFAULT_KEEP),
        tuple((name, _formula(name, text)) for name, text in _table(table, "quantities").items()),
        (*(axis.name for axis in axes if axis.numeric), *([INTENSITY] if records.intensities else [])),
    )
    tables = records.tables
    if tables and "motion" not in scene:
        scene = {**scene, "motion": motion_of(next(iter(tables.values())))}
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
            given_chunk=None if table.get("chunk") is None else parsed(_CHUNK, table["chunk"], "chunk"),
            table=complete,
        )
    )


def _axis(name: str, table: Any, folder: Path | None) -> Axis:
    axis = axis_from(name, table)
    try:
        return located(axis, folder)
    except InputError as error:
        raise InputError(f"axes.{name}: {error}") from None


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
        table, path = scene_table(_beside(value, folder))
        folder = path.parent if path is not None else None
    elif isinstance(value, Mapping):
        table = dict(value)
    else:
        raise InputError(f"scene = {value!r}: give {KEYS['scene']}")
    return with_absolute_paths(table, folder)


def _beside(source: str, folder: Path | None) -> str:
    """A path in a study file as seen from here; names of presets as they are."""
    path = (folder or Path()) / source
    return str(path) if is_input(path) else source


def _sampling(table: Table, axes: tuple[Axis, ...]) -> Sampling | None:
    drawn = [axis.name for axis in axes if axis.random]
    if not drawn and "cells" not in table.get("sampling", {}):
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
