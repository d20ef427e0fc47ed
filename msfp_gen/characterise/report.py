"""The characterisation of a run: every closed cycle, the first way out, every surface, and the envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import pi, sqrt
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from msfp_gen.characterise.loops import REVERSAL, Loop, closed_cycles, effective_properties, turning_points
from msfp_gen.characterise.stages import Branch, branch_of, signed_slip
from msfp_gen.characterise.surfaces import SurfaceUse, surface_use
from msfp_gen.errors import InputError
from msfp_gen.history import Array, History
from msfp_gen.summary import axial_load
from msfp_gen.transitions import is_monotonic, transitions

if TYPE_CHECKING:
    from msfp_gen.result import Result

ASIDE = 0.02  # way aside, over the largest displacement, that still counts as motion in one direction
REST = 0.05  # last share of a run over which it is judged whether the bearing has come to rest
STILL = 0.01  # movement in it, over the largest displacement, that counts as rest
Kind = Literal["cycles", "monotonic", "one direction", "two directions"]
LOOP_NUMBERS = ("effective_stiffness", "effective_period", "energy_dissipated", "effective_damping",
                "zero_displacement_force")  # fmt: skip
NO_LOOP = "effective stiffness, damping, zero-displacement force and stages of a cycle are not defined"


@dataclass(frozen=True)
class Range:
    """Least, mean and most of a quantity over the cycles."""

    least: float
    mean: float
    most: float


@dataclass(frozen=True)
class Cycle:
    """One closed cycle, from a turning point to the next on its side.

    start, end [s]. loop: effective properties. effective_period: 2 pi sqrt(N/(g k_eff)) [s]; None without a constant
    load. balance_energy: what friction, rims and the top dissipated in this time by the energy balance [J], to compare
    with the area of the loop. branches: the way back and the way out again. surfaces: their use within the cycle.
    """

    number: int
    start: float
    end: float
    loop: Loop
    effective_period: float | None
    balance_energy: float
    branches: tuple[Branch, Branch]
    surfaces: tuple[SurfaceUse, ...]

    def stage_stiffness(self) -> dict[tuple[int, ...], float]:
        """Sliding surfaces -> stiffness [N/m], the mean over both ways; stages in which all stick are left out."""
        found: dict[tuple[int, ...], list[float]] = {}
        for branch in self.branches:
            for stage in branch.stages:
                if stage.surfaces:
                    found.setdefault(stage.surfaces, []).append(stage.stiffness)
        return {surfaces: float(np.mean(values)) for surfaces, values in found.items()}


@dataclass(frozen=True)
class Characterisation:
    """What `characterise` found. Every number in SI; None where a quantity is not defined, with the reason in `notes`.

    kind: "cycles" (one direction, with closed cycles), "monotonic", "one direction" (no closed cycle) or "two
    directions". direction: unit vector (E1, E2) of the largest displacement. axial_load [N]. first_loading: the way
    from the start to the first turning point, in one direction only. transitions: of a monotonic run
    (`transitions.transitions`). envelope: of LOOP_NUMBERS over the cycles. peak_displacement [m], peak_force [N]:
    largest horizontal ones. secant_stiffness: force along the largest displacement over it [N/m].
    energy_dissipated: in the whole run, by the energy balance [J]. residual_displacement: horizontal, in the last row
    [m]; at_rest: whether the bearing has come to rest by then. maximum_uplift [m]: of any surface.
    """

    name: str
    status: str
    kind: Kind
    direction: tuple[float, float]
    axial_load: float | None
    cycles: tuple[Cycle, ...]
    first_loading: Branch | None
    transitions: dict[str, float | None] | None
    envelope: dict[str, Range]
    surfaces: tuple[SurfaceUse, ...]
    peak_displacement: float
    peak_force: float
    secant_stiffness: float | None
    energy_dissipated: float
    residual_displacement: float
    at_rest: bool
    maximum_uplift: float | None
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain dicts, lists and numbers, ready for JSON."""
        return asdict(self)


def characterise(result: Result) -> Characterisation:
    """Characterise a run; docs/characterise.md has the formulas and their clauses.

    Raises InputError where the bearing did not move, so that there is nothing to characterise.
    """
    history = result.history
    peak = float(history.horizontal.max())
    if peak == 0.0:
        raise InputError("characterise: the bearing did not move in this run; give a motion, or a longer duration")
    row = history.peak_row
    direction = history.displacement[row, :2] / history.horizontal[row]
    cycles, first = _one_direction(result, direction)
    kind = _kind(result, direction, cycles)
    uses = surface_use(result, slice(None))
    lifts = [use.maximum_uplift for use in uses if use.maximum_uplift is not None]
    at_rest = _at_rest(history, peak)
    load = axial_load(result)
    return Characterisation(
        name=result.scene.name,
        status=result.status,
        kind=kind,
        direction=(float(direction[0]), float(direction[1])),
        axial_load=load,
        cycles=cycles,
        first_loading=first,
        transitions=transitions(result, load) if kind == "monotonic" else None,
        envelope=_envelope(cycles),
        surfaces=uses,
        peak_displacement=peak,
        peak_force=float(np.hypot(*history.top_force[:, :2].T).max()),
        secant_stiffness=float(history.top_force[row, :2] @ direction / history.horizontal[row]),
        energy_dissipated=float(_dissipated(history)[-1]),
        residual_displacement=float(history.horizontal[-1]),
        at_rest=at_rest,
        maximum_uplift=max(lifts, default=None),
        notes=tuple(_notes(result, kind, at_rest, uses)),
    )


def _one_direction(result: Result, direction: Array) -> tuple[tuple[Cycle, ...], Branch | None]:
    """The closed cycles and the first way out of a motion in one direction; nothing of any other."""
    history = result.history
    if not _is_straight(history, direction):
        return (), None
    u, force = (rows[:, :2] @ direction for rows in (history.displacement, history.top_force))
    _, plastic = signed_slip(result, direction)
    pivots = turning_points(u, REVERSAL * float(np.ptp(u)))

    def branch(first: int, last: int) -> Branch:
        rows = slice(first, last + 1)
        return branch_of(u[rows], force[rows], plastic[rows], history.gap[rows])

    cycles, dissipated, load = [], _dissipated(history), axial_load(result)
    for number, (start, middle, end) in enumerate(closed_cycles(u, pivots), 1):
        rows = slice(start, end + 1)
        loop = effective_properties(u[rows], force[rows], middle - start)
        cycles.append(Cycle(
            number, float(history.time[start]), float(history.time[end]), loop,
            _period(loop.effective_stiffness, load, result.scene.bearing.gravity),
            float(dissipated[end] - dissipated[start]),
            (branch(start, middle), branch(middle, end)), surface_use(result, rows),
        ))  # fmt: skip
    return tuple(cycles), branch(pivots[0], pivots[1]) if len(pivots) > 1 else None


def _is_straight(history: History, direction: Array) -> bool:
    aside = history.displacement[:, :2] @ np.array([-direction[1], direction[0]])
    return bool(np.abs(aside).max() <= ASIDE * history.horizontal.max())


def _kind(result: Result, direction: Array, cycles: Sequence[Cycle]) -> Kind:
    if cycles:
        return "cycles"
    if is_monotonic(result):
        return "monotonic"
    return "one direction" if _is_straight(result.history, direction) else "two directions"


def _period(stiffness: float, load: float | None, gravity: float) -> float | None:
    return 2 * pi * sqrt(load / (gravity * stiffness)) if load and gravity and stiffness > 0 else None


def _envelope(cycles: Sequence[Cycle]) -> dict[str, Range]:
    found = {}
    for name in LOOP_NUMBERS:
        values = [v for v in (loop_number(cycle, name) for cycle in cycles) if v is not None]
        if values:
            found[name] = Range(min(values), float(np.mean(values)), max(values))
    return found


def loop_number(cycle: Cycle, name: str) -> float | None:
    """One of LOOP_NUMBERS of a cycle."""
    value: float | None = getattr(cycle if name == "effective_period" else cycle.loop, name)
    return value


def _dissipated(history: History) -> Array:
    parts = [values for name, values in history.energy.items() if name.endswith("_dissipated")]
    total: Array = np.sum(parts, axis=0)
    return total


def _at_rest(history: History, peak: float) -> bool:
    """Whether the bearing hardly moves over the last part of the run."""
    begin = history.time[-1] - REST * (history.time[-1] - history.time[0])
    last = history.displacement[history.time >= begin, :2]
    return bool(np.hypot(*np.ptp(last, axis=0)) <= STILL * peak)


def _notes(result: Result, kind: Kind, at_rest: bool, uses: Sequence[SurfaceUse]) -> list[str]:
    """What is not defined in this run, and why."""
    said = []
    if kind == "two directions":
        said.append(f"the motion is in two directions and has no single loop: {NO_LOOP}; "
                    "peaks are radial, the secant stiffness is taken at the largest displacement")  # fmt: skip
    elif kind in ("one direction", "monotonic"):
        said.append(f"no cycle closes: {NO_LOOP}; the first way out has its stages")
    if not at_rest:
        said.append("the bearing still moves when the run ends: what it has then is no residual displacement; "
                    "hold the motion at its end to let it come to rest")  # fmt: skip
    unknown = [str(use.surface) for use in uses if use.contact_area is None]
    if unknown:
        said.append("no radius of the slider is given, so no contact area and no heat flux: "
                    f"surface {', '.join(unknown)}")  # fmt: skip
    if any(use.maximum_uplift is None for use in uses):
        said.append("uplift is not modelled in this run")
    if axial_load(result) is None:
        said.append("no constant axial load: no effective period")
    return said
