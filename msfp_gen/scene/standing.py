"""Springs of the top: whether they hold the plate up, and how much of their compliance the contacts have.

The plate stands by its rotational stiffness against load times lever. While all surfaces slide, friction is a force and
no stiffness. To small tilts the stack is then a chain of links between the sphere centres of its surfaces: body k turns
about the centre of its lower face and carries the load at the centre of its upper face, or at r_nn. Its potential
energy is the energy of the load on links that lean, and of the springs of the top.

The stiffness of a top is the stiffness of everything between the lowest surface and what holds the top plate. In models
with uplift the contacts have a part of this compliance and the spring has the rest, so that a bearing that stays closed
moves as without uplift (docs/uplift.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.scene.top import MassTop, RigTop, load_values
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene_fields import SceneFields
    from msfp_gen.scene.top import Top

MARGIN = 2.0  # stiffness over that which the load at rest needs; below it there is a note


def links(bearing: Bearing) -> Array:
    """Height of the upper sphere centre of bodies 2..n above the lower one; of the top plate: of r_nn.

    ndarray, shape (n-1,) [m].
    """
    centres = np.array([sign * s.radius for sign, s in zip(bearing.layout.signs, bearing.surfaces, strict=True)])
    heights = np.array([body.height for body in bearing.bodies])
    lengths: Array = heights + np.append(centres[1:], 0.0) - centres
    return lengths


def needed_rotational_stiffness(
    bearing: Bearing, load: float, stiffness: float, mass: float = 0.0, height: float = 0.0
) -> float:
    """Least rotational stiffness of the top with which the stack stands while its surfaces slide [N m/rad].

    load: on the top plate at r_nn, without the weight of the mass [N]. stiffness: of the horizontal spring of the top
    [N/m]. mass [kg], height [m]: supported, above r_nn. Not above 0: it stands by itself; infinite: a slider falls
    over, whatever holds the plate.
    """
    lengths = links(bearing)
    weights = bearing.gravity * np.array([body.mass for body in bearing.bodies])
    carried = load + mass * bearing.gravity + np.append(np.cumsum(weights[:0:-1])[::-1], 0.0)
    energy = np.diag(-carried * lengths) + stiffness * np.outer(lengths, lengths)
    energy[-1, -1] -= mass * bearing.gravity * height
    sliders, across = energy[:-1, :-1], energy[:-1, -1]
    if len(sliders) and np.linalg.eigvalsh(sliders)[0] <= 0:
        return np.inf
    return float(across @ np.linalg.solve(sliders, across) - energy[-1, -1])


def check_standing(path: str, stiffness: float, needed: float, load: float) -> None:
    """Raise InputError where a rotational stiffness that is given does not hold the plate up.

    path: of the field in messages. stiffness: its value, 0: none is given. needed: see `needed_rotational_stiffness`.
    load: on the plate [N].
    """
    if 0 < stiffness <= needed < np.inf:
        raise InputError(
            f"{path} = {stiffness:g}: while the surfaces slide, the top plate turns over under {load:.4g} N on a lever "
            f"of {needed / load:.3g} m; give more than {needed:.4g} [N m/rad]"
        )


def unsteady(path: str, stiffness: float, needed: float) -> Iterator[tuple[int, float, str]]:
    """The doubt about a plate that only friction holds up, or that would turn over under `MARGIN` times its load.

    Yields 0 (no surface), the value and the text, as `doubtful_values`. Arguments as in `check_standing`.
    """
    if 0 < needed < np.inf and stiffness < MARGIN * needed:
        reason = f"the top plate turns over where N is {stiffness / needed:.2g} times that at rest"
        if stiffness == 0:
            reason = "nothing holds the top plate up, which turns over while the surfaces slide"
        yield (
            0,
            stiffness,
            f"{path} = {stiffness:g}: {reason}; give more than {needed:.4g} [N m/rad], several times as much",
        )


def standing_of(scene: SceneFields) -> tuple[str, float, float, float] | None:
    """Path, value given, value needed and load of the plate of a scene at its start; None: no spring could hold it."""
    top, load = scene.top, -float(load_values(scene.top)[2])
    if not isinstance(top, RigTop | MassTop):
        return None
    load -= 0.0 if scene.load is None else float(scene.load.evaluate(0.0)[2])
    mass, height = (top.mass, top.height) if isinstance(top, MassTop) else (0.0, 0.0)
    needed = needed_rotational_stiffness(scene.bearing, load, top.stiffness, mass, height)
    return "top.rotational_stiffness", top.rotational_stiffness, needed, load + mass * scene.bearing.gravity


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
    springs = {name: 0.0 if top is None else getattr(top, name) or 0.0 for name in SPRINGS}
    name = max(springs, key=lambda spring: springs[spring])
    return name, springs[name], len(bearing.surfaces) * springs[name] / SHARE


def check_seats(bearing: Bearing, top: Top, effects: Effects | Auto | None) -> None:
    """Raise InputError as `seat_stiffness` does, where a run may model uplift."""
    if effects is None or effects.uplift is not False:
        seat_stiffness(bearing, top)
