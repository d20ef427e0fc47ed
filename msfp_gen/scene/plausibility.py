"""Values of a bearing that are permitted but hardly meant, each with the likely slip."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing

LARGEST_FRICTION = 0.3  # of sliding materials in bearings, with a margin
RADII = (0.05, 20.0)  # of sliding surfaces [m]
LARGEST_TILT = 0.5  # sliding capacity over radius; beyond it a slider tilts by more than 28 degrees


def doubtful_values(bearing: Bearing) -> Iterator[tuple[int, float, str]]:
    """Values that are unlikely: number of the surface, the value, and the text of the doubt with the likely slip."""
    for number, surface in enumerate(bearing.surfaces, start=1):
        path = f"bearing.surfaces[{number - 1}]"
        if surface.friction > LARGEST_FRICTION:
            text = f"{path}.friction = {surface.friction:g} is unusually high; a fraction is meant, not per cent"
            yield number, surface.friction, text
        if not RADII[0] <= surface.radius <= RADII[1]:
            text = f"{path}.radius = {surface.radius:g} m is outside {RADII[0]:g} to {RADII[1]:g} m; is it in metres?"
            yield number, surface.radius, text
        if surface.capacity > LARGEST_TILT * surface.radius:
            text = (
                f"{path}.capacity = {surface.capacity:g} m tilts the slider by "
                f"{surface.capacity / surface.radius:.2g} rad; is it the displacement along the surface, in metres?"
            )
            yield number, surface.capacity, text
        if surface.yield_displacement > 0.1 * surface.capacity:
            text = (
                f"{path}.yield_displacement = {surface.yield_displacement:g} m is more than a tenth of the capacity; "
                "usual are 0.1 to 1 mm"
            )
            yield number, surface.yield_displacement, text
