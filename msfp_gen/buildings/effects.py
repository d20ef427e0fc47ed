"""The effects of the bearings of a building, and the estimate of the least load by which uplift is selected."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import prefixed
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.effect_selection import GIVEN, EffectSelection, Reason
from msfp_gen.scene.friction_parameters import select_friction
from msfp_gen.scene.solver import Solver
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.buildings.scene import BuildingScene

LEAST_SHARE = 0.1  # estimated least load over the load at rest, above which uplift is left out
STEP = 5e-3  # of the linear response [s]
SMALL = 1e-12  # relative excitation below which vertical motion does not excite a mode


class EffectRequest(NamedTuple):
    """The input that decides the effects of a bearing: see `effect_switching.Requested`."""

    effects: Effects | Auto
    solver: Solver
    end: float


def effect_selections(scene: BuildingScene) -> tuple[EffectSelection, ...]:
    """The effects of every bearing, with the reason for each that is selected. Raises InputError."""
    if all(isinstance(mount.effects, Effects) for mount in scene.bearings):
        remaining: list[float] = [0.0] * len(scene.bearings)  # nothing is selected
    elif len(set(scene.grounds[1])) > 1:
        remaining = [-np.inf] * len(scene.bearings)  # the estimate has one motion of the ground
    else:
        remaining = remaining_loads(scene).tolist()
    return tuple(_selected(scene, index, share) for index, share in enumerate(remaining))


def _selected(scene: BuildingScene, index: int, remaining: float) -> EffectSelection:
    """The effects of a bearing by its index, with reasons. remaining: see `remaining_loads`. Raises InputError."""
    mount = scene.bearings[index]
    requested = Auto() if mount.effects is None else mount.effects
    if isinstance(requested, Effects):
        return EffectSelection(requested)
    reasons = tuple(
        Reason(reason.effect, value, GIVEN) if (value := getattr(requested, reason.effect)) is not None else reason
        for reason in _reasons(mount.bearing, requested, remaining)
    )
    with prefixed(f"scene.bearings[{index}]."):
        effects = requested.resolve(**{reason.effect: reason.chosen for reason in reasons})
    return EffectSelection(effects, reasons, error=requested.error)


def _reasons(bearing: Bearing, requested: Auto, remaining: float) -> tuple[Reason, ...]:
    """The choice and reason of every effect. remaining: see `remaining_loads`; -inf: not known."""
    capacity = min(surface.capacity for surface in bearing.surfaces)
    friction = select_friction(bearing, requested.friction_law)
    lifts = remaining <= LEAST_SHARE and requested.sliders != "massless"
    why = f"about {max(remaining, 0.0):.0%} of the load at rest remains"
    if remaining == -np.inf:
        why = "the ground moves differently below some bearings, which may take the load off others"
    saves = "" if lifts else f"{3 * bearing.layout.surfaces} unknown separations"
    return (
        Reason("dimension", "spatial", "the building moves a bearing in space"),
        Reason("sliders", "inertial", "quasi-static steps need motion in one vertical plane"),
        Reason("rims", True, f"nothing limits sliding under a building; the least capacity is {1e3 * capacity:.4g} mm"),
        Reason("uplift", lifts, why, saves),
        Reason("friction", friction, "the parameters that its surfaces have"),
    )


def remaining_loads(scene: BuildingScene) -> Array:
    """An estimate of the least axial load of every bearing over its load at rest, ndarray, shape (bearings,), [-].

    The ground moves everywhere as below the first bearing. The load changes by the vertical response of the linear
    building on the springs of its interfaces, and by overturning as a rigid body under the horizontal force of the
    bearings: all surfaces slide, at the largest distance of the ground from its start.
    """
    times = np.arange(0.0, scene.end, STEP)
    path = scene.first_ground.displacement(times)[:, :2]
    overturning = _overturning(scene, float(np.linalg.norm(path - path[0], axis=1).max()))
    ratios: Array = 1.0 + (_vertical_response(scene, times).min(axis=0) - overturning) / scene.axial_loads
    return ratios


def _vertical_response(scene: BuildingScene, times: Array) -> Array:
    """Change of the axial loads under the vertical motion of the ground, shape (times, bearings) [N]."""
    # By superposition of modes, without the coupling by damping; exact for an acceleration that is linear in a step.
    from scipy.signal import cont2discrete, lfilter

    building, rows = scene.building, scene.attachments[:, 2]
    springs = np.array([mount.interface.vertical_stiffness for mount in scene.bearings])
    dampers = np.array([mount.interface.vertical_damping for mount in scene.bearings])
    squares, modes, rates, _ = scene.vertical_modes
    modal_forces = -modes.T @ building.mass @ building.rigid_motions[:, 2]
    ground = scene.first_ground.acceleration(times)[:, 2]
    loads = np.zeros((len(times), len(rows)))
    for mode, square, rate, force in zip(modes.T, squares, rates, modal_forces, strict=True):
        along = rows @ mode
        if abs(force) * np.abs(along).max() < SMALL * np.abs(building.mass @ mode).max():
            continue
        for weight, numerator in ((springs, [force]), (dampers, [force, 0.0])):
            above, below, _ = cont2discrete((numerator, [1.0, rate, square]), STEP, "foh")
            loads -= np.outer(lfilter(above[0], below, ground), weight * along)
    return loads


def _overturning(scene: BuildingScene, distance: float) -> Array:
    """Largest change of the axial loads by overturning, shape (bearings,) [N]. distance: of the ground [m]."""
    ratio = max(  # horizontal force over load, where all surfaces of a bearing slide
        max(surface.friction for surface in bearing.surfaces)
        + distance / sum(surface.radius for surface in bearing.surfaces)
        for bearing in scene.every_bearing
    )
    motions = scene.building.rigid_motions
    moment = ratio * scene.gravity * float(np.abs((motions.T @ scene.building.mass @ motions)[0, 4]))
    springs = np.array([mount.interface.vertical_stiffness for mount in scene.bearings])
    arms = scene.attachments[:, 2] @ motions[:, 3:5]
    arms -= springs @ arms / springs.sum()
    rocking = springs @ arms**2
    changes = np.divide(moment * springs[:, None] * arms, rocking, where=rocking > 0, out=np.zeros_like(arms))
    largest: Array = np.hypot(*changes.T)
    return largest
