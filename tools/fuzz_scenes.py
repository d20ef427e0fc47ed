"""Random valid scenes for the fuzz campaign, and the criteria for sensible scenes.

Scene number i of a seed is always the same. Every parameter has a usual range, and a wide range from which one in twenty
is drawn: stiff rims, no or high friction, loads near zero, sliders of a gram, motion beyond capacity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from msfp_gen import Bearing, Body, Effects, Layout, Motion, Scene, Solver, Surface, Top
from msfp_gen.scene.scene_fields import InitialState
from msfp_gen.scene.standing import needed_rotational_stiffness
from msfp_gen.scene.top import MassTop, RigTop, load_values

Layers = tuple[int, int, int]
# The models: layouts of 2 to 9 bodies, with every effect in some of them.
SPECS: list[tuple[Layers, dict[str, Any]]] = [
    ((2, 1, 0), {}),
    ((2, 0, 1), {"dimension": "planar"}),
    ((2, 1, 0), {"dimension": "planar", "sliders": "massless"}),
    ((3, 1, 1), {}),
    ((3, 1, 1), {"spin": "patch", "bouc_wen": "isotropic"}),
    ((3, 1, 1), {"dimension": "planar"}),
    ((3, 1, 1), {"dimension": "planar", "uplift": True}),
    ((3, 1, 1), {"sliders": "massless"}),
    ((3, 1, 1), {"friction": "velocity"}),
    ((3, 2, 0), {"bouc_wen": "isotropic"}),
    ((4, 2, 1), {"dimension": "planar"}),
    ((4, 1, 2), {"rims": False}),
    ((5, 2, 2), {}),
    ((5, 2, 2), {"spin": "patch"}),
    ((5, 2, 2), {"bouc_wen": "isotropic"}),
    ((5, 2, 2), {"sliders": "massless"}),
    ((5, 2, 2), {"dimension": "planar"}),
    ((5, 2, 2), {"dimension": "planar", "sliders": "massless", "bouc_wen": "isotropic"}),
    ((5, 2, 2), {"dimension": "planar", "uplift": True}),
    ((5, 2, 2), {"uplift": True}),
    ((5, 2, 2), {"dimension": "planar", "friction": "pvt"}),
    ((5, 2, 2), {"friction": "velocity", "sliders": "massless", "bouc_wen": "isotropic"}),
    ((5, 3, 1), {}),
    ((6, 3, 2), {"dimension": "planar"}),
    ((7, 3, 3), {"bouc_wen": "isotropic"}),
    ((7, 3, 3), {"dimension": "planar", "sliders": "massless"}),
    ((9, 4, 4), {"dimension": "planar"}),
    ((9, 4, 4), {}),
]
SHORT: list[tuple[Layers, dict[str, Any]]] = [  # of the short campaign: models that other tests build too
    ((2, 1, 0), {}),
    ((3, 1, 1), {}),
    ((5, 2, 2), {"bouc_wen": "isotropic"}),
    ((5, 2, 2), {"dimension": "planar", "friction": "velocity"}),
    ((5, 2, 2), {"dimension": "planar"}),
    ((5, 2, 2), {"dimension": "planar", "friction": "pvt"}),
]
WIDE = 0.05  # share of parameters drawn from the wide range
GRAVITY = 9.8
EXPLICIT_STEPS = 10_000  # most steps of a run with an explicit method


@dataclass(frozen=True)
class Case:
    """One scene with its number."""

    number: int
    scene: Scene


class Draw:
    """Random choices of one scene."""

    def __init__(self, seed: int, number: int) -> None:
        self.rng = np.random.default_rng([seed, number])

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def flat(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def decades(self, usual: tuple[float, float], wide: tuple[float, float] | None = None) -> float:
        """Uniform in the logarithm over the usual range, or with probability WIDE over the wide one."""
        low, high = wide if wide is not None and self.chance(WIDE) else usual
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def one(self, items: Any) -> Any:
        return items[int(self.rng.integers(len(items)))]


def a_bearing(draw: Draw, layout: Layers, law: str, ratios: tuple[float, float] = (0.35, 0.8)) -> Bearing:
    """A bearing whose radii decrease inwards, each in a ratio to the next; in the wide range in any order."""
    n, up, down = layout
    outer, ratio = draw.decades((0.3, 3.0), (0.05, 100.0)), draw.flat(*ratios)
    nested = [outer * ratio**i for i in range(up)] + [outer * ratio**i for i in range(down)][::-1]
    if draw.chance(WIDE):
        draw.rng.shuffle(nested)
    bodies = [a_body(draw, outer, min(nested)) for _ in range(n - 1)]
    surfaces = [a_surface(draw, radius, law) for radius in nested]
    return Bearing(
        layout=Layout(*layout),
        base_height=0.03,
        surfaces=surfaces,
        bodies=bodies,
        base_rim_radius=min(0.15 * outer, 0.4 * min(nested)),
    )


def a_law(draw: Draw, law: str, friction: float) -> dict[str, float]:
    """Parameters of a friction law: less friction at low velocity; a patch under tens of megapascals."""
    if law == "velocity":
        return {"friction_slow": friction * draw.flat(0.3, 1.0), "velocity_rate": draw.decades((10.0, 200.0))}
    return {"reference_pressure": 3e7, "patch_radius": draw.decades((0.03, 0.3))} if law == "pvt" else {}


def a_surface(draw: Draw, radius: float, law: str) -> Surface:
    friction = draw.decades((0.005, 0.2), (1e-4, 0.5))
    return Surface(
        **a_law(draw, law, friction),
        radius=radius * draw.flat(0.9, 1.1),
        capacity=radius * (draw.flat(0.3, 0.9) if draw.chance(WIDE) else draw.flat(0.06, 0.25)),
        friction=0.0 if law == "constant" and draw.chance(0.2 * WIDE) else friction,
        yield_displacement=draw.decades((5e-5, 2e-3), (1e-6, 1e-2)),
        rim_stiffness=draw.decades((1e6, 1e8), (1e5, 1e10)),
        rim_damping=draw.one([0.0, 5.0, 1e3]),
    )


def a_body(draw: Draw, outer: float, least: float) -> Body:
    height, mass = draw.flat(0.02, 0.06) * min(outer, 1.0), draw.decades((0.05, 20.0), (1e-6, 100.0))
    across = draw.flat(1.0, 3.0) * height
    inertia = (mass * (across**2 / 4 + height**2 / 12), mass * across**2 / 2)
    return Body(
        height,
        draw.flat(0.3, 0.7) * height,
        mass,
        inertia,
        min(draw.flat(0.05, 0.2) * outer, 0.4 * least),
        draw.flat(0.0, 0.2) * height,
    )


def a_top(draw: Draw, layout: Layers) -> Top:
    """A rig, a load or a mass. The plate of a single pendulum is its slider, so nothing restrains its tilt."""
    load = draw.decades((3e3, 5e6), (1.0, 1e7))
    held = 0.0 if layout[0] == 2 or draw.chance(0.5 * WIDE) else draw.decades((10.0, 100.0)) * load
    damping = draw.one([0.0, 0.01 * held])
    kind = draw.one(["rig", "rig", "mass", "load"])
    if kind == "rig" or layout[0] == 2:
        return Top.rig(load, draw.decades((30.0, 1e4), (1.0, 1e5)) * load, draw.one([0.0, 0.05 * load]), held, damping)
    if kind == "mass":
        mass = load / GRAVITY
        return Top.mass(mass, draw.flat(0.05, 1.0) * mass, draw.flat(0.0, 1.0), held, damping)
    return Top.prescribed((0.0, 0.0, -load))


def held_up(bearing: Bearing, top: Top) -> Top:
    """The top; a spring against tilt that is too weak to hold the plate up is made twice as stiff as it must be."""
    given = getattr(top, "rotational_stiffness", 0.0)
    if not given:
        return top
    mass, height = (top.mass, top.height) if isinstance(top, MassTop) else (0.0, 0.0)
    load = -float(load_values(top)[2])
    needed = needed_rotational_stiffness(bearing, load, getattr(top, "stiffness", 0.0), mass, height)
    return top if given > needed or needed == np.inf else replace(top, rotational_stiffness=2.0 * needed)


def reach(bearing: Bearing) -> float:
    """Displacement that the outer surfaces allow without rim contact [m]."""
    ends = (bearing.surfaces[0], bearing.surfaces[-1])
    return min(s.capacity for s in ends) * (1 if len(bearing.surfaces) == 1 else 2)


def a_motion(draw: Draw, bearing: Bearing, effects: Effects) -> Motion:
    """Sine, circle, figure of eight, push or noise of random amplitude and speed; some of the noise is vertical too."""
    size = reach(bearing) * (draw.flat(1.0, 1.5) if draw.chance(2 * WIDE) else draw.flat(0.05, 0.8))
    frequency = min(draw.decades((0.1, 2.0), (1e-3, 50.0)), 0.5 / np.sqrt(size))  # 1 g at most
    planar, w = effects.dimension == "planar", 2 * np.pi * frequency
    azimuth = draw.flat(0.0, 6.28)
    kind = draw.one(["line", "push", "noise"] if planar else ["line", "circle", "eight", "push", "noise"])
    if kind == "circle":
        return Motion.circle(size, w, cycles=1.0, lead_in=0.7 / frequency)
    if kind == "eight":
        return Motion.figure_eight(size, 0.6 * w, cycles=1.0, lead_in=0.7 / frequency)
    if kind == "push":
        acceleration = draw.flat(0.05, 1.0)
        return Motion.ramp(acceleration, float(np.sqrt(2 * size / acceleration)), direction=azimuth)
    if kind == "noise":
        return noise(draw, size, azimuth, planar, 1.5 if effects.uplift else 0.3)
    return Motion.harmonic(size, frequency, direction=azimuth, cycles=draw.one([0.5, 1.0, 1.5]))


def noise(draw: Draw, size: float, azimuth: float, planar: bool, vertical: float) -> Motion:
    """Earthquake-like motion of two to six seconds with peak displacement `size` [m], some with vertical motion.

    vertical: largest peak vertical acceleration [g].
    """
    duration, step = draw.flat(2.0, 6.0), 0.01
    t = np.arange(0.0, duration, step)
    waves = [(draw.decades((0.3, 5.0)), draw.flat(0, 6.28), draw.rng.normal(size=3)) for _ in range(8)]
    u = sum(np.outer(np.sin(2 * np.pi * f * t + p), a / f**2) for f, p, a in waves)
    u *= (np.sin(np.pi * t / duration) ** 2)[:, None]
    if planar:
        u[:, :2] = np.outer(u[:, 0], [np.cos(azimuth), np.sin(azimuth)])
    u[:, :2] *= size / np.abs(u[:, :2]).max()
    u[:, :2] *= min(1.0, 10.0 / np.abs(np.diff(u[:, :2], 2, axis=0) / step**2).max())
    shaken = draw.flat(0.1, vertical) * GRAVITY if draw.chance(0.3) else 0.0
    u[:, 2] *= shaken / np.abs(np.diff(u[:, 2], 2) / step**2).max()
    return Motion.from_arrays(t, u)


def a_start(draw: Draw, bearing: Bearing, top: Top, effects: Effects) -> InitialState | None:
    """None for a start at rest at the centre, or a displaced state; not for rigs, whose springs would act, or planar models."""
    free = effects.dimension == "spatial" and not effects.uplift and not isinstance(top, RigTop)
    if not free or not draw.chance(2 * WIDE):
        return None
    rows = range(bearing.layout.surfaces)
    q = [
        (0.3 * s.capacity / s.radius * draw.flat(-1, 1), 0.3 * s.capacity / s.radius * draw.flat(-1, 1), 0.0)
        for s in bearing.surfaces
    ]
    return InitialState(
        q, [(0.0, 0.0, 0.0) for _ in rows], [(draw.flat(-0.6, 0.6), draw.flat(-0.6, 0.6)) for _ in rows]
    )


def case(seed: int, number: int, short: bool = False) -> Case:
    """Scene `number` of a seed; the same on every machine."""
    draw = Draw(seed, number)
    layout, words = draw.one(SHORT if short else SPECS)
    effects = Effects(**words)
    bearing = a_bearing(draw, layout, effects.friction)
    top = held_up(bearing, a_top(draw, layout))
    motion = a_motion(draw, bearing, effects)
    start = a_start(draw, bearing, top, effects)
    explicit = effects.sliders == "inertial" and not effects.uplift and draw.chance(0.2)
    rtol = draw.decades((1e-5, 1e-3), (1e-7, 3e-2))
    duration = None
    if explicit:
        duration = max(
            min(motion.duration, EXPLICIT_STEPS / 6 / explicit_rate(bearing, top)), 1e-8
        )  # no run is shorter
    solver = Solver(method="dopri5" if explicit else "implicit", rtol=rtol, max_steps=100_000)
    scene = Scene(
        bearing,
        motion,
        top,
        effects,
        solver,
        duration=duration,
        initial_state=start,
        output_step=draw.one([None, None, 0.01]) if motion.duration > 0.1 and not explicit else None,
        name=f"fuzz-{seed}-{number}",
    )
    return Case(number, scene)


# ---- properties of a scene -------------------------------------------------------------------------------------


def load_of(top: Top) -> float:
    """Axial load [N]."""
    if isinstance(top, MassTop):
        return top.mass * GRAVITY
    return top.axial_load if isinstance(top, RigTop) else -top.force[2]  # type: ignore[attr-defined]


def explicit_rate(bearing: Bearing, top: Top) -> float:
    """Steps per second for stability of an explicit method: the highest frequency of stuck sliders over 3 [1/s].

    The rotational stiffness of a slider is mu N R^2/d_y, and that of its rims k R^2; the lightest body has the least
    inertia about a sphere centre, J + m (R - z)^2. A damper on a light plate may have a higher rate.
    """
    load, worst = load_of(top) + 1.0, 1.0
    stiffness = max(s.friction * load / s.yield_displacement for s in bearing.surfaces)
    if isinstance(top, RigTop):
        stiffness += top.stiffness
    held = getattr(top, "rotational_stiffness", 0.0)
    radius = max(s.radius for s in bearing.surfaces)
    for body in bearing.bodies:
        inertia = min(body.moments)
        turning = (2 * stiffness * (radius * 0.1) ** 2 + held + 2 * load * radius) / inertia
        worst = max(worst, np.sqrt(2 * stiffness / body.mass + turning))
    plate = bearing.bodies[-1]
    turning = getattr(top, "rotational_damping", 0.0) / min(plate.moments)
    return float(max(worst, turning, getattr(top, "damping", 0.0) / plate.mass))


def wide(bearing: Bearing) -> bool:
    """Whether the radius of every slider is at least a tenth of its sphere's, so that it does not tip under friction."""
    rows = enumerate(bearing.surfaces)
    return all(bearing.slider_rim_radius(i) >= max(0.1, s.friction) * s.radius for i, s in rows)


def sensible(scene: Scene) -> bool:
    """Whether the scene is sensible in practice; every line is a condition."""
    bearing, top, effects, solver = scene.bearing, scene.top, scene.effects, scene.solver
    load, radii = load_of(top), [s.radius for s in bearing.surfaces]
    m, p = bearing.layout.m, bearing.layout.p
    middle = [np.diff(radii[:m]), -np.diff(radii[m:])]
    base, peak = (
        scene.motion.displacement(np.linspace(0, scene.end, 400)),
        scene.motion.acceleration(np.linspace(0, scene.end, 400)),
    )
    demand = float(np.linalg.norm(base[:, :2], axis=1).max())
    held = getattr(top, "rotational_stiffness", 0.0)
    return bool(
        all(0.005 <= s.friction <= 0.2 for s in bearing.surfaces)  # usual friction coefficients
        and all(5e-5 <= s.yield_displacement <= 2e-3 for s in bearing.surfaces)  # usual yield displacements
        and all(1e6 <= s.rim_stiffness <= 1e8 for s in bearing.surfaces)
        and all(s.capacity <= 0.3 * s.radius for s in bearing.surfaces)  # tilts of 0.3 rad at most
        and min(radii[0], radii[-1]) >= 0.25
        and max(radii) <= 5.0
        and all((steps <= 0).all() for steps in middle)
        and ((m and p) or len(radii) <= 2)  # radii decrease inwards
        and all(0.05 <= b.mass <= 20.0 for b in bearing.bodies)
        and load >= 3e3
        and load >= 10 * sum(b.mass for b in bearing.bodies) * GRAVITY
        and (bearing.layout.n == 2 or held >= 10.0 * load)  # building or rig restrains the tilt of the top plate
        and not (isinstance(top, RigTop) and not 30 * load <= top.stiffness <= 1e4 * load)
        and demand <= (0.8 if isinstance(top, RigTop) else 0.4) * reach(bearing)  # within capacity
        and np.abs(peak[:, :2]).max() <= 1.0 * GRAVITY
        and (effects.uplift or np.abs(peak[:, 2]).max() <= 0.3 * GRAVITY)  # the load does not vanish
        and solver.method == "implicit"  # the explicit method is for comparison only
        and scene.initial_state is None
        and not (isinstance(top, MassTop) and effects.sliders == "massless")  # inertia acts only through the slopes
        and (not effects.uplift or wide(bearing))  # sliders that do not tip
        and 1e-5 <= solver.rtol <= 1e-3
    )
