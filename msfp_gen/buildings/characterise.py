"""Characterisation of a building on bearings: its isolation system as one loop, and what is left of each bearing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from msfp_gen.analysis.characterise import Characterisation
from msfp_gen.analysis.characterise.loops import Path, rests
from msfp_gen.analysis.characterise.report import characterised, effective_period
from msfp_gen.common.tables import Table, yes


@dataclass(frozen=True)
class BearingDemand:
    """Demand on one bearing.

    number: from 1. name. peak_displacement: horizontal [m]. capacity_left: least of its surfaces [m].
    minimum_load_ratio, maximum_load_ratio: N over N at rest [-]. residual_displacement: None where the bearing still
    moves when the run ends [m]. dissipated [J].
    """

    number: int
    name: str
    peak_displacement: float
    capacity_left: float
    minimum_load_ratio: float
    maximum_load_ratio: float
    residual_displacement: float | None
    dissipated: float

    @classmethod
    def of(cls, summary: Mapping[str, Any], residual_displacement: float | None) -> BearingDemand:
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


@dataclass(frozen=True, repr=False)
class BuildingCharacterisation(Characterisation):
    """Result of `characterise` for a building, in SI units: its isolation system as one bearing, and each bearing.

    The displacement is the mean of the bearings, the force the base shear, the load the weight, and energy is that of
    all bearings; there are no sliding regimes and no surfaces.

    Attributes:
        secant_period: of the building as a rigid mass with the secant stiffness [s].
        peak_floor_acceleration: horizontal, of any floor [m/s^2]. peak_drift_ratio: of any storey; None without [-].
        bearings: demands on each.
    """

    FORCE: ClassVar[str] = "peak base shear"
    LOAD: ClassVar[str] = "the weight"
    OF: ClassVar[str] = ", mean of the bearings"

    secant_period: float | None
    peak_floor_acceleration: float
    peak_drift_ratio: float | None
    bearings: tuple[BearingDemand, ...]

    @classmethod
    def of(cls, result: Any) -> BuildingCharacterisation:
        """Characterise the run of a `BuildingResult`. Raises InputError where the bearings did not move."""
        mean, summary = np.mean([one.history.displacement for one in result.bearings], axis=0), result.summary
        path = Path.of(result.time, mean, result.base_reaction, "the building")
        peaks = (float(result.extremes.mean_displacement[3]), summary["peak_force"]["radial"])
        load, gravity = result.scene.weight, result.scene.gravity
        system = characterised(
            result.scene.name, result.status, path, peaks, load, gravity, result.dissipated.sum(axis=1)
        )
        return cls(
            **vars(system),
            secant_period=effective_period(system.secant_stiffness, load, gravity),
            peak_floor_acceleration=summary["peak_floor_acceleration"]["radial"],
            peak_drift_ratio=summary["peak_drift_ratio"],
            bearings=tuple(
                BearingDemand.of(one.summary, float(np.hypot(*u[-1])) if rests(result.time, u) else None)
                for one in result.bearings
                for u in [one.history.displacement[:, :2]]
            ),
        )

    @property
    def title(self) -> str:
        """What it is of."""
        return f"isolation system of {self.name or 'the building'}"

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of the quantities of the run."""
        period = [] if self.secant_period is None else [("secant period", f"{self.secant_period:.3g} s")]
        return super().rows() + period

    @property
    def capacity_left(self) -> float:
        """The least of all bearings [m]."""
        return min(bearing.capacity_left for bearing in self.bearings)

    def demand_table(self) -> Table:
        """Table of the demands on the bearings."""
        rows = [
            (
                str(demand.number),
                demand.name or "-",
                f"{1e3 * demand.peak_displacement:.1f}",
                f"{1e3 * demand.capacity_left:.1f}",
                yes(demand.capacity_left <= 0),
                f"{demand.minimum_load_ratio:.2f} ... {demand.maximum_load_ratio:.2f}",
                "moves" if (last := demand.residual_displacement) is None else f"{1e3 * last:.2f}",
                f"{1e-3 * demand.dissipated:.1f}",
            )
            for demand in self.bearings
        ]
        columns = ("no.", "name", "u [mm]", "left [mm]", "rim", "N / N at rest", "residual [mm]", "dissipated [kJ]")
        return Table("bearings; left: least capacity less sliding", columns, rows)
