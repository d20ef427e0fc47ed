"""Planar, massless, rigid-plastic limit of a stack in closed form: friction circles and one line of force.

Massless bodies hand on one force along one straight line. About the sphere centre c_g of surface g that force has the
moment Gamma_g. A stuck surface has |Gamma| <= rho |C|, rho = mu R / sqrt(1 + mu^2), C the contact force; a sliding one
has Gamma = -+ rho |C|: the line is tangent to the friction circle. A rim adds its own force. So each stage of a push is
a set of tangencies, solved at any displacement without integrating; stages end at roots of scalar functions.

Plane E1-E3; tilts are angles about E2, so t_3 = (sin, cos) and t_1 = (cos, -sin). The top plate is pushed to +E1 over
a level base, which by symmetry is the base moving to -E1 under the plate. Friction is rigid-plastic (d_y -> 0).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .forces import concave
from .parameters import Array
from .stack import complex_jacobian, newton

STILL = 1e-6  # [rad/m] a sliding surface turning back faster than this is stuck; slower is "at yield, not moving"
SLACK = 1e-9  # relative excess over the friction circle that starts a slip
TOUCH = 1e-10  # [m] a stage starts this far behind the meeting with a rim, so that its stiffness is in the rates
STRIDE = (1e-11, 4e-3)  # [m] events are looked for once a stride, which doubles from the first to the second


@dataclass(frozen=True)
class Push:
    """A stack under a vertical load [N] whose top plate, tilted by tau, feels the moment -rotational_stiffness tau.

    With weights the forces are no longer one line, so no longer the closed form: for `quasi_static` only.
    """

    bearing: Any
    load: float
    rotational_stiffness: float = 0.0
    weights: bool = False


@dataclass(frozen=True)
class Equilibrium:
    """displacement [m], horizontal force of the rig [N], its moment [N m], relative tilts delta (n-1,) [rad]."""

    displacement: float
    force: float
    moment: float
    delta: Array
    direction: Array  # (n-1,) sign of the slip of each surface at yield, 0 where stuck


class Transition(NamedTuple):
    """What happened at which surface ("slides", "sticks", "rim"), and the equilibrium at that moment."""

    what: str
    surface: int
    at: Equilibrium


class Moments(NamedTuple):
    """Per surface: moment of the contact force about the sphere centre [N m], and its bound rho |C| [N m]."""

    moment: Array
    bound: Array


def links(bearing: Any) -> Array:
    """Distances along t_3^k: base to c_1, then c_{k-1} to c_k for bodies 2..n-1, then c_{n-1} to r_nn; (n,) [m]."""
    signed = [sign * s.radius for sign, s in zip(concave(bearing), bearing.surfaces, strict=True)]
    heights = [bearing.base_height] + [body.height for body in bearing.bodies]
    lengths: Array = np.array(heights) + np.array([*signed, 0.0]) - np.array([0.0, *signed])
    return lengths


def centres(bearing: Any, delta: Array) -> Array:
    """c_1 .. c_{n-1} and r_nn relative to r_01, (n, 2) [m], at relative tilts delta (n-1,) [rad]."""
    tilt = np.concatenate([[0.0], np.cumsum(delta)])
    return np.cumsum(links(bearing)[:, None] * np.stack([np.sin(tilt), np.cos(tilt)], axis=1), axis=0)


def weights_above(bearing: Any, spots: Array, delta: Array) -> tuple[Array, Array]:
    """Weight of bodies g+1..n [N] and its moment about c_g over -1 [N m], each (n-1,)."""
    tilt, weight = np.cumsum(delta), bearing.gravity * np.array([body.mass for body in bearing.bodies])
    parts = zip(concave(bearing), bearing.surfaces, bearing.bodies, strict=True)
    arms = np.array([b.centroid - s.radius if sign > 0 else s.radius + b.height - b.centroid for sign, s, b in parts])
    x = spots[:-1, 0] + arms * np.sin(tilt)  # centres of mass, from r_g,g+1 up (3.6) or down (3.10)
    above = np.cumsum(weight[::-1])[::-1]
    return above, np.cumsum((weight * x)[::-1])[::-1] - above * spots[:-1, 0]


def contact_moments(push: Push, delta: Array, force: Any, moment: Any, share: Any = 1.0) -> Moments:
    """Moments of the contact forces about their sphere centres, the rims' part taken off; share: Y of each surface."""
    bearing, spots = push.bearing, centres(push.bearing, delta)
    tilt = np.concatenate([[0.0], np.cumsum(delta)])
    weight, weight_moment = weights_above(bearing, spots, delta) if push.weights else np.zeros((2, len(delta)))
    gamma, size = [], []
    for i, (sign, surface) in enumerate(zip(concave(bearing), bearing.surfaces, strict=True)):
        x, z = spots[-1] - spots[i]
        about = -moment - z * force - x * push.load - weight_moment[i]
        rim, k = rim_force(surface, delta[i]), i + 2 if sign > 0 else i + 1  # body k touches the cup
        offset = bearing.bodies[k - 2].rim_offset if k > 1 else bearing.base_rim_offset
        # f_bar is along -+ t_1 of body k (3.24)
        across, along = (
            -force + sign * rim * np.cos(tilt[k - 1]),
            push.load + weight[i] - sign * rim * np.sin(tilt[k - 1]),
        )
        gamma.append(about - (surface.radius - offset) * rim)
        size.append(np.sqrt(across**2 + along**2))
    mu, R = (np.array([getattr(s, name) for s in bearing.surfaces]) for name in ("friction", "radius"))
    return Moments(np.array(gamma), mu * share * R / np.sqrt(1 + (mu * share) ** 2) * np.array(size))


def rim_force(surface: Any, delta: Any) -> Any:
    """Rim force -k_c (s - s_c), with the sign of delta, compression only [N]; (3.20)-(3.23) at rest."""
    sign = np.sign(np.real(delta))
    over = surface.radius * delta * sign - surface.capacity
    return -surface.rim_stiffness * over * sign if np.real(over) > 0 else 0.0 * delta


def equations(push: Push, stage: Equilibrium) -> Callable[[Array, float], Array]:
    """Residual of y = (delta, force/load, moment/load) at a displacement, with the surfaces of `stage` at yield.

    A tangency where a surface is at yield, an unchanged tilt where it is stuck; the plate's moment; the displacement.
    """
    size, stiffness = push.load, push.rotational_stiffness
    start = centres(push.bearing, np.zeros(len(stage.delta)))[-1, 0]

    def residual(y: Array, displacement: float) -> Array:
        delta, force, moment = y[:-2], y[-2] * size, y[-1] * size
        about = contact_moments(push, delta, force, moment)
        yielding = (about.moment + stage.direction * about.bound) / size
        tilt = (moment + stiffness * delta.sum()) / (size + stiffness)
        moved = centres(push.bearing, delta)[-1, 0] - start - displacement
        return np.concatenate([np.where(stage.direction != 0, yielding, delta - stage.delta), [tilt, moved]])

    return residual


def advance(push: Push, stage: Equilibrium, displacement: float) -> Equilibrium:
    """The same stage at another displacement [m]."""
    residual = equations(push, stage)
    y = np.array([*stage.delta, stage.force / push.load, stage.moment / push.load])
    pieces = max(1, int(np.ceil(abs(displacement - stage.displacement) / 5e-3)))
    for d in np.linspace(stage.displacement, displacement, pieces + 1)[1:]:
        y, _ = newton(lambda x, d=d: residual(x, d), y, tolerance=1e-13 * max(1.0, np.abs(y).max()))  # type: ignore[misc]
    return replace(stage, displacement=displacement, delta=y[:-2], force=y[-2] * push.load, moment=y[-1] * push.load)


def slip_rates(push: Push, stage: Equilibrium) -> Array:
    """d delta/d displacement along the stage, (n-1,) [rad/m], on the side of the rims' kink that loading takes."""
    residual = equations(push, stage)
    y = np.array([*stage.delta, stage.force / push.load, stage.moment / push.load])
    jacobian = complex_jacobian(lambda x: residual(x, stage.displacement), y)
    rates: Array = np.linalg.solve(jacobian, np.eye(y.size)[-1])[:-2]
    return rates


def first_slip(push: Push) -> Transition:
    """From rest with a level plate, the line of force turns about r_nn until it touches the first friction circle."""
    bearing, delta = push.bearing, np.zeros(push.bearing.layout.n - 1)
    spots, mu = centres(bearing, delta), np.array([s.friction for s in bearing.surfaces])
    height = spots[-1, 1] - spots[:-1, 1]
    sine = mu * np.array([s.radius for s in bearing.surfaces]) / np.hypot(1, mu) / np.abs(height)
    g = int(np.argmin(sine))
    if sine[g] >= 1:
        raise ArithmeticError("every surface locks itself: its friction circle holds r_nn")
    direction = np.zeros(len(delta))
    direction[g] = np.sign(height[g])
    force = push.load * np.tan(np.arcsin(sine[g]))
    return Transition("slides", g + 1, Equilibrium(0.0, float(force), 0.0, delta, direction))


def _margins(push: Push, stage: Equilibrium) -> Array:
    """Functions that are negative inside a stage, (2, n-1): yield of stuck or reversal of sliding surfaces; rims."""
    about = contact_moments(push, stage.delta, stage.force, stage.moment)
    excess = np.abs(about.moment) - (1 + SLACK) * about.bound
    back = -stage.direction * slip_rates(push, stage) - STILL
    arc = [s.radius * abs(d) - s.capacity for s, d in zip(push.bearing.surfaces, stage.delta, strict=True)]
    return np.stack([np.where(stage.direction != 0, back, excess), np.array(arc)])


def _next_event(push: Push, stage: Equilibrium, end: float) -> tuple[Equilibrium, int, int] | None:
    """First displacement in [stage, end] where a margin turns positive: the state, the row and the surface index."""
    from scipy.optimize import brentq

    low, before, stride = stage, _margins(push, stage), STRIDE[0]
    if before[0].max() > 0:  # the change of stage itself sent a surface back
        return stage, 0, int(before[0].argmax())
    while low.displacement < end - STRIDE[0]:
        high = advance(push, low, min(low.displacement + stride, end))
        after = _margins(push, high)
        crossed = np.argwhere((after > 0) & (before <= 0))
        if len(crossed):
            roots = [
                brentq(
                    lambda d, at=tuple(c), low=low: _margins(push, advance(push, low, d))[at],
                    low.displacement,
                    high.displacement,
                    xtol=1e-15,
                )
                for c in crossed
            ]
            first = int(np.argmin(roots))
            row, surface = (int(i) for i in crossed[first])
            return advance(push, low, roots[first] + row * TOUCH), row, surface
        low, before, stride = high, after, min(2 * stride, STRIDE[1])
    return None


def transitions(push: Push, end: float) -> list[Transition]:
    """What happens, in order, as the top is pushed from rest to a displacement [m]."""
    story = [first_slip(push)]
    for _ in range(10 * push.bearing.layout.n):
        event = _next_event(push, story[-1].at, end)
        if event is None:
            return story
        at, row, i = event
        direction = at.direction.copy()
        if row == 1:
            story.append(Transition("rim", i + 1, at))
            continue
        sticks = direction[i] != 0
        direction[i] = 0.0 if sticks else -np.sign(contact_moments(push, at.delta, at.force, at.moment).moment[i])
        story.append(Transition("sticks" if sticks else "slides", i + 1, replace(at, direction=direction)))
    raise ArithmeticError(f"stages change without end near displacement {story[-1].at.displacement:.6g} m")


def force_at(push: Push, displacements: Sequence[float], story: list[Transition] | None = None) -> Array:
    """Horizontal force [N] that a monotonic push needs at each displacement [m] > 0; story: its transitions."""
    story = story or transitions(push, max(displacements))
    reached, force = story[0].at, np.empty(len(displacements))
    for index in np.argsort(displacements):
        d = displacements[index]
        # of several transitions at one place the last one told counts
        stage = max((s.at for s in story if s.at.displacement <= d), key=lambda at: at.displacement)
        stage = [s.at for s in story if s.at.displacement == stage.displacement][-1]
        reached = advance(push, max(stage, reached, key=lambda at: at.displacement), d)
        force[index] = reached.force
    return force
