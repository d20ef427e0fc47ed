"""Search for designs: the Pareto front of quantities over the random axes of a study, by NSGA-II of pymoo.

The designs of a generation become a study of listed samples on a pool; its rows give the objectives of the next one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, FAINT, PALE, headline, page
from msfp_gen.studies.assessment.rows import (
    SIZE,
    STATISTICS,
    check_columns,
    complete,
    labelled,
    numbers,
    read_study,
    scale_of,
    write_frame,
)
from msfp_gen.studies.axes import Sampling, values_at
from msfp_gen.studies.batch import Pool, pool_from, require
from msfp_gen.studies.definition import Study, load_study
from msfp_gen.studies.run import run_on

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST = 1e30  # objective of a design without a value, so that every other design is better
DESIGNS = "designs.parquet"
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Goals:
    """Objectives and limits of a search.

    Attributes:
        minimise, maximise: quantities of the study, the objectives.
        at_most: quantity -> largest value of a feasible design.
        statistic: of a quantity over the runs of a design: a key of STATISTICS.
    """

    minimise: tuple[str, ...]
    maximise: tuple[str, ...] = ()
    at_most: Mapping[str, float] | None = None
    statistic: str = "max"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objectives."""
        return (*self.minimise, *self.maximise)

    @property
    def limits(self) -> dict[str, float]:
        """Quantity -> largest value of a feasible design; may be empty."""
        return dict(self.at_most or {})

    @property
    def signs(self) -> Array:
        """1 for an objective to be minimised, -1 for an objective to be maximised, shape (objectives,) [-]."""
        return np.array([1.0] * len(self.minimise) + [-1.0] * len(self.maximise))


@dataclass(frozen=True)
class Front:
    """Result of `pareto`.

    Attributes:
        goals: of the search.
        units: column -> unit.
        designs: DataFrame, one row for each design: `generation`, the axes, the statistics of objectives and limits,
            `feasible`, and `front`, true for a feasible design that no other feasible design dominates.
    """

    goals: Goals
    units: dict[str, str]
    designs: Any


def pareto(
    source: str | Path | Mapping[str, Any],
    output: str | Path,
    goals: Goals,
    *,
    population: int = 32,
    generations: int = 20,
    seed: int = 0,
    progress: Progress | None = None,
    **engine: Any,
) -> Front:
    """Search the random axes of a study for the Pareto front of its quantities.

    Each generation is a study of its own in `output`, so that the same call continues an interrupted search. A design
    with a run that ended early is not feasible.

    source: a study file, or a table. Its random axes are the design variables; its other axes, such as records, give
    the runs of each design; `[sampling]` is not used. output: folder of the search, with `designs.parquet` and a folder
    for each generation. goals: objectives and limits. population, generations, seed: of NSGA-II; there are population x
    generations designs. progress: called with the number of generations done, and of all. engine: `workers`, `threads`,
    `executor`, `dask` or `mpi`, as of `study`.

    Raises InputError before any run: invalid input; RunError: workers died; the same call continues.
    """
    require("pymoo", "pymoo", "a Pareto search")
    study = load_study(source, design=True)
    _check(study, goals, population, generations)
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem

    count, limits = sum(axis.random for axis in study.axes), 1 + len(goals.limits)
    problem = Problem(n_var=count, n_obj=len(goals.names), n_ieq_constr=limits, xl=0.0, xu=1.0)
    algorithm = NSGA2(pop_size=population)
    algorithm.setup(problem, termination=("n_gen", generations), seed=seed, verbose=False)
    evaluated = []
    with pool_from(**engine) as pool:
        for number in range(1, generations + 1):
            candidates = algorithm.ask()
            shares = np.asarray(candidates.get("X"), dtype=float)
            evaluated.append(_evaluate(study, number, shares, goals, pool, Path(output)))
            if number < generations:
                objectives, violations = _objectives(evaluated[-1], goals)
                Evaluator().eval(StaticProblem(problem, F=objectives, G=violations), candidates)
                algorithm.tell(infills=candidates)
                if progress is not None:
                    progress(number, generations)
    return _front(evaluated, goals, Path(output))


def _check(study: Study, goals: Goals, population: int, generations: int) -> None:
    """Raise InputError for a study without random axes, or for goals with quantities that the study does not keep."""
    if not any(axis.random for axis in study.axes):
        raise InputError(
            "axes: none has a distribution, so that there is nothing to search; give its bounds as `uniform`"
        )
    if len(goals.names) < 2 or len(set(goals.names)) < len(goals.names):
        raise InputError("pareto: give two or more different quantities to minimise or maximise")
    check_columns((*goals.names, *goals.limits), study.keep.numbers)
    if goals.statistic not in STATISTICS:
        raise InputError(f"statistic = {goals.statistic!r}: give one of {', '.join(STATISTICS)}")
    for word, value, least in (("population", population, 4), ("generations", generations, 1)):
        if value < least:
            raise InputError(f"{word} = {value}: give {least} or more")


def _evaluate(study: Study, number: int, shares: Array, goals: Goals, pool: Pool, folder: Path) -> Any:
    """Run the designs of a generation; returns a DataFrame with axes, statistics, `ended` and `feasible`.

    shares: cumulative probabilities of the random axes, shape (designs, axes). `ended` is the share of complete runs.
    """
    import pandas as pd

    values = values_at(shares, study.distributions)
    sampling = Sampling("listed", values=tuple(map(tuple, values.tolist())))
    table = {**study.table, "sampling": {"method": "listed", "values": values.tolist()}}
    own_folder = folder / f"generation-{number:03d}"
    run_on(pool, replace(study, sampling=sampling, table=table), own_folder)
    quantities = list(dict.fromkeys((*goals.names, *goals.limits)))
    rows = read_study(own_folder, quantities)
    axes = [axis.name for axis in study.axes if axis.random]
    shape = (-1, len(values))
    reduce = STATISTICS[goals.statistic]
    statistics = {name: reduce(numbers(rows, name).reshape(shape), axis=0) for name in quantities}
    ended = complete(rows).reshape(shape)
    feasible = ended.all(axis=0) & ~np.isnan(list(statistics.values())).any(axis=0)
    for name, bound in goals.limits.items():
        feasible &= statistics[name] <= bound
    designs = pd.DataFrame({"generation": number, **dict(zip(axes, values.T, strict=True)), **statistics})
    designs = designs.assign(ended=ended.mean(axis=0), feasible=feasible)
    designs.attrs["units"] = rows.attrs["units"]
    return designs


def _objectives(designs: Any, goals: Goals) -> tuple[Array, Array]:
    """Objectives to be minimised, shape (designs, objectives), and violations, positive where a limit is violated.

    The violations, shape (designs, 1 + limits), begin with the share of runs that ended early.
    """
    values = designs[list(goals.names)].to_numpy() * goals.signs
    unknown = (designs.ended < 1).to_numpy() | np.isnan(values).any(axis=1)
    violations = [1.0 - designs.ended.to_numpy()]
    for name, bound in goals.limits.items():
        excess = (designs[name].to_numpy() - bound) / (abs(bound) or 1.0)
        violations.append(np.where(np.isnan(excess), LARGEST, excess))
    return np.where(unknown[:, None], LARGEST, values), np.column_stack(violations)


def _front(generations: Sequence[Any], goals: Goals, folder: Path) -> Front:
    """The front of the designs of all generations; writes `designs.parquet`."""
    import pandas as pd

    designs = pd.concat([frame.drop(columns="ended") for frame in generations], ignore_index=True)
    designs["front"] = designs.feasible.to_numpy() & not_dominated(
        np.where(designs.feasible.to_numpy()[:, None], designs[list(goals.names)].to_numpy() * goals.signs, np.inf)
    )
    write_frame(designs, folder / DESIGNS)
    return Front(goals, dict(generations[0].attrs["units"]), designs)


def not_dominated(values: Array) -> Any:
    """Whether no other row dominates a row, ndarray of bool, shape (rows,).

    A row dominates another if it is at most equal in all columns and less in one.
    """
    dominated = np.zeros(len(values), dtype=bool)
    for index, row in enumerate(values):
        dominated[index] = ((values <= row).all(axis=1) & (values < row).any(axis=1)).any()
    return ~dominated


def front_table(front: Front) -> Table:
    """The designs on the front as a table for a terminal, sorted by the first objective."""
    designs = front.designs[front.designs.front].sort_values(front.goals.names[0])
    columns = [name for name in designs.columns if name not in ("generation", "feasible", "front")]
    rows = [[f"{value:.4g}" for value in row] for row in designs[columns].to_numpy()]
    count, feasible = len(front.designs), int(front.designs.feasible.sum())
    title = f"{len(designs)} designs on the Pareto front, of {feasible} feasible ones among {count}"
    return Table(title, columns, rows)


def plot_pareto(result: Front, path: str | Path | None = None, title: str = "") -> Figure:
    """All designs over the first two objectives; a line joins the designs on the front. path: as of `page`."""
    first, second = result.goals.names[:2]
    designs, front = result.designs, result.designs[result.designs.front].sort_values(first)
    scales = [scale_of(designs[name], result.units.get(name, "")) for name in (first, second)]
    with page(*SIZE, path) as figure:
        headline(figure, title or "Pareto front")
        axes = figure.subplots()
        for kind, marker, colour, label in (
            (designs[~designs.feasible], "x", PALE, "not feasible"),
            (designs[designs.feasible & ~designs.front], ".", FAINT, "dominated"),
        ):
            x, y = (scale.factor * kind[name] for scale, name in zip(scales, (first, second), strict=True))
            axes.plot(x, y, marker, color=colour, label=label)
        x, y = (scale.factor * front[name] for scale, name in zip(scales, (first, second), strict=True))
        line = "-" if len(result.goals.names) == 2 else "none"
        axes.plot(x, y, "o", linestyle=line, color=COLOURS[0], label=f"front, {len(front)} designs")
        axes.set(xlabel=labelled(first, scales[0].unit), ylabel=labelled(second, scales[1].unit))
        axes.legend()
    return figure
