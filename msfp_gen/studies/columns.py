"""Quantities of runs for tables, studies and bounds: names, units, and where summary or characterisation have them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from msfp_gen.buildings.scene import BuildingScene

if TYPE_CHECKING:
    from msfp_gen.buildings.file import AnyScene


class Quantity(NamedTuple):
    """A quantity of a run.

    path: dotted, in the summary, or in the characterisation where `characterised`; `.*` stands for each surface, floor,
    storey or bearing, bottom first or in the order of the file, and gives a column for each. governs: whether its
    largest or its least value governs a design; "" if neither does. at_rest: defined where the run ends at rest.
    """

    unit: str
    path: str
    governs: Literal["most", "least", ""] = ""
    characterised: bool = False
    at_rest: bool = False


RUN = {
    "status": Quantity("", "status"),
    "message": Quantity("", "message"),
    "duration": Quantity("s", "duration"),
    "peak_displacement": Quantity("m", "peak_displacement.radial", "most"),
    "peak_force": Quantity("N", "peak_force.radial", "most"),
    "peak_force_ratio": Quantity("", "peak_force_ratio"),
    "rims_met": Quantity("", "rims_met"),
    "verdict": Quantity("", "verdict.word"),
    "limits_exceeded": Quantity("", "verdict.limits"),
    "closure_error": Quantity("", "energy.closure_error"),
    "steps": Quantity("", "counters.steps"),
    "wall_time": Quantity("s", "wall_time"),
    "secant_stiffness": Quantity("N/m", "secant_stiffness", characterised=True),
    "energy_dissipated": Quantity("J", "energy_dissipated", characterised=True),
    "residual_displacement": Quantity("m", "residual_displacement", "most", characterised=True, at_rest=True),
    # of cycles, their mean
    "effective_stiffness": Quantity("N/m", "envelope.effective_stiffness.mean", characterised=True),
    "effective_period": Quantity("s", "envelope.effective_period.mean", characterised=True),
    "effective_damping": Quantity("", "envelope.effective_damping.mean", characterised=True),
    "zero_displacement_force": Quantity("N", "envelope.zero_displacement_force.mean", characterised=True),
}
BEARING = RUN | {
    "axial_load": Quantity("N", "axial_load"),
    "peak_input_energy": Quantity("J", "energy.peak_input"),
    "dissipated_share": Quantity("", "energy.dissipated_share"),
    "peak_sliding": Quantity("m", "peak_sliding.*"),
    "minimum_gap": Quantity("m", "minimum_gap.*"),
    "minimum_normal_force": Quantity("N", "minimum_normal_force.*"),
    "maximum_normal_force": Quantity("N", "maximum_normal_force.*"),
    "least_friction": Quantity("", "least_friction.*"),
    "most_friction": Quantity("", "most_friction.*"),
    "peak_temperature": Quantity("degC", "peak_temperature.*"),
    "peak_rim_force": Quantity("N", "peak_rim_force.*"),
    "uplift_height": Quantity("m", "uplift.height"),
    "uplift_duration": Quantity("s", "uplift.duration"),
    "maximum_uplift": Quantity("m", "maximum_uplift", "most", characterised=True),
    "capacity_left": Quantity("m", "surfaces.*.capacity_left", "least", characterised=True),
    "peak_velocity": Quantity("m/s", "surfaces.*.peak_velocity", "most", characterised=True),
    "peak_heat_flux": Quantity("W/m^2", "surfaces.*.peak_heat_flux", "most", characterised=True),
}
BUILDING = RUN | {
    "peak_base_torsion": Quantity("N m", "peak_base_torsion"),
    "peak_overturning_moment": Quantity("N m", "peak_overturning_moment.radial", "most"),
    "peak_floor_acceleration": Quantity("m/s^2", "peak_floor_acceleration.radial", "most"),
    "peak_vertical_acceleration": Quantity("m/s^2", "peak_floor_acceleration.E3"),
    "peak_drift_ratio": Quantity("", "peak_drift_ratio", "most"),
    "peak_corner_drift_ratio": Quantity("", "peak_corner_drift_ratio", "most"),
    "minimum_load_ratio": Quantity("", "minimum_load_ratio", "least"),
    "maximum_load_ratio": Quantity("", "maximum_load_ratio", "most"),
    "floor_acceleration": Quantity("m/s^2", "floors.*.peak_acceleration.radial", "most"),
    "storey_drift_ratio": Quantity("", "storeys.*.peak_drift_ratio", "most"),
    "storey_corner_drift_ratio": Quantity("", "storeys.*.peak_corner_drift_ratio", "most"),
    "storey_shear": Quantity("N", "storeys.*.peak_shear.radial", "most"),
    "bearing_displacement": Quantity("m", "bearings.*.peak_displacement.radial", "most"),
    "bearing_load_ratio": Quantity("", "bearings.*.minimum_load_ratio", "least"),
    "bearing_maximum_load_ratio": Quantity("", "bearings.*.maximum_load_ratio", "most"),
    "bearing_uplift_height": Quantity("m", "bearings.*.uplift.height", "most"),
    "bearing_uplift_duration": Quantity("s", "bearings.*.uplift.duration", "most"),
    "secant_period": Quantity("s", "secant_period", characterised=True),
    "capacity_left": Quantity("m", "capacity_left", "least", characterised=True),
}


MOVING = "the run ends while the bearing still moves: give motion.hold, such as 20 s, for time without motion"


class Source(NamedTuple):
    """A quantity, or that of one surface, floor, storey or bearing, by its place from 0."""

    quantity: Quantity
    place: int | None = None

    def reason(self, characterisation: Any) -> str:
        """Why a run that was characterised has no value; "" where no reason is known."""
        rests = getattr(characterisation, "at_rest", True)
        return "" if rests or not self.quantity.at_rest else MOVING

    @property
    def compared(self) -> bool:
        """Whether `bound` compares it; quantities of parts of a building are only in its suites."""
        of_part = self.quantity.path.partition(".*")[0] in ("floors", "storeys", "bearings")
        return not of_part and (self.quantity.characterised or bool(self.quantity.governs))

    def value(self, summary: Mapping[str, Any], characterisation: Any) -> Any:
        """Its value; None where the run has none. characterisation: None where it is not needed, or not possible."""
        quantity = self.quantity
        if quantity.at_rest and not getattr(characterisation, "at_rest", False):
            return None
        value = value_at(characterisation if quantity.characterised else summary, quantity.path)
        if self.place is None or value is None:
            return value
        return value[self.place] if self.place < len(value) else None


class Counts(NamedTuple):
    """What quantities of a scene there is one of each: the most surfaces of any bearing, and parts of a building."""

    surfaces: int = 0
    floors: int = 0
    storeys: int = 0
    bearings: int = 0

    @classmethod
    def of(cls, scene: AnyScene) -> Counts:
        """Those of a scene; of one bearing there is no building."""
        surfaces = max(len(bearing.surfaces) for bearing in scene.every_bearing)
        if not isinstance(scene, BuildingScene):
            return cls(surfaces)
        return cls(surfaces, len(scene.building.nodes), len(scene.building.columns), len(scene.bearings))

    def or_more(self, other: Counts) -> Counts:
        """The larger of each."""
        return Counts(*map(max, self, other))


@lru_cache(maxsize=16)
def catalogue(counts: Counts) -> dict[str, Source]:
    """Column -> where it comes from, of a bearing or of a building."""
    sources: dict[str, Source] = {}
    for name, quantity in (BUILDING if counts.bearings else BEARING).items():
        head, several, _ = quantity.path.partition(".*")
        if several:
            numbers = range(getattr(counts, head, counts.surfaces))
            sources |= {f"{name}_{index + 1}": Source(quantity, index) for index in numbers}
        else:
            sources[name] = Source(quantity)
    return sources


def value_at(table: Any, path: str) -> Any:
    """The value at a dotted path of keys or attributes, None without it; `*` gives a list of the values of all rows."""
    value = table
    head, several, rest = path.partition(".*")
    for part in head.split("."):
        value = value.get(part) if isinstance(value, Mapping) else getattr(value, part, None)
    if not several or value is None:
        return value
    return [value_at(row, rest.lstrip(".")) for row in value] if rest else value


def plain_cell(value: Any) -> Any:
    """A value of a cell: lists of whole numbers separated by spaces (`rims_met`), other lists and tables as JSON."""
    if isinstance(value, list) and all(type(item) is int for item in value):
        return " ".join(map(str, value))
    return json.dumps(value, default=str) if isinstance(value, list | tuple | dict) else value
