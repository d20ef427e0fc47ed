"""`Study`: the definition of a study, checked, with the values of its axes for every run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import prod
from typing import Annotated, Any

import numpy as np

from msfp_gen.buildings import dataset as building_dataset
from msfp_gen.buildings.file import AnyScene
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, check_fields
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.inputs import Files, expecting, recording
from msfp_gen.results import dataset
from msfp_gen.scene.file.changes import multiplied_table
from msfp_gen.studies.batch import check_method
from msfp_gen.studies.columns import Counts, Keep
from msfp_gen.studies.study.axes import INTENSITY, Axis, Distribution, Recipe, Sampling, SceneFactory

MOST_RUNS = 100_000_000

TRIED = 1000  # numbers of one axis that are tried before the first run, at least; of texts and tables all
PARTS = 64  # that a small study has at least, unless these would have fewer than LEAST runs
LEAST, MOST = 8, 256  # runs of a chunk where the study file does not say


@dataclass(frozen=True)
class Limits:
    """Limits of a study.

    run_seconds: wall time of one run, after which it ends with status `limit` [s]. failures: runs that may fail; with
    more the study ends, which keeps what is done. None: no limit. Raises InputError.
    """

    run_seconds: Annotated[float | None, Quantity("s", above=0.0)] = None
    failures: Annotated[int | None, Quantity("", least=0, whole=True)] = None

    def __post_init__(self) -> None:
        check_fields(self, "limits")


@dataclass(frozen=True)
class Task:
    """The runs of one chunk, as workers receive them.

    Attributes:
        number: of the chunk, from 0.
        first: index of its first run, from 0.
        codes: of each grid axis, ndarray, shape (runs,): the indices of its values.
        drawn: values of the random axes, ndarray, shape (runs, random axes), [units of the axes].
    """

    number: int
    first: int
    codes: tuple[np.ndarray[Any, np.dtype[np.intp]], ...]
    drawn: Array

    def __len__(self) -> int:
        return len(self.drawn)

    def rows(self, axes: Sequence[Axis]) -> list[tuple[tuple[Any, ...], tuple[Any, ...]]]:
        """Of every run the values of the axes, and what the table shows for them."""
        codes, drawn = iter(self.codes), iter(self.drawn.T)
        values: list[Sequence[Any]] = []
        labels: list[Sequence[Any]] = []
        for axis in axes:
            if axis.values is None:
                values.append(next(drawn).tolist())
                labels.append(values[-1])
            else:
                chosen = next(codes).tolist()
                values.append([axis.values[code] for code in chosen])
                labels.append([axis.labels[code] for code in chosen])
        if not axes:
            return [((), ())] * len(self)
        return list(zip(zip(*values, strict=True), zip(*labels, strict=True), strict=True))


@dataclass(frozen=True)
class Study:
    """The definition of a study.

    Attributes:
        name: a label.
        recipe: base scene, axes and records.
        sampling: how the random axes are drawn; None without random axes.
        keep: the quantities of each run.
        limits: of a run, and of the study.
        given_chunk: runs of a chunk; None: from the number of runs.
        table: the study as a plain table, complete: scene and records are in it.
        files: path -> sha256 of every file that was opened to make the scenes of every value.
        base: fingerprint of the scene of the first run, with the files that were opened for it.
        opened: (index of an axis, index of its value) -> fingerprint of the files that were opened beyond these.
    """

    name: str
    recipe: Recipe
    sampling: Sampling | None
    keep: Keep
    limits: Limits
    given_chunk: int | None
    table: dict[str, Any]
    files: Files = field(default_factory=dict)
    base: str = ""
    opened: dict[tuple[int, int], str] = field(default_factory=dict)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes, in the order of the columns of the table."""
        return self.recipe.axes

    @property
    def distributions(self) -> list[Distribution]:
        """Those of the random axes."""
        return [axis.distribution for axis in self.axes if axis.distribution is not None]

    @cached_property
    def samples(self) -> Array:
        """Values of the random axes, ndarray, shape (samples, axes), [units of the axes]; one row without any."""
        return np.zeros((1, 0)) if self.sampling is None else self.sampling.drawn(self.distributions)

    @cached_property
    def grid(self) -> tuple[int, ...]:
        """Numbers of values of the axes that have some, slowest first."""
        return tuple(len(axis.values) for axis in self.axes if axis.values is not None)

    @cached_property
    def cells(self) -> np.ndarray[Any, np.dtype[np.intp]] | None:
        """The combination of values of each sample, from 0, shape (samples,); None: every sample has all of them."""
        cells = None if self.sampling is None else self.sampling.cells
        return None if cells is None else np.array(cells, dtype=np.intp) - 1

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the grid of runs, slowest first: one for each axis with values, then the samples."""
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

    def scene(self, run: int) -> AnyScene:
        """The scene of a run, numbered from 1 as in the table, to look at it alone. Raises InputError."""
        if not 1 <= run <= self.runs:
            raise InputError(f"run = {run}: give a number from 1 to {self.runs}")
        number, row = divmod(run - 1, self.chunk)
        values, _ = self.task(number).rows(self.axes)[row]
        with expecting(self.files):
            scene = SceneFactory(self.recipe).scene(values)
        return replace(scene, name=f"{self.name or 'study'}, run {run}")


def check_study(study: Study) -> Study:
    """The study with its quantities fitted to its bearings, and with the files that its scenes open. Raises InputError:
    a value that a scene does not accept, names that occur twice, or too many runs.

    Every text and table among the values of a grid, and the least and the largest number of an axis, is tried in the
    base scene.
    """
    if study.runs > MOST_RUNS:
        raise InputError(f"axes: {study.runs} runs; give at most {MOST_RUNS}")
    if study.cells is not None and study.cells.max() >= prod(study.grid):
        raise InputError(f"sampling.cells has {study.cells.max() + 1}: the axes have {prod(study.grid)} combinations")
    with recording() as files:
        study = _tried_study(replace(study, files=files))
    reserved = [INTENSITY] if study.recipe.intensities else []
    names = [*reserved, *(axis.name for axis in study.axes), *(column.name for column in study.keep.columns())]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"{twice[0]}: this name occurs twice among axes, keep and quantities; give another")
    return study


def _tried_study(study: Study) -> Study:
    """The study after all that `check_study` tries."""
    try:
        factory = SceneFactory(study.recipe)
    except InputError as error:
        raise InputError(f"scene: {error}") from None
    for axis in study.axes:
        try:
            _check_axis(axis, factory, bool(study.recipe.records))
        except InputError as error:
            raise InputError(f"axes.{axis.name}.{error}") from None
    counts = Counts()
    columns: dict[str, None] = {}
    first, base, opened = {}, "", {}
    for place, scene, files in _tried(study, factory):  # one after the other: their motions are long
        if place is None:
            first, base = files, fingerprint((scene, sorted(files.values())))
        elif own := sorted(digest for path, digest in files.items() if path not in first):
            opened[place] = fingerprint(own)
        counts = counts.or_more(Counts.of(scene))
        if study.keep.formulas:
            columns |= dict.fromkeys(_columns(scene))
    keep = replace(study.keep, counts=counts, history=tuple(columns))
    return replace(study, keep=keep, base=base, opened=opened)


def _columns(scene: AnyScene) -> Iterable[str]:
    """Of the history of a run, as in an exported file."""
    if isinstance(scene, BuildingScene):
        return building_dataset.columns(scene)
    return dataset.columns(scene)


def _check_axis(axis: Axis, factory: SceneFactory, has_records: bool) -> None:
    """Raise InputError where an axis cannot change the base scene."""
    for path in axis.paths if axis.change in ("sets", "multiplies") else ():
        if path.partition(".")[0] == "motion" and has_records:
            raise InputError(f"{axis.change} = {path!r}: [records] gives the motion; change it there")
        try:
            if axis.change == "multiplies" or axis.surfaces is not None:
                multiplied_table(factory.recipe.scene, path, 1.0, axis.surfaces)
        except InputError as error:
            raise InputError(f"{axis.change} = {path!r}: {str(error).removeprefix(f'{path}: ')}") from None
    count = min(len(bearing.surfaces) for bearing in factory.base.every_bearing)
    for surface in axis.surfaces or ():
        if surface > count:
            raise InputError(f"surfaces has {surface}: this bearing has surfaces 1 to {count}")


def _tried(study: Study, factory: SceneFactory) -> Iterator[tuple[tuple[int, int] | None, AnyScene, Files]]:
    """The scenes of the first run, and of every value of each axis with the first values of the others.

    Yields the indices of the axis and of its value, None for the first run; the scene, and the files that it opened.
    """
    (base, _), *_ = study.task(0).rows(study.axes)
    named = ", ".join(f"{axis.name} = {value!r:.40}" for axis, value in zip(study.axes, base, strict=True))
    yield None, *_made(factory, base, f"run 1 ({named})")
    drawn = iter(study.samples.T)
    for index, axis in enumerate(study.axes):
        if axis.values is None:
            column = next(drawn)
            tried: list[tuple[int, Any]] = list(enumerate(sorted({float(column.min()), float(column.max())})))
        else:
            numeric = all(isinstance(value, int | float) for value in axis.values)
            tried = list(enumerate(axis.values))[:: max(1, len(axis.values) // TRIED) if numeric else 1]
        for place, value in tried:
            changed = (*base[:index], value, *base[index + 1 :])
            yield (index, place), *_made(factory, changed, f"axes.{axis.name}: value {value!r}")


def _made(factory: SceneFactory, values: Sequence[Any], where: str) -> tuple[AnyScene, Files]:
    try:
        with recording() as files:
            scene = factory.scene(values)
        check_method(scene)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return scene, files
