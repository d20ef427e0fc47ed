"""Kinematics of the report, vector by vector: bases (2.1)-(2.6), points (3.1)-(3.11), rates (2.36)-(2.84).

Lists are indexed by body number (index 0 is the fixed frame E); a basis is a (3, 3) array whose ROWS are t_1, t_2, t_3.
Everything accepts complex numbers, so that a complex step differentiates it to machine precision.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .parameters import Array

E = np.eye(3)


def _zeros() -> Array:
    return np.zeros(3)


@dataclass(frozen=True)
class Base:
    """Prescribed motion of body 1: u_g [m] and (psi, theta, phi)_1 [rad] with two rates each, all shape (3,)."""

    displacement: Array = field(default_factory=_zeros)
    velocity: Array = field(default_factory=_zeros)
    acceleration: Array = field(default_factory=_zeros)
    angles: Array = field(default_factory=_zeros)
    rates: Array = field(default_factory=_zeros)
    rate_rates: Array = field(default_factory=_zeros)


@dataclass(frozen=True)
class State:
    """psi, theta, phi of bodies 2..n, shape (n-1, 3) [rad], their rates and second rates, and the base."""

    q: Array
    v: Array
    a: Array
    base: Base = field(default_factory=Base)


class Rotation(NamedTuple):
    """Lists over bodies 0..n: bases t, angular velocities w and accelerations dw; *_total include the spin phi."""

    t: list[Array]
    w: list[Array]
    w_total: list[Array]
    dw: list[Array]
    dw_total: list[Array]


class Points(NamedTuple):
    """Position, velocity and acceleration by name: '01', '1', '11', '1c', '12', '2', ..."""

    r: dict[str, Array]
    v: dict[str, Array]
    a: dict[str, Array]


class Step(NamedTuple):
    """One position equation: r_name = r_previous + length t_3^body."""

    name: str
    previous: str
    length: float
    body: int


def cross(a: Array, b: Array) -> Array:
    """a x b of two vectors; `numpy.cross` is ten times slower on so few numbers."""
    (a1, a2, a3), (b1, b2, b3) = a, b
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def rotate(psi: Any, theta: Any, e: Array) -> Array:
    """R(psi, theta, e_i) applied to e_i, rows, shape (3, 3): (2.3)-(2.6), written out on the basis they turn."""
    e1, e2, e3 = e
    c, s = np.cos(psi), np.sin(psi)
    t1, t2, t3 = e1, c * e2 + s * e3, c * e3 - s * e2  # (2.4), (2.6)
    c, s = np.cos(theta), np.sin(theta)
    return np.array([c * t1 - s * t3, t2, c * t3 + s * t1])  # (2.5)


def bases(q: Array, base: Base) -> list[Array]:
    """t^0 = E, t^1 .. t^n: (2.1), (2.2)."""
    t: list[Array] = [E]
    for psi, theta, _ in np.vstack([base.angles, q]):
        t.append(rotate(psi, theta, t[-1]))
    return t


def rotation(state: State) -> Rotation:
    """Angular velocities (3.12) and accelerations (2.56)-(2.65) of every body."""
    base, t = state.base, bases(state.q, state.base)
    rates, seconds = np.vstack([base.rates, state.v]), np.vstack([base.rate_rates, state.a])
    w, w_total, dw, dw_total = ([np.zeros(3)] for _ in range(4))
    for k, ((psi1, theta1, phi1), (psi2, theta2, phi2)) in enumerate(zip(rates, seconds, strict=True), start=1):
        before, (_, t2, t3) = t[k - 1][0], t[k]
        w.append(theta1 * t2 + psi1 * before + w[k - 1])  # (3.12)
        w_total.append(phi1 * t3 + w[k])  # (3.12), t_3 also for the base: the printed t_2^1 contradicts (2.27)
        dw.append(
            theta2 * t2 + cross(w[k], theta1 * t2) + psi2 * before + cross(w[k - 1], psi1 * before) + dw[k - 1]
        )  # (2.56), (2.58), ...
        dw_total.append(phi2 * t3 + cross(w[k], phi1 * t3) + dw[k])  # (2.57), (2.59), ...
    return Rotation(t, w, w_total, dw, dw_total)


def joint(bearing: Any, one: int, other: int | None = None) -> str:
    """Name of the point "34" or "33"; with a stroke in stacks of ten and more bodies, whose body 11 is "11"."""
    return f"{one}{'_' if bearing.layout.n > 9 else ''}{one if other is None else other}"


def steps(bearing: Any) -> list[Step]:
    """The position equations (3.2)-(3.11) in order, with (2.20) read as l_4 - z_4."""
    l1 = bearing.base_height
    z1 = bearing.base_centroid if bearing.base_centroid is not None else l1 / 2
    table = [Step("1", "01", z1, 1), Step(joint(bearing, 1), "1", l1 - z1, 1)]  # (3.2), (3.3)
    for g in range(1, bearing.layout.n):
        R, body = bearing.surfaces[g - 1].radius, bearing.bodies[g - 1]  # bodies[g - 1] is body g + 1
        length, z = body.height, body.centroid
        own, centre, below, mass, above = (
            joint(bearing, g),
            f"{g}c",
            joint(bearing, g, g + 1),
            f"{g + 1}",
            joint(bearing, g + 1),
        )
        if g <= bearing.layout.m:
            lengths = (R, -R, z, length - z)  # (3.4)-(3.7)
        else:
            lengths = (-R, R, length - z, z)  # (3.8)-(3.11)
        names = (own, centre, below, mass, above)
        for i, (distance, k) in enumerate(zip(lengths, (g, g + 1, g + 1, g + 1), strict=True)):
            table.append(Step(names[i + 1], names[i], distance, k))
    return table


def points(bearing: Any, state: State, turn: Rotation | None = None) -> Points:
    """Every named point: r (3.1)-(3.11), v (2.37)-(2.55), a (2.66)-(2.84), with (2.39), (2.41), (2.53) corrected."""
    turn = rotation(state) if turn is None else turn
    base = state.base
    r, v, a = {"01": base.displacement}, {"01": base.velocity}, {"01": base.acceleration}  # (3.1), (2.37), (2.66)
    for name, previous, length, k in steps(bearing):
        t3, w, dw = turn.t[k][2], turn.w[k], turn.dw[k]
        r[name] = r[previous] + length * t3
        v[name] = v[previous] + length * cross(w, t3)
        a[name] = a[previous] + length * cross(dw, t3) + length * cross(w, cross(w, t3))
    return Points(r, v, a)


def along(state: State, t: Any) -> State:
    """The state a time t [s] later on the path of constant second rates: q + v t + a t^2/2, and the base likewise."""
    b = state.base
    base = Base(
        b.displacement + b.velocity * t + b.acceleration * t * t / 2,
        b.velocity + b.acceleration * t,
        b.acceleration,
        b.angles + b.rates * t + b.rate_rates * t * t / 2,
        b.rates + b.rate_rates * t,
        b.rate_rates,
    )
    return State(state.q + state.v * t + state.a * t * t / 2, state.v + state.a * t, state.a, base)


def rate(function: Callable[[State], Any], state: State, step: float = 1e-30) -> Any:
    """Time rate of function(state) along the path of `along`, by a complex step: exact to rounding."""
    return np.imag(function(along(state, 1j * step))) / step
