"""Figures that are not of one run: ground motions with baseline correction, response spectra, work and precision."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from operator import mul
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import G
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    INK,
    LINE,
    SMALL,
    THIN,
    Scale,
    distinct_colours,
    engineering,
    headline,
    page,
    plain,
    subscript,
)
from msfp_gen.motions.records import Corrected, Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOM = 1.25  # height of a panel over the peak of the corrected motion; the raw motion may leave the panel
BLANK = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}  # behind a note
# Attribute, symbol, unit, and whether the unit takes a prefix: accelerations stay in m/s^2 for comparison.
ROWS = (("acceleration", "a", "m/s²", False), ("velocity", "v", "m/s", True), ("displacement", "d", "m", True))


def plot_correction(record_before: Record, record_after: Corrected, path: str | Path | None = None) -> Figure:
    """Acceleration, velocity and displacement of each component before (grey) and after baseline correction.

    "Before" is the raw acceleration with its mean, integrated from rest over the time window of the corrected motion.
    If the motion was scaled, both are, and the title gives the factor. Panels fit the corrected motion; the final value
    of the raw motion is written in. Raises InputError for a path that cannot be written.
    """
    about = record_after.metadata
    start, factor = float(about.get("window_start", 0.0)), float(about.get("scale", 1.0))
    raw = _integrated(record_before, start, len(record_after.time), factor)
    moving = np.flatnonzero(np.any(record_before.acceleration, axis=0)).tolist()
    with page(3.7 * len(moving) + 0.6, 6.8, path) as figure:
        headline(
            figure, f"{record_before.name or 'record'}: as recorded (grey) and {_processing(record_after, factor)}"
        )
        grid = figure.subplots(3, len(moving), squeeze=False, sharex=True)
        for column, axis in zip(grid.T, moving, strict=True):
            for axes, (name, symbol, unit, prefixed) in zip(column, ROWS, strict=True):
                before, after = raw[name][:, axis], getattr(record_after, name)[:, axis]
                scale = engineering(after, unit) if prefixed else Scale(1.0, unit)
                _compare(axes, record_after.time, before * scale.factor, after * scale.factor)
                if prefixed:
                    _note_end(axes, before, unit)
                axes.set_ylabel(f"{symbol}{subscript(axis + 1)} [{scale.unit}]")
            channel = record_before.channels[axis]
            column[0].set_title(f"E{subscript(axis + 1)}" + (f"  ({plain(channel)})" if channel else ""))
            column[-1].set_xlabel("time t [s]")
    return figure


def plot_response_spectrum(
    periods: ArrayLike,
    spectra: Mapping[str, ArrayLike],
    path: str | Path | None = None,
    *,
    target: tuple[ArrayLike, ArrayLike] | None = None,
    mean: ArrayLike | None = None,
    damping: float = 0.05,
    title: str = "Response spectrum",
) -> Figure:
    """Pseudo-acceleration [m/s^2], with g to the right, over the period [s] on a logarithmic axis.

    Args:
        periods: ndarray, shape (k,), [s], above zero.
        spectra: label -> ndarray, shape (k,), [m/s^2].
        path: file to write: .png, .svg or .pdf; None: none.
        target: periods [s] and accelerations [m/s^2] of a target spectrum, drawn for comparison.
        mean: ndarray, shape (k,), [m/s^2]: the mean of the spectra, drawn over them.
        damping: ratio to critical damping, for the title.
        title: of the figure.

    Raises:
        InputError: a period that is not above zero, a spectrum of another length, or a path that cannot be written.
    """
    x = np.asarray(periods, dtype=float)
    if x.ndim != 1 or not len(x) or not np.all(x > 0):
        raise InputError("periods: give at least one, all above zero [s]")
    curves = {label: np.asarray(values, dtype=float) for label, values in spectra.items()}
    for label, values in curves.items():
        if values.shape != x.shape:
            raise InputError(f"spectra[{label!r}] has shape {values.shape}: give one value per period, {x.shape}")
    with page(7.6, 4.8, path) as figure:
        headline(figure, title)
        axes = figure.subplots()
        for colour, (label, values) in zip(distinct_colours(len(curves)), curves.items(), strict=True):
            axes.plot(x, values, color=colour, label=label)
        if mean is not None:
            axes.plot(x, np.asarray(mean, dtype=float), color=INK, linewidth=2.5, label="mean")
        if target is not None:
            axes.plot(*(np.asarray(v, dtype=float) for v in target), color=INK, linestyle=(0, (5, 3)), label="target")
        axes.set(
            xscale="log",
            xlabel="period T [s]",
            ylabel="pseudo-acceleration Sₐ [m/s²]",
            title=f"{100 * damping:.3g} % of critical damping",
        )
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("{x:g}" if x.max() < 10 * x.min() else "")
        axes.set_ylim(bottom=0)
        right = axes.secondary_yaxis("right", functions=(partial(mul, 1 / G), partial(mul, G)))
        right.set_ylabel("Sₐ [g]")
        right.spines["right"].set_visible(True)
        axes.legend(loc="upper right")
    return figure


def _processing(motion: Corrected, factor: float) -> str:
    """The processing of a record, for the title."""
    untouched = str(motion.metadata.get("correction", "")).startswith("none")
    return ("not corrected" if untouched else "corrected") + ("" if factor == 1 else f", both scaled by {factor:.4g}")


def _integrated(record: Record, start: float, points: int, factor: float) -> dict[str, Array]:
    """A window of the raw record, scaled, and its integrals from rest by the trapezoidal rule, shape (points, 3)."""
    from scipy.integrate import cumulative_trapezoid

    first, options = round(start / record.time_step), {"dx": record.time_step, "axis": 0, "initial": 0}
    acceleration = factor * record.acceleration[first : first + points]
    velocity = cumulative_trapezoid(acceleration, **options)
    displacement = cumulative_trapezoid(velocity, **options)
    return {"acceleration": acceleration, "velocity": velocity, "displacement": displacement}


def _compare(axes: Axes, time: Array, raw: Array, values: Array) -> None:
    axes.plot(time[: len(raw)], raw, color=FAINT, linewidth=LINE)
    axes.plot(time, values, color=COLOURS[0], linewidth=THIN)
    height = ROOM * float(np.abs(values).max()) or 1.0
    axes.set_ylim(-height, height)
    axes.margins(x=0.01)


def _note_end(axes: Axes, raw: Array, unit: str) -> None:
    """Write the final value of the raw velocity or displacement: the drift that correction removes."""
    end = engineering(raw[-1:], unit)
    axes.annotate(
        f"as recorded: ends at {raw[-1] * end.factor:.3g} {end.unit}",
        (0.98, 0.97),
        ha="right",
        va="top",
        xycoords="axes fraction",
        fontsize=SMALL,
        color=INK,
        bbox=BLANK,
    )


COSTS = {"seconds": "seconds of wall time", "newton": "Newton iterations"}
FLAGS = ("failed", "wrong", "cut")
MARKERS = "osD^vP*X<>"
TOP = 0.965  # height of the markers of runs without a known error, over the height of the axes


def plot_work_precision(
    table: Mapping[str, Mapping[str, ArrayLike]],
    path: str | Path | None = None,
    *,
    errors: Mapping[str, str] | None = None,
    floors: Mapping[str, Mapping[str, float]] | None = None,
    marks: Mapping[str, Mapping[str, float]] | None = None,
    title: str = "Work and precision",
) -> Figure:
    """Error over cost of several methods, on logarithmic axes, with one row of panels for each kind of error.

    Args:
        table: method -> column -> values, shape (k,), one per run. Columns are `seconds`, wall time [s]; `newton`,
            Newton iterations (may be missing); relative errors [-] under any name; and flags (may be missing):
            `failed`, drawn as a cross at the top; `cut`, a run that was cut off with its expected cost, drawn as an
            arrow at the top; `wrong`, a run that reported success with a wrong result, drawn with a ring.
        path: file to write: .png, .svg or .pdf; None: none.
        errors: column -> label of the errors; None: every column that is neither cost nor flag.
        floors: label -> column -> error, drawn as a line below which errors are not known, such as the difference of
            two references.
        marks: label -> column -> value, of a run that is marked and named, such as the default.
        title: of the figure.

    Raises:
        InputError: a table without a method, an error or a cost, columns of different length, or a path that cannot be
            written.
    """
    columns = _checked(table)
    named = errors or {name: name.replace("_", " ") for name in _error_names(columns)}
    costs = [cost for cost in COSTS if any(cost in column for column in columns.values())]
    for what, names in (("error", named), ("cost", costs)):
        if not names:
            raise InputError(
                f"table has no {what}: give a column such as {'force_max' if what == 'error' else 'seconds'}"
            )
    height = 4.0 if len(named) < 3 else 3.0
    with page(5.6 * len(costs) + 1.6, height * len(named) + 0.6, path) as figure:
        headline(figure, title)
        grid = figure.subplots(len(named), len(costs), squeeze=False, sharex="col", sharey="row")
        for row, (error, label) in zip(grid, named.items(), strict=True):
            for axes, cost in zip(row, costs, strict=True):
                _draw_panel(axes, columns, error, cost, floors or {})
                _mark(axes, {label: (at.get(cost), at.get(error)) for label, at in (marks or {}).items()})
            row[0].set_ylabel(f"{label}, relative")
        for axes, cost in zip(grid[-1], costs, strict=True):
            axes.set_xlabel(COSTS[cost])
            _whole_decades(axes, [column[cost] for column in columns.values() if cost in column])
        _legend(figure, columns)
    return figure


def _mark(axes: Axes, marks: Mapping[str, tuple[float | None, float | None]]) -> None:
    """Name runs by their cost and error, where both are known."""
    for label, (cost, error) in marks.items():
        if cost is not None and error is not None:
            axes.plot([cost], [error], marker="o", markersize=13, fillstyle="none", color=INK, linestyle="none")
            axes.annotate(label, (cost, error), xytext=(10, 8), textcoords="offset points", color=INK, bbox=BLANK)


def _checked(table: Mapping[str, Mapping[str, ArrayLike]]) -> dict[str, dict[str, Array]]:
    """The table as arrays. Raises InputError that names a method whose columns differ in length."""
    if not table:
        raise InputError("table is empty: give at least one method with its columns")
    out = {}
    for method, method_columns in table.items():
        columns = {name: np.atleast_1d(np.asarray(values, dtype=float)) for name, values in method_columns.items()}
        lengths = {len(values) for values in columns.values()}
        if len(lengths) != 1:
            counts = ", ".join(f"{name} {len(values)}" for name, values in columns.items()) or "none"
            raise InputError(f"table[{method!r}]: columns of one length are needed; given {counts}")
        out[method] = columns
    return out


def _error_names(columns: Mapping[str, Mapping[str, Array]]) -> list[str]:
    names = [name for column in columns.values() for name in column if name not in (*COSTS, *FLAGS)]
    return list(dict.fromkeys(names))


def _draw_panel(
    axes: Axes,
    columns: Mapping[str, Mapping[str, Array]],
    error: str,
    cost: str,
    floors: Mapping[str, Mapping[str, float]],
) -> None:
    axes.set(xscale="log", yscale="log")
    for index, (method, column) in enumerate(columns.items()):
        if cost not in column or error not in column:
            continue
        style = _line_style(index)
        x, y = column[cost], column[error]
        failed, wrong, cut = (column.get(flag, np.zeros(len(x))) > 0 for flag in FLAGS)
        good = ~failed & ~cut & np.isfinite(y) & (y > 0)
        axes.plot(x[good], y[good], **style, label=method)
        axes.plot(x[good & wrong], y[good & wrong], **RING)
        for unknown, mark in ((failed, CROSS), (cut, ARROW)):
            at = x[unknown & (x > 0)]
            axes.plot(
                at, np.full(len(at), TOP), **mark | {"color": style["color"]}, transform=axes.get_xaxis_transform()
            )
    for name, values in floors.items():
        if error in values:
            axes.axhline(values[error], color=INK, linewidth=THIN, linestyle=(0, (5, 3)))
            axes.annotate(
                name,
                (0.01, values[error]),
                xycoords=("axes fraction", "data"),
                xytext=(0, 2),
                textcoords="offset points",
                fontsize=SMALL,
                color=INK,
                in_layout=False,
            )
    axes.grid(which="minor", visible=False)


def _whole_decades(axes: Axes, costs: list[Array]) -> None:
    """Set the limits to powers of ten, so that narrow data have labelled ticks too."""
    from matplotlib.ticker import NullFormatter

    values = np.concatenate(costs)
    exponents = np.log10(values[values > 0])
    if len(exponents):
        axes.set_xlim(10 ** np.floor(exponents.min()), 10 ** np.ceil(exponents.max() + 1e-9))
    axes.xaxis.set_minor_formatter(NullFormatter())


RING: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 13,
    "markerfacecolor": "none",
    "markeredgecolor": INK,
    "markeredgewidth": LINE,
    "zorder": 5,
}
ARROW: dict[str, Any] = {"linestyle": "none", "marker": 9, "markersize": 7, "fillstyle": "none"}
CROSS: dict[str, Any] = {"linestyle": "none", "marker": "x", "markersize": 7, "markeredgewidth": LINE}

MARKS = (
    ("failed", CROSS | {"color": FAINT}, "failed"),
    ("wrong", RING, "wrong success"),
    ("cut", ARROW | {"color": FAINT}, "cut off, cost expected"),
)


def _line_style(index: int) -> dict[str, Any]:
    """Colour, marker and line style of a method; lines are dashed when the colours repeat."""
    return {
        "color": COLOURS[index % len(COLOURS)],
        "marker": MARKERS[index % len(MARKERS)],
        "markersize": 5,
        "linestyle": ("-", "--", ":")[index // len(COLOURS) % 3],
    }


def _legend(figure: Figure, columns: Mapping[str, Mapping[str, Array]]) -> None:
    """One legend for the figure: all methods, and the flags that occur."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **_line_style(index), label=method) for index, method in enumerate(columns)]
    for flag, style, text in MARKS:
        if any(np.any(column.get(flag, np.zeros(1)) > 0) for column in columns.values()):
            handles.append(Line2D([], [], **style, label=text))
    figure.legend(handles=handles, loc="outside right upper")
