"""Temperature inside a heated plate, from the temperature of its surface.

With y_n' = kappa_n (T_s - y_n), kappa_n = D ((2n+1) pi/(2d))^2, the temperature at a depth x of a plate of thickness d
whose back face is insulated is the sum of c_n y_n, c_n = 4 sin((2n+1) pi x/(2d))/((2n+1) pi), whose c_n add up to 1
(Carslaw and Jaeger). The temperature of the surface is linear between the rows, where each y_n is known exactly; modes
that are left out follow it at once. In a half-space an insulated face so deep that no heat comes there changes nothing.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.scene.friction_parameters import start_temperatures
from msfp_gen.specification.friction_laws import HEAT

if TYPE_CHECKING:
    from msfp_gen.results.result import Result

REACH = 6.0  # sqrt(D t) from which on a half-space remains at its start temperature, to rounding
FINE = 2.0  # modes over the thickness in units of sqrt(D times the median step of the rows)


def temperature_at_depth(result: Result, depth: float) -> Array:
    """Temperature at a depth below the centre of every surface in every row, shape (T, n-1) [degC].

    depth: below the sliding surface, inside the heated plate [m]. The result follows from the temperature of the
    surface in the rows, which is taken as linear between them. Source: Carslaw and Jaeger, Conduction of Heat in Solids
    (1959). Raises InputError where the run has no temperatures, or where a plate is thinner than the depth.
    """
    if not 0 <= depth < inf:
        raise InputError(f"depth = {depth}: a distance below the sliding surface [m]; give 0 or more")
    temperature, bearing = result.history.temperature, result.bearing
    if temperature is None:
        raise InputError(
            "temperature_at_depth: this run has no temperatures; give effects.friction = 'pvt' or 'pvtd', or a formula "
            "with T or Td"
        )
    starts, inside = start_temperatures(bearing), np.empty_like(temperature)
    for index, surface in enumerate(bearing.surfaces):
        thickness = inf if surface.plate_thickness is None else surface.plate_thickness
        if depth > thickness:
            raise InputError(
                f"depth = {depth}: the plate of surface {index + 1} ends at plate_thickness = {thickness} [m]; "
                "give less"
            )
        diffusivity = surface.diffusivity or HEAT["diffusivity"]
        assert diffusivity is not None
        rise = temperature[:, index] - starts[index]
        inside[:, index] = starts[index] + rise_inside(result.history.time, rise, depth, diffusivity, thickness)
    return inside


def rise_inside(time: Array, rise: Array, depth: float, diffusivity: float, thickness: float) -> Array:
    """Rise of temperature at a depth [m], shape (T,) [K], from the surface's rise [K], linear between its times [s]."""
    steps = np.diff(time)
    across = min(thickness, depth + REACH * float(np.sqrt(diffusivity * (time[-1] - time[0]))))
    count = 10 + int(FINE * across / np.sqrt(diffusivity * np.median(steps)))
    waves = (np.arange(count) + 0.5) * np.pi / across
    rates, shares = diffusivity * waves**2, 2.0 * np.sin(waves * depth) / (waves * across)
    slopes = np.divide(np.diff(rise), steps, out=np.zeros_like(steps), where=steps > 0)
    behind, inside = np.zeros(count), np.array(rise)  # behind: of each mode, behind the surface
    for row, (step, slope) in enumerate(zip(steps, slopes, strict=True), start=1):
        lag = slope / rates
        behind = lag + (behind - lag) * np.exp(-rates * step)
        inside[row] -= shares @ behind
    return inside
