"""Characterisation of a run: closed cycles, first loading, demands on the surfaces, and envelope of the cycles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from math import pi, sqrt
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from msfp_gen.analysis.characterise.loops import Loop, Path
from msfp_gen.analysis.characterise.stages import Branch, branch_of, signed_slip
from msfp_gen.analysis.characterise.surfaces import SurfaceDemand, capacity_demands, surface_demands
from msfp_gen.analysis.summary import axial_load
from msfp_gen.analysis.transitions import is_monotonic, transitions
from msfp_gen.common.arrays import Array

if TYPE_CHECKING:
    from msfp_gen.results.extremes import Extremes
    from msfp_gen.results.run_data import RunData
    from msfp_gen.scene.bearing import Bearing

Kind = Literal["cycles", "monotonic", "one direction", "two directions"]
LOOP_QUANTITIES = (
    "effective_stiffness",
    "effective_period",
    "energy_dissipated",
    "effective_damping",
    "zero_displacement_force",
)
NO_LOOP = "effective stiffness, damping, zero-displacement force and the sliding regimes of a cycle are not defined"


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


@dataclass(frozen=True)
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
        transitions: of a monotonic run (`transitions.transitions`).
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

    def __repr__(self) -> str:
        """The main quantities in ten lines at most."""
        stiffness = "-" if self.secant_stiffness is None else f"{1e-6 * self.secant_stiffness:.4g} kN/mm"
        residual = "" if self.at_rest else ", still moving"
        rows = {
            "motion": f"{self.kind}, {len(self.cycles)} closed cycles",
            "peak displacement": f"{1e3 * self.peak_displacement:.4g} mm",
            "peak force": f"{1e-3 * self.peak_force:.4g} kN",
            "secant stiffness": stiffness,
            "energy dissipated": f"{1e-3 * self.energy_dissipated:.4g} kJ",
            "residual": f"{1e3 * self.residual_displacement:.4g} mm{residual}",
            **({"not defined": "; ".join(self.notes)} if self.notes else {}),
        }
        title = f"Characterisation of {self.name or 'an unnamed run'}, status {self.status}"
        return "\n".join([title, *(f"  {label:<18}{value}" for label, value in rows.items())])

    name: str
    status: str
    kind: Kind
    direction: tuple[float, float]
    axial_load: float | None
    cycles: tuple[Cycle, ...]
    first_loading: Branch | None
    transitions: dict[str, float | None] | None
    envelope: dict[str, Range]
    surfaces: tuple[SurfaceDemand, ...]
    peak_displacement: float
    peak_force: float
    secant_stiffness: float | None
    energy_dissipated: float
    residual_displacement: float
    at_rest: bool
    maximum_uplift: float | None
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self)


def characterise(result: RunData) -> Characterisation:
    """Characterise a run; docs/characterise.md gives the formulas and the clauses of codes.

    Raises InputError if the bearing did not move.
    """
    history, load = result.history, axial_load(result)
    path = Path.of(history.time, history.displacement, history.top_force)
    (u, force), (slip, plastic) = path.along, signed_slip(result, path.direction)

    def branch(first: int, last: int) -> Branch:
        rows = slice(first, last + 1)
        return branch_of(u[rows], force[rows], slip[rows], plastic[rows], history.gap[rows])

    dissipated, turning = _dissipated(result), path.turning
    cycles = _cycles(path, load, result.scene.bearing, dissipated, lambda rows: surface_demands(result, rows), branch)
    kind: Kind = "cycles" if cycles else "monotonic" if is_monotonic(result) else _directions(path)
    name, status, demands = result.scene.name, result.status, surface_demands(result)
    whole = _whole(name, status, kind, path, load, cycles, demands, dissipated, result.extremes)
    notes = list(whole.notes)
    if any(demand.maximum_uplift is None for demand in demands):
        notes.append("uplift is not modelled in this run")
    if load is None:
        notes.append("no constant axial load: no effective period")
    return replace(
        whole,
        first_loading=branch(turning[0], turning[1]) if len(turning) > 1 else None,
        transitions=transitions(result, load) if kind == "monotonic" else None,
        notes=tuple(notes),
    )


def _directions(path: Path) -> Kind:
    return "one direction" if path.straight else "two directions"


def characterise_rows(
    name: str,
    status: str,
    path: Path,
    bearing: Bearing,
    load: float,
    gap: Array,
    dissipated: Array,
    extremes: Extremes,
) -> Characterisation:
    """Characterise one bearing of a building, by what its rows have.

    name, status: of the run. load: at rest [N]. gap: to the rims, shape (T, n-1) [m]. dissipated: energy since the
    start, shape (T,) [J]. extremes: over all steps.
    """
    cycles = _cycles(path, load, bearing, dissipated, lambda rows: capacity_demands(bearing, gap[rows].min(axis=0)))
    kind: Kind = "cycles" if cycles else _directions(path)
    demands = capacity_demands(bearing, extremes.gap)
    note = "the rows of a building have no slip velocities: no sliding regimes, velocities, heat and uplift of surfaces"
    whole = _whole(name, status, kind, path, load, cycles, demands, dissipated, extremes)
    return replace(whole, notes=(*whole.notes, f"{note}; periods are with N at rest"))


def _cycles(
    path: Path,
    load: float | None,
    bearing: Bearing,
    dissipated: Array,
    demands: Callable[[slice], tuple[SurfaceDemand, ...]],
    branch: Callable[[int, int], Branch] | None = None,
) -> list[Cycle]:
    """The closed cycles of a path. demands: over some rows. branch: from one row to another; None: not known."""
    return [
        Cycle(
            number,
            float(path.time[start]),
            float(path.time[end]),
            loop,
            _period(loop.effective_stiffness, load, bearing.gravity),
            float(dissipated[end] - dissipated[start]),
            () if branch is None else (branch(start, middle), branch(middle, end)),
            demands(slice(start, end + 1)),
        )
        for number, (start, middle, end, loop) in enumerate(path.cycles(), 1)
    ]


def _whole(
    name: str,
    status: str,
    kind: Kind,
    path: Path,
    load: float | None,
    cycles: Sequence[Cycle],
    demands: tuple[SurfaceDemand, ...],
    dissipated: Array,
    extremes: Extremes,
) -> Characterisation:
    """What follows from path and cycles. dissipated: energy since the start, shape (T,) [J]."""
    uplifts = [demand.maximum_uplift for demand in demands if demand.maximum_uplift is not None]
    return Characterisation(
        name=name,
        status=status,
        kind=kind,
        direction=(float(path.direction[0]), float(path.direction[1])),
        axial_load=load,
        cycles=tuple(cycles),
        first_loading=None,
        transitions=None,
        envelope=_envelope(cycles),
        surfaces=demands,
        peak_displacement=float(extremes.displacement[3]),
        peak_force=float(extremes.top_force[3]),
        secant_stiffness=path.secant_stiffness,
        energy_dissipated=float(dissipated[-1]),
        residual_displacement=path.residual,
        at_rest=path.at_rest,
        maximum_uplift=max(uplifts, default=None),
        notes=tuple(_notes(kind, path.at_rest, demands)),
    )


def _period(stiffness: float, load: float | None, gravity: float) -> float | None:
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


def loop_quantity(cycle: Cycle, name: str) -> float | None:
    """One of LOOP_QUANTITIES of a cycle."""
    value: float | None = getattr(cycle if name == "effective_period" else cycle.loop, name)
    return value


def _dissipated(result: RunData) -> Array:
    """Energy dissipated since the start [J], shape (T,)."""
    parts = [values for name, values in result.history.energy.items() if name.endswith("_dissipated")]
    total: Array = np.sum(parts, axis=0)
    return total


def _notes(kind: Kind, at_rest: bool, demands: Sequence[SurfaceDemand]) -> list[str]:
    """What is not defined in this run, and why."""
    notes = []
    if kind == "two directions":
        notes.append(
            f"the motion is in two directions and has no single loop: {NO_LOOP}; "
            "peaks are radial, the secant stiffness is taken at the largest displacement"
        )
    elif kind in ("one direction", "monotonic"):
        notes.append(f"no cycle closes: {NO_LOOP}; sliding regimes are given for the first loading")
    if not at_rest:
        notes.append(
            "the bearing still moves when the run ends, so its last displacement is no residual displacement; "
            "hold the motion at its end to let it come to rest"
        )
    unknown = [str(demand.surface) for demand in demands if demand.contact_area is None]
    if unknown:
        notes.append(
            f"no radius of the slider is given, so no contact area and no heat flux: surface {', '.join(unknown)}"
        )
    return notes
