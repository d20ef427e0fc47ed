"""The runs of an estimate: a number of draws comes in, values of a model at the first draws go out.

A draw is a combination of the values of the gridded axes, all equally likely, and one value of each random axis. Draw k
is the same for every model and in every call. The runs of each model are a study of its own in a folder.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from msfp_gen.common.arrays import Array, Flags, Indices
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.studies.assessment.rows import COMPLETE, column_numbers, read_study
from msfp_gen.studies.axes import Sampling, SceneFactory, values_at
from msfp_gen.studies.definition import Study
from msfp_gen.studies.estimation.estimators import EXACT
from msfp_gen.studies.run import STUDY_FILE, parts_in, readable_parts, run_on, study_table
from msfp_gen.studies.workers import Pool

DISPLACEMENT = "peak_displacement"  # with it a regression follows forces that are no line of the cheap ones
BLOCK = 1024  # draws that are made together
CHUNKS = {EXACT: 4, "equivalent": 64}  # model -> runs of a part
CHUNK = 8  # runs of a part of any other model
MEASURED = 4  # parts from which the cost of a run is computed


class ModelRuns(Protocol):
    """Runs of several models on the same draws.

    levels: names of the models, the exact model first. population: number of draws that exist; None: unlimited.
    """

    levels: tuple[str, ...]
    population: int | None

    def values(self, level: str, count: int) -> tuple[Array, Flags]:
        """The quantity at the first draws, shape (count,) [its unit], and which runs ended early, shape (count,).

        A cheap model may give further quantities beside it, then shape (count, k). Missing runs are computed.
        The quantity of a run that ended early is the value until then; it is infinite where a run has no value, and an
        exact run without one has ended early.
        """

    def cost(self, level: str) -> float:
        """Core time of a run of a model, as measured [s]."""

    def spent(self) -> tuple[float, dict[str, int]]:
        """Core time of all runs [s], and model -> number of its runs."""


class Draws:
    """The random draws of a study; equal for equal seeds.

    Attributes:
        cells: number of combinations of the values of the gridded axes.
        population: number of draws that exist, where there is no random axis; else None.
    """

    def __init__(self, study: Study, seed: int) -> None:
        self.study, self.seed = study, seed
        self.cells = int(np.prod(study.grid))
        self.population = None if study.distributions else self.cells
        self._blocks: dict[int, tuple[Indices, Array]] = {}
        self._order = np.random.default_rng([seed, 0]).permutation(self.cells) if self.population else None

    def of(self, numbers: Indices) -> tuple[Indices, Array]:
        """Draws by number, shape (draws,): their combinations, from 0, shape (draws,), and values of the random axes.

        The values have shape (draws, random axes) [units of the axes].
        """
        if self._order is not None:
            return self._order[numbers], np.zeros((len(numbers), 0))
        cells, values = zip(
            *(self._block(int(block)) for block in range(int(numbers.max(initial=0)) // BLOCK + 1)), strict=True
        )
        return np.concatenate(cells)[numbers], np.concatenate(values)[numbers]

    def _block(self, block: int) -> tuple[Indices, Array]:
        if block not in self._blocks:
            rng = np.random.default_rng([self.seed, block + 1])
            cells = rng.integers(self.cells, size=BLOCK)
            shares = rng.random((BLOCK, len(self.study.distributions)))
            self._blocks[block] = cells, values_at(shares, self.study.distributions)
        return self._blocks[block]


class StudyModelRuns:
    """The source of a study: exact runs are in the folder of the study, runs of each other model in a folder within.

    progress: called with the name of a model and the number of draws, before `values` of these draws.
    """

    def __init__(
        self, study: Study, folder: Path, quantity: str, levels: Sequence[str], seed: int, pool: Pool,
        progress: Callable[[str, int], None] | None = None,
    ) -> None:  # fmt: skip
        self.levels = tuple(levels)
        self.draws = Draws(study, seed)
        self.population = self.draws.population
        check_quantity(study, quantity, levels)
        folders = {level: folder if level == EXACT else folder / level for level in levels}
        self._models = {
            level: _Model(
                level_study(study, level, quantity),
                own_folder,
                quantities_of_model(study, level, quantity),
                self.draws,
                pool,
                exact=level == EXACT,
            )
            for level, own_folder in folders.items()
        }
        self._progress = progress

    def values(self, level: str, count: int) -> tuple[Array, Flags]:
        """See `ModelRuns`."""
        if self._progress is not None:
            self._progress(level, count)
        return self._models[level].values(count)

    def cost(self, level: str) -> float:
        """See `ModelRuns`."""
        return self._models[level].cost()

    def spent(self) -> tuple[float, dict[str, int]]:
        """See `ModelRuns`."""
        runs = {level: model.count for level, model in self._models.items() if model.count}
        return sum(count * self.cost(level) for level, count in runs.items()), runs


class _Model:
    """The runs of one model at the first `count` draws, kept as a study in a folder."""

    def __init__(
        self, study: Study, folder: Path, names: Sequence[str], draws: Draws, pool: Pool, *, exact: bool
    ) -> None:
        self.study, self.folder, self.names, self.draws, self.pool, self.exact = (
            study, folder, names, draws, pool, exact,
        )  # fmt: skip
        self.count = 0
        if (folder / STUDY_FILE).is_file():
            self.count = int(study_table(folder).get("accuracy", {}).get("draws", 0))
        self._values, self._early = np.zeros(0), np.zeros(0, dtype=bool)

    def values(self, count: int) -> tuple[Array, Flags]:
        if count > len(self._values):
            self.count = max(count, self.count)
            self._run()
        return self._values[:count], self._early[:count]

    def _run(self) -> None:
        run_on(self.pool, self._listed_study(), self.folder)
        rows = read_study(self.folder, list(self.names))
        values = np.stack([column_numbers(rows, name) for name in self.names], axis=1)
        values = values[:, 0] if len(self.names) == 1 else values
        complete = np.asarray(rows["status"] == COMPLETE)
        if len(values) < self.count:
            raise RunError(f"{self.folder}: {self.count - len(values)} runs are missing; run the same command again")
        self._values = np.where(np.isnan(values), np.inf, values)
        self._early = ~complete | (self.exact & np.isnan(values.reshape(len(values), -1)[:, 0]))

    def _listed_study(self) -> Study:
        """The study whose rows are the runs."""
        cells, values = self.draws.of(np.arange(self.count))
        sampling = Sampling(
            "listed",
            values=tuple(map(tuple, values.tolist())) if values.shape[1] else None,
            cells=tuple((cells + 1).tolist()),
        )
        listing = {"method": "listed", "cells": list(sampling.cells or ())}
        listing |= {"values": values.tolist()} if values.shape[1] else {}
        accuracy = {**self.study.table.get("accuracy", {}), "draws": self.count}
        return replace(
            self.study, sampling=sampling, table={**self.study.table, "sampling": listing, "accuracy": accuracy}
        )

    def cost(self) -> float:
        """Core time of a run [s]: median over the first parts, so that later runs do not change it.

        The mean would be too large: in its first part a process builds or loads the model.
        """
        import pyarrow.parquet as pq

        seconds = []
        for name, _ in sorted(parts_in(self.folder).items(), key=lambda part: part[1])[:MEASURED]:
            with readable_parts(self.folder / name):
                schema = pq.read_metadata(self.folder / name)
            seconds.append(float((schema.metadata or {})[b"seconds"]) / schema.num_rows)
        return float(np.median(seconds))


def level_study(study: Study, level: str, quantity: str) -> Study:
    """The study of one model: the exact model keeps all its quantities, any other keeps `quantities_of_model`."""
    chunk = CHUNKS.get(level, CHUNK)
    if level == EXACT:
        return replace(study, given_chunk=study.given_chunk or chunk)
    scene = {**study.inputs.scene, "fidelity": level}
    formulas = tuple((name, text) for name, text in study.keep.formulas if name == quantity)
    names = [name for name in quantities_of_model(study, level, quantity) if name not in dict(formulas)]
    keep = replace(study.keep, names=tuple(names), formulas=formulas)
    table = {key: value for key, value in study.table.items() if key not in ("keep", "quantities")}
    table |= {"scene": scene, "keep": list(keep.names), "quantities": dict(formulas)}
    return replace(study, inputs=replace(study.inputs, scene=scene), keep=keep, table=table, given_chunk=chunk)


def quantities_of_model(study: Study, level: str, quantity: str) -> list[str]:
    """The quantities that a model gives: the quantity, and of a cheap model the peak displacement beside it."""
    second = level != EXACT and quantity != DISPLACEMENT and DISPLACEMENT in study.keep.known
    return [quantity, DISPLACEMENT] if second else [quantity]


def check_quantity(study: Study, quantity: str, levels: Sequence[str]) -> None:
    """Raise InputError: the study does not keep the quantity, or a model lacks the quantity or refuses the scene."""
    if quantity not in study.keep.numbers:
        kept = ", ".join(study.keep.numbers)
        raise InputError(f"quantity = {quantity!r}: the study keeps {kept}; give one, or add it to keep")
    SceneFactory(study.inputs)
    for level in levels:
        if level != EXACT:
            SceneFactory(replace(study.inputs, scene={**study.inputs.scene, "fidelity": level}))
