"""Summary of the result of a building as plain data, its tables, and the characterisation of the isolation system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from msfp_gen.common.tables import Table, yes
from msfp_gen.results.characterise import Characterisation, characterised, effective_period
from msfp_gen.results.history import by_axis
from msfp_gen.results.loops import ForcePath, rests
from msfp_gen.results.summary import ratios_text, summary_of_run

ColumnFormats = dict[str, tuple[str, str, float, str]]


def summarise(result: Any) -> dict[str, Any]:
    """The summary of a `BuildingResult`; `BuildingResult.summary` lists its keys."""
    extremes, weight = result.extremes, result.scene.weight
    bearings = [bearing.summary for bearing in result.bearings]
    floors, storeys = result.floors, result.storeys
    force = by_axis(extremes.base_reaction)
    return {
        **summary_of_run(result, result.time, result.counters, result.wall_time),
        "peak_displacement": _largest([bearing["peak_displacement"] for bearing in bearings]),
        "weight": weight,
        "peak_force": force,
        "peak_force_ratio": force["radial"] / weight,
        "peak_base_torsion": float(extremes.base_torsion[0]),
        "peak_overturning_moment": {
            key: value for key, value in by_axis(extremes.overturning_moment).items() if key != "E3"
        },
        "peak_twist": float(extremes.base_twist[0]),
        "times": {
            "peak_force": by_axis(extremes.times["base_reaction"]),
            "peak_base_torsion": float(extremes.times["base_torsion"][0]),
            "peak_overturning_moment": {
                key: value for key, value in by_axis(extremes.times["overturning_moment"]).items() if key != "E3"
            },
            "peak_twist": float(extremes.times["base_twist"][0]),
        },
        "minimum_load_ratio": min(bearing["minimum_load_ratio"] for bearing in bearings),
        "maximum_load_ratio": max(bearing["maximum_load_ratio"] for bearing in bearings),
        "rims_met": [bearing["number"] for bearing in bearings if bearing["rims_met"]],
        "peak_floor_acceleration": _largest([floor["peak_acceleration"] for floor in floors]),
        "peak_corner_acceleration": _largest([floor["peak_corner_acceleration"] for floor in floors]),
        "peak_drift_ratio": max((storey["peak_drift_ratio"] for storey in storeys), default=None),
        "peak_corner_drift_ratio": max((storey["peak_corner_drift_ratio"] for storey in storeys), default=None),
        "floors": floors,
        "storeys": storeys,
        "bearings": bearings,
        "verdict": result.verdict.as_dict,
        "energy": {
            "peak_kinetic": float(extremes.energy[0]),
            "peak_strain": float(extremes.energy[1]),
            "damped": float(result.damped[-1]),
            "input": float(result.input[-1]),
            "dissipated": float(result.dissipated[-1].sum()),
            "interface_dissipated": float(result.interface_dissipated[-1].sum()),
            "closure_error": result.energy_error[0],
        },
    }


def _largest(peaks: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The largest value of each component of several peaks."""
    return {component: max(peak[component] for peak in peaks) for component in peaks[0]}


def work_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and value of the energies of a building, its twist and its overturning moment."""
    moment = summary["peak_overturning_moment"]
    about = f"{1e-6 * moment['E1']:.4g} MN m about E1, {1e-6 * moment['E2']:.4g} about E2"
    return [
        ("energy", _energy(summary["energy"])),
        ("twist", f"{summary['peak_twist']:.3g} rad"),
        ("overturning", f"{about}, at the height of the bearings"),
    ]


def tables(summary: Mapping[str, Any]) -> list[Table]:
    """Tables of the floors, storeys and bearings of a summary, and of bearings that lifted."""
    rigid = any(floor["floor"] for floor in summary["floors"])
    at = f"at {_AT[rigid]}: absolute acceleration, displacement from the ground; a, u: in the plane"
    at += "; corner: of the plan" * rigid
    floors = _upwards(f"peaks of floors {at}", NODES | (CORNERS if rigid else {}), summary["floors"])
    of_storeys = (
        "peaks of storeys: drift at the stiffness centre, in the plane over the height there and at the corners"
    )
    storeys = [_upwards(of_storeys, STOREYS, summary["storeys"])] if summary["storeys"] else []
    bearings = summary["bearings"]
    lifted = [_uplift(bearings)] if any(bearing["uplift"]["count"] for bearing in bearings) else []
    return [floors, *storeys, _bearings(bearings), *lifted]


def floor_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and value of the largest acceleration of the floors and drift of the storeys."""
    rigid = any(floor["floor"] for floor in summary["floors"])
    acceleration = f"peak acceleration at {_AT[rigid]} {_plane_and_vertical(summary['peak_floor_acceleration'])}"
    acceleration += f"; at corners {_plane_and_vertical(summary['peak_corner_acceleration'])}" if rigid else ""
    if (drift := summary["peak_drift_ratio"]) is None:
        return [("floors", acceleration)]
    drifts = f"peak drift at stiffness centres {100 * drift:.3g} % of the height"
    drifts += f"; at corners {100 * summary['peak_corner_drift_ratio']:.3g} %"
    return [("floors", acceleration), ("storeys", drifts)]


_AT = {True: "centres of mass", False: "nodes"}


def _plane_and_vertical(peak: Mapping[str, float]) -> str:
    return f"{peak['radial']:.4g} m/s^2, vertical {peak['E3']:.4g}"


def rims_text(bearings: Sequence[Mapping[str, Any]]) -> str:
    """The surfaces that met their rims, and for these the bearings by name or number, as text."""
    groups: dict[str, list[str]] = {}
    for bearing in bearings:
        if bearing["rims_met"]:
            groups.setdefault(_numbers(bearing["rims_met"]), []).append(bearing["name"] or str(bearing["number"]))
    texts = [
        f"{surfaces} of {', '.join(names) if len(names) < len(bearings) else 'all bearings'}"
        for surfaces, names in groups.items()
    ]
    return f"surfaces {'; '.join(texts)}" if texts else "none"


def _numbers(surfaces: Sequence[int]) -> str:
    return ", ".join(map(str, surfaces))


def _energy(energy: Mapping[str, float]) -> str:
    return (
        f"bearings dissipate {1e-3 * energy['dissipated']:.4g} kJ, joints "
        f"{1e-3 * energy['interface_dissipated']:.4g} kJ, the frame {1e-3 * energy['damped']:.4g} kJ; balance of the "
        f"frame closes to {energy['closure_error']:.2g}"
    )


# Column -> (key of a floor, component of its value, scale, format).
NODES: ColumnFormats = {
    "floor": ("name", "", 1, ""),
    "z [m]": ("height", "", 1, "g"),
    "a1 [m/s^2]": ("peak_acceleration", "E1", 1, ".3f"),
    "a2": ("peak_acceleration", "E2", 1, ".3f"),
    "a3": ("peak_acceleration", "E3", 1, ".3f"),
    "a": ("peak_acceleration", "radial", 1, ".3f"),
    "u1 [mm]": ("peak_displacement", "E1", 1e3, ".1f"),
    "u2": ("peak_displacement", "E2", 1e3, ".1f"),
    "u": ("peak_displacement", "radial", 1e3, ".1f"),
}
CORNERS: ColumnFormats = {  # as NODES, at the corners of the plan
    "corner a": ("peak_corner_acceleration", "radial", 1, ".3f"),
    "corner a3": ("peak_corner_acceleration", "E3", 1, ".3f"),
    "corner u": ("peak_corner_displacement", "radial", 1e3, ".1f"),
}
STOREYS: ColumnFormats = {  # as NODES, of a storey
    "storey": ("name", "", 1, ""),
    "drift 1 [mm]": ("peak_drift", "E1", 1e3, ".2f"),
    "drift 2": ("peak_drift", "E2", 1e3, ".2f"),
    "[% height]": ("peak_drift_ratio", "", 100, ".3f"),
    "at corners": ("peak_corner_drift_ratio", "", 100, ".3f"),
    "shear 1 [MN]": ("peak_shear", "E1", 1e-6, ".3f"),
    "shear 2": ("peak_shear", "E2", 1e-6, ".3f"),
    "torsion [MN m]": ("peak_torsion", "", 1e-6, ".3f"),
}


def _upwards(title: str, columns: ColumnFormats, parts: Sequence[Mapping[str, Any]]) -> Table:
    """A table of floors or storeys, the highest first."""
    rows = [
        [format((part[key][of] if of else part[key]) * scale, style) for key, of, scale, style in columns.values()]
        for part in reversed(parts)
    ]
    return Table(title, tuple(columns), rows)


def _bearings(bearings: Sequence[Mapping[str, Any]]) -> Table:
    """Table of the peaks of every bearing."""
    rows = [
        (
            str(bearing["number"]),
            bearing["name"] or "-",
            f"{1e3 * bearing['peak_displacement']['radial']:.1f}",
            f"{1e-3 * bearing['peak_force']['radial']:.1f}",
            f"{1e-3 * bearing['axial_load']:.1f}",
            ratios_text(bearing, " ... "),
            left_text(bearing["minimum_gap"]),
            f"{100 * bearing['displacement_used']:.0f}",
            _numbers(bearing["rims_met"]) or "-",
        )
        for bearing in bearings
    ]
    columns = (
        "no.",
        "name",
        "u [mm]",
        "F [kN]",
        "N at rest [kN]",
        "N / N at rest",
        "least left [mm]",
        "used [%]",
        "rims",
    )
    return Table(f"peaks of bearings; {LEFT}; rims: surfaces", columns, rows)


LEFT = "left: capacity less sliding of the surface named; used: u over the displacement at which all rims are met"


def left_text(gaps: Sequence[float]) -> str:
    """The least gap [mm] and its surface, counted from 1. gaps: of the surfaces, bottom first [m]."""
    surface = int(np.argmin(gaps))
    return f"{1e3 * gaps[surface]:.1f} of {surface + 1}"


def _uplift(bearings: Sequence[Mapping[str, Any]]) -> Table:
    """Table of the uplift of every bearing that lifted."""
    rows = [
        (
            str(bearing["number"]),
            bearing["name"] or "-",
            f"{1e3 * bearing['uplift']['height']:.3g}",
            f"{1e3 * bearing['uplift']['duration']:.3g}",
            str(bearing["uplift"]["count"]),
        )
        for bearing in bearings
        if bearing["uplift"]["count"]
    ]
    return Table("uplift of bearings", ("no.", "name", "height [mm]", "longest [ms]", "times"), rows)


@dataclass(frozen=True)
class BearingDemand:
    """Demand on one bearing.

    number: from 1. name: of the bearing. peak_displacement: horizontal [m]. gaps: least of each surface, bottom first
    [m]; gap_shares: the same over its capacity [-]. displacement_used: peak_displacement over the displacement at which
    all rims are met [-]. minimum_load_ratio, maximum_load_ratio: axial force over the load at rest [-].
    residual_displacement: [m]; None where the bearing still moves when the run ends. dissipated: energy at the end [J].
    """

    number: int
    name: str
    peak_displacement: float
    gaps: tuple[float, ...]
    gap_shares: tuple[float, ...]
    displacement_used: float
    minimum_load_ratio: float
    maximum_load_ratio: float
    residual_displacement: float | None
    dissipated: float

    @property
    def capacity_left(self) -> float:
        """Capacity less sliding, the least of its surfaces [m]."""
        return min(self.gaps)

    @property
    def capacity_left_at(self) -> str:
        """The bearing, the surface with the least capacity left, and its share of its capacity."""
        surface = int(np.argmin(self.gaps))
        name = f" {self.name}" if self.name else ""
        return f"bearing {self.number}{name}, surface {surface + 1}: {100 * self.gap_shares[surface]:.3g} %"


@dataclass(frozen=True, repr=False)
class BuildingCharacterisation(Characterisation):
    """Result of `characterise` for a building, in SI units: the isolation system as one bearing, and each bearing.

    The displacement is the mean of the bearings, the force the base shear, the load the weight, and the energy the sum
    over the bearings. There are no sliding regimes and no surfaces.

    Attributes:
        secant_period: of the building as a rigid mass on the secant stiffness [s].
        peak_floor_acceleration: horizontal, of any floor at its centre of mass [m/s^2].
        peak_drift_ratio: of any storey at its stiffness centre [-]; None without storeys.
        bearings: the demand on each bearing.
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
        summary, displacements = result.summary, [bearing.history.displacement for bearing in result.bearings]
        mean, paths = np.mean(displacements, axis=0), [displacement[:, :2] for displacement in displacements]
        path = ForcePath.of(result.time, mean, result.base_reaction, "the building")
        peaks = (float(result.extremes.mean_displacement[3]), summary["peak_force"]["radial"])
        load, gravity = result.scene.weight, result.scene.gravity
        lost = (result.dissipated + result.interface_dissipated).sum(axis=1)
        system = characterised(result.scene.name, result.status, path, peaks, load, gravity, lost)
        return cls(
            **vars(system),
            secant_period=effective_period(system.secant_stiffness, load, gravity),
            peak_floor_acceleration=summary["peak_floor_acceleration"]["radial"],
            peak_drift_ratio=summary["peak_drift_ratio"],
            bearings=tuple(
                BearingDemand(
                    bearing["number"],
                    bearing["name"],
                    bearing["peak_displacement"]["radial"],
                    tuple(bearing["minimum_gap"]),
                    tuple(1.0 - used for used in bearing["capacity_used"]),
                    bearing["displacement_used"],
                    bearing["minimum_load_ratio"],
                    bearing["maximum_load_ratio"],
                    float(np.hypot(*u[-1])) if rests(result.time, u) else None,
                    bearing["dissipated"],
                )
                for bearing, u in zip(summary["bearings"], paths, strict=True)
            ),
        )

    @property
    def title(self) -> str:
        """Title of the characterisation, with the name of the building."""
        return f"isolation system of {self.name or 'the building'}"

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of the quantities of the run."""
        period = [] if self.secant_period is None else [("secant period", f"{self.secant_period:.3g} s")]
        return super().rows() + period

    @property
    def capacity_left(self) -> float:
        """Capacity less sliding, the least of all surfaces of all bearings [m]."""
        return self._tightest.capacity_left

    @property
    def capacity_left_at(self) -> str:
        """The bearing and surface of `capacity_left`, and its share of the capacity of this surface."""
        return self._tightest.capacity_left_at

    @property
    def _tightest(self) -> BearingDemand:
        return min(self.bearings, key=lambda bearing: bearing.capacity_left)

    def demand_table(self) -> Table:
        """Table of the demands on the bearings."""
        rows = [
            (
                str(demand.number),
                demand.name or "-",
                f"{1e3 * demand.peak_displacement:.1f}",
                left_text(demand.gaps),
                f"{100 * demand.displacement_used:.0f}",
                yes(demand.capacity_left <= 0),
                ratios_text(vars(demand), " ... "),
                "moves" if (last := demand.residual_displacement) is None else f"{1e3 * last:.2f}",
                f"{1e-3 * demand.dissipated:.1f}",
            )
            for demand in self.bearings
        ]
        columns = ("no.", "name", "u [mm]", "left [mm]", "used [%]", "rim", "N / N at rest", "residual [mm]",
                   "dissipated [kJ]")  # fmt: skip
        return Table(f"bearings; {LEFT}", columns, rows)
