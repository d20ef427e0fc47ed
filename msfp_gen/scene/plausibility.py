"""Values of a bearing that are permitted but hardly meant, each with the likely slip."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.scene.standing import standing_of, unsteady
from msfp_gen.scene.top import MassTop, sprung_mass

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.parts import SceneParts

LARGEST_FRICTION = 0.3  # of sliding materials in bearings, with a margin
RADII = (0.05, 20.0)  # of sliding surfaces [m]
LEAST_DAMPING = 0.01  # ratio of a vibration on vertical springs below which what it adds depends on the tolerance
USUAL_DAMPING = 0.02  # ratio that is named as the remedy
LARGEST_TILT = 0.5  # sliding capacity over radius; beyond it a slider tilts by more than 28 degrees


def scene_doubts(scene: SceneParts) -> Iterator[tuple[int, float, str]]:
    """Those of the bearing of a scene, and of what holds its top plate up."""
    yield from doubtful_values(scene.bearing)
    if standing := standing_of(scene):
        yield from unsteady(*standing[:3])
    if (mass := sprung_mass(scene.top)) and isinstance(scene.top, MassTop):
        turn = np.sqrt((scene.top.vertical_stiffness or 0.0) / mass)
        given = scene.top.vertical_damping
        ratio, cure = given / (2 * turn * mass), 2 * USUAL_DAMPING * turn * mass
        if ratio < LEAST_DAMPING:
            name, what = "top.vertical_damping", "the mass vibrates on its vertical spring"
            yield 0, ratio, ringing(name, given, what, turn, ratio, cure)


def ringing(path: str, given: float, what: str, turn: float, ratio: float, cure: float) -> str:
    """The text of a doubt about a vibration that rings on.

    path: of the damping in messages. given: its value. what: vibrates, at the circular frequency `turn` [rad/s] with
    the damping ratio `ratio`. cure: damping with which it has `USUAL_DAMPING`.
    """
    return (
        f"{path} = {given:g}: {what} at {turn / (2 * np.pi):.3g} Hz with {ratio:.1%} of critical damping and rings "
        f"on: accelerations and rotations depend on the tolerance by several per cent; give {cure:.3g} N s/m for "
        f"{USUAL_DAMPING:.0%}"
    )


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
