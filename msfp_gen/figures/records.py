"""Figures of ground motions: baseline correction and response spectra."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from operator import mul
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    INK,
    LINE,
    SMALL,
    THIN,
    Scale,
    distinct,
    engineering,
    headline,
    page,
    plain,
    subscript,
)
from msfp_gen.motions.records import Corrected, Record
from msfp_gen.motions.records.record import G

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
        for colour, (label, values) in zip(distinct(len(curves)), curves.items(), strict=True):
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
    first = round(start / record.time_step)
    acceleration = factor * record.acceleration[first : first + points]
    velocity = _integral(acceleration, record.time_step)
    return {"acceleration": acceleration, "velocity": velocity, "displacement": _integral(velocity, record.time_step)}


def _integral(values: Array, step: float) -> Array:
    return np.concatenate([np.zeros((1, values.shape[1])), np.cumsum((values[1:] + values[:-1]) * step / 2, axis=0)])


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
