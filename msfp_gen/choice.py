"""Which effects a run begins with: the smallest set that can matter, and the figure that each choice rests on."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.drive import plane_of
from msfp_gen.layout import Auto, Effects
from msfp_gen.packing import load_values
from msfp_gen.piecewise import Array
from msfp_gen.prescribed import Prescribed
from msfp_gen.top import MassTop, RigTop

if TYPE_CHECKING:
    from msfp_gen.scene import Scene

LEAST_LOAD = 0.2  # share of the load at rest that must remain for uplift to be left out
UNLOADED = 0.05  # share of it at which the watch over uplift trips
PLANE_SHARE = 0.5  # of the run that must lie in a plane for it to begin there


@dataclass(frozen=True)
class Reason:
    """Why an effect is in or out: the word chosen, the figure it rests on, and what it saves."""

    effect: str
    chosen: object
    because: str
    saves: str = ""


@dataclass(frozen=True)
class Choice:
    """The effects a run begins with.

    plane_until: time at which the scene leaves the vertical plane of a planar model [s]. error: the asked error.
    """

    effects: Effects
    reasons: tuple[Reason, ...] = ()
    plane_until: float = inf
    error: float = 0.005


def choose(scene: Scene) -> Choice:
    """The choice for a scene; its own effects where they are given. Raises InputError where parts contradict."""
    asked = scene.effects
    if isinstance(asked, Effects):
        return Choice(asked)
    turning = scene.top_rotation is not None
    uplift = _uplift(scene, asked)
    sliders = _sliders(scene, asked, bool(uplift.chosen))
    plane, until = _dimension(scene, asked)
    reasons = (plane, sliders, _rims(scene, asked), uplift, _friction(scene, asked))
    effects = asked.closed(**{reason.effect: reason.chosen for reason in reasons}, top_rotation=turning or None)
    stays = until if effects.dimension == "planar" else inf
    return Choice(effects, reasons, stays, asked.error)


def _given(asked: Auto, name: str) -> Reason | None:
    value = getattr(asked, name)
    return None if value is None else Reason(name, value, "asked for")


def _dimension(scene: Scene, asked: Auto) -> tuple[Reason, float]:
    if (given := _given(asked, "dimension")) is not None:
        return given, inf
    azimuth, until, what = plane_of(scene)
    if until < PLANE_SHARE * scene.end:
        return Reason("dimension", "spatial", f"the {what} leaves every vertical plane at {until:.4g} s"), inf
    bodies, spins = scene.bearing.layout.surfaces, asked.spin == "locked"
    saves = f"{bodies} unknown accelerations in place of {bodies * (2 if spins else 3)}"
    if until < scene.end:
        return Reason("dimension", "planar", f"in one vertical plane until {until:.4g} s, then spatial", saves), until
    because = f"motion, loads and start lie in the vertical plane at azimuth {np.degrees(azimuth):.4g} deg"
    return Reason("dimension", "planar", because, saves), inf


def _rims(scene: Scene, asked: Auto) -> Reason:
    if (given := _given(asked, "rims")) is not None:
        return given
    if scene.stop is not None and scene.stop.all_rims:
        return Reason("rims", True, "the run stops where all rims are met")
    least = min(surface.capacity for surface in scene.bearing.surfaces)
    reach = float(np.ptp(_sampled_motion(scene)[:, :2], axis=0).max()) * np.sqrt(2)
    start = 0.0 if scene.initial_state is None else _started(scene)
    if isinstance(scene.top, RigTop) and scene.top.stiffness > 0 and scene.load is None and reach + start < least:
        because = f"the base moves {1e3 * reach:.4g} mm, the least capacity is {1e3 * least:.4g} mm"
        return Reason("rims", False, because, "the forces of the rims and their events")
    if isinstance(scene.top, RigTop) and scene.top.stiffness > 0:
        return Reason("rims", True, f"the base moves {1e3 * reach:.4g} mm, the least capacity is {1e3 * least:.4g} mm")
    return Reason("rims", True, f"a {scene.top.kind} top bounds no sliding; the least capacity is {1e3 * least:.4g} mm")


def _started(scene: Scene) -> float:
    """How far the initial state slides any surface [m], at most."""
    assert scene.initial_state is not None
    tilt = np.hypot(*np.array(scene.initial_state.q, dtype=float)[:, :2].T)
    return float(np.max(tilt * [surface.radius for surface in scene.bearing.surfaces]))


def _sliders(scene: Scene, asked: Auto, uplift: bool) -> Reason:
    if (given := _given(asked, "sliders")) is not None:
        return given
    fixed = {
        "a body in flight moves by its inertia": uplift,
        "free spin is decided by inertia": asked.spin == "free",
        "the explicit method integrates accelerations": scene.solver.method == "dopri5",
    }
    for because, holds in fixed.items():
        if holds:
            return Reason("sliders", "inertial", because)
    share, limit = inertia_share(scene), inertia_limit(scene, asked.error)
    figures = f"inertial forces of the sliders are {share:.2g} of N, {limit:.2g} would change friction by the error"
    if share > limit:
        return Reason("sliders", "inertial", figures)
    period, motion = answer_time(scene), fastest(scene)
    if period > 0.05 * motion:
        return Reason("sliders", "inertial", f"sliders answer in {period:.2g} s, the motion changes in {motion:.2g} s")
    return Reason("sliders", "massless", figures, "all accelerations of the sliders, and steps through their ringing")


def _friction(scene: Scene, asked: Auto) -> Reason:
    if (given := _given(asked, "friction")) is not None:
        return given
    word, _ = scene.law
    saves = "the states of heat of every surface, until the rise in temperature matters" if word == "pv" else ""
    return Reason("friction", word, "the numbers that the surfaces carry", saves)


def _uplift(scene: Scene, asked: Auto) -> Reason:
    if (given := _given(asked, "uplift")) is not None:
        return given
    if asked.sliders == "massless" or scene.solver.method == "dopri5":
        return Reason("uplift", False, "massless sliders or the explicit method cannot part; the load is watched")
    rest, least = resting_load(scene), least_load(scene)
    figures = f"at least {least / rest:.0%} of the load at rest presses, {rest:.4g} N" if rest > 0 else "no load"
    if rest > 0 and least > LEAST_LOAD * rest:
        return Reason("uplift", False, figures, f"{3 * scene.bearing.layout.surfaces} unknowns of separation")
    return Reason("uplift", True, figures)


def resting_load(scene: Scene) -> float:
    """Vertical load on the lowest surface at the start [N]."""
    weights = scene.bearing.gravity * sum(body.mass for body in scene.bearing.bodies)
    return float(_vertical(scene, 0.0)) + _supported(scene) * scene.bearing.gravity + weights


def least_load(scene: Scene) -> float:
    """Least vertical load that loads and vertical acceleration alone leave, as if nothing swung [N]."""
    times = _sampled_times(scene)
    vertical = scene.motion.evaluate(times, 2)[:, 2]
    weights = sum(body.mass for body in scene.bearing.bodies)
    carried = (_supported(scene) + weights) * (scene.bearing.gravity + vertical)
    return float(np.min(carried + _vertical(scene, times)))


def _supported(scene: Scene) -> float:
    return scene.top.mass if isinstance(scene.top, MassTop) else 0.0


def _vertical(scene: Scene, time: ArrayLike) -> Array:
    """What top and load press with at times [s]."""
    added = 0.0 if scene.load is None else scene.load.evaluate(time)[..., 2]
    return -np.asarray(load_values(scene.top)[2] + added)


def inertia_share(scene: Scene) -> float:
    """Largest inertial force of a body over the normal force, if it moved as the base does."""
    peak = float(np.linalg.norm(scene.motion.evaluate(_sampled_times(scene), 2)[:, :3], axis=1).max())
    rest = resting_load(scene)
    return max(body.mass for body in scene.bearing.bodies) * peak / rest if rest > 0 else inf


def quasistatic(scene: Scene, effects: Effects) -> bool:
    """Whether a model with these effects needs no integration: no force depends on a rate, to the tolerance.

    There must be no mass on top, and dampers must carry little of the friction: rates are known to a hundredth.
    """
    if not effects.flows or scene.solver.method != "implicit" or isinstance(scene.top, MassTop):
        return False
    return damping_share(scene) <= min(1e-3, 1e3 * scene.solver.rtol)


def damping_share(scene: Scene) -> float:
    """Force of the dampers over friction, if everything moved as the base does; inf where there is no friction.

    The top plate turns no faster than a surface slides over its radius, nor than its spring lets friction turn it
    while friction turns over, within d_y.
    """
    surfaces, rig = scene.bearing.surfaces, scene.top
    speed = float(np.linalg.norm(scene.motion.evaluate(_sampled_times(scene), 1)[:, :3], axis=1).max())
    friction = min(surface.friction for surface in surfaces) * least_load(scene)
    if friction <= 0:
        return inf
    share = max(surface.rim_damping for surface in surfaces) * speed / friction
    if isinstance(rig, RigTop):
        free = min(surface.radius for surface in surfaces) ** 2 * friction
        held = rig.rotational_stiffness * min(surface.yield_displacement for surface in surfaces)
        share += rig.damping * speed / friction + rig.rotational_damping * speed / max(free, held)
    return share


def inertia_limit(scene: Scene, error: float) -> float:
    """Share of N that changes the friction force by the asked error: error times the largest friction coefficient."""
    return error * max(surface.friction for surface in scene.bearing.surfaces)


def answer_time(scene: Scene) -> float:
    """Longest period of a slider on the spring of a stuck surface, 2 pi sqrt(m d_y/(mu N)) [s]."""
    rest, longest = resting_load(scene), 0.0
    for index, surface in enumerate(scene.bearing.surfaces):
        stiffness = surface.friction * rest / surface.yield_displacement + rest / surface.radius
        longest = max(longest, scene.bearing.bodies[index].mass / stiffness if stiffness > 0 else inf)
    return float(2 * np.pi * np.sqrt(longest))


def fastest(scene: Scene) -> float:
    """Time in which the motion of the base changes, peak velocity over peak acceleration [s]; inf where it rests."""
    times = _sampled_times(scene)
    speed, push = (np.linalg.norm(scene.motion.evaluate(times, order)[:, :3], axis=1).max() for order in (1, 2))
    return float(speed / push) if push > 0 else inf


def _sampled_times(scene: Scene) -> Array:
    extra: tuple[Prescribed, ...] = (scene.load,) if scene.load is not None else ()
    knots = np.concatenate([scene.motion.knots, *(each.knots for each in extra), np.linspace(0, scene.end, 1001)])
    return np.unique(knots[knots <= scene.end])


def _sampled_motion(scene: Scene) -> Array:
    return scene.motion.evaluate(_sampled_times(scene))
