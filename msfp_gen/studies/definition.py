"""`Study`: the definition of a study, read from a TOML file or a table and checked before the first run.

A study file comes in; axes, the base scene and the kept columns go out, as tasks of a pool (`Task`) and as the scene of
any run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import resources
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from msfp_gen.common.aliases import Progress, SceneTable
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Choice, Quantity, check_fields, ruled_fields
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.inputs import Files, expecting, is_input, recording
from msfp_gen.results.dataset import columns as columns_of_system
from msfp_gen.results.quantities import ColumnSource, quantities
from msfp_gen.scene.file.catalogue import check_whole_numbers, known_keys, parsed
from msfp_gen.scene.file.changes import multiplied_table
from msfp_gen.scene.file.loader import Suite, load_suite, scene_table, suite_from_table, toml_file
from msfp_gen.scene.file.source import with_absolute_paths
from msfp_gen.scene.plausibility import doubts, target_doubts
from msfp_gen.scene.system import System
from msfp_gen.studies.axes import (
    INTENSITY,
    Axis,
    Distribution,
    Sampling,
    SceneFactory,
    StudyInputs,
    axis_from,
    grid,
    motion_of,
)
from msfp_gen.studies.bounding.factors import load_factors
from msfp_gen.studies.columns import Keep, usual_names

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion

MOST_RUNS = 100_000_000

TRIED = 1000  # numbers of one axis that are tried before the first run, at most; texts and tables are all tried
DOUBTED = 25  # numbers of one axis about which doubts are stated, at most; texts and tables are all judged
PARTS = 64  # parts of a study, at least, unless these would have fewer than LEAST runs
LEAST, MOST = 8, 256  # runs of a chunk where the study file does not give `chunk`
OF_RECORDS = ("record", "scale")  # names of axes that [records] reserves
RECORD_KEYS = ("suite", "motions", "scales", "intensity", "target")
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
_CHUNK = Quantity("", least=1, whole=True)


@dataclass(frozen=True)
class StudyLimits:
    """Limits of a study: the table `[limits]` of a study file.

    run_seconds: wall time after which a run ends with status `limit` [s]. failures: number of runs that may fail; one
    more ends the study, whose finished parts are kept. None: no limit. Raises InputError.
    """

    run_seconds: Annotated[float | None, Quantity("s", above=0.0)] = None
    failures: Annotated[int | None, Quantity("", least=0, whole=True)] = None

    def __post_init__(self) -> None:
        check_fields(self, "limits")


@dataclass(frozen=True)
class Task:
    """The runs of one chunk, as a worker receives them.

    Attributes:
        number: of the chunk, from 0.
        first: index of the first run, from 0.
        codes: for each gridded axis the index of the value of every run, ndarray, shape (runs,).
        drawn: values of the random axes, ndarray, shape (runs, random axes), [units of the axes].
    """

    number: int
    first: int
    codes: tuple[np.ndarray[Any, np.dtype[np.intp]], ...]
    drawn: Array

    def __len__(self) -> int:
        return len(self.drawn)

    def rows(self, axes: Sequence[Axis]) -> list[tuple[tuple[Any, ...], tuple[Any, ...]]]:
        """(values of the axes, their labels in the table) of every run."""
        codes, drawn = iter(self.codes), iter(self.drawn.T)
        values: list[Sequence[Any]] = []
        labels: list[Sequence[Any]] = []
        for axis in axes:
            if axis.values is None:
                values.append(next(drawn).tolist())
                labels.append(values[-1])
            else:
                indices = next(codes).tolist()
                values.append([axis.values[index] for index in indices])
                labels.append([axis.labels[index] for index in indices])
        if not axes:
            return [((), ())] * len(self)
        return list(zip(zip(*values, strict=True), zip(*labels, strict=True), strict=True))


@dataclass(frozen=True)
class Study:
    """The definition of a study.

    Attributes:
        name: a label.
        inputs: base scene, axes and records.
        sampling: how the random axes are drawn; None for a study without random axes.
        keep: the columns of each run.
        limits: of a run and of the study.
        given_chunk: runs of a chunk as given; None: `chunk` follows from the number of runs.
        table: the study as a plain table that contains scene and records.
        files: path -> sha256 of every file that was opened to make the scenes of all values.
        base: fingerprint of the scene of the first run and of the files that were opened for this scene.
        opened: (index of an axis, index of its value) -> fingerprint of the files that the value opens in addition.
    """

    name: str
    inputs: StudyInputs
    sampling: Sampling | None
    keep: Keep
    limits: StudyLimits
    given_chunk: int | None
    table: dict[str, Any]
    files: Files = field(default_factory=dict)
    base: str = ""
    opened: dict[tuple[int, int], str] = field(default_factory=dict)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes, in the order of the columns of the table."""
        return self.inputs.axes

    @property
    def distributions(self) -> list[Distribution]:
        """The distributions of the random axes."""
        return [axis.distribution for axis in self.axes if axis.distribution is not None]

    @cached_property
    def samples(self) -> Array:
        """Values of the random axes, ndarray, shape (samples, random axes), [units of the axes]; at least one row."""
        return np.zeros((1, 0)) if self.sampling is None else self.sampling.drawn(self.distributions)

    @cached_property
    def grid(self) -> tuple[int, ...]:
        """Numbers of values of the gridded axes, slowest first."""
        return tuple(len(axis.values) for axis in self.axes if axis.values is not None)

    @cached_property
    def cells(self) -> np.ndarray[Any, np.dtype[np.intp]] | None:
        """The combination of grid values of each sample, from 0, shape (samples,); None: each has all combinations."""
        cells = None if self.sampling is None else self.sampling.cells
        return None if cells is None else np.array(cells, dtype=np.intp) - 1

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the grid of runs, slowest first: of each gridded axis, then the number of samples."""
        return (len(self.samples),) if self.cells is not None else (*self.grid, len(self.samples))

    @property
    def runs(self) -> int:
        """Number of runs."""
        return prod(self.shape)

    @property
    def chunk(self) -> int:
        """Runs of a chunk."""
        if self.given_chunk is not None:
            return self.given_chunk
        wanted = max(self.runs // PARTS, 1)
        return min(max(1 << (wanted.bit_length() - 1), LEAST), MOST)

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.runs // self.chunk)

    def task(self, number: int) -> Task:
        """The runs of a chunk, numbered from 0."""
        first = number * self.chunk
        *codes, sample = np.unravel_index(np.arange(first, min(first + self.chunk, self.runs)), self.shape)
        if self.cells is not None:
            codes = list(np.unravel_index(self.cells[sample], self.grid)) if self.grid else []
        return Task(number, first, tuple(codes), self.samples[sample])

    @property
    def ends(self) -> list[System]:
        """The scenes of the first and the last run, which have the first and the last values of all gridded axes."""
        scenes = [self.scene(1)]
        with suppress(InputError):  # which becomes a row with its message
            scenes.append(self.scene(self.runs))
        return scenes

    def scene(self, run: int) -> System:
        """The scene of one run, by its number in the table, from 1. Raises InputError."""
        if not 1 <= run <= self.runs:
            raise InputError(f"run = {run}: give a number from 1 to {self.runs}")
        number, row = divmod(run - 1, self.chunk)
        values, _ = self.task(number).rows(self.axes)[row]
        with expecting(self.files):
            scene = SceneFactory(self.inputs).scene(values)
        return replace(scene, name=f"{self.name or 'study'}, run {run}")


def check_study(study: Study) -> Study:
    """Check a study; returns it with its quantities and the files that its scenes open.

    Values of each axis are tried in the base scene: all texts and tables, and of numbers many, with the least and the
    largest of a random axis. Raises InputError: a value that a scene does not accept, a name that occurs twice, or too
    many runs.
    """
    if study.runs > MOST_RUNS:
        raise InputError(f"axes: {study.runs} runs; give at most {MOST_RUNS}")
    if study.cells is not None and study.cells.max() >= prod(study.grid):
        raise InputError(f"sampling.cells has {study.cells.max() + 1}: the axes have {prod(study.grid)} combinations")
    with recording() as read:
        with prefixed("scene: "):
            factory = SceneFactory(study.inputs)
        for axis in study.axes:
            with prefixed(f"axes.{axis.name}."):
                _check_axis(axis, factory, bool(study.inputs.records))
        sources: dict[str, ColumnSource] = {}
        columns: dict[str, None] = {}
        first, base, opened = {}, "", {}
        for place, scene, files in _tried_scenes(study, factory):  # one scene in memory at a time: motions are long
            if place is None:
                first, base = files, fingerprint((scene, sorted(files.values())))
            elif additional := sorted(digest for path, digest in files.items() if path not in first):
                opened[place] = fingerprint(additional)
            sources = quantities(scene) | sources
            if study.keep.formulas:
                columns |= dict.fromkeys(columns_of_system(scene))
        kept = study.keep.names if "keep" in study.table else usual_names(sources)
        keep = replace(study.keep, names=kept, sources=tuple(sources.items()), history=tuple(columns))
        study = replace(study, keep=keep, files=read, base=base, opened=opened)
    reserved = [INTENSITY] if study.inputs.intensities else []
    names = [*reserved, *(axis.name for axis in study.axes), *(column.name for column in study.keep.columns)]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"{twice[0]}: this name occurs twice among axes, keep and quantities; give another")
    return study


def study_doubts(study: Study) -> list[tuple[str, list[str]]]:
    """The doubts about the values of a study: of its first run, and of this run with other values of one axis.

    Returns pairs of a name, "run 1" or an axis with its value, and the texts; of the target of the suite in each.
    """
    target = target_doubts(study.table.get("records", {}).get("target"))
    with expecting(study.files):
        tried = _tried_scenes(study, SceneFactory(study.inputs), DOUBTED)
        return [(_tried_name(study, place), [*target, *doubts(scene)]) for place, scene, _ in tried]


def _tried_name(study: Study, place: tuple[int, int] | None) -> str:
    """A tried scene in messages. place: indices of the axis and of its value, None of the first run."""
    if place is None:
        return "run 1"
    axis = study.axes[place[0]]
    value = axis.labels[place[1]] if axis.values is not None else ("least", "largest")[place[1]]
    return f"{axis.name} {value:.4g}" if isinstance(value, float) else f"{axis.name} {value}"


def _check_axis(axis: Axis, factory: SceneFactory, has_records: bool) -> None:
    """Raise InputError where an axis names a field or a surface that the base scene does not let it change."""
    for path in axis.paths if axis.change in ("sets", "multiplies") else ():
        if path.partition(".")[0] == "motion" and has_records:
            raise InputError(f"{axis.change} = {path!r}: [records] gives the motion; change it there")
        try:
            if axis.change == "multiplies" or axis.surfaces is not None:
                multiplied_table(factory.inputs.scene, path, 1.0, axis.surfaces)
        except InputError as error:
            raise InputError(f"{axis.change} = {path!r}: {str(error).removeprefix(f'{path}: ')}") from None
    count = min(len(bearing.surfaces) for bearing in factory.base.every_bearing)
    for surface in axis.surfaces or ():
        if surface > count:
            raise InputError(f"surfaces has {surface}: this bearing has surfaces 1 to {count}")


def _tried_scenes(
    study: Study, factory: SceneFactory, most: int = TRIED
) -> Iterator[tuple[tuple[int, int] | None, System, Files]]:
    """The scene of the first run, and for each tried value of an axis the scene with this value in the first run."""
    # Yields (index of the axis, index of the value), None for the first run; the scene; and the files that it opened.
    # most: numbers of one axis.
    (base, _), *_ = study.task(0).rows(study.axes)
    named = ", ".join(f"{axis.name} = {value!r:.40}" for axis, value in zip(study.axes, base, strict=True))
    yield None, *_scene_and_files(factory, base, f"run 1 ({named})")
    drawn = iter(study.samples.T)
    for index, axis in enumerate(study.axes):
        if axis.values is None:
            column = next(drawn)
            tried: list[tuple[int, Any]] = list(enumerate(sorted({float(column.min()), float(column.max())})))
        else:
            count = len(axis.values)
            numeric = all(isinstance(value, int | float) for value in axis.values)
            places = np.linspace(0, count - 1, min(count, most) if numeric else count).round().astype(int)
            tried = [(place, axis.values[place]) for place in places.tolist()]
        for place, value in tried:
            changed = (*base[:index], value, *base[index + 1 :])
            yield (index, place), *_scene_and_files(factory, changed, f"axes.{axis.name}: value {value!r}")


def _scene_and_files(factory: SceneFactory, values: Sequence[Any], where: str) -> tuple[System, Files]:
    """The scene of values of the axes, and the files that were opened for it. Raises InputError that names `where`."""
    with prefixed(f"{where}: "):
        with recording() as files:
            scene = factory.scene(values)
        scene.check_method()
    return scene, files


def fields_of(table: Mapping[str, Any], key: str, kind: type, where: str = "") -> dict[str, Any]:
    """The table at `key`, whose keys are fields of the dataclass `kind`; empty without `key`. Raises InputError."""
    inner = table.get(key, {})
    if not isinstance(inner, Mapping):
        raise InputError(f"{where}{key} = {inner!r}: give a table")
    known_keys(inner, [name for name, _, _ in ruled_fields(kind)], f"{where}{key}.")
    return dict(inner)


@dataclass(frozen=True)
class Intensity:
    """The intensity measure of a record: spectral pseudo-acceleration, or peak ground acceleration without a period.

    period [s], damping [-]: of the oscillator. component: of the spectrum. Raises InputError.
    """

    period: Annotated[float | None, Quantity("s", above=0.0)] = None
    damping: Annotated[float, Quantity("", above=0.0)] = 0.05
    component: Annotated[str, Choice(COMPONENTS)] = "geomean"

    def __post_init__(self) -> None:
        check_fields(self, "records.intensity")

    def of(self, motion: Motion) -> float:
        """The intensity measure of a motion [m/s^2]."""
        from msfp_gen.motions.records.spectrum import MEASURES, response_spectrum

        spectrum = response_spectrum(motion, [self.period or 1.0], damping=self.damping)
        values = spectrum.pga if self.period is None else spectrum.psa[0]
        return float(values[MEASURES.index(self.component)])


def _records(
    table: Any, folder: Path | None, progress: Progress | None
) -> tuple[list[Axis], dict[str, SceneTable], dict[str, float], SceneTable]:
    """Read a table `[records]`. folder: of the study file. Raises InputError."""
    # Returns four values, all empty for None: the axes `record` and, with scales, `scale`; name -> `[motion]` table
    # of a record, without the key `kind`, with absolute paths; name -> intensity measure at scale 1 [m/s^2], empty
    # without `intensity`; and the table `[records]` with motions in place of a suite file.
    if table is None:
        return [], {}, {}, {}
    if not isinstance(table, Mapping):
        raise InputError(f"records = {table!r}: give {NOUN}")
    known_keys(table, RECORD_KEYS, "records.")
    suite = _suite(table, folder, progress)
    axes = [grid(Axis("record", "record"), [record.name for record in suite.records])]
    if (scales := table.get("scales")) is not None:
        with prefixed("records.scales: "):
            axes.append(grid(Axis("scale", "scale"), scales))
        if not axes[1].numeric or min(axes[1].labels) <= 0:
            raise InputError(f"records.scales = {scales!r}: give numbers above 0")
    tables = {record.name: record.table for record in suite.records}
    intensities = {}
    if "intensity" in table:
        measure = Intensity(**fields_of(table, "intensity", Intensity, "records."))
        intensities = {record.name: measure.of(record.motion) for record in suite.records}
        if weak := [name for name, value in intensities.items() if not value > 0]:
            raise InputError(f"records.intensity: record {weak[0]!r} has none in this component; give another")
    complete = {
        "motions": [*tables.values()],
        "scales": scales,
        "intensity": table.get("intensity"),
        "target": suite.target or table.get("target"),  # of the factors, for reports; the motions have the factors
    }
    return axes, tables, intensities, complete


def _suite(table: Mapping[str, Any], folder: Path | None, progress: Progress | None) -> Suite:
    if ("suite" in table) == ("motions" in table):
        raise InputError("records: give suite, the path of a suite file, or motions, a list of [[records.motions]]")
    if "suite" in table:
        if not isinstance(table["suite"], str):
            raise InputError(f"records.suite = {table['suite']!r}: give a path in quotes")
        return load_suite(_beside(table["suite"], folder), progress)
    with prefixed("records.motions: "):
        return suite_from_table({"records": table["motions"]}, folder, progress)


def example_text() -> str:
    """The text of a small study file, to start from: a few hundred runs."""
    return (resources.files(__package__) / "example.toml").read_text(encoding="utf-8")


def load_study(source: str | Path | Mapping[str, Any], progress: Progress | None = None) -> Study:
    """Read and check the study in a TOML file, or in a table of the same keys. Paths in a file are relative to it.

    progress: of the scaling of a suite of records. Raises InputError of one line that names the file, the path of the
    field, the value and the remedy.
    """
    if isinstance(source, Mapping):
        return _study(source, None, progress)
    path = Path(source)
    if not is_input(path):
        raise InputError(f"study = {str(source)!r}: no such file; `msfp-gen study --example` prints one to start from")
    with prefixed(f"{path}: "):
        table = toml_file(path)
        # Of the folder of a study, whose paths are absolute: its records may lie beside it.
        return _study(table, path.resolve().parent.parent if "about" in table else path.parent, progress)


def _study(table: Mapping[str, Any], folder: Path | None, progress: Progress | None) -> Study:
    check_whole_numbers(table)
    known_keys(table, KEYS, "")
    if "scene" not in table:
        raise InputError(f"scene is missing: give {KEYS['scene']}")
    with recording():  # a file that changes from here to the end of the check is an error
        return _checked_study(table, folder, progress)


def _checked_study(table: Mapping[str, Any], folder: Path | None, progress: Progress | None) -> Study:
    scene = _scene(table["scene"], folder)
    record_axes, tables, intensities, record_table = _records(table.get("records"), folder, progress)
    named_axes = [axis_from(name, axis, folder) for name, axis in _table(table, "axes").items()]
    axes = (*record_axes, *named_axes)
    if record_axes and (taken := [axis.name for axis in named_axes if axis.name in OF_RECORDS]):
        raise InputError(f"axes.{taken[0]}: [records] makes the axes {' and '.join(OF_RECORDS)}; give another name")
    sampling = _sampling(table, axes)
    formulas = tuple(_table(table, "quantities").items())
    for name, text in formulas:
        if not isinstance(text, str):
            raise InputError(f"quantities.{name} = {text!r}: give a formula in quotes, such as 'peak_sliding_1 / 0.13'")
    names = table.get("keep", ())
    if not isinstance(names, list | tuple) or not all(isinstance(item, str) for item in names):
        raise InputError(f"keep = {names!r}: give {KEYS['keep']} in quotes")
    keep = Keep(
        tuple(names),
        formulas,
        (*(axis.name for axis in axes if axis.numeric), *([INTENSITY] if intensities else [])),
    )
    if tables and "motion" not in scene:
        scene = {**scene, "motion": motion_of(next(iter(tables.values())))}
    factors = {
        path: load_factors(_beside(path, folder)) for axis in axes if axis.change == "factors" for path in axis.paths
    }
    complete = {
        **{key: value for key, value in table.items() if key != "about"},
        "scene": scene,
        **({"records": record_table} if tables else {}),
        **(
            {"axes": {axis.name: _axis_table(axis, table["axes"][axis.name]) for axis in named_axes}}
            if named_axes
            else {}
        ),
    }
    return check_study(
        Study(
            name=str(table.get("name", "")),
            inputs=StudyInputs(scene, axes, tables, factors, intensities),
            sampling=sampling,
            keep=keep,
            limits=StudyLimits(**fields_of(table, "limits", StudyLimits)),
            given_chunk=None if table.get("chunk") is None else parsed(_CHUNK, table["chunk"], "chunk"),
            table=complete,
        )
    )


def _axis_table(axis: Axis, table: SceneTable) -> SceneTable:
    """The table of an axis for the copy of the study: values with absolute paths, labels as the study file has them."""
    if axis.values is None or list(axis.values) == table.get("values"):
        return table
    return {**table, "values": list(axis.values), "labels": list(axis.labels)} if "values" in table else table


def _table(table: Mapping[str, Any], key: str) -> SceneTable:
    """The table at a key of a study file; empty without the key. Raises InputError."""
    value = table.get(key, {})
    if not isinstance(value, Mapping):
        raise InputError(f"{key} = {value!r}: give {KEYS[key]}")
    return dict(value)


def _scene(value: Any, folder: Path | None) -> SceneTable:
    """The table of the base scene, with absolute paths, from the value of the key `scene`."""
    if isinstance(value, str):
        table, path = scene_table(_beside(value, folder))
        folder = path.parent if path is not None else None
    elif isinstance(value, Mapping):
        table = dict(value)
    else:
        raise InputError(f"scene = {value!r}: give {KEYS['scene']}")
    return with_absolute_paths(table, folder)


def _beside(source: str, folder: Path | None) -> str:
    """A path in a study file, relative to the working directory; the name of a preset stays as it is."""
    path = (folder or Path()) / source
    return str(path) if is_input(path) else source


def _sampling(table: Mapping[str, Any], axes: tuple[Axis, ...]) -> Sampling | None:
    random_axes = [axis.name for axis in axes if axis.random]
    if not random_axes and "cells" not in table.get("sampling", {}):
        if "sampling" in table:
            raise InputError("sampling: no axis has a distribution; leave it out")
        return None
    if "sampling" not in table:
        raise InputError(
            f"sampling is missing: axes.{random_axes[0]} has a distribution; give [sampling] with samples and seed"
        )
    return Sampling(**fields_of(table, "sampling", Sampling))
