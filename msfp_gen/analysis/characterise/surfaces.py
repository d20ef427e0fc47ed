"""Demands on every sliding surface in a run: remaining capacity, slip velocity, heat flux, uplift."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.results.run_data import BearingData, RunData
from msfp_gen.results.sliding import separated

if TYPE_CHECKING:
    from msfp_gen.common.arrays import Array
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


def surface_demands(one: BearingData, rows: slice | None = None) -> tuple[SurfaceDemand, ...]:
    """Demands on every surface over `rows`, bottom first; over the whole run, its steps included, without them."""
    history, extremes, whole = one.history, one.extremes, rows is None
    rows = slice(None) if rows is None else rows
    gap, lift = (values[rows] for values in (history.gap, history.lift))
    least_gap = extremes.gap if whole else gap.min(axis=0)
    most_lift = extremes.lift if whole and extremes.lift is not None else lift.max(axis=0)
    has_uplift = one.effects.uplift or bool(history.lift.any())  # a monitor may add uplift during the run
    slips = _slips(one, rows, whole) if isinstance(one, RunData) else None
    return tuple(
        SurfaceDemand(
            surface=i + 1,
            capacity_left=float(least_gap[i]),
            capacity_left_share=float(least_gap[i]) / surface.capacity,
            peak_velocity=None if slips is None else float(slips[0][i]),
            peak_heat_flux=float(slips[1][i]) / area if slips is not None and area else None,
            heat=float(slips[2][i]) / area if slips is not None and area else None,
            contact_area=area,
            maximum_uplift=float(most_lift[i]) if has_uplift else None,
        )
        for i, surface in enumerate(one.bearing.surfaces)
        for area in (_contact_area(one.bearing, i),)
    )


def _slips(result: RunData, rows: slice, whole: bool) -> tuple[Array, Array, Array]:
    """Largest slip velocity [m/s] and friction power [W], and its integral [J], of every surface, shape (n-1,) each."""
    history, fastest = result.history, result.extremes.slip_speed
    speed = np.where(separated(history), 0.0, np.linalg.norm(history.slip_velocity, axis=2))[rows]
    power = result.friction_coefficient[rows] * history.normal_force[rows] * speed
    heat = np.asarray(np.trapezoid(power, history.time[rows], axis=0))
    return (fastest if whole and fastest is not None else speed.max(axis=0)), power.max(axis=0), heat


def _contact_area(bearing: Bearing, surface: int) -> float | None:
    """Contact area of a surface (index from 0) [m^2]; None if no radius is given."""
    patch = bearing.surfaces[surface].patch_radius
    radius = bearing.slider_rim_radius(surface) if patch is None else patch
    return pi * radius**2 if radius > 0 else None
