"""Runs of a suite made again for its report: loops of all rows, and what the vertical component of the ground does.

The rows of a suite have no histories. At each bound the run with the largest displacement is made again, and once more
without its vertical component; all quantities of the former are compared with its row. One of them is made a third
time at a smaller tolerance, for the error of the runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    HAIR,
    INK,
    THIN,
    Scale,
    displacement,
    displacement_label,
    engineering,
    force,
    headline,
    page,
    plain,
    subscript,
)
from msfp_gen.motions.motion import Motion
from msfp_gen.studies.batch import completed_runs
from msfp_gen.studies.bounding import CASES, SuiteBounds
from msfp_gen.studies.bounding.runs import shown_as

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.scene.solver import Solver
    from msfp_gen.studies.definition import Study

# Quantities that are compared with and without the vertical component, where the runs have them.
COMPARED = (
    "peak_displacement", "peak_force", "peak_overturning_moment", "peak_floor_acceleration", "peak_corner_acceleration",
    "peak_vertical_acceleration", "peak_drift_ratio", "maximum_load_ratio", "minimum_load_ratio",
    "maximum_normal_force_1",
)  # fmt: skip
BESIDE = 4.0  # time before and after the largest base shear that is drawn [s]
LOADED = 0.1  # of the load at rest, least sum of the axial forces to which a shear is compared
FINER = 10.0  # by this the tolerances of one run are smaller, for the error of the runs
MOST_STEPS = 30.0  # of this run over the steps of the run at the tolerance of the suite; about 2 to 5 are usual
NOTHING = 1e-9  # vertical acceleration that is none [m/s^2]


@dataclass(frozen=True)
class Repeated:
    """A run of a suite made again. level: the same without its vertical component; None where it has none, or failed.

    difference: largest relative difference of a quantity from the row of the suite, over `compared` quantities. finer:
    of one of the runs the same at tolerances divided by FINER; None of the others, or where it failed.
    """

    case: str
    record: str
    result: Any
    level: Any
    difference: float
    compared: int
    finer: Any = None


def repeated(study: Study, bounds: SuiteBounds, rows: Any, progress: Progress | None = None) -> list[Repeated]:
    """The runs with the largest displacement at each bound, of those that reached their end, made again."""
    chosen = []
    for case in CASES:
        ended = rows[(rows["bounds"] == case) & (rows["status"] == "ok")]
        if len(ended):
            chosen.append(ended.loc[ended["peak_displacement"].idxmax()])
    if not chosen:
        return []
    scenes = [study.scene(int(row["run"])) for row in chosen]
    moved = [index for index, scene in enumerate(scenes) if has_vertical(scene.motion)]
    level = [replace(scenes[index], motion=without_vertical(scenes[index].motion)) for index in moved]
    tight = next((index for index, row in enumerate(chosen) if row["bounds"] == "nominal"), 0)
    tightened = scenes[tight].solver.tightened(FINER)
    most = min(tightened.max_steps, int(MOST_STEPS * chosen[tight]["steps"]))
    finer = replace(scenes[tight], solver=replace(tightened, max_steps=most))
    with closing(completed_runs([*scenes, *level, finer], progress=progress)) as runs:
        ended = {index: result for index, result in runs if result.status == "ok"}
    without = {index: ended.get(len(scenes) + place) for place, index in enumerate(moved)}
    found = []
    for index, row in enumerate(chosen):
        if (again := ended.get(index)) is not None:
            difference, count = _difference(study, row, again)
            other = ended.get(len(scenes) + len(level)) if index == tight else None
            found.append(Repeated(row["bounds"], row["record"], again, without.get(index), difference, count, other))
    return found


def error_words(solver: Solver, run: Repeated | None) -> list[str]:
    """What the tolerance of the runs says of the error of results, in lines. run: which was made again with `finer`."""
    lines = [
        f"The tolerance of the runs is rtol = {solver.rtol:g} (method {solver.method}): the error that one time step "
        "may have. It is no error of a result, since the errors of steps add up, or decay. The page accuracy of the "
        "documentation has the errors of results that were measured at several tolerances, on single bearings and on "
        "buildings."
    ]
    if run is None:
        return [
            *lines,
            "The error of the results was not measured: no run at a smaller tolerance was made for this page, or it "
            "did not reach its end. `msfp-gen run SCENE --error 0.5%` finds the tolerance for a given error, and "
            "states the error of its run.",
        ]
    return [
        *lines,
        f"For this page the run of {run.record} at {run.case} was made once more at rtol = {solver.rtol / FINER:g}. "
        "The differences in the table estimate the errors of this run; the errors of the other runs, at the same "
        "tolerance, were not measured. These are errors of the solution of the equations. They contain no error of the "
        "model, of the properties of the bearings or of the ground motions.",
    ]


def finer_table(study: Study, run: Repeated) -> Table:
    """Quantities of a run at the tolerance of all runs and at a smaller one, and their difference."""
    rows = []
    for name in COMPARED:
        if (source := study.keep.known.get(name)) is None:
            continue
        pair = [source.value(result.entry, None) for result in (run.result, run.finer)]
        if None in pair:
            continue
        unit, scale = shown_as(source.quantity.unit)
        coarse, fine = (float(value) * scale for value in pair)
        change = f"{100 * abs(coarse - fine) / abs(fine):.2g} %" if fine else "-"
        words = source.words(name)
        rows.append((f"{words} [{unit}]" if unit else words, f"{coarse:.5g}", f"{fine:.5g}", change))
    steps = (str(result.entry("counters")["steps"]) for result in (run.result, run.finer))
    rtol = run.result.scene.solver.rtol
    columns = ("", f"rtol = {rtol:g}", f"rtol = {rtol / FINER:g}", "difference")
    title = f"{run.record} at {run.case}, at the tolerance of all runs and at a smaller one"
    return Table(title, columns, [*rows, ("time steps", *steps, "-")])


def has_vertical(motion: Motion) -> bool:
    """Whether the ground moves vertically."""
    return bool(np.abs(motion.acceleration(motion.knots)[:, 2]).max() > NOTHING)


def without_vertical(motion: Motion) -> Motion:
    """The motion without its component along E3."""
    coefficients = motion.coefficients.copy()
    coefficients[:, 2] = 0.0
    return replace(motion, coefficients=coefficients)


def _difference(study: Study, row: Any, result: Any) -> tuple[float, int]:
    """Largest relative difference of the quantities of a run from a row, and the number of quantities."""
    values, _ = study.keep.values(result, {})
    pairs = [(values[name], row[name]) for name in study.keep.numbers if row[name] == row[name]]  # not NaN
    known = [(np.inf if again is None or again != again else again, before) for again, before in pairs]  # not NaN
    most = max((abs(again - before) / abs(before or 1.0) for again, before in known), default=0.0)
    return float(most), len(pairs)


def repeat_words(runs: Sequence[Repeated]) -> str:
    """Which runs were made again, and how they agree with the rows, in a line."""
    names = ", ".join(f"{run.record} at {run.case}" for run in runs)
    most, count = max(run.difference for run in runs), runs[0].compared
    agree = "each equal to its row" if most == 0 else f"which differ from their rows by at most {most:.1g} of the value"
    return (
        f"Rows in time are not kept. The run with the largest displacement at each bound was made again for this page: "
        f"{names}. {count} quantities of each were compared, {agree}."
    )


def plot_loops(runs: Sequence[Repeated], name: str) -> Figure:
    """Force over displacement at each bound, all rows: sum over the bearings, and the bearing that moves most."""
    several = len(runs[0].result.bearings) > 1
    with page(9.5, 0.6 + 2.7 * (1 + several)) as figure:
        headline(figure, f"{name}: loops of the runs with the largest displacement")
        grid = figure.subplots(1 + several, len(runs), squeeze=False, sharex=True, sharey="row")
        everything = [_sum(run.result) for run in runs]
        own = [_most(run.result) for run in runs]
        for row, loops in zip(grid, (everything, own), strict=False):
            scale = engineering(np.concatenate([forces.ravel() for _, _, forces in loops]), "N")
            for axes, (label, moved, forces), run in zip(row, loops, runs, strict=True):
                _loop(axes, moved, forces, scale)
                axes.set_title(f"{run.case}, {plain(run.record)}: {plain(label)}", fontsize=9.5)
            row[0].set_ylabel(f"force F [{scale.unit}]")
            row[-1].legend(loc="lower right")
        for axes in grid[-1]:
            axes.set_xlabel(displacement_label())
    return figure


def _loop(axes: Axes, moved: Array, forces: Array, scale: Scale) -> None:
    for axis in (0, 1):
        axes.plot(
            displacement(moved[:, axis]),
            force(forces[:, axis], scale),
            color=COLOURS[axis],
            linewidth=HAIR,
            label=f"along E{subscript(axis + 1)}",
        )


def _sum(result: Any) -> tuple[str, Array, Array]:
    """Label, mean displacement and sum of the forces of all bearings, shape (k, 3) [m], [N]."""
    rows = [one.history for one in result.bearings]
    moved, forces = (np.array([getattr(one, name) for one in rows]) for name in ("displacement", "top_force"))
    label = f"all {len(rows)} bearings" if len(rows) > 1 else "the bearing"
    return label, moved.mean(axis=0), forces.sum(axis=0)


def _most(result: Any) -> tuple[str, Array, Array]:
    """Label, displacement and forces of the bearing that moves most, shape (k, 3) [m], [N]."""
    one = max(result.bearings, key=lambda bearing: float(bearing.history.horizontal.max()))
    return one.label, one.history.displacement, one.history.top_force


def vertical_table(study: Study, runs: Sequence[Repeated]) -> Table:
    """Quantities with the vertical component of the ground and without it, and their ratio."""
    rows = []
    for name in COMPARED:
        source = study.keep.known.get(name)
        if source is None:
            continue
        unit, scale = shown_as(source.quantity.unit)
        cells = []
        for run in runs:
            pair = [source.value(result.entry, None) for result in (run.result, run.level)]
            known = [np.nan if value is None else float(value) * scale for value in pair]
            ratio = known[0] / known[1] if known[1] else np.nan
            cells += ["-" if np.isnan(value) else f"{value:.4g}" for value in known]
            cells.append("-" if np.isnan(ratio) else f"{ratio:.2f}")
        rows.append((f"{source.words(name)} [{unit}]" if unit else source.words(name), *cells))
    shares = [(shear_share(run.result), shear_share(run.level)) for run in runs]
    cells = [cell for a, b in shares for cell in (f"{a:.4f}", f"{b:.4f}", f"{a / b:.2f}" if b else "-")]
    rows.append(("largest base shear over the axial forces of the same instant [-]", *cells))
    columns = ("", *(f"{run.case} {word}" for run in runs for word in ("with", "without", "ratio")))
    return Table("the same runs with the vertical component of the ground and without it", columns, rows)


def shear_share(result: Any) -> float:
    """The largest horizontal force over the sum of the axial forces of the same row [-]."""
    _, _, forces = _sum(result)
    vertical, rest = np.abs(forces[:, 2]), float(sum(result.scene.loads_at_rest))
    loaded = vertical > LOADED * rest
    return float((np.hypot(*forces[loaded, :2].T) / vertical[loaded]).max())


def plot_vertical(runs: Sequence[Repeated]) -> Figure:
    """A run with the vertical component and without it: base shear, axial force, accelerations over the height."""
    run = next((one for one in runs if one.case == "nominal"), runs[0])
    pair = (("with", run.result, INK), ("without", run.level, COLOURS[1]))
    floors = run.result.entry("floors")
    with page(9.5, 4.2) as figure:
        headline(figure, f"{run.record}, {run.case}: with the vertical component of the ground and without it")
        row = figure.subplots(1, 3 if floors else 2, width_ratios=(1.3, 1.3, 1)[: 3 if floors else 2])
        _, _, forces = _sum(run.result)
        scale, shear = engineering(forces[:, :2], "N"), np.hypot(*forces[:, :2].T)
        at = float(run.result.time[int(shear.argmax())])
        index = int(np.argmax([np.ptp(one.history.top_force[:, 2]) for one in run.result.bearings]))
        bearing = run.result.bearings[index]
        for word, result, colour in pair:
            shown = np.abs(result.time - at) <= BESIDE
            _, _, forces = _sum(result)
            own = np.abs(result.bearings[index].history.top_force[:, 2]) / run.result.scene.loads_at_rest[index]
            for axes, values in ((row[0], scale.factor * np.hypot(*forces[:, :2].T)), (row[1], own)):
                axes.plot(result.time[shown], values[shown], color=colour, linewidth=THIN, label=word)
            if floors:
                _accelerations(row[2], result.entry("floors"), colour, word)
        row[0].set(title="base shear", xlabel="time t [s]", ylabel=f"in the plane [{scale.unit}]")
        row[1].set(title=f"axial force of {plain(bearing.label or 'the bearing')}", xlabel="time t [s]")
        row[1].set_ylabel("over the load at rest [-]")
        row[1].axhline(1.0, color=FAINT, linewidth=HAIR)
        for axes in row:
            axes.legend(loc="best")
    return figure


def _accelerations(axes: Axes, floors: Sequence[Any], colour: str, word: str) -> None:
    """Largest accelerations over the height: in the plane, and dashed vertically."""
    heights = [floor["height"] for floor in floors]
    for component, line in (("radial", "-"), ("E3", "--")):
        values = [floor["peak_corner_acceleration"][component] for floor in floors]
        label = ("in the plane" if component == "radial" else "vertical") if word == "with" else None
        axes.plot(values, heights, line, color=colour, marker="o", markersize=3, label=label)
    axes.set(title="accelerations at corners", xlabel="[m/s²]", ylabel="height z [m]")
    axes.set_xlim(left=0.0)
