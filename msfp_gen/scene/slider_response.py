"""How fast sliding bodies respond to a change of the motion: what decides whether their inertia matters."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.scene.top import RigTop, Top

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.parts import SceneParts


def response_time(bearing: Bearing, top: Top, load: float) -> float:
    """Longest time in which a body between two sliding surfaces follows a change of its velocity, sqrt(m/k) [s].

    Surfaces share the motion differently while the bodies respond. Sliding friction has no stiffness: k is that of the
    spheres, N/R of both surfaces, and of the rig above the top plate. load: N, the smallest of the run [N]; inf
    without load.
    """
    longest, radii = 0.0, [surface.radius for surface in bearing.surfaces]
    held = top.stiffness if isinstance(top, RigTop) else 0.0
    above = [*(load / radius for radius in radii[1:]), held]
    for radius, stiffness, body in zip(radii, above, bearing.bodies, strict=True):
        longest = max(longest, body.mass / (load / radius + stiffness) if load > 0 else inf)
    return float(np.sqrt(longest))


def motion_time_scale(motion: Motion, times: Array) -> float:
    """Peak velocity of the base over its peak acceleration [s], of `times` [s]; inf where it is at rest."""
    velocity, acceleration = (np.linalg.norm(motion.evaluate(times, order)[:, :3], axis=1).max() for order in (1, 2))
    return float(velocity / acceleration) if acceleration > 0 else inf


def turned_or_pushed(scene: SceneParts) -> bool:
    """Whether base or top rotate, or a load history has other components than the vertical one."""
    turned = scene.top_rotation is not None or np.any(scene.motion.coefficients[:, 3:])
    return bool(turned or (scene.load is not None and np.any(scene.load.coefficients[:, [0, 1, 3, 4, 5]])))
