"""The quantities of the run of a building that tables, studies and bounds report."""

from __future__ import annotations

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.results.quantities import RUN, ColumnSource, RunQuantity, sources_of

_RUN = RUN | {
    "rims_met": RUN["rims_met"]._replace(kept=False),
    "peak_force": RUN["peak_force"]._replace(words="peak base shear"),
    "peak_force_ratio": RUN["peak_force_ratio"]._replace(words="peak base shear over the weight"),
}
LEAST, MOST = "least axial force over the load at rest", "largest axial force over the load at rest"
AT_CORNERS = "peak floor acceleration at corners"
LEAST_LEFT = "least capacity left of a surface"  # inner ones of a triple pendulum have little, however far it moves
QUANTITIES = _RUN | {
    "peak_base_torsion": RunQuantity("N m", "peak_base_torsion", extreme="most"),
    "peak_overturning_moment": RunQuantity("N m", "peak_overturning_moment.radial", "most"),
    "peak_floor_acceleration": RunQuantity("m/s^2", "peak_floor_acceleration.radial", "most", kept=True),
    "peak_vertical_acceleration": RunQuantity("m/s^2", "peak_floor_acceleration.E3", extreme="most"),
    "peak_corner_acceleration": RunQuantity("m/s^2", "peak_corner_acceleration.radial", "most", words=AT_CORNERS),
    "peak_corner_vertical_acceleration": RunQuantity("m/s^2", "peak_corner_acceleration.E3", extreme="most"),
    "peak_drift_ratio": RunQuantity("", "peak_drift_ratio", "most", kept=True),
    "peak_corner_drift_ratio": RunQuantity("", "peak_corner_drift_ratio", "most", words="peak drift ratio at corners"),
    "minimum_load_ratio": RunQuantity("", "minimum_load_ratio", "least", kept=True, words=LEAST),
    "maximum_load_ratio": RunQuantity("", "maximum_load_ratio", "most", words=MOST),
    "floor_acceleration": RunQuantity("m/s^2", "floors.*.peak_acceleration.radial", "most", of_parts=True),
    "floor_corner_acceleration": RunQuantity(
        "m/s^2", "floors.*.peak_corner_acceleration.radial", "most", of_parts=True, words="acceleration at corners"
    ),
    "storey_drift_ratio": RunQuantity("", "storeys.*.peak_drift_ratio", "most", of_parts=True),
    "storey_corner_drift_ratio": RunQuantity("", "storeys.*.peak_corner_drift_ratio", "most", of_parts=True),
    "storey_shear": RunQuantity("N", "storeys.*.peak_shear.radial", "most", of_parts=True),
    "bearing_displacement": RunQuantity("m", "bearings.*.peak_displacement.radial", "most", of_parts=True),
    "bearing_load_ratio": RunQuantity("", "bearings.*.minimum_load_ratio", "least", of_parts=True, words=LEAST),
    "bearing_maximum_load_ratio": RunQuantity("", "bearings.*.maximum_load_ratio", "most", of_parts=True, words=MOST),
    "bearing_uplift_height": RunQuantity("m", "bearings.*.uplift.height", "most", of_parts=True),
    "bearing_uplift_duration": RunQuantity("s", "bearings.*.uplift.duration", "most", of_parts=True),
    "floor_spectra": RunQuantity("", "floor_spectra", apart=True),  # as JSON: `spectra.kept_spectra`
    "secant_period": RunQuantity("s", "secant_period", characterised=True),
    "capacity_left": RunQuantity(
        "m", "capacity_left", "least", words=LEAST_LEFT, characterised=True, where="capacity_left_at"
    ),
}


def quantities(scene: BuildingScene) -> dict[str, ColumnSource]:
    """Column -> source of the quantities of a building, with the names of its floors, storeys and bearings."""
    parts = {
        "floors": [node.name for node in scene.building.nodes],
        "storeys": [column.name for column in scene.building.columns],
        "bearings": [bearing.name or f"bearing {number}" for number, bearing in enumerate(scene.bearings, 1)],
    }
    return sources_of(QUANTITIES, parts, 0)
