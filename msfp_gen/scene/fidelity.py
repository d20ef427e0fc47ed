"""Cheaper models of a scene, made from the scene itself: `at_fidelity` (docs/fidelity.md).

Each is a scene like any other, which the generator derives and compiles; nobody writes one for a layout.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.scene.backbone import Backbone
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.top import MassTop, PrescribedTop
from msfp_gen.specification.layout import Effects, Layout

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene
    from msfp_gen.scene.solver import Solver
    from msfp_gen.scene.top import Top

_Scene = TypeVar("_Scene")  # of a bearing or of a building
LOOSE = 1e-2  # relative tolerance of the cheaper models
JOINT = 0.05  # radius of the joint of the equivalent pendulum, and height of its slider [m]
JOINT_FRICTION = 1e-3
LEVEL = 100.0  # rotational stiffness of the plate of the equivalent pendulum, over what it needs to stand

# Level -> what a run at it cannot see, for its note.
UNSEEN = {
    "loose": f"fidelity = 'loose': solver.rtol is {LOOSE:g}; vibrations of stuck sliders are damped, and the time at "
    "which a rim is met is less exact",
    "massless": f"fidelity = 'massless': sliders have no inertia, nothing can lift off, and solver.rtol is {LOOSE:g}",
    "equivalent": "fidelity = 'equivalent': one pendulum with the longest sliding regime of the published backbone; it "
    "does not see the other regimes, the single surfaces and their rims, heat, uplift and the tilt of the top plate",
    "rigid": "fidelity = 'rigid': the building is one rigid body; it does not see drifts and floor accelerations",
}


def at_fidelity(scene: Scene, word: str) -> Scene:
    """The scene at a level of fidelity: "exact" (as it is), "loose", "massless" or "equivalent".

    Raises InputError of one line where the scene has no such model.
    """
    if word == "exact":
        return scene
    if word not in _REDUCTIONS:
        levels = ", ".join(map(repr, ("exact", *_REDUCTIONS)))
        raise InputError(f"fidelity = {word!r}: one bearing has no such model; give one of {levels}")
    if word == "backbone":
        return labelled(scene, word)
    return replace(_REDUCTIONS[word](scene), fidelity=word)


def labelled(scene: _Scene, word: str) -> _Scene:
    """The scene with another fidelity, which alone says how studies run it; nothing is checked again."""
    other = copy(scene)
    object.__setattr__(other, "fidelity", word)
    return other


def _loose(scene: Scene) -> Scene:
    if scene.solver.rtol >= LOOSE:
        raise InputError(f"fidelity = 'loose': solver.rtol = {scene.solver.rtol:g} already; give less than {LOOSE:g}")
    return replace(scene, solver=replace(scene.solver, rtol=LOOSE))


def _massless(scene: Scene) -> Scene:
    effects = scene.modelled
    if effects.sliders == "massless" and scene.solver.rtol >= LOOSE:
        raise InputError("fidelity = 'massless': the scene has massless sliders already; leave it out")
    effects = replace(effects, sliders="massless", uplift=False, spin="locked")
    return replace(scene, effects=effects, solver=implicit_solver(scene.solver))


def implicit_solver(solver: Solver) -> Solver:
    """The settings of the cheaper models."""
    return replace(solver, method="implicit", rtol=max(solver.rtol, LOOSE))


def _equivalent(scene: Scene) -> Scene:
    if isinstance(scene.top, PrescribedTop):
        raise InputError("fidelity = 'equivalent': it needs a top of kind 'rig' or 'mass', which holds the plate level")
    if scene.initial_state is not None:
        raise InputError("fidelity = 'equivalent': it starts centred and at rest; leave initial_state out")
    effects = Effects(
        dimension=scene.modelled.dimension, sliders="massless", rims=scene.modelled.rims,
        bouc_wen=scene.modelled.bouc_wen,
    )  # fmt: skip
    bearing = equivalent_pendulum([scene.bearing], [1.0])
    return replace(
        scene,
        bearing=bearing,
        top=_level(scene, bearing),
        effects=effects,
        top_rotation=None,
        solver=implicit_solver(scene.solver),
    )


def _level(scene: Scene, bearing: Bearing) -> Top:
    """The top with a rotational stiffness that holds its plate level."""
    top: Any = scene.top
    lever = JOINT + bearing.bodies[-1].height
    load = getattr(top, "axial_load", 0.0)
    if isinstance(top, MassTop):
        load, lever = top.mass * bearing.gravity, lever + top.height
    held: Top = replace(top, rotational_stiffness=max(top.rotational_stiffness, LEVEL * load * lever))
    return held


def main_regime(backbone: Backbone) -> tuple[float, float, float]:
    """Friction coefficient, radius [m] and yield displacement [m] of the longest sliding regime of a backbone.

    The yield displacement gives a loop to its end the dissipation of the published loop, which begins with the regimes
    before. The regime is that of the least slope.
    """
    u, force = backbone.points
    slopes = np.diff(force) / np.diff(u)
    main = int(np.argmin(slopes))
    slope = float(slopes[main])
    friction = float(force[main] - slope * u[main])
    missing = friction + slope * u[: main + 1] - force[: main + 1]
    lost = float(np.trapezoid(missing, u[: main + 1])) + float(force[0]) * backbone.yielding / 2
    return friction, 1 / slope, 2 * lost / friction


def equivalent_pendulum(bearings: Sequence[Bearing], shares: Sequence[float]) -> Bearing:
    """One articulated pendulum, of layout (3, 1, 1), with the main regimes of the published backbones of its stacks.

    shares: of the load that they carry together. Its capacity is the least displacement at which the last slider of a
    stack meets its rim.
    """
    backbones = [Backbone.of(bearing) for bearing in bearings]
    regimes, weights = np.array([main_regime(backbone) for backbone in backbones]), np.array(shares)
    friction, stiffness = float(weights @ regimes[:, 0]), float(weights @ (1 / regimes[:, 1]))
    yielding = float(weights @ (regimes[:, 0] * regimes[:, 2])) / friction
    first = bearings[0]
    outer, plate = first.surfaces[0], first.bodies[-1]
    common = {
        "rim_stiffness": sum(bearing.surfaces[0].rim_stiffness for bearing in bearings),
        "rim_damping": sum(bearing.surfaces[0].rim_damping for bearing in bearings),
        "contact_damping": outer.contact_damping,
    }
    capacity = min(backbone.capacity for backbone in backbones)
    dish = Surface(1 / stiffness, capacity, friction, yielding, **common)
    joint = Surface(JOINT, 0.9 * JOINT, JOINT_FRICTION, JOINT * JOINT_FRICTION, **common)
    mass = sum(body.mass for body in first.bodies[:-1]) or 1e-3 * plate.mass
    slider = Body(JOINT, JOINT / 2, mass, mass * JOINT**2, rim_radius=JOINT / 5)
    return Bearing(
        Layout.dfp(), first.base_height, [dish, joint], [slider, replace(plate, rim_radius=0.0)], gravity=first.gravity
    )


_REDUCTIONS: dict[str, Callable[[Scene], Scene]] = {
    "loose": _loose,
    "massless": _massless,
    "equivalent": _equivalent,
    "backbone": lambda scene: scene,
}
