"""Selection of the effects at the start of a run (docs/effects.md), with the quantity that decides each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array, distinct
from msfp_gen.common.later import kept
from msfp_gen.scene.planarity import scene_plane
from msfp_gen.scene.top import MassTop, RigTop, Top, load_values
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.motions.prescribed import Load
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene_fields import SceneFields


def response_time(bearing: Bearing, top: Top, load: float) -> float:
    """Longest time in which a body between two sliding surfaces follows a change of its velocity, sqrt(m/k) [s].

    Surfaces share the motion differently while the bodies respond. Sliding friction has no stiffness: k is the
    stiffness of the spheres, N/R of both surfaces, and of the rig above the top plate. load: N, the smallest of the run
    [N]; inf without load.
    """
    longest, radii = 0.0, [surface.radius for surface in bearing.surfaces]
    rig = top.stiffness if isinstance(top, RigTop) else 0.0
    above = [*(load / radius for radius in radii[1:]), rig]
    for radius, stiffness, body in zip(radii, above, bearing.bodies, strict=True):
        longest = max(longest, body.mass / (load / radius + stiffness) if load > 0 else inf)
    return float(np.sqrt(longest))


class Samples(NamedTuple):
    """The base motion of a scene at its knots, at the load's, and at 1001 even times until the end of the run.

    times: shape (k,) [s]. displacement [m], acceleration [m/s^2]: shape (k, 3). peak_speed [m/s], peak_acceleration
    [m/s^2]: largest magnitudes.
    """

    times: Array
    displacement: Array
    acceleration: Array
    peak_speed: float
    peak_acceleration: float


def samples_of(scene: SceneFields) -> Samples:
    """The samples of a scene, which are taken once for a motion."""
    return kept(scene.motion, _sampled, scene.end, scene.load)


def _sampled(motion: Motion, end: float, load: Load | None) -> Samples:
    times = np.concatenate([motion.knots, () if load is None else load.knots, np.linspace(0, end, 1001)])
    times = distinct(times[times <= end])
    displacement, velocity, acceleration = (motion.evaluate(times, order)[:, :3] for order in range(3))
    peaks = (float(np.linalg.norm(values, axis=1).max()) for values in (velocity, acceleration))
    return Samples(times, displacement, acceleration, *peaks)


def motion_time_scale(scene: SceneFields) -> float:
    """Peak velocity of the base over its peak acceleration [s]; inf where it is at rest."""
    motion = samples_of(scene)
    return motion.peak_speed / motion.peak_acceleration if motion.peak_acceleration > 0 else inf


def turned_or_pushed(scene: SceneFields) -> bool:
    """Whether base or top rotate, or a load history has other components than the vertical one."""
    turned = scene.top_rotation is not None or np.any(scene.motion.coefficients[:, 3:])
    return bool(turned or (scene.load is not None and np.any(scene.load.coefficients[:, [0, 1, 3, 4, 5]])))


MIN_LOAD_SHARE = 0.2  # uplift is left out if more than this share of the load at rest remains throughout the run
UPLIFT_MONITOR_SHARE = 0.05  # share of the load at rest below which the monitor of uplift trips
PEAK_LOAD_SHARE = 1.5  # N under a rigid mass over the largest load, above which the monitor of uplift trips
RESPONSE_SHARE = 0.125  # massless sliders: their response time over error x time scale of the motion, at most
MIN_PLANAR_SHARE = 0.5  # a run starts planar if its scene stays in one vertical plane for this share of the duration
GIVEN = "given in the scene"  # reason of an effect that `Auto` fixes


@dataclass(frozen=True)
class Reason:
    """Selection of one effect: the value selected, the quantity that decides it, and the work that it saves."""

    effect: str
    chosen: object
    because: str
    saves: str = ""


@dataclass(frozen=True)
class EffectSelection:
    """The effects at the start of a run.

    reasons: one for each selected effect; none where the scene gives `Effects`. plane_until: time at which the scene
    leaves the vertical plane of a planar model [s]. error: `Auto.error`, as a share of the friction force [-].
    """

    effects: Effects
    reasons: tuple[Reason, ...] = ()
    plane_until: float = inf
    error: float = 0.005


def select_effects(scene: SceneFields) -> EffectSelection:
    """The effects of a scene: as given, or selected. Raises InputError where the given ones contradict each other."""
    requested = scene.effects
    if isinstance(requested, Effects):
        return EffectSelection(requested)
    uplift, friction = _uplift(scene, requested), _friction(scene, requested)
    plane, until = _dimension(scene, requested)
    others = (plane, _rims(scene, requested), uplift, friction)
    rotates = (scene.top_rotation is not None) or None

    def resolved(*reasons: Reason) -> Effects:
        return requested.resolve(**{reason.effect: reason.chosen for reason in reasons}, top_rotation=rotates)

    sliders = _sliders(scene, requested, resolved(*others), until)
    reasons = (plane, sliders, *others[1:])
    effects = resolved(*reasons)
    plane_until = until if effects.dimension == "planar" else inf
    return EffectSelection(effects, reasons, plane_until, requested.error)


def _fixed(requested: Auto, name: str) -> Reason | None:
    value = getattr(requested, name)
    return None if value is None else Reason(name, value, GIVEN)


def _dimension(scene: SceneFields, requested: Auto) -> tuple[Reason, float]:
    if (fixed := _fixed(requested, "dimension")) is not None:
        return fixed, inf
    azimuth, until, name = scene_plane(scene)
    if until < MIN_PLANAR_SHARE * scene.end:
        return Reason("dimension", "spatial", f"the {name} leaves every vertical plane at {until:.4g} s"), inf
    bodies, angles = scene.bearing.layout.surfaces, 2 if requested.spin == "locked" else 3
    saves = f"{bodies} unknown accelerations in place of {bodies * angles}"
    if until < scene.end:
        return Reason("dimension", "planar", f"in one vertical plane until {until:.4g} s, then spatial", saves), until
    because = f"motion, loads and initial state lie in the vertical plane at azimuth {np.degrees(azimuth):.4g} deg"
    return Reason("dimension", "planar", because, saves), inf


def _rims(scene: SceneFields, requested: Auto) -> Reason:
    if (fixed := _fixed(requested, "rims")) is not None:
        return fixed
    if scene.stop is not None and scene.stop.all_rims:
        return Reason("rims", True, "the stop condition is contact at all rims")
    capacity = min(surface.capacity for surface in scene.bearing.surfaces)
    farthest = _farthest(scene)
    limit = f"the smallest capacity is {1e3 * capacity:.4g} mm"
    if not (isinstance(scene.top, RigTop) and scene.top.stiffness > 0):
        return Reason("rims", True, f"a {scene.top.kind} top does not limit the sliding displacement; {limit}")
    because = f"the base moves up to {1e3 * farthest:.4g} mm from its start, {limit}"
    if scene.load is None and farthest + _initial_sliding(scene) < capacity:
        return Reason("rims", False, because, "the forces of the rims and their events")
    return Reason("rims", True, because)


def _farthest(scene: SceneFields) -> float:
    """Largest horizontal distance of the base from its position at the start [m]."""
    path = samples_of(scene).displacement[:, :2]
    return float(np.linalg.norm(path - path[0], axis=1).max())


def _initial_sliding(scene: SceneFields) -> float:
    """Largest sliding displacement of a surface in the initial state [m]; an upper bound."""
    if scene.initial_state is None:
        return 0.0
    tilt = np.hypot(*np.array(scene.initial_state.q, dtype=float)[:, :2].T)
    return float(np.max(tilt * [surface.radius for surface in scene.bearing.surfaces]))


def _sliders(scene: SceneFields, requested: Auto, others: Effects, plane_until: float) -> Reason:
    """Massless only where quasi-static steps apply: elsewhere leaving inertia out saves little and costs accuracy."""
    # others: the effects selected before. plane_until: time at which a planar scene leaves its plane [s].
    if (fixed := _fixed(requested, "sliders")) is not None:
        return fixed
    if because := _requires_inertia(scene, others, plane_until):
        return Reason("sliders", "inertial", because)
    share, limit = inertia_share(scene), inertia_limit(scene, requested.error)
    if share > limit:
        because = f"inertial forces of the sliders are {share:.2g} of N; the permitted share is {limit:.2g}"
        return Reason("sliders", "inertial", because)
    time_scale = motion_time_scale(scene)
    response = response_time(scene.bearing, scene.top, minimum_load(scene))
    longest = RESPONSE_SHARE * requested.error * time_scale
    because = f"sliding bodies respond within {response:.2g} s; for this motion {longest:.2g} s is permitted"
    if response > longest:
        return Reason("sliders", "inertial", because)
    because += f", and inertial forces of {limit:.2g} of N, which are {share:.2g}"
    return Reason("sliders", "massless", because, "integration in time: quasi-static steps solve the force balance")


def _requires_inertia(scene: SceneFields, others: Effects, plane_until: float) -> str:
    """Why sliders of any mass need inertia; empty where quasi-static steps apply, which do without it."""
    reasons = {
        "a separated body moves by its inertia": others.uplift,
        "free spin is determined by inertia": not others.determines_spin,
        "the explicit method integrates accelerations": scene.solver.method == "dopri5",
        "quasi-static steps need motion in one vertical plane": others.dimension != "planar" or plane_until < scene.end,
        "its limits are for a base that only translates, and for vertical loads": turned_or_pushed(scene),
    }
    reason = next((because for because, holds in reasons.items() if holds), "")
    return reason or _rate_dependence(scene, replace(others, sliders="massless"))


def _friction(scene: SceneFields, requested: Auto) -> Reason:
    if (fixed := _fixed(requested, "friction")) is not None:
        return fixed
    word, _ = scene.law
    saves = "the thermal states of every surface, until the temperature rise is significant" if word == "pv" else ""
    because = {
        "constant": "the surfaces have no parameters of a friction law",
        "custom": "effects.friction_law gives a formula",
    }.get(word, "the surfaces have the parameters of this law")
    return Reason("friction", word, because, saves)


def _uplift(scene: SceneFields, requested: Auto) -> Reason:
    if (fixed := _fixed(requested, "uplift")) is not None:
        return fixed
    if requested.sliders == "massless" or scene.solver.method == "dopri5":
        because = "massless sliders and the explicit method exclude separation; normal forces are monitored"
        return Reason("uplift", False, because)
    rest, least = load_at_rest(scene), minimum_load(scene)
    because = f"at least {least / rest:.0%} of the load at rest, {rest:.4g} N, remains" if rest > 0 else "no load"
    if rest > 0 and least > MIN_LOAD_SHARE * rest:
        return Reason("uplift", False, because, f"{3 * scene.bearing.layout.surfaces} unknown separations")
    return Reason("uplift", True, because)


def load_at_rest(scene: SceneFields) -> float:
    """Vertical load on the lowest surface at the start, without accelerations; downward positive [N]."""
    weights = scene.bearing.gravity * sum(body.mass for body in scene.bearing.bodies)
    return float(_applied_load(scene, 0.0)) + _supported_mass(scene) * scene.bearing.gravity + weights


def minimum_load(scene: SceneFields) -> float:
    """Smallest vertical load on the lowest surface if all masses follow the vertical motion of the base [N]."""
    return float(np.min(_loads(scene)))


def rigid_mass_limit(scene: SceneFields) -> float:
    """Normal force [N] above which the contacts of a stack under a rigid mass must not be rigid; 0 for other tops.

    It is `PEAK_LOAD_SHARE` times the largest vertical load if all masses follow the vertical motion of the base. A
    rigid mass on rigid contacts has peaks beyond it which do not converge (docs/model.md, "Where the model ends").
    """
    rigid = isinstance(scene.top, MassTop) and scene.top.vertical_stiffness is None
    return PEAK_LOAD_SHARE * float(np.max(_loads(scene))) if rigid else 0.0


def _loads(scene: SceneFields) -> Array:
    """Vertical loads on the lowest surface if all masses follow the vertical motion of the base [N]."""
    motion = samples_of(scene)
    bodies = sum(body.mass for body in scene.bearing.bodies)
    inertial = (_supported_mass(scene) + bodies) * (scene.bearing.gravity + motion.acceleration[:, 2])
    return inertial + _applied_load(scene, motion.times) + _held_load(scene, motion.displacement[:, 2])


def _held_load(scene: SceneFields, height: Array) -> Array | float:
    """Force of the vertical spring of a rig if the top plate rises and falls with the base, downward positive [N]."""
    if not isinstance(scene.top, RigTop):
        return 0.0
    return np.asarray(scene.top.vertical_stiffness * (height - height[0]))


def _supported_mass(scene: SceneFields) -> float:
    """Mass of the top [kg]."""
    return scene.top.mass if isinstance(scene.top, MassTop) else 0.0


def _applied_load(scene: SceneFields, time: ArrayLike) -> Array:
    """Vertical force of the top and the load history at `time` [s], downward positive [N]."""
    history = 0.0 if scene.load is None else scene.load.evaluate(time)[..., 2]
    return -np.asarray(load_values(scene.top)[2] + history)


def inertia_share(scene: SceneFields) -> float:
    """Largest inertial force of a body over the load at rest, if the bodies follow the base [-]."""
    heaviest, rest = max(body.mass for body in scene.bearing.bodies), load_at_rest(scene)
    return heaviest * samples_of(scene).peak_acceleration / rest if rest > 0 else inf


def quasistatic(scene: SceneFields, effects: Effects) -> bool:
    """Whether a run with these effects takes quasi-static steps: no force depends on a rate, within the tolerance.

    Conditions: a planar model without masses and with closed-form friction, no supported mass, the method "implicit",
    and damper forces small against friction. The limit of their share assumes an error of rates of one hundredth.
    """
    return effects.dimension == "planar" and effects.sliders == "massless" and not _rate_dependence(scene, effects)


def _rate_dependence(scene: SceneFields, effects: Effects) -> str:
    """Why a planar run without masses is integrated in time; empty where it takes quasi-static steps."""
    share, limit = damping_share(scene), min(1e-3, 1e3 * scene.solver.rtol)
    reasons = {
        f"the method {scene.solver.method!r} has no quasi-static steps": scene.solver.method != "implicit",
        "the supported mass has inertia, and the sliders move with it": isinstance(scene.top, MassTop),
        "friction depends on more than the slip": not effects.permits_quasistatic_steps,
        f"dampers carry {share:.2g} of the friction force; quasi-static steps permit {limit:.2g}": share > limit,
    }
    return next((because for because, holds in reasons.items() if holds), "")


def damping_share(scene: SceneFields) -> float:
    """Force of the dampers over the friction force, if everything moves as the base does; inf without friction [-].

    The rate of rotation of the top plate has two bounds: the slip velocity over a radius, and, while friction reverses
    within d_y, the change of the friction moment over the rotational stiffness.
    """
    surfaces, top = scene.bearing.surfaces, scene.top
    speed = samples_of(scene).peak_speed
    friction = min(surface.friction for surface in surfaces) * minimum_load(scene)
    if friction <= 0:
        return inf
    share = max(surface.rim_damping for surface in surfaces) * speed / friction
    if isinstance(top, RigTop):
        sliding = min(surface.radius for surface in surfaces) ** 2 * friction
        reversal = top.rotational_stiffness * min(surface.yield_displacement for surface in surfaces)
        linear = max(top.damping, top.vertical_damping)
        share += linear * speed / friction + top.rotational_damping * speed / max(sliding, reversal)
    return share


def inertia_limit(scene: SceneFields, error: float) -> float:
    """Permitted inertial force over N: `error`, a share of the friction force, times the largest coefficient [-]."""
    return error * max(surface.friction for surface in scene.bearing.surfaces)


def slider_period(bearing: Bearing, rest: float) -> float:
    """Longest period of a slider on its stuck surface, 2 pi sqrt(m/(mu N/d_y + N/R)) [s]. rest: axial load [N]."""
    longest = 0.0
    for index, surface in enumerate(bearing.surfaces):
        stiffness = surface.friction * rest / surface.yield_displacement + rest / surface.radius
        longest = max(longest, bearing.bodies[index].mass / stiffness if stiffness > 0 else inf)
    return float(2 * np.pi * np.sqrt(longest))
