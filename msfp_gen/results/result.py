"""`Result`: the result of the run of one bearing, alone or below a building; `AnyResult`: what all results offer.

What can be done with any result is a function of `files.py`, `summary.py` and their neighbours; the methods are those.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.later import Later
from msfp_gen.common.tables import LabelledValues, Printed, Table
from msfp_gen.results import dataset, files
from msfp_gen.results.characterise import Characterisation
from msfp_gen.results.characterise import characterise as characterise_bearing
from msfp_gen.results.files import Storage, read_result
from msfp_gen.results.gradients import Gradients
from msfp_gen.results.history import BearingRows, Counters, Event, Extremes, History
from msfp_gen.results.joining import at_times
from msfp_gen.results.note import DECISIVE, Note, by_importance
from msfp_gen.results.summary import (
    rows_of_bearing,
    summarise,
    summarise_gradients,
    summary_of_bearing,
    surface_peaks_table,
    time_row,
    transition_table,
    work_rows,
)
from msfp_gen.results.verdict import Verdict, verdict_of
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.system import System, kinds
from msfp_gen.specification.layout import Effects

if TYPE_CHECKING:
    import xarray as xr

MAX_NOTES = 3  # printed, unless more are decisive; the others are counted
MAX_POINTS = 600  # of the curve
WIDTH, HEIGHT, MARGIN = 320, 200, 8  # of the curve [px]


class Curve(NamedTuple):
    """A curve for a notebook: points x, y, ndarrays, shape (k,), [units of the caption], and a caption."""

    x: Array
    y: Array
    caption: str


class AnyResult(Printed):
    """What results of one bearing and of a building offer: dataset, files, summary, verdict, tables, printed text.

    source: the attribute of a file by which its kind of result is known. storage: what makes its dataset, and reads its
    files. scene: what was run. status: how the run ended; message: one line of text, "" for a run that succeeded.
    counters: of the work of the solver. notes: messages of the monitors, in order of time (docs/effects.md).
    provenance: versions, names of models and options of the solver, a field.
    """

    source: ClassVar[str]
    storage: ClassVar[Storage]

    if TYPE_CHECKING:  # fields of the subclasses, or properties

        @property
        def scene(self) -> Any:
            """The scene that was run."""

        @property
        def status(self) -> str:
            """How the run ended."""

        @property
        def message(self) -> str:
            """One line of text, "" for a run that succeeded."""

        @property
        def notes(self) -> tuple[Note, ...]:
            """Messages of the monitors."""

        @property
        def time(self) -> Array:
            """Times of the rows."""

        @property
        def provenance(self) -> dict[str, str]:
            """With what the result was computed."""

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Rows, and events, as an xarray.Dataset, with units, meanings and signs in attributes; built at first use."""
        return self.storage.to_dataset(self)

    @property
    def groups(self) -> dict[str, xr.Dataset]:
        """The groups of the netCDF-4 file beside the dataset, by name."""
        return self.storage.groups_of(self)

    to_netcdf, to_csv, to_parquet, to_mat = files.to_netcdf, files.to_csv, files.to_parquet, files.to_mat
    save = files.save

    @property
    def title(self) -> str:
        """Name of the scene, as the head of a table."""
        return self.scene.name or "unnamed scene"

    @property
    def identity(self) -> str:
        """The sha256 of the scene, motions and matrices included, as in checkpoints; provenance names the versions."""
        return fingerprint(self.scene)

    @property
    def succeeded(self) -> bool:
        """Whether the run reached its end or its stop condition."""
        return self.status in ("ok", "stopped")

    @cached_property
    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """Main results in SI units, as values that JSON can hold."""

    def entry(self, key: str) -> Any:
        """One entry of the summary by its key, without computing the others; None where there is none."""
        return self.summary.get(key)

    @property
    @abstractmethod
    def work(self) -> Mapping[str, float]:
        """Counters of the work of the solver, and wall_time [s]."""

    @property
    def events(self) -> tuple[Event, ...]:
        """The events that the run located; () where it locates none, as below a building, whose notes have them."""
        return ()

    @property
    def is_alone(self) -> bool:
        """Whether this is one bearing that was run alone, whose rows have angles, slips and energies of its parts."""
        return False

    @abstractmethod
    def at_times(self, times: ArrayLike) -> Self:
        """The result with rows at other times, by linear interpolation between its own rows.

        times: ndarray, shape (K,), or a number [s]. Raises InputError for a time outside the run.
        """

    @property
    @abstractmethod
    def compared(self) -> dict[str, Array]:
        """The histories by which runs are compared: quantity -> ndarray, shape (k, places, components) [SI]."""

    @abstractmethod
    def characterise(self) -> Characterisation:
        """Effective properties and demands. Raises InputError where nothing moved."""

    @abstractmethod
    def main_results(self) -> LabelledValues:
        """Label and value of the main results, seven rows at most."""

    @property
    @abstractmethod
    def curve(self) -> Curve:
        """The curve that says most about the run."""

    @property
    @abstractmethod
    def bearings(self) -> Sequence[Result]:
        """The results of the bearings of the run."""

    @abstractmethod
    def part_tables(self) -> list[Table]:
        """Tables of the surfaces of a bearing, or of the parts of a building."""

    def work_rows(self) -> LabelledValues:
        """Label and value of the energies of the run and of the work of the solver."""
        return []

    def tables(self) -> list[Table]:
        """The main results, the verdict and the parts as tables, for the console and the report."""
        first = Table(self.title, (), [*self.stated_rows, *self.work_rows()])
        judged = [self.verdict.table] if self.verdict.readings else []
        return [first, *judged, *self.part_tables()]

    def over_steps(self, word: str, field: str) -> Array | None:
        """An extreme of a field over all steps, ndarray, shape (m,), [SI]; None: studies take it over the rows.

        Arguments as in `Result.over_steps`.
        """
        return None

    @cached_property
    def verdict(self) -> Verdict:
        """What the device was asked to bear, against its limits (docs/results.md)."""
        stopped = float(self.bearings[0].history.time[-1]) if self.status == "stopped" else None
        failure = "" if self.succeeded else self.status_text
        whole = self.scene.fidelity == "equivalent"
        return verdict_of(self.bearings, self.scene.limits, failure, stopped, whole)

    @property
    def status_text(self) -> str:
        """How the run ended, with the message of a run that failed."""
        return self.status + (f": {self.message}" if self.message else "")

    @property
    def page(self) -> Any:
        """What a report has of the run; see `report.page.page_of`. Raises InputError: this kind of result has none."""
        raise InputError(f"{self.title}: results of this kind have no report; their rows are in `msfp-gen export`")

    def film(self, times: Array, azimuth: float | None) -> Any:
        """The movie of the run; see `figures.movie.film_of`. Raises InputError: this kind of result has none."""
        raise InputError(f"{self.title}: results of this kind have no movie; their rows are in `msfp-gen export`")

    @property
    def stated_rows(self) -> LabelledValues:
        """Label and value of the main results after the status and the verdict."""
        return [("status", self.status_text), ("verdict", self.verdict.text), *self.main_results()]

    def printed_rows(self) -> tuple[str, LabelledValues]:
        """Name, and `stated_rows` with the first notes, in nine rows at most."""
        lines, others = self.first_notes
        more = f"; {others} more in .notes" if others else ""
        shown = [("notes", "; ".join(lines) + more)] if lines else []
        return f"Result of {self.title}", [*self.stated_rows, *shown]

    @property
    def first_notes(self) -> tuple[list[str], int]:
        """The lines of decisive notes, of others up to `MAX_NOTES` in all, and how many more there are."""
        notes = by_importance(self.notes)
        decisive = sum(note.kind in DECISIVE and not note.action for note in notes)
        shown = max(decisive, MAX_NOTES)
        return [note.line for note in notes[:shown]], max(0, len(notes) - shown)

    def printed_beside(self) -> str:
        """The curve, for a notebook."""
        x, y, caption = self.curve
        return f"<figure style='margin:0'>{_svg(x, y)}<figcaption>{escape(caption)}</figcaption></figure>"


@dataclass(frozen=True)
class Mounting:
    """What a building tells of one of its bearings.

    number: of the bearing, from 1. label: its number and name, for messages. effects: of its model at the start.
    axial_load: compression at rest [N]. interface: between bearing and building. summary: what the summary of a bearing
    has of the building. place_row, load_row: label and value, for tables, of its place in plan and of its axial force
    over the load at rest.
    """

    number: int
    label: str
    bearing: Bearing
    effects: Effects
    axial_load: float
    interface: Any
    summary: Mapping[str, Any]
    place_row: tuple[str, str]
    load_row: tuple[str, str]


class Alone(NamedTuple):
    """What a run of one bearing alone has, and a bearing below a building does not have: scene, rows and counters."""

    scene: Scene
    history: History
    counters: Counters


# (word of an extreme, field of the history) -> field of `Extremes`, the same over all steps of a run.
OVER_STEPS = {
    ("peak", "displacement"): "displacement",
    ("peak", "top_force"): "top_force",
    ("peak", "sliding"): "sliding",
    ("most", "sliding"): "sliding",
    ("least", "gap"): "gap",
    ("most", "rim_force"): "rim_force",
    ("most", "lift"): "lift",
    ("least", "normal_force"): "least_normal",
    ("most", "normal_force"): "most_normal",
    ("least", "friction_coefficient"): "least_friction",
    ("most", "friction_coefficient"): "most_friction",
    ("most", "temperature"): "temperature",
}


@dataclass(frozen=True, eq=False, repr=False)
class Result(AnyResult):
    """The result of `simulate`, or one bearing of the result of a building.

    A RunError has one in `.result` if the run failed after its start. History and notes are made of the recorded rows
    when they are first asked for.

    history: rows, a `History`; below a building `BearingRows`, which have fewer fields: their displacement is across
    bearing and interface, base_displacement is of the ground below the bearing, and top_moment is about its upper end.
    events: located by the run; none below a building. status: "ok", "stopped" (the stop condition of the scene was
    met) or the name of a failure; message: one line of text, "" for a run that succeeded. counters: the work of the
    solver; None below a building, whose solver steps all bearings at once. provenance: versions, model keys and solver
    options with which the result was computed. notes: messages of the monitors, in order of time (docs/effects.md).
    recorded_extremes: over all accepted steps; None where only the rows are known. gradients: derivatives with respect
    to parameters; None: not computed. mounting: None for a bearing alone; below a building, what the scene of the
    building says about the bearing.
    """

    source: ClassVar[str] = "msfp-gen"
    storage: ClassVar[Storage] = dataset.STORAGE
    scene: System
    history: Later[BearingRows] = Later()
    events: tuple[Event, ...] = ()
    counters: Counters | None = field(default_factory=Counters)
    status: str = "ok"
    message: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    notes: Later[tuple[Note, ...]] = Later(())
    recorded_extremes: Extremes | None = None
    gradients: Gradients | None = None
    mounting: Mounting | None = None

    @property
    def bearings(self) -> tuple[Result]:
        """The result itself, as the only bearing."""
        return (self,)

    @property
    def alone(self) -> Alone:
        """Scene, rows and counters of a bearing that was run alone. Raises InputError for a bearing of a building."""
        history, counters = self.history, self.counters
        if self.mounting is None and isinstance(history, History) and counters is not None:
            return Alone(cast("Scene", self.scene), history, counters)
        raise InputError(
            f"{self.label}: the rows of a building have no angles, slips and energies of the parts of a bearing; run "
            "the bearing alone, or draw its overview, loops, orbit or sliding (docs/buildings.md)"
        )

    @property
    def is_alone(self) -> bool:
        """Whether the bearing was run alone, without a building."""
        return self.mounting is None

    @property
    def number(self) -> int:
        """Number of the bearing below a building, from 1; it is 0 for a bearing alone."""
        return 0 if self.mounting is None else self.mounting.number

    @property
    def label(self) -> str:
        """Number and name of the bearing below a building, for messages; "" for a bearing alone."""
        return "" if self.mounting is None else self.mounting.label

    @property
    def title(self) -> str:
        """Name of the scene, below a building after the label, as the head of a table."""
        return f"{self.label} of {super().title}" if self.label else super().title

    @property
    def bearing(self) -> Bearing:
        """The bearing that was run."""
        return self.scene.every_bearing[0] if self.mounting is None else self.mounting.bearing

    @property
    def effects(self) -> Effects:
        """The effects of the model at the start."""
        return self.scene.every_effects[0] if self.mounting is None else self.mounting.effects

    @property
    def axial_load(self) -> float | None:
        """Constant axial load on the top plate, below a building at rest [N]; None if there is none, or it varies."""
        if self.mounting is not None:
            return self.mounting.axial_load
        return constant_load(cast("Scene", self.scene))

    @property
    def one_pendulum(self) -> bool:
        """Whether the run has one equivalent pendulum in place of the stack (docs/studies.md)."""
        return self.scene.fidelity == "equivalent"

    @property
    def work(self) -> Mapping[str, float]:
        """Counters of the work of the solver, and wall_time [s]; {} below a building, whose result has them."""
        return {} if self.counters is None else asdict(self.counters)

    def at_times(self, times: ArrayLike) -> Self:
        """The result with rows at other times: see `AnyResult.at_times`."""
        return replace(self, history=at_times(self.history, times))

    @property
    def compared(self) -> dict[str, Array]:
        """Horizontal force on the top support [N], and sliding of every surface [m]: see `AnyResult.compared`."""
        return {"force": self.history.top_force[:, None, :2], "sliding": self.history.sliding[:, :, None]}

    @property
    def model_changes(self) -> tuple[Note, ...]:
        """The notes after which the run continued with another model; `action` states its effects."""
        return tuple(note for note in self.notes if note.action)

    @property
    def time(self) -> Array:
        """Times of the rows, ndarray, shape (T,), [s]."""
        return self.history.time

    @cached_property
    def extremes(self) -> Extremes:
        """Extremes over all accepted steps; of a bearing alone over its rows too."""
        recorded = self.recorded_extremes
        if recorded is not None and self.mounting is not None:
            return recorded
        rows = Extremes.of_rows(self.alone.history)
        return rows if recorded is None else rows | recorded

    def over_steps(self, word: str, field: str) -> Array | None:
        """An extreme of a field of the history over all steps, ndarray, shape (m,), [SI]; None: it is not recorded.

        word: "peak", "least" or "most". m: the columns of the field.
        """
        name = OVER_STEPS.get((word, field))
        return None if name is None else getattr(self.extremes, name)

    @property
    def friction_coefficient(self) -> Array:
        """Friction coefficient mu of every surface, ndarray, shape (T, n-1), [-]: recorded, or from the bearing.

        Raises InputError below a building.
        """
        recorded = self.alone.history.friction_coefficient
        if recorded is not None:
            return recorded
        return np.broadcast_to(self.bearing.arrays()["friction"], self.history.normal_force.shape)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results of the run in SI units, as values that JSON can hold; `summary.summarise` lists the keys."""
        return summarise(self) | {"verdict": self.verdict.as_dict}

    @cached_property
    def of_bearing(self) -> dict[str, Any]:
        """The part of the summary that all bearings have, without notes, verdict, energy and work of the solver."""
        return summary_of_bearing(self)

    def entry(self, key: str) -> Any:
        """One entry of the summary by its key, without computing the others; None where there is none."""
        if key == "verdict":
            return self.verdict.as_dict
        return self.of_bearing[key] if key in self.of_bearing else super().entry(key)

    def main_results(self) -> LabelledValues:
        """Label and value of the main results."""
        if self.mounting is None:
            return rows_of_bearing(self.summary, time_row(self.summary))
        return rows_of_bearing(self.summary, self.mounting.place_row, [self.mounting.load_row])

    @property
    def curve(self) -> Curve:
        """The hysteresis loop: force over displacement along the direction of the largest displacement."""
        rows = self.history
        return Curve(rows.path[0], rows.top_force[:, :2] @ rows.direction, "force over displacement")

    def work_rows(self) -> LabelledValues:
        """Label and value of the energy of the run and of the work of the solver; none below a building."""
        return work_rows(self.summary) if self.mounting is None else []

    def part_tables(self) -> list[Table]:
        """Tables of the surfaces, and of the transitions of a monotonic run; none of one equivalent pendulum."""
        if self.one_pendulum:
            return []
        changes = self.summary.get("transitions")
        more = [] if changes is None else [transition_table(changes)]
        return [surface_peaks_table(self.summary, self.bearing.surfaces), *more]

    def characterise(self) -> Characterisation:
        """Effective stiffness, damping, sliding regimes, remaining capacity, velocity and heat (docs/results.md).

        A quantity that the rows of a bearing of a building do not give is None, and the notes say so. Raises InputError
        where the bearing did not move.
        """
        return characterise_bearing(self)

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


def constant_load(scene: Scene) -> float | None:
    """The constant axial load on the top plate [N]; None if there is none, or it varies."""
    loads: dict[str, Callable[[Any], float]] = {
        "rig": lambda top: top.axial_load,
        "prescribed": lambda top: -top.force[2],
        "mass": lambda top: top.mass * scene.bearing.gravity,
    }
    load = loads[scene.top.kind](scene.top)
    if scene.load is not None:
        vertical = scene.load.coefficients[:, 2]
        if np.any(vertical[:, 1:]) or np.any(vertical[:, 0] != vertical[0, 0]):
            return None
        load -= float(vertical[0, 0])
    return load if load > 0 else None


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


def characterise(result: Any) -> Any:
    """The characterisation of a run, of one bearing or of a building; docs/results.md and docs/buildings.md.

    Raises InputError where nothing moved.
    """
    if not isinstance(result, AnyResult):
        raise InputError(f"result: this is a {type(result).__name__}; give the result of simulate(scene)")
    return result.characterise()


def load_result(path: str | Path) -> Any:
    """The result in a file that `save` wrote as netCDF: a `Result`, a `BuildingResult` or the result of another system.

    Raises InputError of one line that names the file and the remedy for any other file.
    """
    return read_result(path, _kind_of)


def _kind_of(source: str) -> Any:
    if source == Result.source:
        return Result
    results = (kind.result() for kind in kinds().values() if kind.result is not None)
    return next((result for result in results if result.source == source), None)
