"""Draws of a study, and the runs of its models on them: each model is a study of its own, kept in a folder.

A draw is a combination of the values of the axes with values, each as likely as any other, and a value of each random
axis. Draw k is the same for every model, in every call.

For a fragility a run is the search for the intensity at which the quantity of a draw reaches a threshold. The runs of
the search are at the scales of the study. They close in on the two neighbours between which the threshold lies, and
power laws between neighbours give the crossing (Vamvatsikos and Cornell, 2002, trace and fill an IDA curve alike).
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
from msfp_gen.studies.assessment.rows import numbers, read_study
from msfp_gen.studies.axes import Sampling, SceneFactory, values_at
from msfp_gen.studies.batch import Pool
from msfp_gen.studies.columns import Keep
from msfp_gen.studies.definition import Study
from msfp_gen.studies.estimation.backbone_run import OF_SURFACES, QUANTITIES, check_backbone
from msfp_gen.studies.estimation.estimators import EXACT, Flags, Indices
from msfp_gen.studies.run import STUDY_FILE, parts_in, readable_parts, run_on, study_table

BLOCK = 1024  # draws that are made together
CHUNKS = {EXACT: 4, "backbone": 64}  # runs of a part; of other models
CHUNK = 8
MEASURED = 4  # parts of which the cost of a run is taken
ENDED = "ok"


class Source(Protocol):
    """What an estimate needs: runs of several models on the same draws.

    levels: names, exact first. population: how many draws there are; None: no end of them.
    """

    levels: tuple[str, ...]
    population: int | None

    def values(self, level: str, draws: Indices, scales: Indices | None = None) -> tuple[Array, Flags]:
        """The quantity at draws, shape (draws,) [its unit], computed if need be; which ended early: what they reached.

        Infinite where a run has none. scales: index of the value of the axis `scale` of each run, in place of that of
        the draw.
        """

    def cost(self, level: str) -> float:
        """Seconds of a run, as measured."""

    def spent(self) -> tuple[float, dict[str, int]]:
        """Seconds of all runs, and their number by model."""


class Draws:
    """The random draws of a study; equal for equal seeds."""

    def __init__(self, study: Study, seed: int) -> None:
        self.study, self.seed = study, seed
        self.cells = int(np.prod(study.grid))
        self.population = None if study.distributions else self.cells
        self._blocks: dict[int, tuple[Indices, Array]] = {}
        self._order = np.random.default_rng([seed, 0]).permutation(self.cells) if self.population else None

    def of(self, numbers: Indices) -> tuple[Indices, Array]:
        """Of draws by number, (draws,): the combination, from 0, and values of the random axes [units of the axes]."""
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
        """The intensity of draws at scale 1, shape (draws,), [m/s^2]; ones where the study has none."""
        measures = self.study.recipe.intensities
        if not measures:
            return np.ones(len(numbers))
        gridded = [axis for axis in self.study.axes if axis.values is not None]
        place = [axis.name for axis in gridded].index("record")
        codes = np.unravel_index(self.of(numbers)[0], self.study.grid)[place]
        return np.array([measures[(gridded[place].values or ())[code]] for code in codes])


class StudySource:
    """The models of a study; exact runs are in its folder, those of others in folders within it."""

    def __init__(
        self, study: Study, folder: Path, quantity: str, levels: Sequence[str], seed: int, pool: Pool,
        progress: Callable[[str, int], None] | None = None,
    ) -> None:  # fmt: skip
        self.levels = tuple(levels)
        self.draws = Draws(study, seed)
        self.population = self.draws.population
        check_quantity(study, quantity, levels)
        places = {level: folder if level == EXACT else folder / level for level in levels}
        self._models = {
            level: _Model(level_study(study, level, quantity), place, quantity, self.draws, pool)
            for level, place in places.items()
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
    """The runs of one model: (draw, index of its scale or -1) of every row, as they were asked for."""

    def __init__(self, study: Study, folder: Path, quantity: str, draws: Draws, pool: Pool) -> None:
        self.study, self.folder, self.quantity, self.draws, self.pool = study, folder, quantity, draws, pool
        self.listed: list[tuple[int, int]] = []
        if (folder / STUDY_FILE).is_file():
            kept = study_table(folder).get("accuracy", {}).get("listed", [])
            self.listed = [(int(draw), int(scale)) for draw, scale in kept]
        self._reached, self._early = np.zeros(0), np.zeros(0, dtype=bool)

    def values(self, draws: Indices, scales: Indices | None) -> tuple[Array, Flags]:
        pairs = list(zip(draws.tolist(), [-1] * len(draws) if scales is None else scales.tolist(), strict=True))
        present = set(self.listed)
        if (missing := [pair for pair in dict.fromkeys(pairs) if pair not in present]) or not len(self._reached):
            self.listed += missing
            self._run()
        place = {pair: row for row, pair in enumerate(self.listed)}
        rows = [place[pair] for pair in pairs]
        return self._reached[rows], self._early[rows]

    def _run(self) -> None:
        study = self._complete()
        run_on(self.pool, study, self.folder)
        rows = read_study(self.folder, [self.quantity])
        values = numbers(rows, self.quantity)
        ended = np.asarray(rows["status"] == ENDED)
        if len(values) < len(self.listed):
            raise RunError(
                f"{self.folder}: {len(self.listed) - len(values)} runs are missing; run the same command again"
            )
        self._reached = np.where(np.isnan(values), np.inf, values)
        self._early = ~ended | np.isnan(values)

    def _complete(self) -> Study:
        """The study of all rows that were asked for."""
        numbers_, scales = (np.array(column, dtype=np.intp) for column in zip(*self.listed, strict=True))
        cells, values = self.draws.of(numbers_)
        if (scales >= 0).any():
            cells = _scaled(self.study, cells, scales)
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
        """Median over the first parts of their seconds of a core for each run, so that it stays the same.

        Not the mean: in its first part a process builds or loads the model.
        """
        import pyarrow.parquet as pq

        seconds = []
        for name, _ in sorted(parts_in(self.folder).items(), key=lambda part: part[1])[:MEASURED]:
            with readable_parts(self.folder / name):
                schema = pq.read_metadata(self.folder / name)
            seconds.append(float((schema.metadata or {})[b"seconds"]) / schema.num_rows)
        return float(np.median(seconds))


def _scaled(study: Study, cells: Indices, scales: Indices) -> Indices:
    """The combinations with another value of the axis `scale`."""
    names = [axis.name for axis in study.axes if axis.values is not None]
    codes = list(np.unravel_index(cells, study.grid))
    place = names.index("scale")
    codes[place] = np.where(scales >= 0, scales, codes[place])
    return np.asarray(np.ravel_multi_index(codes, study.grid))


def level_study(study: Study, level: str, quantity: str) -> Study:
    """The study of one model: of the exact one as it is, of others with the quantity alone."""
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
    """Raise InputError: the study does not keep the quantity, or a model does not have it, or is not for the scene."""
    if quantity not in study.keep.numbers:
        kept = ", ".join(study.keep.numbers)
        raise InputError(f"quantity = {quantity!r}: the study keeps {kept}; give one, or add it to keep")
    factory = SceneFactory(study.recipe)
    for level in levels:
        if level == "backbone":
            check_backbone(factory.base)
            known = {*QUANTITIES, *study.keep.axes}
            if not study.keep.counts.bearings:
                known |= {f"{name}_{k + 1}" for name in OF_SURFACES for k in range(study.keep.counts.surfaces)}
            if missing := [name for name in _names_in(study.keep, quantity) if name not in known]:
                raise InputError(
                    f"quantity = {quantity!r}: {missing[0]} is none of the model 'backbone'; give another quantity, or "
                    "accuracy.models = ['massless']"
                )
        elif level != EXACT:
            SceneFactory(replace(study.recipe, scene={**study.recipe.scene, "fidelity": level}))


def _names_in(keep: Keep, quantity: str) -> list[str]:
    """The quantities of which one is made."""
    text = dict(keep.formulas).get(quantity)
    if text is None:
        return [quantity]
    if "(" in text and any(f"{word}(" in text for word in ("peak", "least", "most", "last")):
        return [text]
    return sorted(formula.names_in(formula.parse(text, [*keep.known, *keep.axes])))


@dataclass(frozen=True)
class Crossings:
    """Logarithms of scales at which draws reach a threshold, shape (k,) [-], and how many are beyond the study.

    runs: that the draws took, all together.
    """

    logarithms: Array
    beyond: int
    runs: int


def crossings(source: Source, level: str, draws: Indices, scales: Array, threshold: float, guess: Array) -> Crossings:
    """Find where draws reach a threshold.

    scales: rising. guess: of the logarithm of the scale of each crossing, with which the search begins.
    """
    count, most = len(draws), len(scales)
    low, high = np.full(count, -1), np.full(count, most)  # neighbours: below, and at or above the threshold
    values = np.full((count, most), np.nan)
    following = np.searchsorted(np.log(scales), guess).clip(0, most - 1)
    runs = 0
    while (open_ := np.flatnonzero(high - low > 1)).size:
        at = following[open_]
        reached, early = source.values(level, draws[open_], at)
        values[open_, at] = np.where(early & (reached < threshold), np.inf, reached)
        runs += len(open_)
        over = values[open_, at] >= threshold
        high[open_] = np.where(over, np.minimum(at, high[open_]), high[open_])
        low[open_] = np.where(over, low[open_], np.maximum(at, low[open_]))
        following = _following(low, high, following, most)
    logs = np.array(
        [_crossing(np.log(scales), row, lo, hi, threshold) for row, lo, hi in zip(values, low, high, strict=True)]
    )
    return Crossings(logs, int(((low < 0) | (high >= most)).sum()), runs)


def _following(low: Indices, high: Indices, last: Indices, most: int) -> Indices:
    """The scale to run next: a neighbour of the last one as long as one side is not known, else the middle."""
    step = np.where(last == low, low + 1, high - 1)
    middle = (low + high) // 2
    known = (low >= 0) & (high < most)
    return np.where(known, middle, step).clip(0, most - 1)


def _crossing(logs: Array, values: Array, low: int, high: int, threshold: float) -> float:
    """The crossing between two neighbours, by a power law; beyond the scales half a step from the last one."""
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
    """A source of crossings: a run of it is the search of a draw. intensity: logarithm of that of draws at scale 1."""

    def __init__(self, source: Source, threshold: float, scales: Array, intensity: Callable[[Indices], Array]) -> None:
        self.source, self.threshold, self.scales, self.intensity = source, threshold, scales, intensity
        self.levels, self.population = source.levels, source.population
        self.beyond = 0
        self._values: dict[str, dict[int, float]] = {level: {} for level in source.levels}
        self._runs = dict.fromkeys(source.levels, 0)

    def values(self, level: str, draws: Indices, scales: Indices | None = None) -> tuple[Array, Flags]:
        """Logarithms of the intensities at which draws cross, shape (draws,) [-]; none ends early."""
        known = self._values[level]
        new = np.array([draw for draw in draws.tolist() if draw not in known], dtype=np.intp)
        if new.size:
            searches = crossings(self.source, level, new, self.scales, self.threshold, self._guess(level, new))
            self._runs[level] += searches.runs
            self.beyond += searches.beyond if level == EXACT else 0
            known.update(zip(new.tolist(), searches.logarithms.tolist(), strict=True))
        logs = np.array([known[draw] for draw in draws.tolist()])
        return logs + self.intensity(draws), np.zeros(len(draws), dtype=bool)

    def _guess(self, level: str, draws: Indices) -> Array:
        """Where the search of a draw begins: where the cheapest model crosses, shifted by what the pilot showed."""
        middle = np.full(len(draws), float(np.log(self.scales[len(self.scales) // 2])))
        cheap = next((name for name in self.levels[1:] if self._values[name] and name != level), None)
        if level != EXACT or cheap is None:
            return middle
        known = self._values[cheap]
        shifts = [value - known[draw] for draw, value in self._values[level].items() if draw in known]
        shift = float(np.median(shifts)) if shifts else 0.0
        return np.array([known.get(draw, at) + shift for draw, at in zip(draws.tolist(), middle, strict=True)])

    def cost(self, level: str) -> float:
        """Seconds of the search of a draw."""
        return self.source.cost(level) * self._runs[level] / max(len(self._values[level]), 1)

    def spent(self) -> tuple[float, dict[str, int]]:
        """As of `Source`."""
        return self.source.spent()
