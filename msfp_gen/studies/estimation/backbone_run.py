"""The cheapest level: a mass on the published backbones of its bearings, in fixed steps of compiled code.

The backbone is one of elastic and plastic elements in parallel, which reverse as the stack does, until its slope rises
for the first time; the regimes after that, in which rims carry, are springs beyond a gap. Force and load act in both
directions.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.file import check_one_ground, load_shares
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.jit.build import load_driver
from msfp_gen.scene.fidelity import EQUAL, Backbone
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import MassTop

if TYPE_CHECKING:
    from types import ModuleType

    from msfp_gen.buildings.file import AnyScene
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.specification.layout import Auto, Effects

STEP = 0.01  # [s], at most
STABLE = 0.5  # largest circular frequency times step
# Quantities of its runs, without the number of a surface.
QUANTITIES = (
    "status", "message", "duration", "peak_displacement", "peak_force", "peak_force_ratio", "rims_met", "wall_time",
)  # fmt: skip
OF_SURFACES = ("peak_sliding", "minimum_gap", "capacity_used")  # of one bearing only


@dataclass(frozen=True)
class BackboneRun:
    """A run of the cheapest level: its scene and the quantities of its summary; there are no rows.

    Sliding of surfaces is that of the published backbone at the largest displacement.
    """

    scene: AnyScene
    status: str
    message: str
    summary: dict[str, Any]

    def storage(self) -> Any:
        """Where the columns of a history are: a run without rows has none."""
        return SimpleNamespace(columns=lambda _: {}, arrays_of=lambda _: {})

    def characterise(self) -> Any:
        """Raises InputError: there are no rows."""
        raise InputError("fidelity = 'backbone': it keeps no history; give 'equivalent'")


def run_backbone(scene: AnyScene) -> BackboneRun:
    """Run a scene at the cheapest level. Raises InputError: what it is not for, as `check_backbone` says."""
    begin = time.perf_counter()
    check_backbone(scene)
    if isinstance(scene, Scene):
        assert isinstance(scene.top, MassTop)
        stop = 0.0 if scene.stop is None or scene.stop.displacement is None else scene.stop.displacement
        bearings, shares, mass = [_with_rims(scene.bearing, scene.effects)], [1.0], scene.top.mass
        motion = scene.motion
    else:
        bearings = [_with_rims(one.bearing, one.effects) for one in scene.bearings]
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
        gap = [surface.capacity - value for surface, value in zip(scene.bearing.surfaces, sliding, strict=True)]
        met = [number for number, value in enumerate(gap, start=1) if value <= 1e-9]
        summary |= {"peak_sliding": sliding, "minimum_gap": gap, "rims_met": met}
    return BackboneRun(scene, summary["status"], "", summary)


def check_backbone(scene: AnyScene) -> None:
    """Raise InputError where a scene is none of a mass on bearings that starts at rest."""
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
    """The bearing, with rims that carry nothing where the effects of its scene have none."""
    return bearing.replace(rim_stiffness=0.0) if effects and effects.rims is False else bearing


@lru_cache(maxsize=64)
def _backbone(bearing: Bearing, load: float) -> Backbone:
    return Backbone.of(bearing, load)


def _elements(bearings: tuple[Bearing, ...], shares: tuple[float, ...], mass: float) -> tuple[Array, float, Array]:
    """Elements (stiffness, strength), spring, and gaps (displacement, stiffness) of bearings side by side."""
    alike: dict[Bearing, list[float]] = {}
    for bearing, share in zip(bearings, shares, strict=True):
        alike.setdefault(bearing, []).append(share)
    weight = mass * bearings[0].gravity
    parts = [(sum(own), *parallel(_backbone(bearing, weight * float(np.mean(own))))) for bearing, own in alike.items()]
    elements = np.concatenate([rows * share for share, rows, _, _ in parts], axis=1)
    gaps = np.concatenate([rows * [[1.0], [share]] for share, _, _, rows in parts], axis=1)
    limit = _driver().MOST
    if elements.shape[1] > limit:
        raise InputError(f"bearings: {elements.shape[1]} regimes of different bearings; the backbone takes {limit}")
    return elements, float(sum(share * spring for share, _, spring, _ in parts)), gaps


def parallel(backbone: Backbone) -> tuple[Array, float, Array]:
    """Elements (stiffness [1/m], strength), shape (2, k), spring [1/m], and gaps (displacement [m], stiffness [1/m]).

    Each element yields where the slope falls, until it rises for the first time. Stiffness and strength are over the
    load. The last gap is that at which all sliders press on their rims.
    """
    u, force = backbone.points
    slopes = np.diff(force) / np.diff(u)
    rising = np.append(np.diff(slopes) > slopes[:-1] * EQUAL, True)
    main = int(np.flatnonzero(rising)[0])
    stiffness = -np.diff(slopes[: main + 1])
    yields = u[1 : main + 1]
    falling = stiffness > 0
    gaps = np.array([u[main + 1 :], np.diff([*slopes[main:], backbone.last_slope])])
    return np.array([stiffness, stiffness * yields])[:, falling], float(slopes[main]), gaps


def _ground(motion: Motion, end: float, step: float) -> Array:
    """Accelerations of the ground at the beginning of every step [m/s^2], shape (steps, 3)."""
    times = np.arange(0.0, end, step)
    if not motion.sampled:
        return np.ascontiguousarray(motion.evaluate(times, 2)[:, :3])
    at_knots = 2 * motion.coefficients[:, :3, 2]  # linear between samples
    return np.stack([np.interp(times, motion.knots[:-1], channel) for channel in at_knots.T], axis=1)


@cache
def _driver() -> ModuleType:
    return load_driver("msfp_gen.studies.estimation")[0]
