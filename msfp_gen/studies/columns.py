"""Columns of tables of runs: names, units, and where a summary has their values."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

# Column -> (unit, path in the summary). A path that ends in * gives one column for each surface, bottom first.
COLUMNS = {
    "status": ("", "status"),
    "message": ("", "message"),
    "duration": ("s", "duration"),
    "peak_displacement": ("m", "peak_displacement.radial"),
    "peak_force": ("N", "peak_force.radial"),
    "peak_force_ratio": ("", "peak_force_ratio"),
    "peak_sliding": ("m", "peak_sliding.*"),
    "minimum_gap": ("m", "minimum_gap.*"),
    "minimum_normal_force": ("N", "minimum_normal_force.*"),
    "maximum_normal_force": ("N", "maximum_normal_force.*"),
    "rims_met": ("", "rims_met"),
    "peak_input_energy": ("J", "energy.peak_input"),
    "closure_error": ("", "energy.closure_error"),
    "steps": ("", "counters.steps"),
    "wall_time": ("s", "wall_time"),
}
# The same of a building; `.*.` stands for each floor, storey or bearing, from below or in the order of the file.
BUILDING_COLUMNS = {
    "status": ("", "status"),
    "message": ("", "message"),
    "duration": ("s", "duration"),
    "peak_displacement": ("m", "peak_displacement.radial"),
    "peak_force": ("N", "peak_force.radial"),
    "peak_force_ratio": ("", "peak_force_ratio"),
    "peak_base_torsion": ("N m", "peak_base_torsion"),
    "peak_floor_acceleration": ("m/s^2", "peak_floor_acceleration.radial"),
    "peak_vertical_acceleration": ("m/s^2", "peak_floor_acceleration.E3"),
    "peak_drift_ratio": ("", "peak_drift_ratio"),
    "minimum_load_ratio": ("", "minimum_load_ratio"),
    "maximum_load_ratio": ("", "maximum_load_ratio"),
    "rims_met": ("", "rims_met"),
    "floor_acceleration": ("m/s^2", "floors.*.peak_acceleration.radial"),
    "storey_drift_ratio": ("", "storeys.*.peak_drift_ratio"),
    "storey_shear": ("N", "storeys.*.peak_shear.radial"),
    "bearing_displacement": ("m", "bearings.*.peak_displacement.radial"),
    "bearing_load_ratio": ("", "bearings.*.minimum_load_ratio"),
    "closure_error": ("", "energy.closure_error"),
    "wall_time": ("s", "wall_time"),
}


def of_building(summary: Mapping[str, Any]) -> bool:
    """Whether this is the summary of a building."""
    return "bearings" in summary


def summary_value(summary: Mapping[str, Any], path: str) -> Any:
    """The value of a summary at a dotted path, None where it has none; `*` gives a list of the values of all rows."""
    value: Any = summary
    head, each, rest = path.partition(".*")
    for part in head.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if not each or value is None:
        return value
    return [summary_value(row, rest.lstrip(".")) for row in value] if rest else value


def plain_cell(value: Any) -> Any:
    """A value of a cell: lists of whole numbers separated by spaces (`rims_met`), other lists and tables as JSON."""
    if isinstance(value, list) and all(type(item) is int for item in value):
        return " ".join(map(str, value))
    return json.dumps(value, default=str) if isinstance(value, list | tuple | dict) else value
