"""What accuracy costs: error against seconds and against Newton iterations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.errors import InputError
from msfp_gen.figures.style import COLOURS, FAINT, INK, LINE, SMALL, THIN, headline, page
from msfp_gen.history import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Table = Mapping[str, Mapping[str, ArrayLike]]
COSTS = {"seconds": "seconds of wall time", "newton": "Newton iterations"}
FLAGS = ("failed", "wrong", "cut")
MARKERS = "osD^vP*X<>"
ROOF = 0.965  # height at which runs without an error stand, as a share of the axes


def plot_work_precision(
    table: Table,
    path: str | Path | None = None,
    *,
    errors: Mapping[str, str] | None = None,
    floors: Mapping[str, Mapping[str, float]] | None = None,
    title: str = "Work and precision",
) -> Figure:
    """Error against cost for several methods, on logarithmic axes: a row of panels for every kind of error.

    Args:
        table: for every method columns of one length k, a point each: `seconds` [s]; `newton`, left out where a method
            counts none; errors, relative, by name; and the flags `failed` (the run ended in an error: marked by a cross
            at the top), `cut` (it was cut off, and its costs are what the whole was expected to take: marked by an
            arrow at the top) and `wrong` (the run claimed success, and its error says otherwise: ringed), left out
            where no point has them.
        path: where to write it: .png, .svg or .pdf.
        errors: the columns that are errors, and what to call them; None: every column that is no cost and no flag.
        floors: lines below which an error means nothing, such as the disagreement of two references: for each line the
            value by name of the error.
        title: of the figure.

    Raises:
        InputError: a table without a method, an error or a cost; columns of different length; a path.
    """
    columns = _checked(table)
    named = errors or {name: name.replace("_", " ") for name in _error_names(columns)}
    costs = [cost for cost in COSTS if any(cost in given for given in columns.values())]
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
            row[0].set_ylabel(f"{label}, relative")
        for axes, cost in zip(grid[-1], costs, strict=True):
            axes.set_xlabel(COSTS[cost])
            _whole_decades(axes, [given[cost] for given in columns.values() if cost in given])
        _legend(figure, grid[0, 0], columns)
    return figure


def _checked(table: Table) -> dict[str, dict[str, Array]]:
    """The table as arrays. InputError names the method and the column that does not fit."""
    if not table:
        raise InputError("table is empty: give at least one method with its columns")
    out = {}
    for method, given in table.items():
        columns = {name: np.atleast_1d(np.asarray(values, dtype=float)) for name, values in given.items()}
        lengths = {len(values) for values in columns.values()}
        if len(lengths) != 1:
            found = ", ".join(f"{name} {len(values)}" for name, values in columns.items()) or "none"
            raise InputError(f"table[{method!r}]: columns of one length are needed; given {found}")
        out[method] = columns
    return out


def _error_names(columns: Mapping[str, Mapping[str, Array]]) -> list[str]:
    names = [name for given in columns.values() for name in given if name not in (*COSTS, *FLAGS)]
    return list(dict.fromkeys(names))


def _draw_panel(
    axes: Axes, columns: Mapping[str, Mapping[str, Array]], error: str, cost: str,
    floors: Mapping[str, Mapping[str, float]],
) -> None:  # fmt: skip
    axes.set(xscale="log", yscale="log")
    for index, (method, given) in enumerate(columns.items()):
        if cost not in given or error not in given:
            continue
        look = _look(index)
        x, y = given[cost], given[error]
        failed, wrong, cut = (given.get(flag, np.zeros(len(x))) > 0 for flag in FLAGS)
        good = ~failed & ~cut & np.isfinite(y) & (y > 0)
        axes.plot(x[good], y[good], **look, label=method)
        axes.plot(x[good & wrong], y[good & wrong], **RING)
        for lost, mark in ((failed, CROSS), (cut, ARROW)):
            at = x[lost & (x > 0)]
            axes.plot(at, np.full(len(at), ROOF), **mark | {"color": look["color"]},
                      transform=axes.get_xaxis_transform())  # fmt: skip
    for name, values in floors.items():
        if error in values:
            axes.axhline(values[error], color=INK, linewidth=THIN, linestyle=(0, (5, 3)))
            axes.annotate(name, (0.01, values[error]), xycoords=("axes fraction", "data"), xytext=(0, 2),
                          textcoords="offset points", fontsize=SMALL, color=INK, in_layout=False)  # fmt: skip
    axes.grid(which="minor", visible=False)


def _whole_decades(axes: Axes, costs: list[Array]) -> None:
    """Limits at powers of ten: each is a tick with a label, however narrow the data."""
    from matplotlib.ticker import NullFormatter

    values = np.concatenate(costs)
    exponents = np.log10(values[values > 0])
    if len(exponents):
        axes.set_xlim(10 ** np.floor(exponents.min()), 10 ** np.ceil(exponents.max() + 1e-9))
    axes.xaxis.set_minor_formatter(NullFormatter())


RING: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 13, "markerfacecolor": "none",
                        "markeredgecolor": INK, "markeredgewidth": LINE, "zorder": 5}  # fmt: skip
ARROW: dict[str, Any] = {"linestyle": "none", "marker": 9, "markersize": 7, "fillstyle": "none"}
CROSS: dict[str, Any] = {"linestyle": "none", "marker": "x", "markersize": 7, "markeredgewidth": LINE}

MARKS = (("failed", CROSS | {"color": FAINT}, "failed"), ("wrong", RING, "wrong success"),
         ("cut", ARROW | {"color": FAINT}, "cut off, cost expected"))  # fmt: skip


def _look(index: int) -> dict[str, Any]:
    """Colour and marker of a method; past the colours the lines are dashed, so that no two look the same."""
    return {"color": COLOURS[index % len(COLOURS)], "marker": MARKERS[index % len(MARKERS)], "markersize": 5,
            "linestyle": ("-", "--", ":")[index // len(COLOURS) % 3]}  # fmt: skip


def _legend(figure: Figure, axes: Axes, columns: Mapping[str, Mapping[str, Array]]) -> None:
    """Every method, also one that a panel lacks, and the marks that occur."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **_look(index), label=method) for index, method in enumerate(columns)]
    for flag, look, text in MARKS:
        if any(np.any(given.get(flag, np.zeros(1)) > 0) for given in columns.values()):
            handles.append(Line2D([], [], **look, label=text))
    figure.legend(handles=handles, loc="outside right upper")
