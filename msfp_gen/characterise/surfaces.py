"""What a run asks of every sliding surface: capacity left, slip velocity, heat flux, uplift."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.stages import parted

if TYPE_CHECKING:
    from msfp_gen.result import Result


@dataclass(frozen=True)
class SurfaceUse:
    """Extremes of one surface (1..n-1) over some rows; SI.

    capacity_left: least gap to the rim [m]; below zero the rim is pressed. peak_velocity: largest slip velocity while
    the surface is closed [m/s].
    peak_heat_flux: largest mu N |v|/A [W/m^2], and heat: its integral over time [J/m^2]; None where A is not known.
    contact_area: A = pi r^2 with r the radius of the sliding patch, else the rim radius of the slider [m^2]; None where
    the bearing has neither.
    maximum_uplift: largest clearance between both bodies [m]; None where the model knows no uplift.
    """

    surface: int
    capacity_left: float
    capacity_left_share: float
    peak_velocity: float
    peak_heat_flux: float | None
    heat: float | None
    contact_area: float | None
    maximum_uplift: float | None


def surface_use(result: Result, rows: slice) -> tuple[SurfaceUse, ...]:
    """The use of every surface over `rows`, bottom first."""
    history, bearing = result.history, result.scene.bearing
    speed = np.where(parted(history), 0.0, np.linalg.norm(history.slip_velocity, axis=2))[rows]
    power = result.friction_coefficient[rows] * history.normal_force[rows] * speed
    heat = np.asarray(np.trapezoid(power, history.time[rows], axis=0))
    parts = result.scene.modelled.uplift or bool(history.lift.any())  # given, chosen, or taken in on the way
    found = []
    for i, surface in enumerate(bearing.surfaces):
        left, area = float(history.gap[rows, i].min()), _contact_area(result, i)
        found.append(SurfaceUse(
            i + 1, left, left / surface.capacity, float(speed[:, i].max()),
            float(power[:, i].max()) / area if area else None,
            float(heat[i]) / area if area else None,
            area,
            float(history.lift[rows, i].max()) if parts else None,
        ))  # fmt: skip
    return tuple(found)


def _contact_area(result: Result, surface: int) -> float | None:
    bearing = result.scene.bearing
    patch = bearing.surfaces[surface].patch_radius
    radius = bearing.slider_rim_radius(surface) if patch is None else patch
    return pi * radius**2 if radius > 0 else None
