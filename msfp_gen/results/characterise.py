"""`characterise`: cycles, first loading, demands and envelope of a run, as tables and CSV (docs/results.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import atan2, degrees, pi, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import check_output
from msfp_gen.common.tables import Table, write_rows
from msfp_gen.results.history import History
from msfp_gen.results.loops import Branch, ForcePath, Loop, SurfaceDemand, branch_of, signed_slip, surface_demands
from msfp_gen.results.summary import is_monotonic, transitions

if TYPE_CHECKING:
    from msfp_gen.results.result import Result

LoadingKind = Literal["cycles", "monotonic", "one direction", "two directions"]
CSV_SUFFIXES = (".csv",)


class LoopQuantity(NamedTuple):
    """A quantity of a cycle: unit, heading and scale of its column in the table of cycles."""

    unit: str
    heading: str
    scale: float


LOOP_QUANTITIES = {
    "effective_stiffness": LoopQuantity("N/m", "k_eff [kN/m]", 1e-3),
    "effective_period": LoopQuantity("s", "T_eff [s]", 1.0),
    "energy_dissipated": LoopQuantity("J", "loop area [J]", 1.0),
    "effective_damping": LoopQuantity("1", "damping [%]", 100.0),
    "zero_displacement_force": LoopQuantity("N", "Q at zero [kN]", 1e-3),
}
DEMAND_UNITS = {
    "capacity_left": "m",
    "peak_velocity": "m/s",
    "peak_heat_flux": "W/m^2",
    "heat": "J/m^2",
    "maximum_uplift": "m",
}
# Column -> (demand on a surface, scale, format).
DEMAND_COLUMNS = {
    "capacity left [mm]": ("capacity_left", 1e3, ".2f"),
    "of capacity [%]": ("capacity_left_share", 100, ".1f"),
    "velocity [mm/s]": ("peak_velocity", 1e3, ".4g"),
    "heat flux [kW/m2]": ("peak_heat_flux", 1e-3, ".4g"),
    "heat [kJ/m2]": ("heat", 1e-3, ".4g"),
    "uplift [mm]": ("maximum_uplift", 1e3, ".4g"),
}
TIMES = {"start [s]", "end [s]"}  # columns that have no envelope
CycleRow = dict[str, float | str | None]


@dataclass(frozen=True)
class Range:
    """Least, mean and largest value of a quantity over the cycles."""

    least: float
    mean: float
    most: float


@dataclass(frozen=True)
class Cycle:
    """One closed cycle, from a turning point to the next on the same side.

    Attributes:
        number: from 1.
        start, end: times [s].
        loop: effective properties.
        effective_period: 2 pi sqrt(N/(g k_eff)) [s]; None without a constant load.
        balance_energy: energy dissipated by friction, rims and top in this time by the energy balance [J], to compare
            with the area of the loop.
        branches: the half cycle to the opposite turning point, and the one back; none of a bearing of a building.
        surfaces: demands on the surfaces within the cycle.
    """

    number: int
    start: float
    end: float
    loop: Loop
    effective_period: float | None
    balance_energy: float
    branches: tuple[Branch, ...]
    surfaces: tuple[SurfaceDemand, ...]

    def stage_stiffness(self) -> dict[tuple[int, ...], float]:
        """Sliding surfaces -> stiffness [N/m], mean of both half cycles; regimes in which all stick are left out."""
        stiffness: dict[tuple[int, ...], list[float]] = {}
        for branch in self.branches:
            for stage in branch.stages:
                if stage.surfaces:
                    stiffness.setdefault(stage.surfaces, []).append(stage.stiffness)
        return {surfaces: float(np.mean(values)) for surfaces, values in stiffness.items()}


@dataclass(frozen=True, repr=False)
class Characterisation:
    """Result of `characterise`, in SI units; None for a quantity that is not defined, with the reason in `notes`.

    Attributes:
        name, status: of the run.
        kind: "cycles" (one direction, with closed cycles), "monotonic", "one direction" (no closed cycle) or "two
            directions".
        direction: unit vector (E1, E2) of the largest displacement.
        axial_load: constant axial load [N].
        cycles: closed cycles.
        first_loading: path from the start to the first turning point; None for a motion in two directions.
        transitions: of a monotonic run (`transitions`).
        envelope: of LOOP_QUANTITIES over the cycles.
        surfaces: demands on the surfaces over the run.
        peak_displacement, peak_force: largest horizontal displacement [m] and force [N].
        secant_stiffness: force along the largest displacement, divided by it [N/m].
        energy_dissipated: in the whole run, by the energy balance [J].
        residual_displacement: horizontal displacement in the last row [m].
        at_rest: whether the bearing is at rest by then.
        maximum_uplift: of any surface [m].
        notes: what is not defined, and why.
    """

    FORCE: ClassVar[str] = "peak force"
    LOAD: ClassVar[str] = "the axial load"
    OF: ClassVar[str] = ""  # whose displacement it is

    name: str
    status: str
    kind: LoadingKind
    direction: tuple[float, float]
    axial_load: float | None
    cycles: tuple[Cycle, ...]
    first_loading: Branch | None
    transitions: dict[str, float | None] | None
    envelope: dict[str, Range]
    surfaces: tuple[SurfaceDemand, ...]
    peak_displacement: float
    peak_force: float
    secant_stiffness: float
    energy_dissipated: float
    residual_displacement: float
    at_rest: bool
    maximum_uplift: float | None
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self)

    def __repr__(self) -> str:
        """The main quantities in ten lines at most."""
        rows = [*self.rows(), *([("not defined", "; ".join(self.notes))] if self.notes else [])]
        title = f"Characterisation of {self.title}, status {self.status}"
        return "\n".join([title, *(f"  {label:<18}{value}" for label, value in rows)])

    @property
    def title(self) -> str:
        """Name of the scene or bearing."""
        return self.name or "unnamed scene"

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of the quantities of the run."""
        ratio = f" ({self.peak_force / self.axial_load:.4f} of {self.LOAD})" if self.axial_load else ""
        angle, rest = degrees(atan2(self.direction[1], self.direction[0])), "" if self.at_rest else ", still moving"
        stiffness, damping = (self.envelope.get(name) for name in ("effective_stiffness", "effective_damping"))
        share = "-" if damping is None else f"{100 * damping.mean:.4g} %"
        lift, count = self.maximum_uplift, len(self.cycles)
        return [
            ("motion", f"{self.kind}, {count} closed cycles; largest displacement at {angle:.1f} degrees from E1"),
            ("peak displacement", f"{self.peak_displacement * 1e3:.2f} mm{self.OF}"),
            (self.FORCE, f"{self.peak_force / 1e3:.3f} kN{ratio}"),
            ("secant stiffness", f"{self.secant_stiffness / 1e6:.4g} kN/mm at the largest displacement"),
            *([("effective", f"stiffness {stiffness.mean / 1e6:.4g} kN/mm, damping {share}")] if stiffness else []),
            ("energy dissipated", f"{self.energy_dissipated:.5g} J in the whole run"),
            ("at the end", f"{self.residual_displacement * 1e3:.2f} mm{rest}"),
            *([] if lift is None else [("maximum uplift", f"{lift * 1e3:.3f} mm")]),
        ]

    def tables(self) -> list[Table]:
        """Tables of the run, its cycles, the sliding regimes of first loading and last cycle, and the demands."""
        branches, notes, demands = list(self._named_branches()), [(note,) for note in self.notes], self.demand_table()
        return [
            Table(f"{self.title}, {self.status}", (), self.rows()),
            *([self._cycle_table()] if self.cycles else []),
            *([_stage_table(branches)] if branches else []),
            *([demands] if demands.rows else []),
            *([Table("what is not defined in this run, and why", (), notes)] if notes else []),
        ]

    def demand_table(self) -> Table:
        """Table of the demands on the surfaces."""
        columns = DEMAND_COLUMNS.values()
        rows = [
            (str(demand.surface), *(_number(getattr(demand, name), scale, style) for name, scale, style in columns))
            for demand in self.surfaces
        ]
        title = "surfaces, bottom first: least capacity left, largest velocity, heat and uplift"
        return Table(title, ("surface", *DEMAND_COLUMNS), rows)

    def _cycle_table(self) -> Table:
        columns = ("cycle", "least u [mm]", "largest u [mm]", *(kind.heading for kind in LOOP_QUANTITIES.values()))
        rows = []
        for cycle in self.cycles:
            ends = (cycle.loop.displacement_least, cycle.loop.displacement_most)
            numbers = [_number(loop_quantity(cycle, name), scale) for name, (_, _, scale) in LOOP_QUANTITIES.items()]
            rows.append((str(cycle.number), *(f"{end * 1e3:.2f}" for end in ends), *numbers))
        for scope in ("least", "mean", "most"):
            ranges = [(self.envelope.get(name), scale) for name, (_, _, scale) in LOOP_QUANTITIES.items()]
            numbers = ["-" if at is None else _number(getattr(at, scope), scale) for at, scale in ranges]
            rows.append((scope, "", "", *numbers))
        return Table("closed cycles", columns, rows)

    def _named_branches(self) -> Iterator[tuple[str, Branch]]:
        if self.first_loading is not None:
            yield "first loading", self.first_loading
        if self.cycles:
            last = self.cycles[-1]
            for half, branch in enumerate(last.branches, start=1):
                yield f"cycle {last.number}, half {half}", branch


def loop_quantity(cycle: Cycle, name: str) -> float | None:
    """One of LOOP_QUANTITIES of a cycle."""
    value: float | None = getattr(cycle if name == "effective_period" else cycle.loop, name)
    return value


def write_characterisation(characterisation: Characterisation, path: str | Path) -> Path:
    """Write one row per cycle, then least, mean and largest values of the cycles, then the run, to a CSV file.

    The file appears only when complete. Raises InputError for a path that does not end in .csv or cannot be written.
    """
    return write_rows(check_output(path, CSV_SUFFIXES), csv_rows(characterisation))


def csv_rows(characterisation: Characterisation) -> list[CycleRow]:
    """The rows of `write_characterisation`: column with its unit -> value; None and missing columns are empty cells."""
    cycles = [{"scope": f"cycle {cycle.number}", **_cycle_row(cycle)} for cycle in characterisation.cycles]
    whole: CycleRow = {
        "scope": "run",
        "peak_displacement [m]": characterisation.peak_displacement,
        "peak_force [N]": characterisation.peak_force,
        "secant_stiffness [N/m]": characterisation.secant_stiffness,
        "total_energy_dissipated [J]": characterisation.energy_dissipated,
        "residual_displacement [m]": characterisation.residual_displacement if characterisation.at_rest else None,
        **_demand_row(characterisation.surfaces),
    }
    return [*cycles, *_envelope_rows(cycles), whole]


def _envelope_rows(cycles: list[CycleRow]) -> Iterator[CycleRow]:
    kinds: dict[str, Callable[[list[float]], float]] = {
        "least": min,
        "mean": lambda values: sum(values) / len(values),
        "most": max,
    }
    for scope, pick in kinds.items() if cycles else ():
        row: CycleRow = {"scope": scope}
        for name in (key for key in cycles[0] if key not in TIMES):
            values = [value for cycle in cycles if isinstance(value := cycle.get(name), float)]
            if values and len(values) == len(cycles):
                row[name] = pick(values)
        yield row


def _cycle_row(cycle: Cycle) -> CycleRow:
    loop = cycle.loop
    row: CycleRow = {
        "start [s]": cycle.start,
        "end [s]": cycle.end,
        "displacement_most [m]": loop.displacement_most,
        "displacement_least [m]": loop.displacement_least,
        "force_most [N]": loop.force_most,
        "force_least [N]": loop.force_least,
        **{f"{name} [{kind.unit}]": loop_quantity(cycle, name) for name, kind in LOOP_QUANTITIES.items()},
        "balance_energy [J]": cycle.balance_energy,
    }
    stages = cycle.stage_stiffness().items()
    stiffness: CycleRow = {f"stiffness sliding on {_joined(surfaces)} [N/m]": value for surfaces, value in stages}
    return row | stiffness | _demand_row(cycle.surfaces)


def _demand_row(demands: tuple[SurfaceDemand, ...]) -> CycleRow:
    return {
        f"{name}_{demand.surface} [{unit}]": getattr(demand, name)
        for demand in demands
        for name, unit in DEMAND_UNITS.items()
    }


def _stage_table(branches: list[tuple[str, Branch]]) -> Table:
    columns = ("path", "sliding", "from u [mm]", "to u [mm]", "stiffness [kN/m]", "intercept [kN]", "scatter [kN]")
    rows = [
        (
            name if not index else "",
            _joined(stage.surfaces),
            f"{stage.start * 1e3:.2f}",
            f"{stage.end * 1e3:.2f}",
            f"{stage.stiffness / 1e3:.4g}",
            f"{stage.intercept / 1e3:.4g}",
            f"{stage.scatter / 1e3:.2g}",
        )
        for name, branch in branches
        for index, stage in enumerate(branch.stages)
    ]
    return Table("sliding regimes: surfaces that slide, and the straight line fitted to the force", columns, rows)


def _joined(surfaces: tuple[int, ...]) -> str:
    return "+".join(map(str, surfaces)) or "none"


def _number(value: float | None, scale: float, style: str = ".4g") -> str:
    return "-" if value is None else format(value * scale, style)


NOT_RECORDED = (
    "the rows of a building have no slip velocities: no sliding regimes, velocities and heat of surfaces; periods are "
    "with N at rest"
)
NO_STACK = "one pendulum is in place of the stack: no sliding regimes and no demands on surfaces"
NO_LOOP = "effective stiffness, damping, zero-displacement force and the sliding regimes of a cycle are not defined"


def characterise(one: Result) -> Characterisation:
    """Characterise a run of one bearing; docs/results.md gives the formulas and the clauses of codes.

    What the rows of a bearing below a building do not have is None, and the notes say so; its period is that with N at
    rest. Raises InputError if the bearing did not move.
    """
    history, load, peaks = one.history, one.axial_load, one.extremes
    path = ForcePath.of(history.time, history.displacement, history.top_force)
    branch = _branches(one, path) if isinstance(one.history, History) and not one.one_pendulum else None
    name = one.title if one.number else one.scene.name
    largest = (float(peaks.displacement[3]), float(peaks.top_force[3]))
    common = name, one.status, path, largest, load, one.bearing.gravity, history.dissipated
    if one.one_pendulum:
        found = characterised(*common)
        return replace(found, notes=(*found.notes, NO_STACK))
    characterisation = characterised(*common, partial(surface_demands, one), branch)
    notes = list(characterisation.notes)
    if any(demand.maximum_uplift is None for demand in characterisation.surfaces):
        notes.append("uplift is not modelled in this run")
    if load is None:
        notes.append("no constant axial load: no effective period")
    if branch is None:
        return replace(characterisation, notes=(*notes, NOT_RECORDED))
    monotonic, turning = not characterisation.cycles and is_monotonic(one), path.turning
    return replace(
        characterisation,
        kind="monotonic" if monotonic else characterisation.kind,
        first_loading=branch(turning[0], turning[1]) if len(turning) > 1 else None,
        transitions=transitions(one) if monotonic else None,
        notes=tuple(notes),
    )


def _branches(result: Result, path: ForcePath) -> Callable[[int, int], Branch]:
    """A function that gives the sliding regimes between two rows."""
    (u, force), (slip, plastic) = path.along, signed_slip(result, path.direction)

    def branch(first: int, last: int) -> Branch:
        rows = slice(first, last + 1)
        return branch_of(u[rows], force[rows], slip[rows], plastic[rows], result.history.gap[rows])

    return branch


def characterised(
    name: str,
    status: str,
    path: ForcePath,
    peaks: tuple[float, float],
    load: float | None,
    gravity: float,
    dissipated: Array,
    demands: Callable[[slice | None], tuple[SurfaceDemand, ...]] = lambda rows: (),
    branch: Callable[[int, int], Branch] | None = None,
) -> Characterisation:
    """Properties that follow from the path of a bearing, or of an isolation system.

    name, status: of the run. peaks: largest horizontal displacement [m] and force [N] over all steps. load: of the
    period [N]; None: none. dissipated: energy since the start, shape (T,) [J]. demands: on the surfaces over some rows;
    None: over the run. branch: from one row to another; None: not known.
    """
    cycles = tuple(
        Cycle(
            number,
            float(path.time[start]),
            float(path.time[end]),
            loop,
            effective_period(loop.effective_stiffness, load, gravity),
            float(dissipated[end] - dissipated[start]),
            () if branch is None else (branch(start, middle), branch(middle, end)),
            demands(slice(start, end + 1)),
        )
        for number, (start, middle, end, loop) in enumerate(path.cycles(), 1)
    )
    surfaces, straight = demands(None), path.straight
    kind: LoadingKind = "cycles" if cycles else "one direction" if straight else "two directions"
    uplifts = [demand.maximum_uplift for demand in surfaces if demand.maximum_uplift is not None]
    return Characterisation(
        name=name,
        status=status,
        kind=kind,
        direction=(float(path.direction[0]), float(path.direction[1])),
        axial_load=load,
        cycles=cycles,
        first_loading=None,
        transitions=None,
        envelope=_envelope(cycles),
        surfaces=surfaces,
        peak_displacement=float(peaks[0]),
        peak_force=float(peaks[1]),
        secant_stiffness=path.secant_stiffness,
        energy_dissipated=float(dissipated[-1]),
        residual_displacement=path.residual,
        at_rest=path.at_rest,
        maximum_uplift=max(uplifts, default=None),
        notes=tuple(_notes(kind, path, surfaces, regimes=branch is not None)),
    )


def effective_period(stiffness: float, load: float | None, gravity: float) -> float | None:
    """Effective period [s]; None if the load is not constant or the stiffness not positive."""
    return 2 * pi * sqrt(load / (gravity * stiffness)) if load and gravity and stiffness > 0 else None


def _envelope(cycles: Sequence[Cycle]) -> dict[str, Range]:
    """Quantity -> its range over the cycles in which it is defined."""
    ranges = {}
    for name in LOOP_QUANTITIES:
        values = [v for v in (loop_quantity(cycle, name) for cycle in cycles) if v is not None]
        if values:
            ranges[name] = Range(min(values), float(np.mean(values)), max(values))
    return ranges


REMEDY = "give motion.hold, such as 20 s, for time without motion in which it comes to rest"


def _notes(kind: LoadingKind, path: ForcePath, demands: Sequence[SurfaceDemand], regimes: bool) -> list[str]:
    """Which quantities this run does not define, and why. regimes: whether the sliding regimes are known."""
    notes = []
    if kind == "two directions":
        notes.append(
            f"the motion is in two directions and has no single loop: {NO_LOOP}; "
            "peaks are radial, the secant stiffness is taken at the largest displacement"
        )
    elif kind == "one direction":
        regime = "; sliding regimes are given for the first loading" if regimes else ""
        notes.append(f"no cycle closes: {NO_LOOP}{regime}")
    if not path.at_rest:
        notes.append(
            f"{path.what} still moves when the run ends, so its last displacement, {1e3 * path.residual:.4g} mm, is no "
            f"residual displacement: {REMEDY}"
        )
    unknown = [str(demand.surface) for demand in demands if demand.contact_area is None]
    if unknown:
        notes.append(
            f"no radius of the slider is given, so no contact area and no heat flux: surface {', '.join(unknown)}"
        )
    return notes
