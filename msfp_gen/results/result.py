"""`Result`: the result of a run; `AnyResult`: what those of a building and of one of its bearings offer alike."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.results import dataset
from msfp_gen.results.characterise import Characterisation
from msfp_gen.results.characterise import characterise as characterise_bearing
from msfp_gen.results.files import ResultFiles, Storage, read_result
from msfp_gen.results.note import by_importance
from msfp_gen.results.run_data import BearingData, RunData
from msfp_gen.results.summary import (
    rows_of_bearing,
    summarise,
    summarise_gradients,
    surface_table,
    time_row,
    transition_table,
    work_rows,
)
from msfp_gen.results.verdict import Verdict, verdict_of
from msfp_gen.scene.system import kinds

if TYPE_CHECKING:
    import xarray as xr

MAX_NOTES = 3  # printed, the most important ones; the others are counted
MAX_POINTS = 600  # of the curve
WIDTH, HEIGHT, MARGIN = 320, 200, 8  # of the curve [px]
Rows = list[tuple[str, str]]  # label and value


class Curve(NamedTuple):
    """A curve for a notebook: points x, y, ndarrays, shape (k,), [units of the caption], and a caption."""

    x: Array
    y: Array
    caption: str


class AnyResult(ResultFiles, ABC):
    """Summary, printed text, tables and characterisation of a result.

    counters: of the work of the solver. notes: messages of the monitors, in order of time (docs/effects.md).
    """

    @cached_property
    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """Main results in SI units, as values that JSON can hold."""

    @abstractmethod
    def characterise(self) -> Characterisation:
        """Effective properties and demands. Raises InputError where nothing moved."""

    @abstractmethod
    def main_results(self) -> Rows:
        """Label and value of the main results, seven rows at most."""

    @property
    @abstractmethod
    def curve(self) -> Curve:
        """The curve that says most about the run."""

    @property
    @abstractmethod
    def bearings(self) -> Sequence[OneBearing]:
        """The results of the bearings of the run."""

    @abstractmethod
    def part_tables(self) -> list[Table]:
        """Tables of the surfaces of a bearing, or of the parts of a building."""

    def work_rows(self) -> Rows:
        """Label and value of the energies of the run and of the work of the solver."""
        return []

    def tables(self) -> list[Table]:
        """The main results, the verdict and the parts as tables, for the console and the report."""
        first = Table(self.title, (), [*self.stated_rows, *self.work_rows()])
        judged = [self.verdict.table] if self.verdict.readings else []
        return [first, *judged, *self.part_tables()]

    @cached_property
    def verdict(self) -> Verdict:
        """What the device was asked to bear, against its limits (docs/limits.md)."""
        stopped = float(self.bearings[0].history.time[-1]) if self.status == "stopped" else None
        failure = "" if self.succeeded else self.status_text
        whole = self.scene.fidelity == "equivalent"
        return verdict_of(self.bearings, self.scene.limits, failure, stopped, whole)

    @property
    def status_text(self) -> str:
        """How the run ended, with the message of a run that failed."""
        return self.status + (f": {self.message}" if self.message else "")

    @property
    def stated_rows(self) -> Rows:
        """Label and value of the main results after the status and the verdict."""
        return [("status", self.status_text), ("verdict", self.verdict.text), *self.main_results()]

    def printed_rows(self) -> Rows:
        """`stated_rows` with the first notes."""
        lines, others = self.first_notes
        more = f"; {others} more in .notes" if others else ""
        shown = [("notes", "; ".join(lines) + more)] if lines else []
        return [*self.stated_rows, *shown]

    @property
    def first_notes(self) -> tuple[list[str], int]:
        """The lines of the most important notes, `MAX_NOTES` at most, and how many others there are."""
        lines = [note.line for note in by_importance(self.notes)]
        return lines[:MAX_NOTES], max(0, len(lines) - MAX_NOTES)

    def __repr__(self) -> str:
        """The main results in ten lines at most."""
        rows = [f"  {label:<18}{_one_line(value)}" for label, value in self.printed_rows()]
        return "\n".join([f"Result of {self.title}", *rows])

    def _repr_html_(self) -> str:
        """The main results as a table beside a curve, for a notebook."""
        cells = "".join(
            f"<tr><th>{escape(label)}</th><td>{escape(_one_line(value))}</td></tr>"
            for label, value in self.printed_rows()
        )
        x, y, caption = self.curve
        return (
            f"<div><b>{escape(self.title)}</b><div style='display:flex;gap:1em'><table>{cells}</table>"
            f"<figure style='margin:0'>{_svg(x, y)}<figcaption>{escape(caption)}</figcaption></figure></div></div>"
        )


class OneBearing(AnyResult, BearingData):
    """The result of one bearing, alone or of a building."""

    @property
    def bearings(self) -> tuple[OneBearing]:
        """The bearing itself."""
        return (self,)

    def main_results(self) -> Rows:
        """Label and value of the peaks of the bearing."""
        return rows_of_bearing(self.summary)

    @property
    def curve(self) -> Curve:
        """The hysteresis loop: force over displacement along the direction of the largest displacement."""
        rows = self.history
        return Curve(rows.path[0], rows.top_force[:, :2] @ rows.direction, "force over displacement")

    def part_tables(self) -> list[Table]:
        """Tables of the surfaces, and of the transitions of a monotonic run; none of one pendulum in their place."""
        if self.one_pendulum:
            return []
        changes = self.summary.get("transitions")
        more = [] if changes is None else [transition_table(changes)]
        return [surface_table(self.summary, self.bearing.surfaces), *more]

    def characterise(self) -> Characterisation:
        """Effective stiffness, damping, sliding regimes, remaining capacity, velocity and heat (docs/characterise.md).

        What the rows of a bearing of a building do not have is None, and the notes say so. Raises InputError where the
        bearing did not move.
        """
        return characterise_bearing(self)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Result(OneBearing, RunData):
    """The result of `simulate`; a RunError has one in `.result` if the run failed after its start.

    status: "ok", "stopped" (the stop condition of the scene was met) or the name of a failure; message: one line of
    text, "" for a run that succeeded. counters: the work of the solver. provenance: versions, model keys and solver
    options with which the result was computed. notes: messages of the monitors, in order of time (docs/effects.md).
    """

    storage: ClassVar[Storage] = dataset.STORAGE

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results of the run in SI units, as values that JSON can hold; `summary.summarise` lists the keys."""
        return summarise(self) | {"verdict": self.verdict.as_dict}

    def main_results(self) -> Rows:
        """Label and value of the main results."""
        return [time_row(self.summary), *super().main_results()]

    def work_rows(self) -> Rows:
        """Label and value of the energy of the run and of the work of the solver."""
        return work_rows(self.summary)

    @cached_property
    def gradient(self) -> xr.Dataset:
        """Derivatives of the dataset with respect to parameters, first dimension `parameter`; docs/gradients.md.

        Raises InputError where the run computed none.
        """
        return dataset.to_gradient_dataset(self)

    @cached_property
    def gradient_summary(self) -> dict[str, dict[str, Any]]:
        """Derivatives of the scalars of the summary, by the path of the parameter; docs/gradients.md.

        Raises InputError where the run computed none.
        """
        return summarise_gradients(self)


def _svg(x: Array, y: Array) -> str:
    rows = np.unique(np.linspace(0, len(x) - 1, min(MAX_POINTS, len(x))).astype(int))
    x, y = _scaled(x[rows], WIDTH), HEIGHT - _scaled(y[rows], HEIGHT)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return (
        f'<svg width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="loop">'
        f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1"/></svg>'
    )


def _scaled(values: Array, size: float) -> Array:
    """Values mapped to a margin inside 0 ... `size`."""
    low, spread = float(values.min()), float(np.ptp(values)) or 1.0
    scaled: Array = MARGIN + (values - low) / spread * (size - 2 * MARGIN)
    return scaled


def _one_line(text: str) -> str:
    return " ".join(text.split())


def characterise(result: Any) -> Any:
    """The characterisation of a run, of one bearing or of a building; docs/characterise.md and docs/buildings.md.

    Raises InputError where nothing moved.
    """
    if not isinstance(result, AnyResult):
        raise InputError(f"result: this is a {type(result).__name__}; give the result of simulate(scene)")
    return result.characterise()


def load_result(path: str | Path) -> Any:
    """The result in a file that `save` wrote as netCDF: a `Result`, or that of another system, such as of a building.

    Raises InputError of one line that names the file and the remedy for any other file.
    """
    return read_result(path, _kind_of)


def _kind_of(source: str) -> Any:
    if source == Result.source:
        return Result
    results = (kind.result() for kind in kinds().values() if kind.result is not None)
    return next((result for result in results if result.source == source), None)
