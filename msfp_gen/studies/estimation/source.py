"""The runs of an estimate: numbers of draws come in, values of a model at these draws go out.

A draw is a combination of the values of the gridded axes, all equally likely, and one value of each random axis. Draw k
is the same for every model and in every call. The runs of each model are a study of its own in a folder.

For a fragility, `Searches` takes the place of a run: it finds the intensity at which the quantity of a draw reaches a
threshold. The runs of a search are at scales of the study. They close in on the two neighbouring scales between which
the quantity reaches the threshold, and a power law between the two gives the crossing (in the manner of the IDA curves
of Vamvatsikos and Cornell, 2002).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.specification import formula
from msfp_gen.studies.assessment.rows import COMPLETE, numbers, read_study
from msfp_gen.studies.axes import Sampling, SceneFactory, values_at
from msfp_gen.studies.batch import Pool
from msfp_gen.studies.columns import Keep
from msfp_gen.studies.definition import Study
from msfp_gen.studies.estimation.backbone_run import OF_SURFACES, QUANTITIES, check_backbone
from msfp_gen.studies.estimation.estimators import EXACT, Flags, Indices
from msfp_gen.studies.run import STUDY_FILE, parts_in, readable_parts, run_on, study_table

BLOCK = 1024  # draws that are made together
CHUNKS = {EXACT: 4, "backbone": 64}  # model -> runs of a part
CHUNK = 8  # runs of a part of any other model
MEASURED = 4  # parts from which the cost of a run is computed


class Source(Protocol):
    """Runs of several models on the same draws.

    levels: names of the models, the exact model first. population: number of draws that exist; None: unlimited.
    """

    levels: tuple[str, ...]
    population: int | None

    def values(self, level: str, draws: Indices, scales: Indices | None = None) -> tuple[Array, Flags]:
        """The quantity at draws, shape (draws,) [its unit], and which runs ended early, shape (draws,).

        Missing runs are computed. The quantity of a run that ended early is the value until then; it is infinite where
        a run has no value. scales: index of the scale of each run, shape (draws,), in place of the scale of its draw.
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

    def intensity(self, numbers: Indices) -> Array:
        """The intensity of draws at scale 1, shape (draws,) [m/s^2]; 1 where the study has no intensity."""
        of_record = self.study.recipe.intensities
        if not of_record:
            return np.ones(len(numbers))
        gridded = [axis for axis in self.study.axes if axis.values is not None]
        position = [axis.name for axis in gridded].index("record")
        records = np.unravel_index(self.of(numbers)[0], self.study.grid)[position]
        return np.array([of_record[(gridded[position].values or ())[record]] for record in records])


class StudySource:
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
            level: _Model(level_study(study, level, quantity), own_folder, quantity, self.draws, pool)
            for level, own_folder in folders.items()
        }
        self._progress = progress

    def values(self, level: str, draws: Indices, scales: Indices | None = None) -> tuple[Array, Flags]:
        """As of `Source`."""
        if self._progress is not None:
            self._progress(level, len(draws))
        return self._models[level].values(draws, scales)

    def cost(self, level: str) -> float:
        """As of `Source`."""
        return self._models[level].cost()

    def spent(self) -> tuple[float, dict[str, int]]:
        """As of `Source`."""
        runs = {level: len(model.listed) for level, model in self._models.items() if model.listed}
        return sum(count * self.cost(level) for level, count in runs.items()), runs


class _Model:
    """The runs of one model, kept as a study in a folder.

    listed: (draw, index of the scale in place of the scale of the draw, or -1) of every row, in the order of requests.
    """

    def __init__(self, study: Study, folder: Path, quantity: str, draws: Draws, pool: Pool) -> None:
        self.study, self.folder, self.quantity, self.draws, self.pool = study, folder, quantity, draws, pool
        self.listed: list[tuple[int, int]] = []
        if (folder / STUDY_FILE).is_file():
            listed = study_table(folder).get("accuracy", {}).get("listed", [])
            self.listed = [(int(draw), int(scale)) for draw, scale in listed]
        self._values, self._early = np.zeros(0), np.zeros(0, dtype=bool)

    def values(self, draws: Indices, scales: Indices | None) -> tuple[Array, Flags]:
        pairs = list(zip(draws.tolist(), [-1] * len(draws) if scales is None else scales.tolist(), strict=True))
        present = set(self.listed)
        if (missing := [pair for pair in dict.fromkeys(pairs) if pair not in present]) or not len(self._values):
            self.listed += missing
            self._run()
        row_of = {pair: row for row, pair in enumerate(self.listed)}
        rows = [row_of[pair] for pair in pairs]
        return self._values[rows], self._early[rows]

    def _run(self) -> None:
        run_on(self.pool, self._listed_study(), self.folder)
        rows = read_study(self.folder, [self.quantity])
        values = numbers(rows, self.quantity)
        complete = np.asarray(rows["status"] == COMPLETE)
        if len(values) < len(self.listed):
            raise RunError(
                f"{self.folder}: {len(self.listed) - len(values)} runs are missing; run the same command again"
            )
        self._values = np.where(np.isnan(values), np.inf, values)
        self._early = ~complete | np.isnan(values)

    def _listed_study(self) -> Study:
        """The study whose rows are the listed runs."""
        draws, scales = (np.array(column, dtype=np.intp) for column in zip(*self.listed, strict=True))
        cells, values = self.draws.of(draws)
        if (scales >= 0).any():
            cells = _with_scales(self.study, cells, scales)
        sampling = Sampling(
            "listed",
            values=tuple(map(tuple, values.tolist())) if values.shape[1] else None,
            cells=tuple((cells + 1).tolist()),
        )
        listing = {"method": "listed", "cells": list(sampling.cells or ())}
        listing |= {"values": values.tolist()} if values.shape[1] else {}
        accuracy = {**self.study.table.get("accuracy", {}), "listed": [list(pair) for pair in self.listed]}
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


def _with_scales(study: Study, cells: Indices, scales: Indices) -> Indices:
    """The combinations with these values of the axis `scale`, by index; where the index is -1, as they are."""
    names = [axis.name for axis in study.axes if axis.values is not None]
    positions = list(np.unravel_index(cells, study.grid))
    axis = names.index("scale")
    positions[axis] = np.where(scales >= 0, scales, positions[axis])
    return np.asarray(np.ravel_multi_index(positions, study.grid))


def level_study(study: Study, level: str, quantity: str) -> Study:
    """The study of one model: the exact model keeps all quantities of the study, any other this quantity alone."""
    chunk = CHUNKS.get(level, CHUNK)
    if level == EXACT:
        return replace(study, given_chunk=study.given_chunk or chunk)
    scene = {**study.recipe.scene, "fidelity": level}
    formulas = tuple((name, text) for name, text in study.keep.formulas if name == quantity)
    keep = replace(study.keep, names=() if formulas else (quantity,), formulas=formulas)
    table = {key: value for key, value in study.table.items() if key not in ("keep", "quantities")}
    table |= {"scene": scene, "keep": list(keep.names), "quantities": dict(formulas)}
    return replace(study, recipe=replace(study.recipe, scene=scene), keep=keep, table=table, given_chunk=chunk)


def check_quantity(study: Study, quantity: str, levels: Sequence[str]) -> None:
    """Raise InputError: the study does not keep the quantity, or a model lacks the quantity or refuses the scene."""
    if quantity not in study.keep.numbers:
        kept = ", ".join(study.keep.numbers)
        raise InputError(f"quantity = {quantity!r}: the study keeps {kept}; give one, or add it to keep")
    factory = SceneFactory(study.recipe)
    for level in levels:
        if level == "backbone":
            check_backbone(factory.base)
            known = {*QUANTITIES, *study.keep.axes}
            known |= {name for name in study.keep.known if name.rpartition("_")[0] in OF_SURFACES}
            if missing := [name for name in _names_in(study.keep, quantity) if name not in known]:
                raise InputError(
                    f"quantity = {quantity!r}: {missing[0]} is none of the model 'backbone'; give another quantity, or "
                    "accuracy.models = ['massless']"
                )
        elif level != EXACT:
            SceneFactory(replace(study.recipe, scene={**study.recipe.scene, "fidelity": level}))


def _names_in(keep: Keep, quantity: str) -> list[str]:
    """The quantities in the formula of a quantity; the name itself where it has no formula."""
    text = dict(keep.formulas).get(quantity)
    if text is None:
        return [quantity]
    if "(" in text and any(f"{word}(" in text for word in ("peak", "least", "most", "last")):
        return [text]
    return sorted(formula.names_in(formula.parse(text, [*keep.known, *keep.axes])))


@dataclass(frozen=True)
class Crossings:
    """The scales at which the quantity of draws reaches a threshold.

    logarithms: of the scales, shape (draws,) [-]. beyond: number of crossings outside the scales of the study. runs:
    number of runs of all searches.
    """

    logarithms: Array
    beyond: int
    runs: int


def crossings(source: Source, level: str, draws: Indices, scales: Array, threshold: float, guess: Array) -> Crossings:
    """Search the scales at which the quantity of draws reaches a threshold.

    scales: rising, shape (k,) [-]. guess: logarithm of the scale at which each search begins, shape (draws,) [-].
    """
    count = len(scales)
    # Indices of scales next to each crossing: the quantity is below the threshold at `low`, at or above it at `high`.
    low, high = np.full(len(draws), -1), np.full(len(draws), count)
    values = np.full((len(draws), count), np.nan)
    upcoming = np.searchsorted(np.log(scales), guess).clip(0, count - 1)
    runs = 0
    while (unfinished := np.flatnonzero(high - low > 1)).size:
        at = upcoming[unfinished]
        reached, early = source.values(level, draws[unfinished], at)
        values[unfinished, at] = np.where(early & (reached < threshold), np.inf, reached)
        runs += len(unfinished)
        exceeds = values[unfinished, at] >= threshold
        high[unfinished] = np.where(exceeds, np.minimum(at, high[unfinished]), high[unfinished])
        low[unfinished] = np.where(exceeds, low[unfinished], np.maximum(at, low[unfinished]))
        upcoming = _next_scale(low, high, upcoming, count)
    logarithms = np.array(
        [_crossing(np.log(scales), row, lo, hi, threshold) for row, lo, hi in zip(values, low, high, strict=True)]
    )
    return Crossings(logarithms, int(((low < 0) | (high >= count)).sum()), runs)


def _next_scale(low: Indices, high: Indices, last: Indices, count: int) -> Indices:
    """Index of the scale to run next: beside the last scale until the crossing is enclosed, then in the middle."""
    beside = np.where(last == low, low + 1, high - 1)
    middle = (low + high) // 2
    enclosed = (low >= 0) & (high < count)
    return np.where(enclosed, middle, beside).clip(0, count - 1)


def _crossing(logs: Array, values: Array, low: int, high: int, threshold: float) -> float:
    """Logarithm of the scale of a crossing, by a power law between two neighbours.

    logs: logarithms of the scales. values: of the quantity at the scales. low, high: indices of the neighbours. Beyond
    the scales the crossing is half a step from the last scale; where no power law exists, in the middle.
    """
    if low < 0:
        return float(logs[0] - (logs[1] - logs[0]) / 2)
    if high >= len(logs):
        return float(logs[-1] + (logs[-1] - logs[-2]) / 2)
    below, above = values[low], values[high]
    if not np.isfinite(above) or not 0 < below < above:
        return float((logs[low] + logs[high]) / 2)
    share = np.log(threshold / below) / np.log(above / below)
    return float(logs[low] + share * (logs[high] - logs[low]))


class Searches:
    """A source whose value at a draw is the logarithm of the intensity at which its quantity reaches a threshold.

    source: of the runs of a search. scales: of the study, rising, shape (k,) [-]. intensity: draws -> logarithm of the
    intensity at scale 1. beyond: number of exact crossings outside the scales.
    """

    def __init__(self, source: Source, threshold: float, scales: Array, intensity: Callable[[Indices], Array]) -> None:
        self.source, self.threshold, self.scales, self.intensity = source, threshold, scales, intensity
        self.levels, self.population = source.levels, source.population
        self.beyond = 0
        self._values: dict[str, dict[int, float]] = {level: {} for level in source.levels}
        self._runs = dict.fromkeys(source.levels, 0)

    def values(self, level: str, draws: Indices, scales: Indices | None = None) -> tuple[Array, Flags]:
        """Logarithms of the intensities of the crossings, shape (draws,) [-]; no search ends early."""
        crossed = self._values[level]
        new = np.array([draw for draw in draws.tolist() if draw not in crossed], dtype=np.intp)
        if new.size:
            found = crossings(self.source, level, new, self.scales, self.threshold, self._guess(level, new))
            self._runs[level] += found.runs
            self.beyond += found.beyond if level == EXACT else 0
            crossed.update(zip(new.tolist(), found.logarithms.tolist(), strict=True))
        logarithms = np.array([crossed[draw] for draw in draws.tolist()])
        return logarithms + self.intensity(draws), np.zeros(len(draws), dtype=bool)

    def _guess(self, level: str, draws: Indices) -> Array:
        """Logarithm of the scale at which each search begins, shape (draws,) [-].

        For the exact model it is the crossing of the first cheaper model that has any, shifted by the median
        difference of the two models so far; for any other model the middle of the scales.
        """
        middle = float(np.log(self.scales[len(self.scales) // 2]))
        cheaper = next((name for name in self.levels[1:] if self._values[name] and name != level), None)
        if level != EXACT or cheaper is None:
            return np.full(len(draws), middle)
        crossed = self._values[cheaper]
        shifts = [value - crossed[draw] for draw, value in self._values[level].items() if draw in crossed]
        shift = float(np.median(shifts)) if shifts else 0.0
        return np.array([crossed.get(draw, middle) + shift for draw in draws.tolist()])

    def cost(self, level: str) -> float:
        """Core time of the search of a draw [s]."""
        return self.source.cost(level) * self._runs[level] / max(len(self._values[level]), 1)

    def spent(self) -> tuple[float, dict[str, int]]:
        """As of `Source`."""
        return self.source.spent()
