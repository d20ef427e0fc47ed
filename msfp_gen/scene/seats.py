"""Stiffness of the unilateral contacts of models with uplift, in series with the springs of the top (docs/uplift.md).

The stiffness of a top is that of everything between the lowest surface and what holds the top plate. In models with
uplift the contacts have a part of this compliance and the spring has the rest, so that a bearing that stays closed
moves as without uplift.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.top import Top

LEAST = 5e9  # of a contact whose stiffness is not given [N/m]
SHARE = 0.05  # of the compliance of the stiffest spring of the top: the most that all such contacts have together
SPRINGS = ("stiffness", "vertical_stiffness")  # of a top


def seat_stiffness(bearing: Bearing, top: Top | None) -> Array:
    """Stiffness of the unilateral contact of every surface, ndarray, shape (n-1,) [N/m].

    Where it is not given: `LEAST`, or more, so that contacts which all have this value have `SHARE` of the compliance
    of the stiffest spring of the top. Raises InputError: the contacts in series are not stiffer than this spring.
    """
    name, stiffest, needed = _stiffest_spring(bearing, top)
    values = [surface.seat_stiffness for surface in bearing.surfaces]
    stiffness = np.array([max(LEAST, needed) if value is None else value for value in values])
    in_series = 1.0 / float((1.0 / stiffness).sum())
    if stiffest >= in_series:
        index = int(stiffness.argmin())
        raise InputError(
            f"bearing.surfaces[{index}].seat_stiffness = {stiffness[index]:g}: with it the contacts of all surfaces in "
            f"series have {in_series:.6g} N/m, which must be more than {name} = {stiffest:g} of the top, since this "
            "contains them; give more [N/m], or leave it out"
        )
    return stiffness


def stiffness_slopes(bearing: Bearing, top: Top, spring: str) -> Array:
    """Derivatives of `seat_stiffness` with respect to a spring of the top, ndarray, shape (n-1,) [-]."""
    values = [surface.seat_stiffness for surface in bearing.surfaces]
    _, stiffest, needed = _stiffest_spring(bearing, top)
    follows = getattr(top, spring) == stiffest and needed > LEAST
    return np.array([len(values) / SHARE if follows and value is None else 0.0 for value in values])


def _stiffest_spring(bearing: Bearing, top: Top | None) -> tuple[str, float, float]:
    """Name and stiffness of the stiffest spring of the top, and what every contact needs to have `SHARE` [N/m]."""
    springs = {name: getattr(top, name, None) or 0.0 for name in SPRINGS}
    name = max(springs, key=lambda spring: springs[spring])
    return name, springs[name], len(bearing.surfaces) * springs[name] / SHARE


def check_seats(bearing: Bearing, top: Top, effects: Effects | Auto | None) -> None:
    """Raise InputError as `seat_stiffness` does, where a run may model uplift."""
    if effects is None or effects.uplift is not False:
        seat_stiffness(bearing, top)
