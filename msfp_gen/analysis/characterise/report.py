"""Characterisation of a run: closed cycles, first loading, demands on the surfaces, and envelope of the cycles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import pi, sqrt

import numpy as np

from msfp_gen.analysis.characterise.characterisation import (
    LOOP_QUANTITIES,
    Characterisation,
    Cycle,
    Kind,
    Range,
    loop_quantity,
)
from msfp_gen.analysis.characterise.loops import Path
from msfp_gen.analysis.characterise.surfaces import Branch, SurfaceDemand, branch_of, signed_slip, surface_demands
from msfp_gen.analysis.transitions import is_monotonic, transitions
from msfp_gen.common.arrays import Array
from msfp_gen.results.run_data import BearingData, RunData

NOT_RECORDED = (
    "the rows of a building have no slip velocities: no sliding regimes, velocities and heat of surfaces; periods are "
    "with N at rest"
)
NO_LOOP = "effective stiffness, damping, zero-displacement force and the sliding regimes of a cycle are not defined"


def characterise(one: BearingData) -> Characterisation:
    """Characterise a run of one bearing; docs/characterise.md gives the formulas and the clauses of codes.

    What the rows of a bearing below a building do not have is None, and the notes say so; its period is that with N at
    rest. Raises InputError if the bearing did not move.
    """
    history, load, peaks = one.history, one.axial_load, one.extremes
    path = Path.of(history.time, history.displacement, history.top_force)
    branch = _branches(one, path) if isinstance(one, RunData) else None
    name = one.title if one.number else one.scene.name
    largest = (float(peaks.displacement[3]), float(peaks.top_force[3]))
    demands = partial(surface_demands, one)
    characterisation = characterised(
        name, one.status, path, largest, load, one.bearing.gravity, history.dissipated, demands, branch
    )
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


def _branches(result: RunData, path: Path) -> Callable[[int, int], Branch]:
    """What gives the sliding regimes from one row to another."""
    (u, force), (slip, plastic) = path.along, signed_slip(result, path.direction)

    def branch(first: int, last: int) -> Branch:
        rows = slice(first, last + 1)
        return branch_of(u[rows], force[rows], slip[rows], plastic[rows], result.history.gap[rows])

    return branch


def characterised(
    name: str,
    status: str,
    path: Path,
    peaks: tuple[float, float],
    load: float | None,
    gravity: float,
    dissipated: Array,
    demands: Callable[[slice | None], tuple[SurfaceDemand, ...]] = lambda rows: (),
    branch: Callable[[int, int], Branch] | None = None,
) -> Characterisation:
    """What follows from the path of a bearing, or of an isolation system.

    name, status: of the run. peaks: largest horizontal displacement [m] and force [N] over all steps. load: that of the
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
    kind: Kind = "cycles" if cycles else "one direction" if straight else "two directions"
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


def _notes(kind: Kind, path: Path, demands: Sequence[SurfaceDemand], regimes: bool) -> list[str]:
    """What is not defined in this run, and why. regimes: whether those of sliding are known."""
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
