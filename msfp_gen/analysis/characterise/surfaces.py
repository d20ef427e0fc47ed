"""Demands on every sliding surface in a run: remaining capacity, slip velocity, heat flux, uplift."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.results.sliding import separated

if TYPE_CHECKING:
    from msfp_gen.common.arrays import Array
    from msfp_gen.results.run_data import RunData
    from msfp_gen.scene.bearing import Bearing


@dataclass(frozen=True)
class SurfaceDemand:
    """Extreme values of one surface over some rows.

    Attributes:
        surface: 1..n-1.
        capacity_left: least gap to the rim [m]; negative where the rim is compressed.
        capacity_left_share: the same over the capacity [-].
        peak_velocity: largest slip velocity while the surface is in contact [m/s]; None if it is not known.
        peak_heat_flux: largest mu N |v|/A [W/m^2]; None if A or v is not known.
        heat: its integral over time [J/m^2]; None if A or v is not known.
        contact_area: A = pi r^2, with r the radius of the sliding patch, else the rim radius of the slider [m^2]; None
            if the bearing has neither.
        maximum_uplift: largest opening of the surface [m]; None in a model without uplift.
    """

    surface: int
    capacity_left: float
    capacity_left_share: float
    peak_velocity: float | None
    peak_heat_flux: float | None
    heat: float | None
    contact_area: float | None
    maximum_uplift: float | None


def surface_demands(result: RunData, rows: slice | None = None) -> tuple[SurfaceDemand, ...]:
    """Demands on every surface over `rows`, bottom first; over the whole run, its steps included, without them."""
    whole, rows = rows is None, slice(None) if rows is None else rows
    history, bearing, extremes = result.history, result.scene.bearing, result.extremes
    speed = np.where(separated(history), 0.0, np.linalg.norm(history.slip_velocity, axis=2))[rows]
    power = result.friction_coefficient[rows] * history.normal_force[rows] * speed
    heat = np.asarray(np.trapezoid(power, history.time[rows], axis=0))
    fastest = extremes.slip_speed if whole and extremes.slip_speed is not None else speed.max(axis=0)
    has_uplift = result.scene.modelled.uplift or bool(history.lift.any())  # a monitor may add uplift during the run
    gap, lift = extremes.gap if whole else history.gap[rows].min(axis=0), history.lift[rows].max(axis=0)
    demands = []
    for i, basic in enumerate(capacity_demands(bearing, gap, lift if has_uplift else None)):
        area = basic.contact_area
        demands.append(
            replace(
                basic,
                peak_velocity=float(fastest[i]),
                peak_heat_flux=float(power[:, i].max()) / area if area else None,
                heat=float(heat[i]) / area if area else None,
            )
        )
    return tuple(demands)


def capacity_demands(bearing: Bearing, gap: Array, lift: Array | None) -> tuple[SurfaceDemand, ...]:
    """What least gaps and largest openings tell, shape (n-1,) [m]; velocity and heat are None.

    lift: None without uplift.
    """
    return tuple(
        SurfaceDemand(
            surface=i + 1,
            capacity_left=float(gap[i]),
            capacity_left_share=float(gap[i]) / surface.capacity,
            peak_velocity=None,
            peak_heat_flux=None,
            heat=None,
            contact_area=_contact_area(bearing, i),
            maximum_uplift=None if lift is None else float(lift[i]),
        )
        for i, surface in enumerate(bearing.surfaces)
    )


def _contact_area(bearing: Bearing, surface: int) -> float | None:
    """Contact area of a surface (index from 0) [m^2]; None if no radius is given."""
    patch = bearing.surfaces[surface].patch_radius
    radius = bearing.slider_rim_radius(surface) if patch is None else patch
    return pi * radius**2 if radius > 0 else None
