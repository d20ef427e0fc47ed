"""The model `backbone`, the cheapest of an estimate: a scene becomes a mass on the backbone curves of its bearings.

Compiled code takes fixed steps and returns the peaks; there is no history. Up to the displacement at which the
published curve first stiffens, a bearing is a spring and elastic-plastic elements in parallel, which unload as the
stack does. The regimes beyond, in which rims carry, are springs that act after a gap. Both horizontal directions count.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.fidelity import check_one_ground, load_shares
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.jit.build import load_driver
from msfp_gen.scene.fidelity import EQUAL, Backbone
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import MassTop

if TYPE_CHECKING:
    from types import ModuleType

    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.system import System
    from msfp_gen.specification.layout import Auto, Effects

STEP = 0.01  # largest step [s]
STABLE = 0.5  # highest circular frequency times step, at most [-]
QUANTITIES = (  # of a run, of the bearing or building as a whole
    "status", "message", "duration", "peak_displacement", "peak_force", "peak_force_ratio", "rims_met", "wall_time",
)  # fmt: skip
OF_SURFACES = ("peak_sliding", "minimum_gap", "capacity_used")  # one value a surface; scenes of one bearing only


@dataclass(frozen=True)
class BackboneRun:
    """A run of the model `backbone`: its scene, status and summary; it has no history.

    The sliding of each surface is taken from the published backbone at the peak displacement.
    """

    scene: System
    status: str
    message: str
    summary: dict[str, Any]

    def storage(self) -> Any:
        """An empty history, with the interface of the storage of a result."""
        return SimpleNamespace(columns=lambda _: {}, arrays_of=lambda _: {})

    def characterise(self) -> Any:
        """Raises InputError: without a history there is nothing to characterise."""
        raise InputError("fidelity = 'backbone': it keeps no history; give 'equivalent'")


def run_backbone(scene: Any) -> BackboneRun:
    """Run a scene as a mass on its backbone. Raises InputError: the scenes that `check_backbone` refuses."""
    begin = time.perf_counter()
    check_backbone(scene)
    if isinstance(scene, Scene):
        assert isinstance(scene.top, MassTop)
        stop = 0.0 if scene.stop is None or scene.stop.displacement is None else scene.stop.displacement
        bearings, shares, mass = [_with_rims(scene.bearing, scene.effects)], [1.0], scene.top.mass
        motion = scene.motion
    else:
        bearings = [_with_rims(mounted.bearing, mounted.effects) for mounted in scene.bearings]
        shares, mass, stop = load_shares(scene), float(scene.axial_loads.sum()) / scene.gravity, 0.0
        motion = scene.first_ground
    elements, spring, gaps = _elements(tuple(bearings), tuple(shares), mass)
    stiffest = float(elements[0].sum() + spring + gaps[1].max())
    gravity = bearings[0].gravity
    step = min(STEP, STABLE / np.sqrt(gravity * stiffest))
    ground = _ground(motion, scene.end, float(step))
    peak, force, steps = _driver().run(elements, spring, gaps, ground, float(step), gravity, stop)
    stopped = steps < len(ground)
    summary: dict[str, Any] = {
        "status": "stopped" if stopped else "ok",
        "message": "",
        "duration": min(steps * float(step), scene.end),
        "peak_displacement": {"radial": peak},
        "peak_force": {"radial": force * mass},
        "peak_force_ratio": force / gravity,
        "wall_time": time.perf_counter() - begin,
    }
    if isinstance(scene, Scene):
        sliding = _backbone(bearings[0], mass * gravity).sliding(peak)
        gaps_left = [surface.capacity - value for surface, value in zip(scene.bearing.surfaces, sliding, strict=True)]
        rims_met = [number for number, gap in enumerate(gaps_left, start=1) if gap <= 1e-9]
        used = [1 - gap / surface.capacity for gap, surface in zip(gaps_left, scene.bearing.surfaces, strict=True)]
        summary |= {"peak_sliding": sliding, "minimum_gap": gaps_left, "capacity_used": used, "rims_met": rims_met}
    return BackboneRun(scene, summary["status"], "", summary)


def check_backbone(scene: Any) -> None:
    """Raise InputError unless the scene is a mass on bearings that starts at rest on a base that does not rotate."""
    if isinstance(scene, Scene):
        if not isinstance(scene.top, MassTop):
            raise InputError(
                f"top.kind = {scene.top.kind!r}: the model 'backbone' carries a mass; give top.kind = 'mass', or "
                "another model, such as 'massless'"
            )
        for name in ("initial_state", "load", "top_rotation"):
            if getattr(scene, name) is not None:
                raise InputError(
                    f"{name}: the model 'backbone' has none; leave it out, or give another model, such as 'massless'"
                )
        if scene.stop is not None and scene.stop.all_rims:
            raise InputError(
                "stop.all_rims: the model 'backbone' does not see when rims are met; give stop.displacement, or "
                "another model, such as 'massless'"
            )
    else:
        check_one_ground(scene, "backbone")
    if np.any(scene.motion.coefficients[:, 3:]):
        other = "massless" if isinstance(scene, Scene) else "rigid"
        raise InputError(
            f"motion: the base rotates, which the model 'backbone' does not see; give another model, such as {other!r}"
        )


def _with_rims(bearing: Bearing, effects: Effects | Auto | None) -> Bearing:
    """The bearing; its rims have no stiffness where the effects of the scene leave rims out."""
    return bearing.replace(rim_stiffness=0.0) if effects and effects.rims is False else bearing


@lru_cache(maxsize=64)
def _backbone(bearing: Bearing, load: float) -> Backbone:
    return Backbone.of(bearing, load)


def _elements(bearings: tuple[Bearing, ...], shares: tuple[float, ...], mass: float) -> tuple[Array, float, Array]:
    """Elements, spring and gaps of all bearings in parallel, as of `parallel`, over the load of all.

    shares: of each bearing in the load. Equal bearings become one, at their mean load.
    """
    shares_of: dict[Bearing, list[float]] = {}
    for bearing, share in zip(bearings, shares, strict=True):
        shares_of.setdefault(bearing, []).append(share)
    weight = mass * bearings[0].gravity
    kinds = [
        (sum(loads), *parallel(_backbone(bearing, weight * float(np.mean(loads)))))
        for bearing, loads in shares_of.items()
    ]
    elements = np.concatenate([own * share for share, own, _, _ in kinds], axis=1)
    gaps = np.concatenate([own * [[1.0], [share]] for share, _, _, own in kinds], axis=1)
    limit = _driver().MOST
    if elements.shape[1] > limit:
        raise InputError(f"bearings: {elements.shape[1]} regimes of different bearings; the backbone takes {limit}")
    return elements, float(sum(share * spring for share, _, spring, _ in kinds)), gaps


def parallel(backbone: Backbone) -> tuple[Array, float, Array]:
    """A backbone curve as elements and a spring in parallel, and springs after gaps; forces are over the load.

    Elements: stiffness [1/m] and strength [-], shape (2, k); an element yields at each displacement where the slope of
    the curve falls, before the slope rises for the first time. Spring: stiffness [1/m]. Gaps: displacement [m] and
    stiffness [1/m], shape (2, g); after the last gap all sliders press on their rims.
    """
    u, force = backbone.points
    slopes = np.diff(force) / np.diff(u)
    rising = np.append(np.diff(slopes) > EQUAL * np.abs(slopes[:-1]), True)
    last = int(np.flatnonzero(rising)[0])  # regime before the slope rises
    stiffness = -np.diff(slopes[: last + 1])
    yields = u[1 : last + 1]
    falling = stiffness > 0
    gaps = np.array([u[last + 1 :], np.diff([*slopes[last:], backbone.last_slope])])
    return np.array([stiffness, stiffness * yields])[:, falling], float(slopes[last]), gaps


def _ground(motion: Motion, end: float, step: float) -> Array:
    """Acceleration of the ground at the beginning of every step, shape (steps, 3) [m/s^2]."""
    times = np.arange(0.0, end, step)
    if not motion.sampled:
        return np.ascontiguousarray(motion.evaluate(times, 2)[:, :3])
    at_knots = 2 * motion.coefficients[:, :3, 2]  # the acceleration of a record is linear between its samples
    return np.stack([np.interp(times, motion.knots[:-1], channel) for channel in at_knots.T], axis=1)


@cache
def _driver() -> ModuleType:
    return load_driver("msfp_gen.studies.estimation")[0]
