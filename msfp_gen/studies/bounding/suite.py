"""Bounds under a suite of ground motions: means, worst values and envelopes over the records.

A scene and a suite become a study with the axes `record` and `bounds`, so that the rows are kept as the runs end, and
the same call continues; statistics go out, as tables, CSV and a figure.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.inputs import expecting
from msfp_gen.common.output import check_output
from msfp_gen.common.tables import Table, decimal_text, write_columns
from msfp_gen.figures.style import INK, distinct_colours, headline, page, plain
from msfp_gen.results.quantities import MOVING, ColumnSource
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.scene.plausibility import doubts, require_meant, target_doubts
from msfp_gen.studies.batch import ENDED
from msfp_gen.studies.bounding.runs import CASES, bounded_scenes, shown_as
from msfp_gen.studies.columns import names_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.scene.system import System
    from msfp_gen.studies.definition import Study

RunKey = tuple[str, str]  # names of a record and of a case

# Quantities of the figure, where the runs have them.
DRAWN = ("peak_displacement", "peak_force", "peak_floor_acceleration", "peak_drift_ratio", "capacity_left")
IN_ROW, MOST_BELOW = 3, 14  # panels of the figure in a row; entries of the legend below each other
WORST: dict[str, Callable[..., Any]] = {"most": np.nanmax, "least": np.nanmin}
# Kept beside the quantities that have a governing value.
OF_RUN = ("duration", "verdict", "verdict_text", "limits_reached", "closure_error", "steps", "peak_force_ratio")
NO_VALUE = "some runs that reached their end have no such value"


@dataclass(frozen=True)
class Statistic:
    """Statistics of a quantity over the records of a suite.

    name: column of the study. part: name of its bearing, storey, floor or surface; "" for the bearing or building as a
    whole. extreme: whether the largest or the least value is the worst. means: by case, over the runs that ended [SI];
    None where a run that ended has no value. worst: by case, of all runs, also of those that ended early [SI].
    comparable: whether all means are of the same records. governs: case with the worst mean; "" unless they are, or
    where all are equal. record: record with the worst value of all; "" where all values are equal.
    """

    name: str
    part: str
    unit: str
    extreme: Literal["most", "least", ""]
    means: tuple[float | None, ...]
    worst: tuple[float | None, ...]
    comparable: bool
    governs: str
    record: str

    @property
    def under(self) -> str:
        """The record with the worst value, as the end of a sentence."""
        return f", under {self.record}" if self.record else ""

    @property
    def envelope(self) -> tuple[float | None, float]:
        """The worst mean, None unless all means are of the same records, and the worst value over the cases [SI]."""
        worst_of = WORST[self.extreme]
        mean = float(worst_of([m for m in self.means if m is not None])) if self.comparable else None
        return mean, float(worst_of([value for value in self.worst if value is not None]))


@dataclass(frozen=True)
class SuiteBounds:
    """Result of `bound_suite`.

    Attributes:
        name: of the scene, for the figure.
        factors: name of the table of factors.
        records: names of the motions.
        left_out: names of the motions of the suite that were not asked for.
        sources: column -> quantity, with the name of its bearing, storey, floor or surface.
        values: column -> values, shape (records, cases) [SI]; NaN where a run has none. Of a run that ended early the
            value until then, where more of the run can only make it worse.
        failures: (record, case) -> message of a run that failed.
        exceeded: (record, case) -> verdict of a run that exceeded limits of the device.
        stopped: (record, case) -> time at which a run met the stop condition of the scene [s].
    """

    name: str
    factors: str
    records: tuple[str, ...]
    left_out: tuple[str, ...]
    sources: Mapping[str, ColumnSource]
    values: Mapping[str, Array]
    failures: Mapping[RunKey, str]
    exceeded: Mapping[RunKey, str]
    stopped: Mapping[RunKey, float]

    @cached_property
    def ended(self) -> Any:
        """Whether each run reached its end, ndarray of bool, shape (records, cases)."""
        early = {*self.failures, *self.stopped}
        return np.array([[(record, case) not in early for case in CASES] for record in self.records])

    @cached_property
    def statistics(self) -> tuple[Statistic, ...]:
        """The statistics of every quantity with a value."""
        known = {name: values for name, values in self.values.items() if not np.isnan(values).all()}
        return tuple(self._statistic(name, values) for name, values in known.items())

    def means(self, name: str) -> tuple[float | None, ...]:
        """The mean of a column by case, over the runs that ended [SI]; None where one of these has no value."""
        columns = (values[ended] for values, ended in zip(self.values[name].T, self.ended.T, strict=True))
        return tuple(float(c.mean()) if c.size and not np.isnan(c).any() else None for c in columns)

    def _statistic(self, name: str, values: Array) -> Statistic:
        quantity, _, part = self.sources[name]
        worst_of = WORST[quantity.governs]
        means = self.means(name)
        worst = [None if np.isnan(column).all() else float(worst_of(column)) for column in values.T]
        comparable = None not in means and all((column == self.ended[:, 0]).all() for column in self.ended.T)
        case = CASES[means.index(worst_of(means))] if comparable and len(set(means)) > 1 else ""
        known = values[~np.isnan(values)]
        place = int(np.argwhere(values == worst_of(values))[0][0])
        record = self.records[place] if len(self.records) == 1 or np.ptp(known) else ""
        return Statistic(name, part, quantity.unit, quantity.governs, means, tuple(worst), comparable, case, record)

    @property
    def undefined(self) -> dict[str, str]:
        """Column -> why it has no mean: some runs that reached their end have no value of it.

        A column without any value is of something that the runs do not model, such as uplift.
        """
        reasons = {}
        for name, values in self.values.items():
            missing, at_rest = np.isnan(values[self.ended]), self.sources[name].quantity.at_rest
            if missing.any() and (at_rest or not np.isnan(values).all()):
                reasons[name] = MOVING if at_rest else NO_VALUE
        return reasons

    @property
    def incomplete(self) -> dict[str, str]:
        """Case -> of what its means are, where a run did not reach its end."""
        texts = {}
        for case, ended in zip(CASES, self.ended.T, strict=True):
            early = [record for record, whole in zip(self.records, ended, strict=True) if not whole]
            if early:
                texts[case] = f"of the {int(ended.sum())} that ended, {', '.join(early)} left out"
        return texts

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return {
            "factors": self.factors,
            "records": list(self.records),
            "left_out": list(self.left_out),
            "statistics": [vars(statistic) | {"envelope": statistic.envelope} for statistic in self.statistics],
            "means": self.incomplete,
            "undefined": self.undefined,
            "exceeded": [{"record": r, "case": c, "verdict": text} for (r, c), text in self.exceeded.items()],
            "stopped": [{"record": r, "case": c, "time": time} for (r, c), time in self.stopped.items()],
            "failures": [{"record": r, "case": c, "message": text} for (r, c), text in self.failures.items()],
        }


def suite_study(
    scene: str | Path | Mapping[str, Any],
    suite: str | Path,
    factors: str | Path,
    progress: Progress | None = None,
) -> Study:
    """The study of `bound_suite`: one run for each record, slowest, and each bound. Arguments: see `bound_suite`.

    progress: of the scaling of the suite. Raises InputError.
    """
    from msfp_gen.studies.definition import load_study  # which imports this package

    table = {
        "name": "" if isinstance(scene, Mapping) else Path(scene).stem,
        "scene": scene if isinstance(scene, Mapping) else str(scene),
        "records": {"suite": str(suite)},
        "axes": {"bounds": {"factors": str(factors)}},
        "chunk": 1,  # a run that has ended is not lost
    }
    study = load_study(table, progress)
    governing = {name: source for name, source in study.keep.sources if source.quantity.governs}
    apart = {name: source for name, source in study.keep.sources if source.quantity.apart}
    names = (*names_of(governing), *OF_RUN, *names_of(apart))
    return replace(study, keep=replace(study.keep, names=names), table={**study.table, "keep": list(names)})


def suite_scenes(study: Study, leave_out: Collection[str] = ()) -> list[tuple[str, System]]:
    """Name of the record and scene of every run of `suite_study`, without the records that are left out.

    The scenes have full fidelity: their values are the ones that are given.
    """
    from msfp_gen.studies.axes import SceneFactory  # which imports this package

    of_records, of_bounds = study.axes
    table = {key: value for key, value in study.inputs.scene.items() if key != "fidelity"}
    factory = SceneFactory(replace(study.inputs, scene=table, axes=(of_records,)))
    factors = study.inputs.factors[of_bounds.paths[0]]
    names = [name for name in study.inputs.records if name not in leave_out]
    with expecting(study.files):
        return [(name, one) for name in names for one in bounded_scenes(factory.scene((name,)), factors).values()]


def suite_doubts(study: Study, scenes: Sequence[tuple[str, System]]) -> list[tuple[str, list[str]]]:
    """Name and doubts of every one of these `suite_scenes`, and the doubts about the target of the suite in each."""
    target = target_doubts(study.table["records"].get("target"))
    return [(name, [*target, *doubts(scene)]) for name, scene in scenes]


def bound_suite(
    study: Study,
    output: str | Path | None = None,
    *,
    leave_out: Collection[str] = (),
    workers: int | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> SuiteBounds:
    """Run the cases of `bound` under each motion of a suite, and keep the quantities of the runs.

    Every run takes in the effects that it needs. The same call continues one that was interrupted. A run that fails is
    part of the result.

    Args:
        study: of scene, suite and factors, by `suite_study`.
        output: folder of the rows, as in `study`; None: they are not kept.
        leave_out: names of records that are neither run nor part of the result.
        workers: runs at the same time; None: one for each core.
        force: whether to run also with values of a run that are implausible in any unit.
        progress: called with the number of runs done, by earlier calls too, and of all.

    Raises InputError before any run: see `study`, or an unknown record; RunError: no run reached its end.
    """
    from msfp_gen.studies.run import run_on
    from msfp_gen.studies.workers import local_pool

    check_left_out(leave_out, study)
    if not force:
        require_meant(*(scene for _, scene in suite_scenes(study, leave_out)))
    names = list(study.inputs.records)
    without = [len(CASES) * names.index(name) + case for name in leave_out for case in range(len(CASES))]
    with TemporaryDirectory() as temporary, local_pool(workers) as pool:
        folder = Path(temporary if output is None else output)
        run_on(pool, study, folder, progress=progress, without=without)
        return _from_rows(study, folder, leave_out)


def load_suite_bounds(folder: str | Path, leave_out: Collection[str] = ()) -> tuple[Study, SuiteBounds]:
    """The study in the folder of `bound_suite`, and its result.

    Raises InputError: no such folder, a file of the inputs or the program has changed, an unknown record, or a run that
    is missing; RunError as in `bound_suite`.
    """
    from msfp_gen.studies.definition import load_study
    from msfp_gen.studies.run import STUDY_FILE, Chunks, study_table

    folder = Path(folder)
    about = study_table(folder)["about"]
    study = load_study(folder / STUDY_FILE)
    if [axis.name for axis in study.axes] != ["record", "bounds"]:
        raise InputError(
            f"{str(folder)!r}: no suite at bounds; give the folder of `msfp-gen bound --suite FILE -o DIR`"
        )
    check_left_out(leave_out, study)
    chunks = Chunks(study, folder)
    if chunks.digest != about.get("digest"):
        raise InputError(
            f"{str(folder)!r}: inputs or program have changed since its runs; run `msfp-gen bound` into another folder"
        )
    for number in range(study.chunks):
        ((_, labels),) = chunks.study.task(number).rows(study.axes)
        if labels[0] not in leave_out and not chunks.path(chunks.study.task(number)).is_file():
            raise InputError(
                f"{str(folder)!r}: no run of {labels[0]} at {labels[1]}; continue `msfp-gen bound`, or give its "
                "record to --leave-out"
            )
    return study, _from_rows(study, folder, leave_out)


def suite_peaks(
    folder: str | Path, leave_out: Collection[str] = ()
) -> tuple[SuiteBounds, dict[str, tuple[float, float]]]:
    """The result in the folder of `bound_suite`, and its mean peaks by case, over the runs that reached their end.

    The peaks are the largest displacement of a bearing [m], and the base shear over the weight [-], of a single bearing
    over its axial load. A case without a run that ended is left out. Raises InputError as `load_suite_bounds`, and
    where a run has no constant axial load.
    """
    from msfp_gen.studies.assessment.rows import read_study

    columns = ["peak_displacement", "peak_force_ratio"]
    bounds = load_suite_bounds(folder, leave_out)[1]
    rows = read_study(folder, ["record", "bounds", *columns])
    rows = rows[(rows["status"] == "ok") & ~rows["record"].isin(list(leave_out))]
    if rows["peak_force_ratio"].isna().any():
        raise InputError(f"{str(folder)!r}: its axial load changes; give runs with a load at rest")
    means = rows.groupby("bounds")[columns].mean()
    return bounds, {case: (float(u), float(shear)) for case, u, shear in means.itertuples()}


def check_left_out(leave_out: Collection[str], study: Study) -> None:
    """Raise InputError where a record is unknown, or none is left."""
    names = list(study.inputs.records)
    for name in leave_out:
        if name not in names:
            hint = suggestion(name, names) or f"; the records are {', '.join(names)}"
            raise InputError(f"--leave-out = {name!r}: no record of the suite{hint}")
    if len(set(leave_out)) == len(names):
        raise InputError("--leave-out: no record of the suite is left; leave fewer out")


def _from_rows(study: Study, folder: Path, leave_out: Collection[str]) -> SuiteBounds:
    """The result of the rows in the folder of a study. Raises RunError where no run reached its end."""
    from msfp_gen.studies.assessment.rows import read_study

    rows = read_study(folder)
    rows = rows[~rows["record"].isin(list(leave_out))]
    runs: list[RunKey] = list(zip(rows["record"], rows["bounds"], strict=True))
    early = rows["status"].to_numpy() != "ok"
    sources = {name: source for name, source in study.keep.sources if name in rows and source.quantity.governs}
    values = {}
    for name, source in sources.items():
        column = rows[name].to_numpy(dtype=float, na_value=np.nan)
        until_then = source.quantity.side == source.quantity.governs  # more of the run can only make it worse
        values[name] = (column if until_then else np.where(early, np.nan, column)).reshape(-1, len(CASES))

    def chosen(column: str, which: Iterable[bool]) -> dict[RunKey, Any]:
        return {run: value for run, value, is_one in zip(runs, rows[column], which, strict=True) if is_one}

    failures = chosen("message", ~rows["status"].isin(ENDED))
    if len(failures) == len(runs):
        raise RunError(
            f"no run of the suite reached its end; the first: {next(iter(failures.values()))}", status="bound"
        )
    return SuiteBounds(
        name=study.name,
        factors=study.inputs.factors[study.axes[-1].paths[0]].name,
        records=tuple(dict.fromkeys(record for record, _ in runs)),
        left_out=tuple(leave_out),
        sources=sources,
        values=values,
        failures=failures,
        exceeded=chosen("verdict_text", rows["verdict"] == "exceeded"),
        stopped=chosen("duration", rows["status"] == "stopped"),
    )


def suite_bound_tables(bounds: SuiteBounds) -> list[Table]:
    """Tables of statistics, and of what is missing in them: one line for each reason.

    The statistics are of the bearing or building as a whole; `write_statistics` writes the statistics of its parts too.
    """
    rows = []
    for statistic in bounds.statistics:
        if not statistic.part:
            unit, scale = shown_as(statistic.unit)
            numbers = (*statistic.means, *statistic.worst)
            cells = ["-" if value is None else decimal_text(value * scale) for value in numbers]
            name = f"{bounds.sources[statistic.name].words(statistic.name)} [{unit}]"
            rows.append((name, *cells, statistic.governs or "-", statistic.record or "-"))
    marks = {case: "*" if case in bounds.incomplete else "" for case in CASES}
    columns = (
        "",
        *(f"mean {case}{marks[case]}" for case in CASES),
        *(f"worst {case}{marks[case]}" for case in CASES),
        "governs",
        "worst record",
    )
    means = [(f"* mean {', '.join(cases)}", text) for text, cases in _grouped(bounds.incomplete, str).items()]
    if means:
        means.append(("* worst", "with the values until then of runs that ended early"))
    if bounds.left_out:
        means.append(("left out", ", ".join(bounds.left_out)))
    exceeded = [(f"{record}, {case}", verdict) for (record, case), verdict in bounds.exceeded.items()]
    undefined = [(", ".join(dict.fromkeys(names)), reason) for reason, names in _reasons(bounds).items()]
    stopped = [(f"{record}, {case}", f"{time:.4g} s") for (record, case), time in bounds.stopped.items()]
    failed = [(_named(runs), bounds.failures[runs[0]]) for runs in _grouped(bounds.failures, _words).values()]
    tables = [
        Table(f"{_counted(bounds)} at bounds by {bounds.factors}: means and worst values", columns, rows),
        Table("the records of the numbers", (), means),
        Table("what has no mean, and why", (), undefined),
        Table("limits of the device that runs exceeded (docs/results.md)", (), exceeded),
        Table("runs that met the stop condition of the scene", (), stopped),
        Table("runs that failed; of several for the same reason the first message", (), failed),
    ]
    return [table for table in tables if table.rows]


def uplift_words(bounds: SuiteBounds) -> tuple[str, ...]:
    """Whether bearings opened, by how much, and else how far their force fell, in words; empty where it is unknown.

    Of one bearing also in how many runs uplift was simulated.
    """
    known = {one.name: one for one in bounds.statistics}
    least = known.get("minimum_load_ratio")
    if least is None:
        return ()
    alone = "maximum_uplift" in bounds.sources
    heights = bounds.values["maximum_uplift"] if alone else np.zeros(0)
    simulated = int((~np.isnan(heights)).sum())
    force = "normal force of a surface" if alone else "axial force of a bearing"
    fell = f"the least {force} was {least.envelope[1]:.3g} of the load at rest{least.under}"
    where = "every run" if simulated == heights.size else f"{simulated} of {heights.size} runs"
    runs = f" Uplift was simulated in {where}." if alone else ""
    if alone and not simulated:
        return (f"No run simulated uplift, which begins where a normal force falls to zero: {fell}.",)
    names = ("maximum_uplift", "bearing_uplift_height")
    opened = [one for one in known.values() if (one.name.rpartition("_")[0] if one.part else one.name) in names]
    highest = max(opened, key=lambda one: one.envelope[1], default=None)
    if highest is not None and (height := highest.envelope[1]) > 0:
        which = "The bearing" if alone else f"Bearings opened, {highest.part} the farthest: a surface"
        return (f"{which} opened by at most {1e3 * height:.3g} mm{highest.under}.{runs}",)
    until = " before it ended" if not bounds.ended.all() else ""
    return (f"No bearing opened in any run{until}: {fell}.{runs}",)


def _counted(bounds: SuiteBounds) -> str:
    count = len(bounds.records)
    return f"{count} record{'s' * (count > 1)}"


def _reasons(bounds: SuiteBounds) -> dict[str, list[str]]:
    """Reason -> words of the quantities without a mean, each once for all parts."""
    reasons: dict[str, list[str]] = {}
    for name, why in bounds.undefined.items():
        source = bounds.sources[name]
        reasons.setdefault(why, []).append(source.words(name).removesuffix(f" of {source.part}"))
    return reasons


def _grouped(values: Mapping[Any, Any], reason: Callable[[Any], str]) -> dict[str, list[Any]]:
    """Reason of a value -> the keys that have it."""
    groups: dict[str, list[Any]] = {}
    for key, value in values.items():
        groups.setdefault(reason(value), []).append(key)
    return groups


def _words(message: str) -> str:
    """A message without its numbers."""
    return re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "", message)


def _named(runs: Iterable[RunKey]) -> str:
    """Runs by the names of their records, each with its cases."""
    cases: dict[str, list[str]] = {}
    for record, case in runs:
        cases.setdefault(record, []).append(case)
    return "; ".join(f"{record}: {', '.join(of_record)}" for record, of_record in cases.items())


def write_statistics(bounds: SuiteBounds, path: str | Path) -> Path:
    """Write the statistics as CSV in SI units: one row for each quantity, with the name of its part.

    Raises InputError for a path that does not end in .csv or cannot be written.
    """
    rows, counts = bounds.statistics, bounds.ended.sum(axis=0).tolist()
    columns: dict[tuple[str, str], list[Any]] = {
        ("quantity", ""): [bounds.sources[row.name].words(row.name) for row in rows],
        ("of", ""): [row.part for row in rows],
        ("unit", ""): [row.unit or "1" for row in rows],
        **{(f"mean {case}", ""): [row.means[i] for row in rows] for i, case in enumerate(CASES)},
        **{(f"records in mean {case}", ""): [counts[i]] * len(rows) for i, case in enumerate(CASES)},
        **{(f"worst {case}", ""): [row.worst[i] for row in rows] for i, case in enumerate(CASES)},
        ("envelope of means", ""): [row.envelope[0] for row in rows],
        ("envelope of worst", ""): [row.envelope[1] for row in rows],
        ("governs", ""): [row.governs for row in rows],
        ("worst record", ""): [row.record for row in rows],
    }
    return write_columns(check_output(path, (".csv",)), columns)


def write_records(bounds: SuiteBounds, path: str | Path) -> Path:
    """Write the quantities of every run as CSV in SI units, one row for each record and case.

    Raises InputError for a path that does not end in .csv or cannot be written.
    """
    count = len(CASES)
    runs = [(record, case) for record in bounds.records for case in CASES]
    columns: dict[tuple[str, str], list[Any]] = {
        ("record", ""): [record for record, _ in runs],
        ("case", ""): [case for _, case in runs],
        ("failure", ""): [bounds.failures.get(run, "") for run in runs],
        ("stopped at", "s"): [bounds.stopped.get(run) for run in runs],
        ("limits exceeded", ""): [bounds.exceeded.get(run, "") for run in runs],
    }
    for name, values in bounds.values.items():
        cells = [None if np.isnan(value) else value for value in values.reshape(len(bounds.records) * count).tolist()]
        columns[bounds.sources[name].words(name), bounds.sources[name].quantity.unit or "1"] = cells
    return write_columns(check_output(path, (".csv",)), columns)


def plot_suite_bounds(bounds: SuiteBounds, path: str | Path | None = None) -> Figure:
    """The quantities DRAWN over the cases: each record in a colour of its own, and the means over the records.

    A cross marks a run that did not reach its end. Raises InputError for a path that cannot be written.
    """
    plotted = [name for name in DRAWN if name in bounds.values and not np.isnan(bounds.values[name]).all()]
    colours = distinct_colours(len(bounds.records))
    rows = 1 + len(plotted) // IN_ROW
    with page(9.5, 0.6 + 2.7 * rows, path, "suite") as figure:
        headline(figure, f"{bounds.name or 'unnamed scene'}: {_counted(bounds)} at bounds by {bounds.factors}")
        cells = list(figure.subplots(rows, IN_ROW, squeeze=False).flat)
        for axes, name in zip(cells, plotted, strict=False):
            _draw(axes, bounds, name, colours)
        for axes in cells[len(plotted) :]:
            axes.set_axis_off()
        handles, labels = cells[0].get_legend_handles_labels()
        cells[len(plotted)].legend(handles, labels, loc="center left", ncols=1 + (len(labels) > MOST_BELOW))
    return figure


def _draw(axes: Axes, bounds: SuiteBounds, name: str, colours: Sequence[str]) -> None:
    unit, scale = shown_as(bounds.sources[name].quantity.unit)
    values = bounds.values[name] * scale
    for record, of_record, colour in zip(bounds.records, values, colours, strict=True):
        axes.plot(CASES, of_record, color=colour, marker="o", markersize=4, label=plain(record))
    for number, (row, case) in enumerate(np.argwhere(~bounds.ended & ~np.isnan(values))):
        style: dict[str, Any] = {"color": colours[row], "marker": "x", "markersize": 10, "linestyle": "none"}
        axes.plot(CASES[case], values[row, case], **style, label="until a run ended early" if number == 0 else None)
    means = [np.nan if mean is None else mean * scale for mean in bounds.means(name)]
    label = "mean of the runs that ended" if bounds.incomplete else "mean"
    axes.plot(CASES, means, color=INK, linewidth=2.5, marker="_", markersize=16, label=label)
    axes.set(title=bounds.sources[name].words(name), ylabel=f"[{unit}]")
    axes.set_ylim(bottom=min(0.0, float(np.nanmin(values))))
