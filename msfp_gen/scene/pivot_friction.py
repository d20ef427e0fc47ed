"""Friction coefficients of data sheets, which refer to the pivot of a bearing, as coefficients of its surfaces.

Published formulas let friction act at the pivot, the middle of the innermost slider, and not at the sliding surface.
The coefficient of an outer surface in such a formula contains the lever arms of the inner ones: docs/devices.md,
"Which friction a data sheet means".
"""

from __future__ import annotations

from collections.abc import Sequence

from msfp_gen.errors import InputError
from msfp_gen.specification.layout import Layout


def friction_from_pivot(
    layout: Layout, radii: Sequence[float], heights: Sequence[float], coefficients: Sequence[float]
) -> list[float]:
    """Friction coefficients mu of the surfaces [-], from coefficients at the pivot.

    With R_eff the distance from the sphere centre to the pivot and ' for the next surface towards the pivot:
    mu = (mu_pivot (R_eff - R_eff') + mu' R')/R.

    Args:
        layout: of the bearing, with as many surfaces concave up as down.
        radii: radius of each surface, bottom first [m].
        heights: height of each body, base first [m].
        coefficients: coefficient of each surface at the pivot, bottom first.

    Raises:
        InputError: the pivot of the layout is not the middle of a slider, or a coefficient would be negative.
    """
    if layout.m != layout.p:
        raise InputError(
            f"bearing.friction_at = 'pivot': layout {layout.name} has {layout.m} surfaces concave up and {layout.p} "
            "down, so its pivot is not the middle of its inner slider; give the coefficients at the surfaces"
        )
    interfaces = [sum(heights[: index + 1]) for index in range(layout.surfaces)]
    pivot = (interfaces[layout.m - 1] + interfaces[layout.m]) / 2
    arms = [abs(z + sign * R - pivot) for z, sign, R in zip(interfaces, layout.signs, radii, strict=True)]
    found = [0.0] * layout.surfaces
    for chain in (range(layout.m - 1, -1, -1), range(layout.m, layout.surfaces)):
        inner_arm = inner_moment = 0.0
        for index in chain:
            moment = coefficients[index] * (arms[index] - inner_arm) + inner_moment
            if moment < 0:
                raise InputError(
                    f"bearing.surfaces[{index}].friction = {coefficients[index]:g} at the pivot: that of the surface "
                    "itself would be negative; give a larger one, or coefficients at the surfaces"
                )
            found[index] = moment / radii[index]
            inner_arm, inner_moment = arms[index], moment
    return found
