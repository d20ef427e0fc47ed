"""Cheaper models of a scene, made from the scene itself: `at_fidelity`, and the published backbone (docs/studies.md).

Each is a scene like any other, which the generator derives and compiles; nobody writes one for a layout.

The backbone takes the surfaces of a stack as links in series, with small angles and no inertia. Fenz and Constantinou
(2008) give it for triple pendulums; here it is generalised to any stack. With F = force over axial load, the slider
over surface k tilts by F - mu_k along the motion, at most capacity/R_k more than the next body outwards. The
displacement of the bearing is the sum of these tilts times the differences of effective radii.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, singledispatch
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.effect_selection import load_at_rest
from msfp_gen.scene.friction_parameters import coefficient, law_parameters
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import FIDELITIES
from msfp_gen.scene.top import MassTop, PrescribedTop
from msfp_gen.specification.layout import Auto, Effects, Layout

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.solver import Solver
    from msfp_gen.scene.top import Top
    from msfp_gen.specification.friction_laws import Law


@dataclass(frozen=True)
class Link:
    """One surface of the series. Horizontal vectors are complex numbers.

    Attributes:
        outside: index of the next link outwards; None at a plate.
        surface: index of the surface, from 0.
        radius: radius of the surface [m].
        effective: effective radius, from the sphere centre to the pivot [m].
        share: effective radius less the effective radius of the next link inwards [m].
        friction: friction coefficient [-].
        limit: largest tilt relative to the next link outwards, at rim contact [rad].
        yielding: yield displacement [m].
        rim: rim stiffness [N/m].
    """

    outside: int | None
    surface: int
    radius: float
    effective: float
    share: float
    friction: float
    limit: float
    yielding: float
    rim: float


def series_links(bearing: Bearing, rims: bool, arms: bool) -> list[Link]:
    """Links of both chains, from the plates inwards. The pivot is the middle of the innermost slider.

    arms: friction acts at the radius of its surface, not at the effective radius (docs/bearing.md), so a surface slides
    from F = (mu R - mu' R')/(R_eff - R_eff') on, with ' for the next surface inwards.
    """
    layout, surfaces = bearing.layout, bearing.surfaces
    tops = np.cumsum([bearing.base_height, *(body.height for body in bearing.bodies)])
    centres = [tops[k] + sign * surfaces[k].radius for k, sign in enumerate(layout.signs)]
    if layout.m and layout.p:
        pivot = tops[layout.m] - bearing.bodies[layout.m - 1].height / 2
    else:  # one chain: the pivot is the top of the stack, or its bottom
        pivot = tops[-1] if layout.m else 0.0
    links: list[Link] = []
    for chain in (range(layout.m), range(layout.surfaces - 1, layout.m - 1, -1)):
        effective = [float(abs(centres[k] - pivot)) for k in chain]
        for place, k in enumerate(chain):
            surface = surfaces[k]
            limit = surface.capacity / surface.radius if rims else float("inf")
            inner_radius, inner_moment = 0.0, 0.0  # effective radius, and mu R, of the next surface inwards
            if place + 1 < len(effective):
                inner = surfaces[chain[place + 1]]
                inner_radius, inner_moment = effective[place + 1], inner.friction * inner.radius
            share = effective[place] - inner_radius
            friction = (surface.friction * surface.radius - inner_moment) / share if arms else surface.friction
            links.append(
                Link(
                    len(links) - 1 if place else None,
                    k,
                    surface.radius,
                    effective[place],
                    share,
                    friction,
                    limit,
                    surface.yield_displacement,
                    surface.rim_stiffness,
                )
            )
    return links


@dataclass(frozen=True)
class Backbone:
    """Force over axial load of a stack that is pushed from its centre, piecewise linear, with rigid rims.

    links: see `series_links`. yielding: displacement within which friction is elastic [m].
    """

    links: tuple[Link, ...]
    yielding: float

    @classmethod
    def of(cls, bearing: Bearing) -> Backbone:
        """The backbone of a bearing, with rims and friction at the radii of its surfaces."""
        links = tuple(series_links(bearing, rims=True, arms=True))
        first = min(link.friction for link in links)
        elastic = [
            link.effective / link.radius * link.yielding for link in links if link.friction <= first * (1 + 1e-9)
        ]
        return cls(links, sum(elastic))

    def tilts(self, force: float) -> list[float]:
        """Tilt of every link [rad] at a force over load, outermost first."""
        tilts: list[float] = []
        for link in self.links:
            most = link.limit + (0.0 if link.outside is None else tilts[link.outside])
            tilts.append(min(max(force - link.friction, 0.0), most))
        return tilts

    def displacement(self, force: float) -> float:
        """Displacement [m] at a force over load."""
        return sum(link.share * tilt for link, tilt in zip(self.links, self.tilts(force), strict=True))

    @cached_property
    def points(self) -> tuple[Array, Array]:
        """Displacements [m] and forces over load where the slope changes, from first sliding to the last rim, (k,)."""
        forces: set[float] = set()
        limits: list[float] = []
        for link in self.links:
            limits.append(link.limit + (0.0 if link.outside is None else limits[link.outside]))
            forces |= {link.friction, link.friction + limits[-1]}
        rising = np.array(sorted(forces))
        displacements = np.array([self.displacement(force) for force in rising])
        last = int(np.searchsorted(displacements, displacements[-1] * (1 - 1e-12)))
        rising, displacements = rising[: last + 1], displacements[: last + 1]
        moved = np.append(True, np.diff(displacements) > 1e-12)
        return displacements[moved], rising[moved]

    @property
    def capacity(self) -> float:
        """Displacement at which the last slider meets its rim [m]."""
        return float(self.points[0][-1])


AnyEffects = TypeVar("AnyEffects", bound=Effects | Auto)
EQUAL = 1e-9  # relative difference of slopes that are equal but for rounding
LOOSE = 1e-2  # relative tolerance of the cheaper models
JOINT = 0.05  # radius of the joint of the equivalent pendulum, and height of its slider [m]
JOINT_FRICTION = 1e-3
LIVELY = 0.99  # share of the motion of the base after which a run of the equivalent pendulum ends
LEVEL = 100.0  # rotational stiffness of the plate of the equivalent pendulum, over what it needs to stand

# Level -> what a run at it cannot see, for its note.
UNSEEN = {
    "loose": f"fidelity = 'loose': solver.rtol is {LOOSE:g}; vibrations of stuck sliders are damped, and the time at "
    "which a rim is met is less exact",
    "massless": f"fidelity = 'massless': sliders have no inertia, nothing can lift off, and solver.rtol is {LOOSE:g}",
    "equivalent": "fidelity = 'equivalent': one pendulum with the longest sliding regime of the published backbone; it "
    "does not see the other regimes, the single surfaces and their rims, heat, uplift and the tilt of the top plate; "
    "its friction is constant, by a friction law at the load at rest, the largest velocity of the base and the start "
    "temperature; without a load it ends when 99 % of the motion of the base have passed",
    "rigid": "fidelity = 'rigid': the building is one rigid body; it does not see drifts and floor accelerations",
}


def at_fidelity(system: Any, word: str) -> Any:
    """A system at a level of fidelity: "exact" (as it is), or another of `FIDELITIES`.

    Raises InputError of one line where there is no such level, or the system has no such model.
    """
    if not isinstance(word, str) or word not in FIDELITIES:
        raise InputError(f"fidelity = {word!r}: give one of {', '.join(map(repr, FIDELITIES))}")
    return system if word == "exact" else _reduced(system, word)


@singledispatch
def _reduced(system: Any, word: str) -> Any:
    return system.at_fidelity(word)


@_reduced.register(Scene)
def _reduced_scene(scene: Scene, word: str) -> Scene:
    if word not in _REDUCTIONS:
        levels = ", ".join(map(repr, ("exact", *_REDUCTIONS)))
        raise InputError(f"fidelity = {word!r}: one bearing has no such model; give one of {levels}")
    return replace(_REDUCTIONS[word](scene), fidelity=word)


def check_stack(scene: Any) -> None:
    """Raise InputError where values of surfaces and bodies describe a pendulum in place of the given stack."""
    if scene.fidelity == "equivalent":
        raise InputError(
            "fidelity = 'equivalent': its surfaces make one pendulum, not the stack; give 'massless', or a "
            "study, which changes the stack first"
        )


def _loose(scene: Scene) -> Scene:
    if scene.solver.rtol >= LOOSE:
        raise InputError(f"fidelity = 'loose': solver.rtol = {scene.solver.rtol:g} already; give less than {LOOSE:g}")
    return replace(scene, solver=replace(scene.solver, rtol=LOOSE))


def _massless(scene: Scene) -> Scene:
    if scene.modelled.sliders == "massless" and scene.solver.rtol >= LOOSE:
        raise InputError("fidelity = 'massless': the scene has massless sliders already; leave it out")
    effects = without_inertia(scene.effects)
    if not scene.modelled.determines_spin:
        effects = replace(effects, spin="locked")
    return replace(scene, effects=effects, solver=implicit_solver(scene.solver))


def without_inertia(effects: AnyEffects) -> AnyEffects:
    """The effects with massless sliders; `Auto` still adds rims, heat and the third dimension where they matter."""
    return replace(effects, sliders="massless", uplift=False)


def implicit_solver(solver: Solver) -> Solver:
    """The settings of the cheaper models."""
    return replace(solver, method="implicit", rtol=max(solver.rtol, LOOSE))


def _equivalent(scene: Scene) -> Scene:
    if isinstance(scene.top, PrescribedTop):
        raise InputError("fidelity = 'equivalent': it needs a top of kind 'rig' or 'mass', which holds the plate level")
    if scene.initial_state is not None:
        raise InputError("fidelity = 'equivalent': it starts centred and at rest; leave initial_state out")
    effects = replace(without_inertia(scene.effects), spin="locked", friction="constant", friction_law=None)
    if isinstance(effects, Effects):
        effects = replace(effects, top_rotation=False)
    stack = constant_friction(scene.bearing, scene.law[1], load_at_rest(scene), peak_speed(scene.motion, scene.end))
    bearing = equivalent_pendulum([stack], [1.0])
    return replace(
        scene,
        bearing=bearing,
        duration=lively_end(scene.motion, scene.end) if scene.load is None else scene.end,
        top=_level(scene, bearing),
        effects=effects,
        top_rotation=None,
        solver=implicit_solver(scene.solver),
    )


def _level(scene: Scene, bearing: Bearing) -> Top:
    """The top with a rotational stiffness that holds its plate level."""
    top: Any = scene.top
    lever = JOINT + bearing.bodies[-1].height
    if isinstance(top, MassTop):
        load, lever = top.mass * bearing.gravity, lever + top.height
    else:
        load = top.axial_load
    level_top: Top = replace(top, rotational_stiffness=max(top.rotational_stiffness, LEVEL * load * lever))
    return level_top


def lively_end(motion: Motion, end: float) -> float:
    """Time by which `LIVELY` of the squared velocity and of the squared acceleration of the base have passed [s]."""
    times = np.union1d(motion.knots[motion.knots < end], np.linspace(0.0, end, 1001))
    passed = [
        np.cumsum(np.sum(motion.evaluate(times[1:], order)[:, :3] ** 2, axis=1) * np.diff(times)) for order in (1, 2)
    ]
    return float(times[1:][max(np.searchsorted(each, LIVELY * each[-1]) if each[-1] else -1 for each in passed)])


def peak_speed(motion: Motion, end: float) -> float:
    """Largest velocity of the base until the end of a run [m/s]."""
    times = np.append(motion.knots[motion.knots < end], np.linspace(0.0, end, 1001))
    return float(np.linalg.norm(motion.evaluate(times, 1)[:, :3], axis=1).max())


def constant_friction(bearing: Bearing, law: Law | None, load: float, speed: float) -> Bearing:
    """The bearing with the coefficients that its friction law gives in one state; None: they are constant.

    load: normal force [N]. speed: of sliding [m/s]. What surfaces remember is as at the start of a run.
    """
    if law is None:
        return bearing
    coefficients = []
    for index, surface in enumerate(bearing.surfaces):
        own = law_parameters(law, bearing, index)
        state = own | {"mu": surface.friction, "v": speed, "N": load, "p": load / own.get("area", float("inf"))}
        if law.memory is not None:
            state[law.memory.variable] = own.get(law.memory.start, 0.0)
        coefficients.append(float(coefficient(law, state)[0]))
    return bearing.replace(friction=coefficients)


def main_regime(backbone: Backbone) -> tuple[float, float, float]:
    """Friction coefficient, radius [m] and yield displacement [m] of the longest sliding regime of a backbone.

    The yield displacement gives a loop to its end the dissipation of the published loop, which begins with the regimes
    before. The regime is the one of the least slope, of equal ones the first.
    """
    u, force = backbone.points
    slopes = np.diff(force) / np.diff(u)
    main = int(np.argmax(slopes <= slopes.min() + EQUAL * abs(slopes.min())))
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
}
