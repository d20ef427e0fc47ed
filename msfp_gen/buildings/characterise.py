"""Characterisation of a building on bearings: its isolation system as one loop, and what is left of each bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import pi, sqrt
from typing import Any

import numpy as np

from msfp_gen.analysis.characterise import tables
from msfp_gen.analysis.characterise.loops import Loop, Path
from msfp_gen.analysis.characterise.report import Characterisation
from msfp_gen.common.arrays import Array
from msfp_gen.common.tables import Table, yes

NO_CYCLES = "no cycle closes in one direction: no effective stiffness and damping; the secant ones are at the peak"


@dataclass(frozen=True)
class BearingDemand:
    """Demand on one bearing.

    number: from 1. name. peak_displacement: horizontal [m]. capacity_left: least of its surfaces [m].
    minimum_load_ratio, maximum_load_ratio: N over N at rest [-]. residual_displacement [m]. dissipated [J].
    """

    number: int
    name: str
    peak_displacement: float
    capacity_left: float
    minimum_load_ratio: float
    maximum_load_ratio: float
    residual_displacement: float
    dissipated: float

    @classmethod
    def of(cls, summary: Mapping[str, Any], residual_displacement: float) -> BearingDemand:
        """From the summary of a bearing."""
        return cls(
            summary["number"],
            summary["name"],
            summary["peak_displacement"]["radial"],
            min(summary["minimum_gap"]),
            summary["minimum_load_ratio"],
            summary["maximum_load_ratio"],
            residual_displacement,
            summary["dissipated"],
        )


@dataclass(frozen=True)
class BuildingCharacterisation:
    """Result of `characterise` for a building, in SI units; None for a quantity that is not defined.

    Attributes:
        name, status: of the run.
        direction: unit vector (E1, E2) of the largest mean displacement of the bearings.
        weight [N].
        peak_displacement, peak_force: of the mean over the bearings [m], and of the base shear [N].
        secant_stiffness: base shear along the largest displacement, divided by it [N/m].
        secant_period: of the building as a rigid mass with it [s].
        cycles: closed cycles of a motion in one direction, base shear over mean displacement.
        residual_displacement [m]; at_rest: whether the building is at rest by then.
        energy_dissipated: in all bearings [J].
        peak_floor_acceleration: horizontal, of any floor [m/s^2]. peak_drift_ratio: of any storey; None without [-].
        bearings: demands on each.
        notes: what is not defined, and why.
    """

    name: str
    status: str
    direction: tuple[float, float]
    weight: float
    peak_displacement: float
    peak_force: float
    secant_stiffness: float
    secant_period: float | None
    cycles: tuple[Loop, ...]
    residual_displacement: float
    at_rest: bool
    energy_dissipated: float
    peak_floor_acceleration: float
    peak_drift_ratio: float | None
    bearings: tuple[BearingDemand, ...]
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls,
        path: Path,
        gravity: float,
        mean_displacement: Array,
        summary: Mapping[str, Any],
        bearings: Sequence[BearingDemand],
    ) -> BuildingCharacterisation:
        """Characterise a run by its summary.

        path: base shear over the mean displacement of the bearings. gravity [m/s^2]. mean_displacement: largest
        magnitudes of that displacement along E1, E2, E3 and in the plane, shape (4,) [m].
        """
        cycles, stiffness, weight = tuple(loop for *_, loop in path.cycles()), path.secant_stiffness, summary["weight"]
        notes = [] if cycles else [NO_CYCLES]
        if not path.at_rest:
            notes.append("the building still moves when the run ends, so that its last displacement is no residual one")
        return cls(
            name=summary["name"],
            status=summary["status"],
            direction=(float(path.direction[0]), float(path.direction[1])),
            weight=weight,
            peak_displacement=float(mean_displacement[3]),
            peak_force=summary["peak_force"]["radial"],
            secant_stiffness=stiffness,
            secant_period=2 * pi * sqrt(weight / (gravity * stiffness)) if stiffness > 0 and gravity else None,
            cycles=cycles,
            residual_displacement=path.residual,
            at_rest=path.at_rest,
            energy_dissipated=summary["energy"]["dissipated"],
            peak_floor_acceleration=summary["peak_floor_acceleration"]["radial"],
            peak_drift_ratio=summary["peak_drift_ratio"],
            bearings=tuple(bearings),
            notes=tuple(notes),
        )

    @property
    def capacity_left(self) -> float:
        """The least of all bearings [m]."""
        return min(bearing.capacity_left for bearing in self.bearings)

    def __repr__(self) -> str:
        """The main quantities in ten lines at most."""
        return "\n".join([f"Characterisation of {self.name or 'an unnamed building'}, status {self.status}",
                          *(f"  {label:<18}{value}" for label, value in _rows(self))])  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self)


def _rows(system: BuildingCharacterisation) -> list[tuple[str, str]]:
    period = "" if system.secant_period is None else f", period {system.secant_period:.3g} s"
    cycles = [loop for loop in system.cycles if loop.effective_damping is not None]
    effective = [
        ("effective", f"stiffness {1e-6 * np.mean([x.effective_stiffness for x in cycles]):.4g} kN/mm, damping "
         f"{100 * np.mean([x.effective_damping for x in cycles]):.3g} % of {len(cycles)} cycles")
    ] if cycles else []  # fmt: skip
    return [
        ("peak displacement", f"{1e3 * system.peak_displacement:.4g} mm, mean of the bearings"),
        (
            "peak base shear",
            f"{1e-6 * system.peak_force:.4g} MN ({system.peak_force / system.weight:.3f} of the weight)",
        ),
        ("at the peak", f"secant stiffness {1e-6 * system.secant_stiffness:.4g} kN/mm{period}"),
        *effective,
        (
            "residual",
            f"{1e3 * system.residual_displacement:.4g} mm" + ("" if system.at_rest else ", still moving"),
        ),
        ("dissipated", f"{1e-3 * system.energy_dissipated:.4g} kJ in the bearings"),
        *([("not defined", "; ".join(system.notes))] if system.notes else []),
    ]


def characterisation_tables(system: BuildingCharacterisation | Characterisation) -> list[Table]:
    """Tables of a characterisation: of one bearing, or of an isolation system and the demands on its bearings."""
    if isinstance(system, Characterisation):
        return tables.characterisation_tables(system)
    rows = [
        (
            str(demand.number),
            demand.name or "-",
            f"{1e3 * demand.peak_displacement:.1f}",
            f"{1e3 * demand.capacity_left:.1f}",
            yes(demand.capacity_left <= 0),
            f"{demand.minimum_load_ratio:.2f} ... {demand.maximum_load_ratio:.2f}",
            f"{1e3 * demand.residual_displacement:.2f}",
            f"{1e-3 * demand.dissipated:.1f}",
        )
        for demand in system.bearings
    ]
    columns = ("no.", "name", "u [mm]", "left [mm]", "rim", "N / N at rest", "residual [mm]", "dissipated [kJ]")
    whole = Table(f"isolation system of {system.name or 'the building'}", (), _rows(system))
    return [whole, Table("bearings; left: least capacity less sliding", columns, rows)]
